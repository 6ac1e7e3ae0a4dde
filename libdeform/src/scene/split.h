// A surface whose triangles are long against the cells that carry it.
#pragma once
#include <cstdint>
#include <vector>

namespace dfm::scene {

struct Triangles {
  std::vector<double> points;       // [n,3]
  std::vector<uint32_t> triangles;  // [m,3]
  std::vector<uint32_t> group;      // [m], or empty
};

// Splits edges at their middles until none is longer than `longest`, m. The shape stays the same: every new
// point lies on an edge of the surface before. The points given keep their numbers and places; the new ones
// follow. Each triangle has the group of the one that it is a part of.
void split_long_edges(double longest, Triangles &surface);

}  // namespace dfm::scene
