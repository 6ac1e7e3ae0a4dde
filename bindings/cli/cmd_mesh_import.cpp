// Surfaces of formats that the library leaves to assimp. The formats of its own never go there: its readers
// are bounded and fuzzed.
#include "cmd_mesh.h"

#ifdef DEFORM_HAVE_ASSIMP
#include <assimp/cimport.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/config.h>
#endif

namespace cli {
namespace {

bool is_foreign(const std::string &path) {
  const std::string ending = mesh_ending(path);
  for (const char *e : {"gltf", "glb", "fbx", "3ds", "dae", "x3d", "3mf", "amf", "ac", "ase", "blend", "lwo",
                        "ms3d", "x", "bvh", "dxf", "ifc"})
    if (ending == e) return true;
  return false;
}

}  // namespace

#ifdef DEFORM_HAVE_ASSIMP

bool import_surface(const std::string &path, MeshSession &session, std::string &sentence) {
  if (!is_foreign(path)) return true;
  struct Store {
    aiPropertyStore *properties = aiCreatePropertyStore();
    ~Store() { aiReleasePropertyStore(properties); }
  } store;
  aiSetImportPropertyInteger(store.properties, AI_CONFIG_PP_SBP_REMOVE,
                             aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene *scene = aiImportFileExWithProperties(
      path.c_str(), aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_PreTransformVertices, nullptr,
      store.properties);
  if (!scene) {
    sentence = path + ": " + aiGetErrorString();
    return false;
  }
  std::vector<double> points;
  std::vector<uint32_t> triangles;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh &mesh = *scene->mMeshes[m];
    const uint32_t first = static_cast<uint32_t>(points.size() / 3);
    for (unsigned v = 0; v < mesh.mNumVertices; ++v)
      points.insert(points.end(),
                    {double(mesh.mVertices[v].x), double(mesh.mVertices[v].y), double(mesh.mVertices[v].z)});
    for (unsigned f = 0; f < mesh.mNumFaces; ++f)
      for (unsigned k = 0; mesh.mFaces[f].mNumIndices == 3 && k < 3; ++k)
        triangles.push_back(first + mesh.mFaces[f].mIndices[k]);
  }
  aiReleaseImport(scene);
  if (triangles.empty()) {
    sentence = path + ": no triangles in this file";
    return false;
  }
  if (dfm_mesh_create(session.context, static_cast<uint32_t>(points.size() / 3), points.data(),
                      static_cast<uint32_t>(triangles.size() / 3), triangles.data(), &session.mesh) < 0) {
    sentence = path + ": " + dfm_last_error();
    return false;
  }
  return true;
}

#else

bool import_surface(const std::string &path, MeshSession &, std::string &sentence) {
  if (!is_foreign(path)) return true;
  sentence = path + ": ." + mesh_ending(path) +
             " is read through assimp, which this command was built without; install libassimp-dev and build "
             "with -D DEFORM_ASSIMP=ON, or export the surface as .obj, .ply or .stl";
  return false;
}

#endif

}  // namespace cli
