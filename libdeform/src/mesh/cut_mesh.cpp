#include "mesh/cut_mesh.h"

#include <algorithm>

#include "core/disjoint_sets.h"

namespace dfm {
namespace {

uint32_t corner_of(const uint32_t *tets, uint32_t cell, uint32_t point) {
  const uint32_t *const c = tets + size_t{4} * cell;
  return 4 * cell + uint32_t(std::find(c, c + 4, point) - c);
}

// Corners of cells {cell, corner} that are copies of one point: joined across faces that are not open.
// split [npoint] out: 1: an open face has it.
DisjointSets join_corners(const Memory &memory, uint32_t npoint, uint32_t ntet, const uint32_t *tets,
                          const Array<uint8_t> &removed, const Array<uint64_t> &open,
                          const Array<uint32_t> &inner, Array<uint8_t> &split) {
  DisjointSets corners(memory, 4 * ntet);
  split.assign(npoint, 0);
  const auto join_across = [&](uint32_t a, uint32_t b) {
    if (removed[a] || removed[b]) return;
    const bool opened = std::binary_search(open.begin(), open.end(), open_face(a, b));
    for (int k = 0; k < 4; ++k) {
      const uint32_t point = tets[size_t{4} * a + size_t(k)], other = corner_of(tets, b, point);
      if (other == 4 * b + 4) continue;  // the corner of a that is not in the face
      if (opened) split[point] = 1;
      else corners.join(4 * a + uint32_t(k), other);
    }
  };
  if (inner.empty()) each_inner_face(sorted_faces(memory, ntet, tets), join_across);
  else
    for (size_t f = 0; f < inner.size(); f += 2) join_across(inner[f], inner[f + 1]);
  return corners;
}

}  // namespace

CutMesh::CutMesh(const Memory &memory) { use_memory(memory, tets, point, cell); }

Array<uint32_t> inner_faces(const Array<TetFace> &faces) {
  Array<uint32_t> out{faces.get_allocator()};
  out.reserve(faces.size());
  each_inner_face(faces, [&](uint32_t i, uint32_t j) {
    out.push_back(i);
    out.push_back(j);
  });
  return out;
}

CutMesh make_cut_mesh(const Memory &memory, uint32_t npoint, uint32_t ntet, const uint32_t *tets,
                      const Array<uint8_t> &removed, const Array<uint64_t> &open,
                      const Array<uint32_t> &inner) {
  CutMesh out(memory);
  Array<uint32_t> number(npoint, UINT32_MAX, memory), copy(memory);
  Array<uint8_t> split{memory};
  DisjointSets corners(memory);
  if (!open.empty()) {
    corners = join_corners(memory, npoint, ntet, tets, removed, open, inner, split);
    copy.assign(size_t{4} * ntet, UINT32_MAX);
  }
  for (uint32_t t = 0; t < ntet; ++t) {
    if (removed[t]) continue;
    out.cell.push_back(t);
    for (int k = 0; k < 4; ++k) number[tets[size_t{4} * t + size_t(k)]] = 0;
  }
  for (uint32_t p = 0; p < npoint; ++p)
    if (number[p] == 0) {
      number[p] = uint32_t(out.point.size());
      out.point.push_back(p);
    }
  Array<uint8_t> taken(npoint, 0, memory);  // the first copy has its cells
  for (const uint32_t t : out.cell)
    for (uint32_t k = 0; k < 4; ++k) {
      const uint32_t p = tets[size_t{4} * t + k];
      if (open.empty() || !split[p]) {
        out.tets.push_back(number[p]);
        continue;
      }
      uint32_t &mine = copy[corners.root(4 * t + k)];
      if (mine == UINT32_MAX) {
        mine = number[p];
        if (taken[p]) {
          mine = uint32_t(out.point.size());
          out.point.push_back(p);
        }
        taken[p] = 1;
      }
      out.tets.push_back(mine);
    }
  return out;
}

Array<uint32_t> parts_of_cells(const Memory &memory, uint32_t npoint, uint32_t ntet, const uint32_t *tets,
                               uint32_t &n) {
  DisjointSets points(memory, npoint);
  for (size_t t = 0; t < size_t{4} * ntet; t += 4)
    for (size_t k = 1; k < 4; ++k) points.join(tets[t], tets[t + k]);
  Array<uint32_t> number(npoint, UINT32_MAX, memory), out(ntet, 0u, memory);
  n = 0;
  for (uint32_t t = 0; t < ntet; ++t) {
    uint32_t &mine = number[points.root(tets[size_t{4} * t])];
    if (mine == UINT32_MAX) mine = n++;
    out[t] = mine;
  }
  return out;
}

uint32_t count_parts(const Memory &memory, uint32_t npoint, uint32_t ntet, const uint32_t *tets) {
  uint32_t n;
  parts_of_cells(memory, npoint, ntet, tets, n);
  return n;
}

}  // namespace dfm
