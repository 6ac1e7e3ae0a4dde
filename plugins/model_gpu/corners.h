// Where cells leave the forces of their corners, and where the points find them.
#pragma once
#include "stepper.h"

namespace gpu {

struct Corners {
  uint32_t ncell = 0;
  size_t room = 0, entries = 0;  // for the forces; of what is kept by cell, three entries each
  Buffer<uvec2> row;             // [npoint] of a point's corners: the first, how many
  Buffer<uvec4> cell;            // [entries] points, places of their forces, what rows count, as four floats
  Buffer<double> rest_row;       // [npoint] 1/s2, of the step bound, with which dampers grow

  // 32 cells side by side
  static size_t entry_of(size_t c, size_t part) { return c / kSide * kSide * 3 + part * kSide + c % kSide; }

  void create(const dfm_host *h, uint32_t npoint, uint32_t n, const uint32_t *cells) {
    ncell = n;
    entries = (size_t(n) + kSide - 1) / kSide * kSide * 3;
    row.create(h, npoint);
    rest_row.create(h, npoint);
    cell.create(h, entries);
    for (size_t k = 0; k < 4 * size_t(n); ++k) ++row[cells[k]].y;
    room = lay_out(row, npoint);
    Buffer<uint32_t> next;
    next.create(h, npoint);
    for (size_t c = 0; c < n; ++c) {
      const uint32_t *const q = cells + 4 * c;
      uint32_t to[4];
      for (int a = 0; a < 4; ++a) to[a] = row[q[a]].x + kSide * next[q[a]]++;
      cell[entry_of(c, 0)] = {q[0], q[1], q[2], q[3]};
      cell[entry_of(c, 1)] = {to[0], to[1], to[2], to[3]};
    }
  }
  void put_shares(size_t c, const float *share) {
    const auto bits = [&](int a) { return std::bit_cast<uint32_t>(share[a]); };
    cell[entry_of(c, 2)] = {bits(0), bits(1), bits(2), bits(3)};
  }
  void put_rows(const double *row_of, const double *mass, uint32_t npoint) {
    for (uint32_t i = 0; i < npoint; ++i) rest_row[i] = row_of[i] / mass[i];
  }
  void add_to(Work &work, uint32_t npoint) const {
    work.array[kCornerRows] = {sizeof(uvec2) * npoint, row.data()};
    work.array[kCorners] = {sizeof(uvec4) * entries, cell.data()};
    work.array[kForces] = {sizeof(dvec4) * room, nullptr};
    work.array[kRestRows] = {sizeof(double) * npoint, rest_row.data()};
  }
};

}  // namespace gpu
