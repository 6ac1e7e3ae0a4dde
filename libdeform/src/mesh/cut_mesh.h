// The effect of a cut on a mesh of tetrahedra: cells are removed, and points are split where faces between
// cells are opened. No cell is divided, so no cell becomes smaller or thinner.
#pragma once
#include <cstdint>

#include "core/memory.h"
#include "mesh/faces.h"

namespace dfm {

// Two cells whose common face is open, the lower one in the high half.
constexpr uint64_t open_face(uint32_t a, uint32_t b) {
  return a < b ? uint64_t{a} << 32 | b : uint64_t{b} << 32 | a;
}

struct CutMesh {
  Array<uint32_t> tets;   // [ncell,4]
  Array<uint32_t> point;  // [npoint] previous number; copies of points come after all others
  Array<uint32_t> cell;   // [ncell] previous number, ascending
  explicit CutMesh(const Memory &memory);
};

// removed [ntet]: 1: removed. open: open faces, ascending; those of removed cells have no effect. Around a
// point with an open face, the cells that are connected by other faces share one copy of it; the first copy
// is that of the lowest cell. Other points are not split, even if cells share only that point. Points without
// cells are removed. inner: inner_faces() of the mesh, or empty where nobody has them.
CutMesh make_cut_mesh(const Memory &memory, uint32_t npoint, uint32_t ntet, const uint32_t *tets,
                      const Array<uint8_t> &removed, const Array<uint64_t> &open,
                      const Array<uint32_t> &inner);

// Calls use(cell, cell) for the two sides of each inner face, the lower cell first, in the order of the
// points of the faces. Skips faces of more than two cells. faces: sorted
template <class Use>
void each_inner_face(const Array<TetFace> &faces, Use &&use) {
  for (size_t i = 0, j = 0; i < faces.size(); i = j) {
    for (j = i + 1; j < faces.size() && faces[j].same_corners(faces[i]);) ++j;
    if (j == i + 2) use(faces[i].owner >> 2, faces[i + 1].owner >> 2);
  }
}
// [n,2] these cells.
Array<uint32_t> inner_faces(const Array<TetFace> &faces);

// [ntet] part of each cell; cells that share a point are in the same part; parts are numbered by their lowest
// cells.
Array<uint32_t> parts_of_cells(const Memory &memory, uint32_t npoint, uint32_t ntet, const uint32_t *tets,
                               uint32_t &n);
uint32_t count_parts(const Memory &memory, uint32_t npoint, uint32_t ntet, const uint32_t *tets);

}  // namespace dfm
