// Numbers that a file gives its nodes or elements, to positions. They may have gaps and come in any order.
#pragma once
#include <cstdint>

#include "core/memory.h"
#include "mesh/cursor.h"

namespace dfm {

class Numbers {
 public:
  Numbers(const Memory &m, const char *of)  // of: "node", in sentences
      : of_(of), tags_(m), order_(m) {}
  void reserve(size_t n) { tags_.reserve(n); }
  void add(int64_t tag) { tags_.push_back(tag); }
  size_t size() const { return tags_.size(); }
  void finish(const Cursor &in);                       // refuses a number given twice
  uint32_t find(const Cursor &in, int64_t tag) const;  // refuses an unknown number
  // Appends the positions of those of first, first + step, ... last that there are; returns how many numbers
  // were looked at for it: of the range or of the file, whichever are fewer.
  uint64_t find_range(int64_t first, int64_t last, int64_t step, Array<uint32_t> &out) const;

 private:
  size_t place(int64_t tag) const;  // in tags_; its size where there is none
  uint32_t position(size_t place) const { return order_.empty() ? uint32_t(place) : order_[place]; }
  const char *of_;
  Array<int64_t> tags_;    // by position, then ascending after finish()
  Array<uint32_t> order_;  // position of each ascending number; empty where they ascend in the file already
};

}  // namespace dfm
