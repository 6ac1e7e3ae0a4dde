// Triangle surfaces before they become the surface of a body or are filled with cells: reading, repair,
// measures, writing.
#pragma once
#include "mesh/mesh.h"

namespace dfm {

struct TriMesh {
  explicit TriMesh(const Memory &m = Memory::standard()) : memory(&m) {
    use_memory(m, points, tris, tri_group, file_point);
  }
  const Memory *memory;
  Array<double> points;       // [npoint,3], m
  Array<uint32_t> tris;       // [ntri,3], neighbors agree; closed pieces face outward
  Array<uint32_t> tri_group;  // [ntri] index into groups, kNoGroup without
  // [npoint] 0-based position of the point in its file (the first of those merged)
  Array<uint32_t> file_point;
  std::vector<MeshGroup> groups;
  // Repairs and observations of the reader.
  uint32_t merged_points = 0, dropped_points = 0, dropped_tris = 0, turned = 0;
  std::vector<std::string> warnings;  // one sentence each
  uint32_t npoint() const { return static_cast<uint32_t>(points.size() / 3); }
  uint32_t ntri() const { return static_cast<uint32_t>(tris.size() / 3); }
};

TriMesh read_tri_mesh(const Memory &memory, const std::string &path);
TriMesh parse_tri_mesh(const Memory &memory, const std::string &path, const char *bytes, size_t size);

// ---- generators: closed surfaces of about `triangles` near-equilateral triangles, in the places of the
// bodies of the same names ----
TriMesh make_cylinder_surface(const Memory &memory, double radius, double length, uint32_t triangles);
TriMesh make_beam_surface(const Memory &memory, double x, double y, double z, uint32_t triangles);
TriMesh make_ball_surface(const Memory &memory, double radius, uint32_t triangles);
TriMesh make_tube_surface(const Memory &memory, double inner, double outer, double length,
                          uint32_t triangles);
// about the origin, axis z
TriMesh make_torus_surface(const Memory &memory, double ring, double radius, uint32_t triangles);

// ---- writing: to a temporary name beside the target, then renamed. By ending: .obj, .ply, .stl, .off, .vtk,
// .vtu. Throws Error.
void write_tri_mesh(const TriMesh &mesh, const std::string &path);

// ---- measures ---------------------------------------------------------------------------------------------
double triangle_area(const double *points, const uint32_t *tri);
// 4 sqrt(3) area / sum l^2: 1 for an equilateral triangle, 0 for a flat one.
double triangle_quality(const double *points, const uint32_t *tri);

dfm_mesh_info mesh_statistics(const TriMesh &mesh);

// Cells of a body-centered cubic lattice that cover the inside of the surface, about `cells` of them, with
// `share` filled in. The surface need not be clean: inside is where the generalized winding number exceeds
// one half. Throws Error(FORMAT) where nothing is inside.
TetMesh fill_surface(const TriMesh &surface, uint32_t cells);
// Cells from one inner point to the triangles, in two layers, for a closed surface of which it sees all
// triangles: no lattice, the surface is the border of the cells. Throws Error(UNSUPPORTED) without such a
// point.
TetMesh fan_surface(const TriMesh &surface);
// Hexahedra of a regular grid over the box of a closed surface: about `cells` of them, or of edges of about
// `size`; the other is 0.
TetMesh make_lattice(const TriMesh &surface, uint32_t cells, double size);

}  // namespace dfm
