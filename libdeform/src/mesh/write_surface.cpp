// Triangles in the formats that other programs read. Text carries 17 digits, so that a double comes
// back as it was.
#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>

#include "core/error.h"
#include "math/vec3.h"
#include "core/file.h"
#include "core/names.h"
#include "mesh/topology_tri.h"

namespace dfm {
namespace {

void put_points(AtomicFile &out, const RestMesh &mesh, const char *before) {
  for (size_t p = 0; p < mesh.points.size(); p += 3)
    out.write(
        format("%s%.17g %.17g %.17g\n", before, mesh.points[p], mesh.points[p + 1], mesh.points[p + 2]));
}

// A backslash at the end of a name would continue its line, and a word that begins with # be a comment.
std::string obj_name(const std::string &name) {
  std::string out = one_line(name);
  for (size_t i = 0; i < out.size(); ++i)
    if ((out[i] == '#' && (i == 0 || out[i - 1] == ' ')) || (out[i] == '\\' && i + 1 == out.size()))
      out[i] = '_';
  return out;
}

void put_obj(AtomicFile &out, const RestMesh &mesh) {
  out.write(format("# %u points, %u triangles, m\n", mesh.npoint(), mesh.ntri()));
  put_points(out, mesh, "v ");
  uint32_t group = kNoGroup;
  for (uint32_t t = 0; t < mesh.ntri(); ++t) {
    if (mesh.tri_group[t] != group) {
      group = mesh.tri_group[t];
      out.write("g " + (group == kNoGroup ? "default" : obj_name(mesh.groups[group].name)) + "\n");
    }
    const uint32_t *c = &mesh.tris[3 * size_t(t)];
    out.write(format("f %u %u %u\n", c[0] + 1, c[1] + 1, c[2] + 1));
  }
}

void put_off(AtomicFile &out, const RestMesh &mesh) {
  out.write(format("OFF\n%u %u 0\n", mesh.npoint(), mesh.ntri()));
  put_points(out, mesh, "");
  for (size_t i = 0; i < mesh.tris.size(); i += 3)
    out.write(format("3 %u %u %u\n", mesh.tris[i], mesh.tris[i + 1], mesh.tris[i + 2]));
}

// As text, because gmsh reads no binary doubles, and meshio no binary numbers behind a list.
void put_ply(AtomicFile &out, const RestMesh &mesh) {
  const bool grouped = !mesh.groups.empty();
  out.write("ply\nformat ascii 1.0\nelement vertex " + std::to_string(mesh.npoint()) +
            "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
            std::to_string(mesh.ntri()) + "\nproperty list uchar uint vertex_indices\n" +
            (grouped ? "property int group\n" : "") + "end_header\n");
  put_points(out, mesh, "");
  for (uint32_t t = 0; t < mesh.ntri(); ++t) {
    const uint32_t *c = &mesh.tris[3 * size_t(t)], group = mesh.tri_group[t];
    out.write(format("3 %u %u %u", c[0], c[1], c[2]));
    if (grouped) out.write(" " + std::to_string(group == kNoGroup ? 0 : mesh.groups[group].tag));
    out.write("\n");
  }
}

void put_stl(AtomicFile &out, const RestMesh &mesh, const std::string &path) {
  for (const double x : mesh.points)
    if (std::fabs(x) > FLT_MAX)
      fail(DFM_E_UNSUPPORTED, "%s: STL holds coordinates up to %g m, the surface has %g m; write .ply",
           path.c_str(), double(FLT_MAX), x);
  std::string head = "binary STL, m";
  head.resize(80, ' ');
  out.write(head);
  out.put(mesh.ntri(), std::endian::little);
  const auto put_vector = [&](Vec3 v) {
    for (int k = 0; k < 3; ++k) out.put(float(v[k]), std::endian::little);
  };
  for (size_t i = 0; i < mesh.tris.size(); i += 3) {
    const std::array<Vec3, 3> corner = corners_of(mesh.points.data(), &mesh.tris[i]);
    const Vec3 u = corner[1] - corner[0], v = corner[2] - corner[0];
    put_vector(normalized(cross((1 / norm(u)) * u, (1 / norm(v)) * v)));
    for (const Vec3 &p : corner) put_vector(p);
    out.put(uint16_t(0));
  }
}

}  // namespace

void write_surface(const RestMesh &mesh, const std::string &path) {
  const std::string ending = ending_of(path);
  // the formats of cells hold triangles too
  if (ending == "vtk") return write_vtk(mesh, path);
  if (ending == "vtu") return write_vtu(mesh, path);
  if (ending != "obj" && ending != "ply" && ending != "stl" && ending != "off")
    fail(DFM_E_UNSUPPORTED,
         "%s: a surface is written as .obj, .ply, .stl, .off, .vtk, .vtu, chosen by the ending of the file "
         "name, which is '%s%s' here",
         path.c_str(), ending.empty() ? "" : ".", ending.c_str());
  AtomicFile out(path);
  if (ending == "obj") put_obj(out, mesh);
  else if (ending == "ply") put_ply(out, mesh);
  else if (ending == "stl") put_stl(out, mesh, path);
  else put_off(out, mesh);
  out.commit();
}

}  // namespace dfm
