// Selects the reader of a file: by its first bytes if these are unambiguous, else by the ending of its name.
// Unsupported formats are refused with advice on conversion.
#include <algorithm>

#include "core/error.h"
#include "core/file.h"
#include "core/names.h"
#include "mesh/raw_mesh.h"

namespace dfm {
namespace {

struct Format {
  const char *name;                   // in sentences
  std::vector<const char *> endings;  // the first is the usual one
  void (*read)(Cursor &, RawMesh &);  // null: not read, and then
  const char *advice;                 // how to convert it
};

constexpr const char *kMeshio = "convert it first: meshio convert FILE OUT.vtu";
constexpr const char *kAssimp =
    "convert it first: deform mesh convert FILE OUT.obj (where the command is built with assimp), or export "
    "OBJ, PLY or STL";
constexpr const char *kCad =
    "it is a shape without cells; mesh it first: gmsh -3 -format msh41 FILE -o OUT.msh";

const std::vector<Format> &formats() {
  static const std::vector<Format> all{
      {"MSH", {"msh", "msh2"}, read_msh, nullptr},
      {"legacy VTK", {"vtk"}, read_vtk, nullptr},
      {"VTU", {"vtu", "vtp"}, read_vtu, nullptr},
      {"Medit", {"mesh"}, read_medit, nullptr},
      {"OBJ", {"obj"}, read_obj, nullptr},
      {"PLY", {"ply"}, read_ply, nullptr},
      {"STL", {"stl"}, read_stl, nullptr},
      {"OFF", {"off", "coff", "noff"}, read_off, nullptr},
      {"Abaqus", {"inp"}, read_abaqus, nullptr},
      {"TetGen", {"ele", "node", "face"}, read_tetgen, nullptr},
      {"Netgen", {"vol"}, read_netgen, nullptr},
      {"TetGen's input or edges", {"poly", "smesh", "edge"}, nullptr, "read the .ele that tetgen writes"},
      {"binary Medit", {"meshb"}, nullptr, "convert it first: gmsh -3 -format mesh FILE -o OUT.mesh"},
      {"glTF", {"gltf", "glb"}, nullptr, kAssimp},
      {"FBX", {"fbx"}, nullptr, kAssimp},
      {"3DS", {"3ds"}, nullptr, kAssimp},
      {"COLLADA", {"dae"}, nullptr, kAssimp},
      {"X3D or Blender", {"x3d", "wrl", "blend"}, nullptr, kAssimp},
      {"3MF or zip", {"3mf", "zip"}, nullptr, kAssimp},
      {"HDF5 (MED, CGNS, XDMF)", {"med", "cgns", "h5m", "h5", "xdmf", "exo", "e"}, nullptr, kMeshio},
      {"Nastran", {"bdf", "nas"}, nullptr, kMeshio},
      {"CAD", {"step", "stp", "iges", "igs", "brep", "geo"}, nullptr, kCad},
      {"volume",
       {"nrrd", "nhdr", "mha", "mhd"},
       nullptr,
       "a label map becomes bodies first: deform mesh from-labels FILE --out DIR"},
      {"gzip", {"gz", "tgz"}, nullptr, "unpack it first: gunzip FILE"},
      {"compressed", {"bz2", "xz", "zst"}, nullptr, "unpack it first"},
      {"UTF-16 text", {}, nullptr, "save it as plain text (ASCII or UTF-8)"}};
  return all;
}

const Format *format_called(std::string_view name) {
  for (const Format &f : formats())
    if (f.name == name) return &f;
  return nullptr;
}

const Format *format_by_ending(const std::string &end) {
  for (const Format &f : formats())
    for (const char *e : f.endings)
      if (end == e) return &f;
  return nullptr;
}

std::string readable() {
  std::string out;
  for (const Format &f : formats())
    if (f.read) out += std::string(out.empty() ? "" : ", ") + "." + f.endings.front();
  return out;
}

bool starts(std::string_view text, std::string_view with) { return text.substr(0, with.size()) == with; }

// The format by unambiguous first bytes; null if there is none. OBJ, ASCII STL and TetGen have no signature.
const Format *format_by_content(std::string_view bytes) {
  if (starts(bytes, "\x1f\x8b")) return format_called("gzip");
  if (starts(bytes, "glTF")) return format_called("glTF");
  if (starts(bytes, "Kaydara FBX") || starts(bytes, "; FBX")) return format_called("FBX");
  if (starts(bytes, "PK\3\4")) return format_called("3MF or zip");
  if (starts(bytes, "\x89HDF")) return format_called("HDF5 (MED, CGNS, XDMF)");
  if (starts(bytes, "\xff\xfe") || starts(bytes, "\xfe\xff")) return format_called("UTF-16 text");
  std::string_view head = bytes.substr(0, 4096);
  head.remove_prefix(std::min(head.find_first_not_of(" \t\r\n"), head.size()));
  if (starts(head, "# vtk DataFile")) return format_called("legacy VTK");
  if (starts(head, "<?xml") || starts(head, "<VTKFile") || starts(head, "<!--")) {
    if (head.find("<VTKFile") != head.npos) return format_called("VTU");
    return format_called(head.find("<COLLADA") != head.npos ? "COLLADA"
                         : head.find("<X3D") != head.npos   ? "X3D or Blender"
                                                            : "");
  }
  while (starts(head, "#")) {  // OFF, Medit and Netgen may begin with comments
    head.remove_prefix(std::min(head.find('\n'), head.size()));
    head.remove_prefix(std::min(head.find_first_not_of(" \t\r\n"), head.size()));
  }
  const std::string_view word = head.substr(0, head.find_first_of(" \t\r\n"));
  if (word == "$MeshFormat" || word == "$NOD" || word == "$Comments") return format_called("MSH");
  if (word == "MeshVersionFormatted") return format_called("Medit");
  if (word == "mesh3d") return format_called("Netgen");
  if (word == "ply") return format_called("PLY");
  if (word == "OFF" || word == "COFF" || word == "NOFF" || word == "CNOFF" || word == "STOFF")
    return format_called("OFF");
  if (starts(word, "**") || Cursor::is_word(word, "*heading") || Cursor::is_word(word, "*node") ||
      Cursor::is_word(word, "*node,"))
    return format_called("Abaqus");
  if (word == "ISO-10303-21;") return format_called("CAD");
  if (starts(word, "NRRD000")) return format_called("volume");
  return nullptr;
}

const Format &choose(const std::string &path, std::string_view bytes, RawMesh &raw) {
  const std::string end = ending_of(path);
  const Format *const named = format_by_ending(end), *const seen = format_by_content(bytes);
  if (bytes.empty())
    fail(DFM_E_FORMAT, "%s: the file is empty; expected a mesh (%s)", path.c_str(), readable().c_str());
  const Format *const found = seen ? seen : named;
  const bool lies = seen && seen != named;
  const std::string although =
      !lies         ? ""
      : end.empty() ? ", as its first bytes show, although its name has no ending"
                    : format(", as its first bytes show, although its name ends in .%s", end.c_str());
  if (!found) {
    std::vector<std::string> known;
    for (const Format &f : formats())
      if (f.read) known.insert(known.end(), f.endings.begin(), f.endings.end());
    const std::string near = nearest(end, known);
    fail(DFM_E_UNSUPPORTED, "%s: unknown mesh file ending '%s'%s; %s are read", path.c_str(), end.c_str(),
         near.empty() ? "" : (", did you mean ." + near + "?").c_str(), readable().c_str());
  }
  if (!found->read)
    fail(DFM_E_UNSUPPORTED, "%s: this is a %s file%s, which the library itself does not read; %s",
         path.c_str(), found->name, although.c_str(), found->advice);
  if (lies) raw.warnings.push_back(format("read as %s%s", found->name, although.c_str()));
  return *found;
}

}  // namespace

std::string ending_of(const std::string &path) {
  const size_t slash = path.find_last_of('/'), dot = path.find_last_of('.');
  if (dot == std::string::npos || (slash != std::string::npos && dot < slash)) return "";
  return lower(path.substr(dot + 1));
}

std::string mesh_kind(const std::string &path, std::string_view bytes) {
  const Format *const seen = format_by_content(bytes), *const found =
                                                           seen ? seen : format_by_ending(ending_of(path));
  return found ? found->name : "";
}

RawMesh parse_raw(const Memory &memory, const std::string &path, const char *bytes, size_t size) {
  RawMesh raw(memory);
  // byte order mark, written by some editors
  const size_t mark = starts({bytes, size}, "\xef\xbb\xbf") ? 3 : 0;
  Cursor in(path, bytes + mark, size - mark);
  choose(path, in.rest(), raw).read(in, raw);
  return raw;
}

RawMesh read_raw(const Memory &memory, const std::string &path) {
  const Format *const named = format_by_ending(ending_of(path));
  if (named && !named->read)  // checked before a large file is read
    fail(DFM_E_UNSUPPORTED, "%s: the library itself reads no %s files; %s", path.c_str(), named->name,
         named->advice);
  const Array<char> bytes = read_whole_file(memory, path, kMaxMeshBytes, "a mesh file");
  return parse_raw(memory, path, bytes.data(), bytes.size());
}

RestMesh read_mesh(const Memory &memory, const std::string &path, uint32_t what) {
  RawMesh raw = read_raw(memory, path);  // the file's bytes are free before the repair begins
  if (what == DFM_MESH_ANY && raw.tets.empty() && raw.tris.empty())
    fail(DFM_E_FORMAT, "%s: no tetrahedra and no triangles in this file; a body needs one of them",
         path.c_str());
  if (what == DFM_MESH_SURFACE || (what == DFM_MESH_ANY && raw.tets.empty()))
    return finish_surface(path, std::move(raw));
  return finish_mesh(path, std::move(raw));
}

}  // namespace dfm
