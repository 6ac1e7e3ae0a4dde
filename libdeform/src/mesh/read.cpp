#include <algorithm>
#include <cctype>

#include "core/error.h"
#include "mesh/file.h"
#include "mesh/raw_mesh.h"

namespace dfm {
namespace {

constexpr uint32_t kMaxGroups = 1u << 16;  // a file cannot make us keep more names than this

std::string ending(const std::string &path) {
  const size_t slash = path.find_last_of('/'), dot = path.find_last_of('.');
  if (dot == std::string::npos || (slash != std::string::npos && dot < slash)) return "";
  std::string text = path.substr(dot + 1);
  for (char &c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

constexpr const char *kReadable = "MSH 2.2 and 4.1 (.msh) and legacy VTK (.vtk) with tetrahedra are read";

}  // namespace

uint32_t RawMesh::group(const Cursor &at, int32_t dimension, int32_t tag) {
  if (tag == 0) return kNoGroup;
  const auto [entry, fresh] = group_index_.try_emplace({dimension, tag}, uint32_t(groups.size()));
  if (fresh) {
    if (groups.size() == kMaxGroups) at.refuse("more than %u physical groups", kMaxGroups);
    groups.push_back({std::to_string(tag), dimension, tag, Array<uint32_t>(HookAllocator<uint32_t>(*memory))});
  }
  return entry->second;
}

TetMesh parse_tet_mesh(const Memory &memory, const std::string &path, const char *bytes, size_t size) {
  Cursor in(path, bytes, size);
  RawMesh raw(memory);
  if (size == 0) in.refuse("the file is empty; %s", kReadable);
  if (ending(path) == "vtk") read_vtk(in, raw);
  else read_msh(in, raw);
  return finish_mesh(path, std::move(raw));
}

TetMesh read_tet_mesh(const Memory &memory, const std::string &path) {
  const std::string kind = ending(path);
  if (kind != "msh" && kind != "msh2" && kind != "vtk") {
    static const std::vector<std::string> later{"vtu", "mesh", "obj", "ply", "stl", "off", "node", "ele", "inp"};
    if (std::find(later.begin(), later.end(), kind) != later.end())
      fail(DFM_E_UNSUPPORTED, "%s: reading .%s is not available yet; %s, so convert it first (for instance with meshio or gmsh)",
           path.c_str(), kind.c_str(), kReadable);
    fail(DFM_E_UNSUPPORTED, "%s: unknown mesh file ending '%s'; %s", path.c_str(), kind.c_str(), kReadable);
  }
  const Array<char> bytes = read_whole_file(memory, path);
  return parse_tet_mesh(memory, path, bytes.data(), bytes.size());
}

}  // namespace dfm
