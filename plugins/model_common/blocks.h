// The points of a body divided into blocks that fit the first-level cache. Passes run block by block: each
// loads its points and sums into its own array, halo included; then each adds up, in block order, what the
// others' halos hold for its points. No two workers write the same place, and the mesh alone determines the
// order of every sum.
#pragma once
#include <algorithm>

#include "block_points.h"
#include "lists.h"
#include "partition.h"
#include "pieces.h"

namespace model {

// Block: a BlockPoints with additions of the model.
template <class Block>
struct Blocks {
  static constexpr uint32_t kNone = ~0u;
  // largest number of pieces of a pass: enough for the workers that one body can use
  static constexpr uint32_t kPieces = 32;
  static constexpr uint32_t kAhead = 64;

  const dfm_host *host = nullptr;
  uint32_t npoint = 0, nblock = 0;
  // blocks per piece of a pass at least; points of the largest block with its halo
  uint32_t grain = 1, largest = 0;
  Buffer<Block> block;
  Buffer<uint32_t> point;
  Buffer<double> p, f;
  Buffer<Merge> merge;                       // by owning block
  Buffer<uint32_t> merge_begin, slot_begin;  // [nblock + 1]

  // Block n with the packed points of the piece that begins at block `begin`: a piece uses one place for all
  // of its blocks, which therefore stays in the cache however large the body is. Pieces begin at multiples of
  // the grain, so no two share a place.
  Block lend(uint32_t n, uint32_t begin) {
    Block b = block[n];
    b.p = p.data() + 8 * size_t(largest) * (begin / grain);
    return b;
  }

  // use(n, begin) for all blocks, begin that of the piece, on the host's workers if that is faster.
  template <class Use>
  void for_each_block(bool parallel, const Use &use) const {
    in_pieces(host, parallel, nblock, grain, [&](uint32_t begin, uint32_t end) {
      for (uint32_t n = begin; n < end; ++n) use(n, begin);
    });
  }

  // Adds the halo values of other blocks to the points of block n.
  template <class Kernels>
  void merge_block(const Kernels &kernels, uint32_t n) {
    kernels.merge(f.data(), merge.data() + merge_begin[n], merge_begin[n + 1] - merge_begin[n]);
  }

 protected:
  // Maps from the mesh to the blocks; a rank is the place of a point in the order of partition_points.
  struct Order {
    // points by rank, ranks by point, first rank of each block, block of a rank
    Buffer<uint32_t> order, rank, begin, block_of;
    // last block that saw a rank, its number there, ranks outside the block
    Buffer<uint32_t> mark, local, halo;
  };

  void order_points(Order &l, const double *rest) {
    for (Buffer<uint32_t> *b : {&l.order, &l.rank, &l.block_of, &l.mark, &l.local, &l.halo})
      b->create(host, npoint);
    l.begin.create(host, partition_capacity(npoint));
    nblock = partition_points(rest, npoint, l.order.data(), l.begin.data());
    for (uint32_t b = 0; b < nblock; ++b)
      for (uint32_t r = l.begin[b]; r < l.begin[b + 1]; ++r) {
        l.rank[l.order[r]] = r;
        l.block_of[r] = b;
      }
    std::fill(l.mark.data(), l.mark.data() + npoint, kNone);
  }

  static uint32_t lowest_rank(const Order &l, const uint32_t *cell) {
    return std::min(std::min(l.rank[cell[0]], l.rank[cell[1]]), std::min(l.rank[cell[2]], l.rank[cell[3]]));
  }

  // Ranks outside block b among those that each(see) shows to `see`, ascending, in l.halo; returns how many.
  template <class Each>
  static uint32_t find_halo(Order &l, uint32_t b, const Each &each) {
    uint32_t n = 0;
    each([&](uint32_t r) {
      if (l.block_of[r] == b || l.mark[r] == b) return;
      l.mark[r] = b;
      l.halo[n++] = r;
    });
    std::sort(l.halo.data(), l.halo.data() + n);
    return n;
  }

  // Allocates the points of all blocks; halo(b) finds the halo of block b.
  template <class Halo>
  void create_points(Order &l, const Halo &halo) {
    slot_begin.create(host, size_t(nblock) + 1);
    for (uint32_t b = 0; b < nblock; ++b) {
      slot_begin[b + 1] = slot_begin[b] + (l.begin[b + 1] - l.begin[b]) + halo(b);
      largest = std::max(largest, slot_begin[b + 1] - slot_begin[b]);
    }
    grain = (nblock + kPieces - 1) / kPieces;
    block.create(host, nblock);
    point.create(host, size_t(slot_begin[nblock]) + kAhead);
    p.create(host, 8 * size_t(largest) * ((nblock + grain - 1) / grain));
    f.create(host, 4 * size_t(slot_begin[nblock]));
    std::fill(l.mark.data(), l.mark.data() + npoint, kNone);
  }

  // Block b with its points, `nhalo` of them in l.halo.
  Block &place_points(Order &l, uint32_t b, uint32_t nhalo) {
    const uint32_t owned = l.begin[b + 1] - l.begin[b];
    uint32_t *const points = point.data() + slot_begin[b];
    for (uint32_t n = 0; n < owned; ++n) {
      l.local[l.begin[b] + n] = n;
      points[n] = l.order[l.begin[b] + n];
    }
    for (uint32_t n = 0; n < nhalo; ++n) {
      l.local[l.halo[n]] = owned + n;
      points[owned + n] = l.order[l.halo[n]];
    }
    Block &out = block[b];
    out.owned = owned;
    out.local = owned + nhalo;
    out.point = points;
    out.f = f.data() + 4 * size_t(slot_begin[b]);
    out.ahead = nblock > 1 ? kAhead : 0;
    return out;
  }

  // Halo sums by owner, sources in block order: the order of the sums depends on the mesh and not on threads.
  void build_merge(const Order &l) {
    const auto each = [&](const auto &use) {
      for (uint32_t b = 0; b < nblock; ++b)
        for (uint32_t n = block[b].owned; n < block[b].local; ++n) {
          const uint32_t r = l.rank[block[b].point[n]], owner = l.block_of[r];
          use(owner, Merge{slot_begin[b] + n, slot_begin[owner] + (r - l.begin[owner])});
        }
    };
    make_lists(host, nblock, each, merge_begin, merge);
  }
};

}  // namespace model
