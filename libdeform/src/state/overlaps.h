// Overlaps that have been found, and what the next look is to take in; step/overlap.h looks.
#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

namespace dfm {

struct Overlap {
  uint64_t a, b;  // ids; of two bodies a < b
  bool obstacle;  // b is one
  // pairs of triangles that cross; of a plane, a sphere or a capsule: triangles that it cuts
  uint32_t crossings = 0;
  uint32_t enclosed = 0;   // surfels of either that lie inside the other
  double depth = 0;        // m, how far what is inside lies from the surface
  bool aside = false;      // deeper than contact leads out: left out of contact until it is apart
  bool separated = false;  // untangle() has put it apart
};
struct PairAside { uint64_t a, b, obstacle; };

struct Overlaps {
  std::vector<uint64_t> placed;         // ids that the next look takes in
  bool all = false, look_only = false;  // it takes in everything; it moves nothing and sets nothing aside
  bool untangle = false;                // it puts apart what it finds, once, whatever the world's flags
  std::vector<Overlap> found;           // by the last look
  std::vector<PairAside> aside;
  bool told = true;  // a step has told it
  bool is_aside(uint64_t a, uint64_t b, bool obstacle) const {
    return std::any_of(aside.begin(), aside.end(), [&](const PairAside &p) {
      return p.a == a && p.b == b && (p.obstacle != 0) == obstacle;
    });
  }
  bool due() const { return all || !placed.empty(); }
  void place(uint64_t id) {
    if (std::find(placed.begin(), placed.end(), id) == placed.end()) placed.push_back(id);
  }
};

}  // namespace dfm
