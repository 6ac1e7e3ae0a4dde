// Faces of cells, sorted so that equal ones are neighbors.
#pragma once
#include <cstdint>
#include <tuple>

#include "core/memory.h"

namespace dfm {

struct TetFace {
  uint32_t a, b, c;  // ascending point numbers
  uint32_t owner;    // 4*cell + face
  // 1: outward order is an odd permutation of a, b, c. Two cells on either side of a face differ in it
  uint32_t odd;
  bool same_corners(const TetFace &o) const { return a == o.a && b == o.b && c == o.c; }
  bool operator<(const TetFace &o) const {
    return std::tie(a, b, c, owner) < std::tie(o.a, o.b, o.c, o.owner);
  }
};

Array<TetFace> sorted_faces(const Memory &memory, uint32_t ntet, const uint32_t *tets);
// [n,3] those of one cell, outward, in the order of the cells. faces: all of tets, sorted
Array<uint32_t> boundary_triangles(const Array<TetFace> &faces, const uint32_t *tets);

}  // namespace dfm
