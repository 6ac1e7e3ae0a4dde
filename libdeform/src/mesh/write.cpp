// Writes tetrahedral meshes as legacy VTK, VTU and Medit; the file name selects the writer.
#include <charconv>

#include "core/error.h"
#include "core/file.h"
#include "mesh/cells.h"
#include "mesh/vtk.h"

namespace dfm {
namespace {

// The file's number of each cell's and then each triangle's group, 0 without. Empty where there are no
// groups at all.
Array<uint32_t> group_numbers(const RestMesh &mesh) {
  Array<uint32_t> out(*mesh.memory);
  if (mesh.groups.empty()) return out;
  const Array<uint32_t> cells = mesh.cell_groups();
  out.reserve(cells.size() + mesh.tri_group.size());
  for (const Array<uint32_t> *groups : {&cells, &mesh.tri_group})
    for (const uint32_t g : *groups)
      out.push_back(g == kNoGroup ? 0 : static_cast<uint32_t>(mesh.groups[g].tag));
  return out;
}

// Triangles have no share; they take 1 so that a picture by share shows them whole.
Array<double> shares(const RestMesh &mesh) {
  Array<double> out(*mesh.memory);
  if (mesh.share.empty()) return out;
  out.assign(mesh.share.begin(), mesh.share.end());
  out.resize(mesh.ntet() + mesh.tri_group.size(), 1.0);
  return out;
}

// Behind the cells, because gmsh expects POINTS first. Names are characters, each name ended by a zero,
// because meshio refuses a file with strings.
void put_group_names(AtomicFile &out, const RestMesh &mesh) {
  if (mesh.groups.empty()) return;
  out.write(std::string("FIELD FieldData 2\n") + kVtkGroupNumber + " 2 " +
            std::to_string(mesh.groups.size()) + " int\n");
  std::string names;
  for (const MeshGroup &g : mesh.groups) {
    out.put(g.dimension, std::endian::big);
    out.put(g.tag, std::endian::big);
    names += g.name + '\0';
  }
  out.write(std::string("\n") + kVtkGroupName + " 1 " + std::to_string(names.size()) + " unsigned_char\n" +
            names + "\n");
}

void put_cells(AtomicFile &out, const Array<uint32_t> &cells, uint32_t corners) {
  for (size_t i = 0; i < cells.size(); ++i) {
    if (i % corners == 0) out.put(corners, std::endian::big);
    out.put(cells[i], std::endian::big);
  }
}

// Rows of a Medit section; numbers in the fewest digits that read back the same.
class TextRows {
 public:
  explicit TextRows(AtomicFile &out) : out_(out) {}
  template <class T>
  void put(T value, char behind) {
    const auto end = std::to_chars(row_ + used_, row_ + sizeof row_, value);
    used_ = size_t(end.ptr - row_);
    row_[used_++] = behind;
    if (behind == '\n') {
      out_.write(row_, used_);
      used_ = 0;
    }
  }
  void elements(const char *keyword, uint32_t corners, const Array<uint32_t> &points,
                const Array<uint32_t> &group, const RestMesh &mesh, const uint8_t *in_file = nullptr) {
    if (group.empty()) return;
    out_.write(std::string(keyword) + "\n" + std::to_string(group.size()) + "\n");
    for (size_t t = 0; t < group.size(); ++t) {
      for (uint32_t k = 0; k < corners; ++k) put(points[corners * t + (in_file ? in_file[k] : k)] + 1, ' ');
      put(group[t] == kNoGroup ? 0 : mesh.groups[group[t]].tag, '\n');
    }
  }

