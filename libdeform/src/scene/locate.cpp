#include "scene/locate.h"

#include <algorithm>
#include <cmath>

#include "geometry/closest.h"
#include "scene/select.h"

namespace dfm::scene {

double volume6(const double *const p[4]) {
  const Vec3 a = load3(p[0]);
  return dot(load3(p[1]) - a, cross(load3(p[2]) - a, load3(p[3]) - a));
}

namespace {

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
    const Vec3 a = load3(corner[k == 0]), b = load3(corner[k <= 1 ? 2 : 1]),
               c = load3(corner[k <= 2 ? 3 : 2]);
    away = std::min(away, closest_on_triangle(load3(point), a, b, c).distance2);
  }
  return std::sqrt(away);
}

void corners_of(const BodyMesh &mesh, uint32_t cell, const double *corner[4]) {
  for (size_t k = 0; k < 4; ++k) corner[k] = &mesh.points[3 * size_t{mesh.info.tets[4 * size_t{cell} + k]}];
}

}  // namespace

Locator::Locator(const BodyMesh &mesh)
    : mesh_(mesh), tree_(Memory::standard(), mesh.info.ntet, [&](uint32_t c) {
        const double *corner[4];
        corners_of(mesh, c, corner);
        Extent box;
        for (const double *x : corner) box.add(load3(x));
        return box;
      }) {}

double Locator::find(const double point[3], uint32_t corners[4], double weights[4]) const {
  constexpr double kRounding = 1e-12;  // of the distances of a cell and of its box
  double away = INFINITY, limit2 = INFINITY;
  uint32_t cell = UINT32_MAX;
  tree_.near(load3(point), limit2, [&](uint32_t c) {
    const double *corner[4];
    double here[4] = {};
    corners_of(mesh_, c, corner);
    const double distance = from_cell(corner, point, here);
    if (distance > away || (distance == away && c > cell)) return;
    away = distance;
    cell = c;
    std::copy_n(here, 4, weights);
    limit2 = std::pow(away + kRounding * (away + mesh_.size), 2);
  });
  if (cell != UINT32_MAX) std::copy_n(mesh_.info.tets + 4 * size_t{cell}, 4, corners);
  return away;
}

}  // namespace dfm::scene
