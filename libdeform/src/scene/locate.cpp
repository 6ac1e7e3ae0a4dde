#include "scene/locate.h"

#include <algorithm>
#include <cmath>

#include "math/extent.h"
#include "scene/select.h"

namespace dfm::scene {

double volume6(const double *const p[4]) {
  const Vec3 a = load3(p[0]);
  return dot(load3(p[1]) - a, cross(load3(p[2]) - a, load3(p[3]) - a));
}

namespace {

// Distance of a point from a segment, and from a triangle: inside its prism the height, else the
// nearest of its edges.
double segment_distance(Vec3 p, Vec3 a, Vec3 b) {
  const Vec3 u = b - a, v = p - a;
  const double t = std::clamp(dot(u, v) / dot(u, u), 0.0, 1.0);
  return norm(v - t * u);
}

double triangle_distance(const double *point, const double *const corner[3]) {
  const Vec3 p = load3(point), c[3] = {load3(corner[0]), load3(corner[1]), load3(corner[2])};
  const Vec3 u = c[1] - c[0], v = c[2] - c[0], w = p - c[0], n = cross(u, v);
  const double s = dot(w, cross(v, n)), t = dot(u, cross(w, n)), whole = dot(n, n);
  if (s >= 0 && t >= 0 && s + t <= whole) return std::fabs(dot(w, n)) / std::sqrt(whole);
  return std::min(
      {segment_distance(p, c[0], c[1]), segment_distance(p, c[1], c[2]), segment_distance(p, c[2], c[0])});
}

// Barycentric coordinates of the point in the cell, and its distance from it.
double from_cell(const double *const corner[4], const double *point, double weights[4]) {
  const double whole = volume6(corner);
  if (!(std::fabs(whole) > 0)) return INFINITY;
  bool inside = true;
  for (int k = 0; k < 4; ++k) {  // volume with corner k moved to the point, over the cell's
    const double *p[4] = {corner[0], corner[1], corner[2], corner[3]};
    p[k] = point;
    weights[k] = volume6(p) / whole;
    inside = inside && weights[k] >= 0;
  }
  double away = inside ? 0 : INFINITY;
  for (int k = 0; k < 4 && !inside; ++k) {
    const double *const face[3] = {corner[k == 0], corner[k <= 1 ? 2 : 1], corner[k <= 2 ? 3 : 2]};
    away = std::min(away, triangle_distance(point, face));
  }
  return away;
}

}  // namespace

Locator::Locator(const BodyMesh &mesh) : mesh_(mesh) {
  const Extent box = extent_of(mesh.points);
  const Vec3 hi = box.hi;
  store3(lo_, box.lo);
  // About one cubic bin per cell; a bin is never thinner than the thinnest extent of the body requires.
  const double extent = std::max({hi[0] - lo_[0], hi[1] - lo_[1], hi[2] - lo_[2]});
  double volume = 1;
  for (int k = 0; k < 3; ++k) volume *= std::max(hi[k] - lo_[k], 1e-3 * extent) / extent;
  const double edge = extent * std::cbrt(volume / std::max(1u, mesh.ntet));
  least_width_ = INFINITY;
  for (int k = 0; k < 3; ++k) {
    n_[k] = std::clamp(int((hi[k] - lo_[k]) / edge), 1, 1000);
    width_[k] = std::max(hi[k] - lo_[k], 1e-3 * extent) / n_[k];
    least_width_ = std::min(least_width_, width_[k]);
  }
  // Two passes over the bins that each cell's box overlaps: count, then fill in the order of the cells.
  begin_.assign(size_t(n_[0]) * size_t(n_[1]) * size_t(n_[2]) + 1, 0);
  for (int pass = 0; pass < 2; ++pass) {
    std::vector<uint32_t> at(begin_.begin(), begin_.end() - 1);
    for (uint32_t c = 0; c < mesh.ntet; ++c) {
      int first[3], last[3];
      for (int k = 0; k < 3; ++k) {
        double least = INFINITY, most = -INFINITY;
        for (int j = 0; j < 4; ++j) {
          const double x = mesh.points[3 * size_t(mesh.tets[4 * size_t(c) + size_t(j)]) + size_t(k)];
          least = std::min(least, x);
          most = std::max(most, x);
        }
        first[k] = bin(least, k);
        last[k] = bin(most, k);
      }
      for (int i = first[0]; i <= last[0]; ++i)
        for (int j = first[1]; j <= last[1]; ++j)
          for (int k = first[2]; k <= last[2]; ++k) {
            const size_t b = (size_t(i) * size_t(n_[1]) + size_t(j)) * size_t(n_[2]) + size_t(k);
            if (pass == 0) ++begin_[b + 1];
            else cell_[at[b]++] = c;
          }
    }
    if (pass == 1) break;
    for (size_t b = 1; b < begin_.size(); ++b) begin_[b] += begin_[b - 1];
    cell_.resize(begin_.back());
  }
}

int Locator::bin(double x, int axis) const {
  return int(std::clamp((x - lo_[axis]) / width_[axis], 0.0, double(n_[axis] - 1)));
}

void Locator::look(int i, int j, int k, const double *point, Best &best) const {
  const size_t b = (size_t(i) * size_t(n_[1]) + size_t(j)) * size_t(n_[2]) + size_t(k);
  for (uint32_t n = begin_[b]; n < begin_[b + 1]; ++n) {
    const uint32_t c = cell_[n], *const t = mesh_.tets + 4 * size_t(c);
    if (best.away == 0 && c >= best.cell) return;
    const double *const corner[4] = {&mesh_.points[3 * size_t(t[0])], &mesh_.points[3 * size_t(t[1])],
                                     &mesh_.points[3 * size_t(t[2])], &mesh_.points[3 * size_t(t[3])]};
    Best here = {0, c, {}};
    here.away = from_cell(corner, point, here.weights);
    if (here.away < best.away || (here.away == best.away && c < best.cell)) best = here;
  }
}

double Locator::find(const double point[3], uint32_t corners[4], double weights[4]) const {
  Best best = {INFINITY, UINT32_MAX, {}};
  const int at[3] = {bin(point[0], 0), bin(point[1], 1), bin(point[2], 2)};
  const int rings = std::max({n_[0], n_[1], n_[2]});
  // Bins of ring r lie at least r - 1 bins away; a point outside the grid is nearer to none of them than
  // its projection.
  for (int r = 0; r < rings && !(best.away < (r - 1) * least_width_) && !(r > 0 && best.away == 0); ++r) {
    int first[3], last[3];
    for (int k = 0; k < 3; ++k) {
      first[k] = std::max(at[k] - r, 0);
      last[k] = std::min(at[k] + r, n_[k] - 1);
    }
    for (int i = first[0]; i <= last[0]; ++i)
      for (int j = first[1]; j <= last[1]; ++j)
        for (int k = first[2]; k <= last[2]; ++k)
          if (std::max({std::abs(i - at[0]), std::abs(j - at[1]), std::abs(k - at[2])}) == r)
            look(i, j, k, point, best);
  }
  if (best.cell == UINT32_MAX) return best.away;
  std::copy_n(mesh_.tets + 4 * size_t(best.cell), 4, corners);
  std::copy_n(best.weights, 4, weights);
  return best.away;
}

}  // namespace dfm::scene
