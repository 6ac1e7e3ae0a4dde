// Meshes before they become bodies or surfaces of bodies: reading, repair, topology, generators, writing.
// Set-up code: nothing here runs in a step.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "core/memory.h"
#include "deform/mesh.h"

namespace dfm {

// A physical group of the file. Cells refer to groups of dimension 3; groups of any dimension keep the points
// of their elements, so that a scene can hold or load a named surface.
struct MeshGroup {
  std::string name;  // the file's; its number as text where the file gives no name
  int32_t dimension = 3;
  int32_t tag = 0;         // the file's number
  Array<uint32_t> points;  // ascending, each once
};

// Cells, or a surface: triangles alone.
struct RestMesh {
  explicit RestMesh(const Memory &m = Memory::standard()) : memory(&m) {
    use_memory(m, points, cells, tets, tet_group, tris, tri_group, file_point, file_cell, share, inside);
  }
  const Memory *memory;
  Array<double> points;  // [npoint,3], m
  // DFM_CELL_* of plugin.h; of another kind than tetrahedra, nodes by cell: `tets` are then the tetrahedra of
  // each, as many as mesh/cells.h says, and [ntet] arrays go by these
  uint32_t cell = 8;
  Array<uint32_t> cells;
  Array<uint32_t> tets;       // [ntet,4], every volume positive
  Array<uint32_t> tet_group;  // [ntet] index into groups, kNoGroup without
  // [ntri,3] of a surface: neighbors agree, closed pieces face outward; beside cells: the file's triangles
  // that belong to a group, so that it survives writing, in the file's sense of turn
  Array<uint32_t> tris;
  Array<uint32_t> tri_group;  // [ntri] index into groups, kNoGroup without
  // [npoint] 0-based position of the point in its file (the first of those merged)
  Array<uint32_t> file_point;
  // [ntet] 0-based position among the file's tetrahedra; empty where none was dropped
  Array<uint32_t> file_cell;
  // [ntet] of a filled surface: how much of the cell is material, (0,1]; else empty
  Array<double> share;
  Array<double> inside;           // [ncell,27] of a lattice, as dfm_mesh_info has it; else empty
  std::vector<MeshGroup> groups;  // by dimension, then tag
  // Repairs and observations of the reader; cells: triangles of a surface.
  uint32_t turned = 0, merged_points = 0, dropped_points = 0, dropped_cells = 0;
  uint32_t overlapping = 0;           // faces whose two cells lie on the same side: the mesh is tangled there
  std::vector<std::string> warnings;  // one sentence each
  uint32_t npoint() const { return static_cast<uint32_t>(points.size() / 3); }
  uint32_t ntri() const { return static_cast<uint32_t>(tris.size() / 3); }
  uint32_t ntet() const { return static_cast<uint32_t>(tets.size() / 4); }
  // The cells as they are written: nodes, and the group of each.
  const Array<uint32_t> &nodes() const { return cells.empty() ? tets : cells; }
  Array<uint32_t> cell_groups() const;
};
inline constexpr uint32_t kNoGroup = UINT32_MAX;
inline constexpr uint32_t kMaxTets = 1u << 30;  // face numbers are 4*cell+face in 32 bits

// "obj" of "FOLDER/A.OBJ"; empty without one.
std::string ending_of(const std::string &path);

// ---- reading ----------------------------------------------------------------------------------------------
// By file name ending; throws Error (IO, FORMAT, UNSUPPORTED) with one sentence. Memory stays within a small
// multiple of the file's size. what: DFM_MESH_*
RestMesh read_mesh(const Memory &memory, const std::string &path, uint32_t what);

// ---- generators (SI units, near-isotropic cells, about `cells` of them) -----------------------------------
// axis z, base at the origin
RestMesh make_cylinder(const Memory &memory, double radius, double length, uint32_t cells);
RestMesh make_beam(const Memory &memory, double x, double y, double z, uint32_t cells);    // from the origin
RestMesh make_bricks(const Memory &memory, double x, double y, double z, uint32_t cells);  // as the beam
// about the origin
RestMesh make_ball(const Memory &memory, double radius, uint32_t cells);
// as the cylinder, with a hole
RestMesh make_tube(const Memory &memory, double inner, double outer, double length, uint32_t cells);
// Closed surfaces of about `triangles` near-equilateral triangles, in the places of the bodies of the same
// names.
RestMesh make_cylinder_surface(const Memory &memory, double radius, double length, uint32_t triangles);
RestMesh make_beam_surface(const Memory &memory, double x, double y, double z, uint32_t triangles);
RestMesh make_ball_surface(const Memory &memory, double radius, uint32_t triangles);
RestMesh make_tube_surface(const Memory &memory, double inner, double outer, double length,
                           uint32_t triangles);
// about the origin, axis z
RestMesh make_torus_surface(const Memory &memory, double ring, double radius, uint32_t triangles);

// ---- cells for a surface ----------------------------------------------------------------------------------
// Cells of a body-centered cubic lattice that cover the inside of the surface, about `cells` of them, with
// `share` filled in. The surface need not be clean: inside is where the generalized winding number exceeds
// one half. Throws Error(FORMAT) where nothing is inside.
RestMesh fill_surface(const RestMesh &surface, uint32_t cells);
// Cells from one inner point to the triangles, in two layers, for a closed surface of which it sees all
// triangles: no lattice, the surface is the border of the cells. Throws Error(UNSUPPORTED) without such a
// point.
RestMesh fan_surface(const RestMesh &surface);
// Hexahedra of a regular grid over the box of a closed surface: about `cells` of them, or of edges of about
// `size`; the other is 0.
RestMesh make_lattice(const RestMesh &surface, uint32_t cells, double size);

// ---- topology ---------------------------------------------------------------------------------------------
// Corners of the four faces of a cell, outward for a positive cell; face f lies opposite corner f.
inline constexpr uint32_t kTetFace[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
inline constexpr uint32_t kTetEdge[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

// Faces that belong to one cell only, [n,3], outward, ordered by owning cell and face. Point numbers are
// those of the cells.
Array<uint32_t> boundary_triangles(const Memory &memory, uint32_t ntet, const uint32_t *tets);
inline Array<uint32_t> boundary_triangles(const Array<uint32_t> &tets) {
  return boundary_triangles(*tets.get_allocator().memory, static_cast<uint32_t>(tets.size() / 4),
                            tets.data());
}
// Edges of the cells, [n,2], i < j, lexicographic.
Array<uint32_t> unique_edges(const Memory &memory, uint32_t ntet, const uint32_t *tets);
// The number of the edge between two points in such a list; UINT32_MAX: there is none.
uint32_t edge_number(const Array<uint32_t> &edges, uint32_t a, uint32_t b);
inline Array<uint32_t> unique_edges(const Array<uint32_t> &tets) {
  return unique_edges(*tets.get_allocator().memory, static_cast<uint32_t>(tets.size() / 4), tets.data());
}

double tet_volume(const double *points, const uint32_t *tet);
// Mean ratio 12 (3V)^(2/3) / sum l^2: 1 for a regular tetrahedron, 0 for a flat one, negative for
// an inverted one.
double tet_quality(const double *points, const uint32_t *tet);
double triangle_area(const double *points, const uint32_t *tri);
// 4 sqrt(3) area / sum l^2: 1 for an equilateral triangle, 0 for a flat one.
double triangle_quality(const double *points, const uint32_t *tri);

// All but the arrays and the text of the warnings.
dfm_mesh_info mesh_statistics(const RestMesh &mesh);

// ---- writing ----------------------------------------------------------------------------------------------
// All write to a temporary file next to the target and rename it, so no partial file remains. Throw
// Error(DFM_E_IO).
void write_msh41(const RestMesh &mesh, const std::string &path);  // binary
void write_msh22(const RestMesh &mesh, const std::string &path);  // binary
void write_vtk(const RestMesh &mesh, const std::string &path);    // legacy 3.0, binary
void write_medit(const RestMesh &mesh, const std::string &path);  // text; groups by number alone
void write_vtu(const RestMesh &mesh, const std::string &path);    // with groups and share as cell data
// By ending: cells as .msh (4.1), .msh2 (2.2), .vtk, .vtu, .mesh; a surface as .obj, .ply, .stl, .off, .vtk,
// .vtu. False: cells are in part material, and the format does not hold how much.
bool write_mesh(const RestMesh &mesh, const std::string &path);
void write_surface(const RestMesh &mesh, const std::string &path);

// VTU (XML, appended raw data), as ParaView reads it.
struct VtuArray {
  const char *name;
  uint32_t width;           // components
  const double *real;       // [n,width], or
  const uint32_t *integer;  // [n,width] where real is null
};
struct VtuGrid {
  uint32_t npoint = 0, ncell = 0, corners = 4;  // 3 triangles, else as in mesh/cells.h
  const double *points = nullptr;               // [npoint,3]
  const uint32_t *cells = nullptr;              // [ncell,corners]
  uint32_t nface = 0;                           // triangles behind the cells; cell data are [ncell+nface]
  const uint32_t *faces = nullptr;              // [nface,3]
  std::vector<VtuArray> point_data, cell_data;
  const std::vector<MeshGroup> *groups = nullptr;  // their names go into the field data
};
void write_vtu(const std::string &path, const VtuGrid &grid);

}  // namespace dfm
