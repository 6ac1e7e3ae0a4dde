// Triangles in the formats that other programs read. Text carries 17 digits, so that a double comes back as it was.
#include <algorithm>
#include <bit>
#include <cctype>
#include <cfloat>
#include <cmath>

#include "core/error.h"
#include "math/vec3.h"
#include "mesh/file.h"
#include "mesh/tri_mesh.h"

namespace dfm {
namespace {

// Bytes of a number in the order the format wants.
template <class T>
void put_as(AtomicFile &out, std::endian order, T value) {
  char bytes[sizeof(T)];
  std::copy_n(reinterpret_cast<const char *>(&value), sizeof(T), bytes);
  if (order != std::endian::native) std::reverse(bytes, bytes + sizeof(T));
  out.write(bytes, sizeof(T));
}

std::string text(uint64_t n) { return std::to_string(n); }

void put_points(AtomicFile &out, const TriMesh &mesh, const char *before) {
  for (size_t p = 0; p < mesh.points.size(); p += 3)
    out.write(format("%s%.17g %.17g %.17g\n", before, mesh.points[p], mesh.points[p + 1], mesh.points[p + 2]));
}

// A space would end a name in OBJ.
std::string one_word(const std::string &name) {
  std::string word = name;
  std::replace_if(word.begin(), word.end(), [](unsigned char c) { return std::isspace(c); }, '_');
  return word;
}

void put_obj(AtomicFile &out, const TriMesh &mesh) {
  out.write(format("# %u points, %u triangles, m\n", mesh.npoint(), mesh.ntri()));
  put_points(out, mesh, "v ");
  uint32_t group = kNoGroup;
  for (uint32_t t = 0; t < mesh.ntri(); ++t) {
    if (mesh.tri_group[t] != group) {
      group = mesh.tri_group[t];
      out.write(group == kNoGroup ? "g\n" : "g " + one_word(mesh.groups[group].name) + "\n");
    }
    const uint32_t *c = &mesh.tris[3 * size_t(t)];
    out.write("f " + text(c[0] + 1ull) + " " + text(c[1] + 1ull) + " " + text(c[2] + 1ull) + "\n");
  }
}

void put_off(AtomicFile &out, const TriMesh &mesh) {
  out.write("OFF\n" + text(mesh.npoint()) + " " + text(mesh.ntri()) + " 0\n");
  put_points(out, mesh, "");
  for (size_t i = 0; i < mesh.tris.size(); i += 3)
    out.write("3 " + text(mesh.tris[i]) + " " + text(mesh.tris[i + 1]) + " " + text(mesh.tris[i + 2]) + "\n");
}

void put_ply(AtomicFile &out, const TriMesh &mesh) {
  out.write("ply\nformat binary_little_endian 1.0\nelement vertex " + text(mesh.npoint()) +
            "\nproperty double x\nproperty double y\nproperty double z\nelement face " + text(mesh.ntri()) +
            "\nproperty list uchar uint vertex_indices\nend_header\n");
  for (const double x : mesh.points) put_as(out, std::endian::little, x);
  for (size_t i = 0; i < mesh.tris.size(); ++i) {
    if (i % 3 == 0) out.put(uint8_t(3));
    put_as(out, std::endian::little, mesh.tris[i]);
  }
}

void put_stl(AtomicFile &out, const TriMesh &mesh, const std::string &path) {
  for (const double x : mesh.points)
    if (std::fabs(x) > FLT_MAX)
      fail(DFM_E_UNSUPPORTED, "%s: STL holds coordinates up to %g m, the surface has %g m; write .ply", path.c_str(), double(FLT_MAX), x);
  std::string head = "binary STL, m";
  head.resize(80, ' ');
  out.write(head);
  put_as(out, std::endian::little, mesh.ntri());
  const auto put_vector = [&](Vec3 v) {
    for (int k = 0; k < 3; ++k) put_as(out, std::endian::little, float(v[k]));
  };
  for (size_t i = 0; i < mesh.tris.size(); i += 3) {
    Vec3 corner[3];
    for (int k = 0; k < 3; ++k) corner[k] = load3(&mesh.points[3 * size_t(mesh.tris[i + k])]);
    const Vec3 u = corner[1] - corner[0], v = corner[2] - corner[0];
    put_vector(normalized(cross((1 / norm(u)) * u, (1 / norm(v)) * v)));
    for (const Vec3 &p : corner) put_vector(p);
    out.put(uint16_t(0));
  }
}

int32_t group_number(const TriMesh &mesh, uint32_t t) { return mesh.tri_group[t] == kNoGroup ? 0 : mesh.groups[mesh.tri_group[t]].tag; }

void put_vtk(AtomicFile &out, const TriMesh &mesh) {
  out.write("# vtk DataFile Version 3.0\ntriangles\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS " + text(mesh.npoint()) + " double\n");
  for (const double x : mesh.points) put_as(out, std::endian::big, x);
  out.write("\nCELLS " + text(mesh.ntri()) + " " + text(4 * uint64_t(mesh.ntri())) + "\n");
  for (size_t i = 0; i < mesh.tris.size(); ++i) {
    if (i % 3 == 0) put_as(out, std::endian::big, int32_t(3));
    put_as(out, std::endian::big, mesh.tris[i]);
  }
  out.write("\nCELL_TYPES " + text(mesh.ntri()) + "\n");
  for (uint32_t t = 0; t < mesh.ntri(); ++t) put_as(out, std::endian::big, int32_t(5));
  if (!mesh.groups.empty()) {
    out.write("\nCELL_DATA " + text(mesh.ntri()) + "\nSCALARS group int 1\nLOOKUP_TABLE default\n");
    for (uint32_t t = 0; t < mesh.ntri(); ++t) put_as(out, std::endian::big, group_number(mesh, t));
  }
  out.write("\n");
}

void put_vtu(const std::string &path, const TriMesh &mesh) {
  VtuGrid grid;
  grid.npoint = mesh.npoint(), grid.ncell = mesh.ntri(), grid.corners = 3;
  grid.points = mesh.points.data(), grid.cells = mesh.tris.data();
  Array<uint32_t> number{HookAllocator<uint32_t>(*mesh.memory)};
  for (uint32_t t = 0; !mesh.groups.empty() && t < mesh.ntri(); ++t) number.push_back(uint32_t(group_number(mesh, t)));
  if (!number.empty()) grid.cell_data.push_back({"group", 1, nullptr, number.data()});
  write_vtu(path, grid);
}

}  // namespace

void write_tri_mesh(const TriMesh &mesh, const std::string &path) {
  const size_t slash = path.find_last_of('/'), dot = path.find_last_of('.');
  std::string ending = dot == std::string::npos || (slash != std::string::npos && dot < slash) ? "" : path.substr(dot);
  for (char &c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (ending == ".vtu") return put_vtu(path, mesh);
  static const std::vector<std::string> known{".obj", ".ply", ".stl", ".off", ".vtk", ".vtu"};
  if (std::find(known.begin(), known.end(), ending) == known.end())
    fail(DFM_E_UNSUPPORTED, "%s: a surface is written as %s, told by the file name's ending; this one ends with '%s'", path.c_str(),
         join(known).c_str(), ending.c_str());
  AtomicFile out(path);
  if (ending == ".obj") put_obj(out, mesh);
  else if (ending == ".ply") put_ply(out, mesh);
  else if (ending == ".stl") put_stl(out, mesh, path);
  else if (ending == ".off") put_off(out, mesh);
  else put_vtk(out, mesh);
  out.commit();
}

}  // namespace dfm
