#include "study.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "cli.h"
#include "messages.h"
#include "run_folder.h"

namespace fs = std::filesystem;

namespace cli::cost {
namespace {

// Keys of a body that name parts of its mesh file: groups, cells by number, nodes by number.
std::string named_part(const Subject &subject, const std::string &body) {
  for (const char *key : {"/materials_by_group", "/fields", "/nodal_bc", "/anisotropy/field"})
    if (subject.find(body + key)) return std::string(key).substr(1);
  for (const char *list : {"/fix", "/forces", "/springs"}) {
    const JsonValue *const rows = subject.find(body + list);
    for (size_t i = 0; rows && i < rows->items.size(); ++i)
      if (rows->items[i].find("group")) return std::string(list).substr(1) + " by group";
  }
  return "";
}

using Context = std::unique_ptr<dfm_context, decltype(&dfm_context_destroy)>;

Context quiet_context() {
  dfm_context_def def = dfm_context_def_default();
  def.log = [](void *, int32_t, const char *) {};
  dfm_context *raw = nullptr;
  need(dfm_context_create(&def, &raw));
  return {raw, dfm_context_destroy};
}

// {"make": KIND, ...}
struct Made {
  std::string kind;
  std::vector<double> size;
  uint32_t cells;
  bool second_order;
  explicit Made(const JsonValue &mesh)
      : kind(mesh.get("make")),
        cells(mesh.find("cells") ? uint32_t(mesh.scalar("cells")) : 1000),
        second_order(mesh.get("order") == "2") {
    for (const char *key : {"inner", "radius", "length"})
      if (mesh.find(key)) size.push_back(mesh.scalar(key));
    if (const JsonValue *const edges = mesh.find("size"))
      for (const JsonValue &edge : edges->items) size.push_back(std::strtod(edge.text.c_str(), nullptr));
    size.resize(3);
  }
};

// Of the boundary, as fine as the tetrahedra of SubjectBody::cells.
uint32_t triangles_of(dfm_context *context, const Made &shape) {
  dfm_tetmesh mesh = 0;
  need(dfm_tetmesh_make(context, shape.kind.c_str(), shape.size.data(), shape.cells, &mesh));
  dfm_tetmesh_info info = {};
  info.size = sizeof info;
  const dfm_status counted = dfm_tetmesh_get_info(mesh, &info);
  dfm_tetmesh_destroy(mesh);
  need(counted);
  return info.ntriangle * (shape.second_order ? 4 : 1);
}

std::string file_of(const Subject &subject, const std::string &pointer) {
  return (fs::path(subject.folder) / subject.find(pointer)->text).string();
}

}  // namespace

std::string why_cells_stay(const Subject &subject) {
  for (size_t i = 0; i < subject.bodies.size(); ++i) {
    const std::string body = "/bodies/" + std::to_string(i);
    const JsonValue *const mesh = subject.find(body + "/mesh");
    if (!mesh) return "body '" + subject.bodies[i].name + "' has no mesh of its own";
    if (mesh->kind == JsonValue::object) continue;
    const std::string part = named_part(subject, body);
    if (!part.empty() && !subject.find(body + "/fill"))
      return "body '" + subject.bodies[i].name + "' has " + part +
             ", which belongs to the cells of its file and not to others";
    if (subject.find(body + "/surface/mesh"))
      return "body '" + subject.bodies[i].name + "' has a separate surface";
  }
  return "";
}

std::string Surfaces::file(size_t body, double times) const {
  const std::string pointer = "/bodies/" + std::to_string(body) + "/mesh", &name = subject_.bodies[body].name;
  const JsonValue &mesh = *subject_.find(pointer);  // each body has one, as why_cells_stay says
  const Context context = quiet_context();
  std::string path = name;
  dfm_trimesh surface = 0;
  const auto place = [&] { path = fs::absolute(fs::path(folder_) / (path + ".obj")).string(); };
  if (mesh.kind == JsonValue::object) {
    const Made shape(mesh);
    uint32_t &own = triangles_[body];
    if (own == 0) own = triangles_of(context.get(), shape);
    // A lattice has the volume of its surface. A round surface of triangles as large as cells has less volume
    // than the shape: edges are half of those of tetrahedra as large as the hexahedra, so that both errors
    // fall alike.
    const auto n = uint32_t(std::lround(4.0 * own * std::pow(times / kHexahedron, 2.0 / 3)));
    path += "_" + std::to_string(n);
    place();
    if (!written_.insert(path).second) return path;
    need(dfm_trimesh_make(context.get(), shape.kind.c_str(), shape.size.data(), n, &surface));
  } else {
    const std::string file = file_of(subject_, pointer);
    uint32_t kind = 0;
    need(dfm_mesh_file_kind(context.get(), file.c_str(), &kind));
    if (kind != DFM_MESH_TETS) return "";
    place();
    if (!written_.insert(path).second) return path;
    need(dfm_trimesh_read(context.get(), file.c_str(), &surface));
  }
  make_folder(folder_);
  const dfm_status status = dfm_trimesh_write(surface, path.c_str());
  dfm_trimesh_destroy(surface);
  need(status);
  return path;
}

}  // namespace cli::cost
