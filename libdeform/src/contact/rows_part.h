// A part of the rows of a contact solve: contacts and bonds that share no unknown with others. Work on one
// part neither reads nor changes another, so parts may be solved at the same time.
#pragma once
#include <cstdint>
#include <span>

#include "core/tasks.h"

namespace dfm {

struct RowRun { uint32_t first, n; };

struct RowsPart {
  std::span<const RowRun> contacts, bonds;  // ascending; the rows of bonds follow those of all contacts
  std::span<const uint32_t> blocks;         // ascending
  uint32_t n = 0, nbond = 0;                // contacts and bonds in it
  uint32_t all() const { return n + nbond; }
};

// f(row)
template <class F>
void each_row(std::span<const RowRun> runs, F &&f) {
  for (const RowRun &r : runs)
    for (uint32_t i = r.first; i < r.first + r.n; ++i) f(i);
}

// f(row): contacts, then bonds.
template <class F>
void each_row(const RowsPart &part, F &&f) {
  each_row(part.contacts, f);
  each_row(part.bonds, f);
}

// f(row) for all rows < n, which cannot fail, in blocks; tasks: null: on this thread alone. A block
// takes some microseconds.
inline constexpr uint32_t kRowsTogether = 32;
template <class F>
void each_row_in_blocks(uint32_t n, Tasks *tasks, F &&f) {
  const auto block = [&](uint32_t begin, uint32_t end) {
    for (uint32_t i = begin; i < end; ++i) f(i);
  };
  if (tasks) tasks->parallel_for(n, kRowsTogether, [&](uint32_t begin, uint32_t end) { block(begin, end); });
  else block(0, n);
}

}  // namespace dfm
