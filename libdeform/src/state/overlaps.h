// Overlaps that have been found, and what the next search covers; step/overlap/overlap.h searches.
#pragma once
#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace dfm {

struct Overlap {
  uint64_t a, b;  // ids; of two bodies a < b
  bool obstacle;  // b is one
  // pairs of triangles that cross; of a plane, a sphere or a capsule: triangles that it cuts
  uint32_t crossings = 0;
  uint32_t enclosed = 0;   // surfels of one that lie inside the other, both ways
  double depth = 0;        // m, largest distance of such a surfel from the other surface
  bool suspended = false;  // too deep for contact to resolve: excluded from contact until the two are apart
  bool separated = false;  // untangle() has separated it
  uint64_t whole = 0;      // id of the body of which both are parts, and lie as contact has left them; else 0
};
struct SuspendedPair { uint64_t a, b, obstacle; };

struct Overlaps {
  std::vector<uint64_t> placed;  // ids that the next search covers
  // search everything; search only, without moving or excluding anything
  bool all = false, report_only = false;
  bool untangle = false;       // separate what is found, once, whatever the flags of the world
  std::vector<Overlap> found;  // by the last search
  std::vector<SuspendedPair> suspended;
  bool reported = true;  // a step has reported it
  // m by the body of which both are parts: the largest depth in the log
  std::vector<std::pair<uint64_t, double>> reported_depths;
  bool is_suspended(uint64_t a, uint64_t b, bool obstacle) const {
    return std::any_of(suspended.begin(), suspended.end(), [&](const SuspendedPair &p) {
      return p.a == a && p.b == b && (p.obstacle != 0) == obstacle;
    });
  }
  // The mode of one search of everything; where that fails, the next one is what it would have been.
  class Mode {
   public:
    Mode(Overlaps &o, bool Overlaps::*mode) : of_(o), mode_(mode), all_(o.all) { o.all = o.*mode = true; }
    ~Mode() {
      of_.*mode_ = false;
      of_.all = of_.all && all_;
    }
    Mode(const Mode &) = delete;

   private:
    Overlaps &of_;
    bool Overlaps::*mode_;
    const bool all_;
  };
  bool is_pending() const { return all || !placed.empty(); }
  void place(uint64_t id) {
    if (std::find(placed.begin(), placed.end(), id) == placed.end()) placed.push_back(id);
  }
};

}  // namespace dfm
