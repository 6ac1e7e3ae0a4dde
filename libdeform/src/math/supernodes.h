// The symbolic factorization of a block matrix, A = P^T L D L^T P: its structure before any value is known.
#pragma once
#include "math/block_matrix.h"

namespace dfm {

// Neighboring columns of L with (almost) the same rows form a supernode, stored as a dense panel. All counts
// are points; each is three rows or columns.
//
//            begin  end
//             | \      |      pivots: the columns of the supernode, a unit lower triangle
//             |   \    |
//   rows[0]   | . . .  |      rows below: ascending, the same for all its columns
//   rows[1]   | . . .  |
//
// The parent of a supernode owns the first of its rows. Children precede their parent, and subtrees are
// contiguous (postorder).
struct Supernodes {
  static constexpr uint32_t kNone = UINT32_MAX;

  explicit Supernodes(const Memory &memory);
  void build(const BlockPattern &pattern);  // by minimum degree
  // order[n]: the point eliminated as the k-th
  void build(const BlockPattern &pattern, const uint32_t *order);

  uint32_t count() const { return uint32_t(parent.size()); }
  uint32_t width(uint32_t s) const { return begin[s + 1] - begin[s]; }
  uint32_t below(uint32_t s) const { return row_begin[s + 1] - row_begin[s]; }
  uint32_t height(uint32_t s) const { return width(s) + below(s); }

  Array<uint32_t> place;      // [n] position of a point in the order of elimination
  Array<uint32_t> begin;      // [count + 1] first column
  Array<uint32_t> owner;      // [n] supernode of a column
  Array<uint32_t> parent;     // [count] kNone at a root
  Array<uint32_t> row_begin;  // [count + 1] into rows
  Array<uint32_t> rows;       // columns of the matrix
  Array<uint32_t> relative;   // as rows: the place of a row in the parent, pivots first
  Array<size_t> value_begin;  // [count + 1] of the panels [3 width][3 height], column after column
  size_t stack = 0;           // doubles that the updates of children need at most

 private:
  void link_parents();  // parent, relative and stack, from the rest
};

}  // namespace dfm
