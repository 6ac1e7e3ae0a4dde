// Order of the points: recursive bisection of the rest shape across its longest side. Every range of the
// order is a compact piece of the body, so a block of consecutive points fits the first-level cache together
// with its halo whatever the size of the body, and neighbors lie close to each other within it. Depends on
// rest positions and point numbers alone.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace model {

constexpr uint32_t kBlockPoints = 1024, kLeafPoints = 4;

struct Partition {
  const double *rest;
  uint32_t *order, *block_begin;
  uint32_t nblock = 0;

  void split(uint32_t begin, uint32_t end, bool in_block) {
    if (!in_block && end - begin <= kBlockPoints) {
      block_begin[nblock++] = begin;
      in_block = true;
    }
    if (end - begin <= kLeafPoints) return;
    double lo[3], hi[3];
    for (int a = 0; a < 3; ++a) lo[a] = hi[a] = rest[3 * size_t(order[begin]) + a];
    for (uint32_t n = begin + 1; n < end; ++n)
      for (int a = 0; a < 3; ++a) {
        lo[a] = std::min(lo[a], rest[3 * size_t(order[n]) + a]);
        hi[a] = std::max(hi[a], rest[3 * size_t(order[n]) + a]);
      }
    int axis = 0;
    for (int a = 1; a < 3; ++a)
      if (hi[a] - lo[a] > hi[axis] - lo[axis]) axis = a;
    const uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(order + begin, order + middle, order + end, [&](uint32_t i, uint32_t j) {
      const double a = rest[3 * size_t(i) + axis], b = rest[3 * size_t(j) + axis];
      return a < b || (a == b && i < j);
    });
    split(begin, middle, in_block);
    split(middle, end, in_block);
  }
};

// The capacity of block_begin, for partition_points.
inline uint32_t partition_capacity(uint32_t npoint) { return 2 * (npoint / kBlockPoints) + 2; }

// Fills order[npoint] and where each block begins in it; returns the number of blocks.
inline uint32_t partition_points(const double *rest, uint32_t npoint, uint32_t *order,
                                 uint32_t *block_begin) {
  for (uint32_t n = 0; n < npoint; ++n) order[n] = n;
  Partition partition{rest, order, block_begin};
  partition.split(0, npoint, false);
  block_begin[partition.nblock] = npoint;
  // nth_element leaves the order within a half to the library: sort the leaves by number so that it depends
  // on the mesh alone.
  struct Leaves {
    static void sort(uint32_t *o, uint32_t begin, uint32_t end) {
      if (end - begin <= kLeafPoints) return std::sort(o + begin, o + end);
      const uint32_t middle = begin + (end - begin) / 2;
      sort(o, begin, middle);
      sort(o, middle, end);
    }
  };
  Leaves::sort(order, 0, npoint);
  return partition.nblock;
}

}  // namespace model
