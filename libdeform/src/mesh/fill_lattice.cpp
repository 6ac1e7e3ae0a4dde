#include "mesh/fill_lattice.h"

#include <algorithm>
#include <cmath>

namespace dfm {
namespace {

struct Axes { int a, b, c; };
int remainder4(int32_t x) { return int(uint32_t(x) & 3); }
int32_t component(Site s, int k) { return k == 0 ? s.x : k == 1 ? s.y : s.z; }
Site moved(Site s, int axis, int32_t by) {
  return {s.x + (axis == 0) * by, s.y + (axis == 1) * by, s.z + (axis == 2) * by};
}

Axes axes_of(Site key) {
  Axes out{};
  for (int k = 0; k < 3; ++k) {
    const int r = remainder4(component(key, k));
    (r == 0 ? out.a : r == 2 ? out.b : out.c) = k;
  }
  return out;
}

}  // namespace

void corners_of(Site key, Site corner[4]) {
  const Axes axes = axes_of(key);
  // Half the key is the middle of the cell; along c the grid points lie on the even side of it and the
  // centers on the odd one.
  const int32_t low = (component(key, axes.c) - 1) / 2;
  const int32_t even = low % 2 == 0 ? low : low + 1;
  const int32_t odd = even == low ? low + 1 : low;
  int32_t grid[3], center[3];
  for (int k = 0; k < 3; ++k) grid[k] = center[k] = component(key, k) / 2;
  grid[axes.c] = even;
  center[axes.c] = odd;
  const Site g{grid[0], grid[1], grid[2]}, m{center[0], center[1], center[2]};
  corner[0] = moved(g, axes.b, -1);
  corner[1] = moved(g, axes.b, 1);
  corner[2] = moved(m, axes.a, -1);
  corner[3] = moved(m, axes.a, 1);
  const Vec3 o = place_of(corner[0]);
  if (dot(cross(place_of(corner[1]) - o, place_of(corner[2]) - o), place_of(corner[3]) - o) < 0)
    std::swap(corner[2], corner[3]);
}

Site neighbor(Site key, uint32_t face) {
  // The cells around an edge are turned by a quarter each: the corner across a face is the old one mirrored
  // in the opposite edge's middle.
  Site p[4];
  corners_of(key, p);
  const Site old = p[face], e = p[face < 2 ? 2 : 0], f = p[face < 2 ? 3 : 1];
  p[face] = {e.x + f.x - old.x, e.y + f.y - old.y, e.z + f.z - old.z};
  return {(p[0].x + p[1].x + p[2].x + p[3].x) / 2, (p[0].y + p[1].y + p[2].y + p[3].y) / 2,
          (p[0].z + p[1].z + p[2].z + p[3].z) / 2};
}

TetShape::TetShape(const Vec3 c[4]) {
  std::copy_n(c, 4, corner);
  for (int f = 0; f < 4; ++f) {
    const Vec3 o = corner[kTetFace[f][0]], n = cross(corner[kTetFace[f][1]] - o, corner[kTetFace[f][2]] - o);
    normal[f] = (dot(n, corner[f] - o) > 0 ? -1.0 : 1.0) * normalized(n);
    offset[f] = dot(normal[f], o);
  }
}

bool TetShape::meets(const Vec3 triangle[3], double tolerance) const {
  bool within[3] = {true, true, true};
  for (int f = 0; f < 4; ++f) {
    bool all_out = true;
    for (int k = 0; k < 3; ++k) {
      const bool out = dot(normal[f], triangle[k]) - offset[f] > tolerance;
      all_out &= out;
      within[k] &= !out;
    }
    if (all_out) return false;
  }
  if (within[0] || within[1] || within[2]) return true;
  const auto apart = [&](Vec3 axis) {
    double tlo = HUGE_VAL, thi = -HUGE_VAL, clo = HUGE_VAL, chi = -HUGE_VAL;
    for (int k = 0; k < 3; ++k) {
      const double d = dot(axis, triangle[k] - corner[0]);
      tlo = std::min(tlo, d);
      thi = std::max(thi, d);
    }
    for (int k = 0; k < 4; ++k) {
      const double d = dot(axis, corner[k] - corner[0]);
      clo = std::min(clo, d);
      chi = std::max(chi, d);
    }
    return std::max(tlo - chi, clo - thi) > tolerance * norm(axis);
  };
  const Vec3 edge[3] = {triangle[1] - triangle[0], triangle[2] - triangle[1], triangle[0] - triangle[2]};
  if (apart(cross(edge[0], edge[1]))) return false;
  for (const auto &e : kTetEdge) {
    const Vec3 along = corner[e[1]] - corner[e[0]];
    for (const Vec3 &t : edge)
      if (apart(cross(along, t))) return false;
  }
  return true;
}

// ---- set of keys ------------------------------------------------------------------------------------------

KeySet::KeySet(const Memory &memory) : keys_(memory), table_(64, UINT32_MAX, memory) {}

size_t KeySet::slot(uint64_t key) const {
  const size_t mask = table_.size() - 1;
  // the upper half: all three coordinates reach it
  size_t i = size_t((key * 0x9E3779B97F4A7C15u) >> 32) & mask;
  while (table_[i] != UINT32_MAX && keys_[table_[i]] != key) i = (i + 1) & mask;
  return i;
}

uint32_t KeySet::find(uint64_t key) const { return table_[slot(key)]; }

uint32_t KeySet::add(uint64_t key, bool *is_new) {
  size_t at = slot(key);
  const bool fresh = table_[at] == UINT32_MAX;
  if (is_new) *is_new = fresh;
  if (!fresh) return table_[at];
  table_[at] = uint32_t(keys_.size());
  keys_.push_back(key);
  if (keys_.size() * 2 > table_.size()) {
    table_.assign(table_.size() * 2, UINT32_MAX);
    for (uint32_t i = 0; i < keys_.size(); ++i) table_[slot(keys_[i])] = i;
  }
  return uint32_t(keys_.size() - 1);
}

}  // namespace dfm