 private:
  AtomicFile &out_;
  char row_[512];
  size_t used_ = 0;
};

}  // namespace

void write_vtk(const RestMesh &mesh, const std::string &path) {
  AtomicFile out(path);
  const CellKind &kind = cell_kind(mesh.cell);
  const uint64_t ntri = mesh.tri_group.size(), nvolume = mesh.ntet() / kind.tets, ncell = nvolume + ntri;
  out.write("# vtk DataFile Version 3.0\ntetrahedra\nBINARY\nDATASET UNSTRUCTURED_GRID\n");
  out.write("POINTS " + std::to_string(mesh.npoint()) + " double\n");
  for (const double x : mesh.points) out.put(x, std::endian::big);
  out.write("\nCELLS " + std::to_string(ncell) + " " + std::to_string((kind.nodes + 1) * nvolume + 4 * ntri) +
            "\n");
  put_cells(out, mesh.nodes(), kind.nodes);
  put_cells(out, mesh.tris, 3);
  out.write("\nCELL_TYPES " + std::to_string(ncell) + "\n");
  for (uint64_t t = 0; t < ncell; ++t) out.put(int32_t(t < nvolume ? kind.vtk : 5), std::endian::big);
  out.write("\n");
  put_group_names(out, mesh);
  const Array<uint32_t> groups = group_numbers(mesh);
  const Array<double> share = shares(mesh);
  if (!groups.empty() || !share.empty()) out.write("CELL_DATA " + std::to_string(ncell) + "\n");
  if (!groups.empty()) {
    out.write(std::string("SCALARS ") + kVtkGroup + " int 1\nLOOKUP_TABLE default\n");
    for (const uint32_t g : groups) out.put(g, std::endian::big);
    out.write("\n");
  }
  if (!share.empty()) {
    out.write("SCALARS share double 1\nLOOKUP_TABLE default\n");
    for (const double s : share) out.put(s, std::endian::big);
    out.write("\n");
  }
  out.commit();
}

void write_vtu(const RestMesh &mesh, const std::string &path) {
  const Array<uint32_t> groups = group_numbers(mesh);
  const Array<double> share = shares(mesh);
  VtuGrid grid;
  grid.npoint = mesh.npoint();
  grid.points = mesh.points.data();
  grid.corners = cell_kind(mesh.cell).nodes;
  grid.ncell = mesh.ntet() / cell_kind(mesh.cell).tets;
  grid.cells = mesh.nodes().data();
  grid.nface = static_cast<uint32_t>(mesh.tri_group.size());
  grid.faces = mesh.tris.data();
  grid.groups = &mesh.groups;
  if (!groups.empty()) grid.cell_data.push_back({kVtkGroup, 1, nullptr, groups.data()});
  if (!share.empty()) grid.cell_data.push_back({"share", 1, share.data(), nullptr});
  Array<double> inside = mesh.inside;
  if (!inside.empty()) {
    inside.resize(inside.size() + size_t{kInsidePoints} * grid.nface);
    grid.cell_data.push_back({kVtkInside, kInsidePoints, inside.data(), nullptr});
  }
  write_vtu(path, grid);
}

void write_medit(const RestMesh &mesh, const std::string &path) {
  const CellKind &kind = cell_kind(mesh.cell);
  if (!kind.medit)
    fail(DFM_E_UNSUPPORTED, "%s: %s are not written to Medit files; write .msh, .msh2, .vtk or .vtu",
         path.c_str(), kind.name);
  AtomicFile out(path);
  out.write("MeshVersionFormatted 2\nDimension\n3\nVertices\n" + std::to_string(mesh.npoint()) + "\n");
  TextRows rows(out);
  for (size_t i = 0; i < mesh.points.size(); i += 3) {
    for (size_t k = 0; k < 3; ++k) rows.put(mesh.points[i + k], ' ');
    rows.put(0, '\n');
  }
  rows.elements("Triangles", 3, mesh.tris, mesh.tri_group, mesh);
  rows.elements(kind.medit, kind.nodes, mesh.nodes(), mesh.cell_groups(), mesh, kind.in_medit);
  out.write("End\n");
  out.commit();
}

bool write_mesh(const RestMesh &mesh, const std::string &path) {
  if (mesh.tets.empty()) {
    write_surface(mesh, path);
    return true;
  }
  const std::string ending = path.rfind('.') == 0 ? "" : ending_of(path);  // a hidden file has none
  if (ending == "msh") write_msh41(mesh, path);
  else if (ending == "msh2") write_msh22(mesh, path);
  else if (ending == "vtk") write_vtk(mesh, path);
  else if (ending == "vtu") write_vtu(mesh, path);
  else if (ending == "mesh") write_medit(mesh, path);
  else
    fail(DFM_E_UNSUPPORTED,
         "%s: tetrahedra are not written to this file name ending; expected .msh (MSH 4.1), .msh2 (MSH 2.2), "
         ".vtk (legacy VTK), .vtu (VTU) or .mesh (Medit)",
         path.c_str());
  return ending == "vtu" || (mesh.inside.empty() && (mesh.share.empty() || ending == "vtk"));
}

}  // namespace dfm
