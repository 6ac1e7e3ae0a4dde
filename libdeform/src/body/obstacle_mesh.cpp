// A rigid surface never folds, so which of its features can be the first to touch is known from its shape: an
// edge that is convex or open, and a vertex with such an edge. Round a vertex without one the free space is,
// nearby, where a few half-spaces meet; of a flat triangle in it a corner is nearest to the mesh. Left out,
// such features make no second contact beside that of the surfel or edge above them: a block on a flat floor
// of triangles has the contacts that it has on a plane.
#include "body/obstacle_mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "body/make_surface.h"
#include "body/phyxels.h"
#include "geometry/convex.h"
#include "geometry/tree_walk.h"

namespace dfm {
namespace {

constexpr double kSlack = 1e-8;  // of all lengths, by which a box is widened against rounding

bool is_closed(const Surface &s) {
  // Three sides a triangle, two an edge: with no place empty every edge has exactly two, one each way.
  return size_t{3} * s.ntri == size_t{2} * s.nedge &&
         std::find(s.edge_tri.begin(), s.edge_tri.end(), kNone) == s.edge_tri.end();
}

void keep_first_features(Surface &s) {
  Array<uint8_t> edge_first(size_t{s.nedge}, 0, s.tri.get_allocator()),
      first(size_t{s.nsurfel}, 0, s.tri.get_allocator());
  Array<uint32_t> sides(size_t{s.nedge}, 0u, s.tri.get_allocator());
  for (const uint32_t e : s.tri_edge) ++sides[e];
  for (uint32_t e = 0; e < s.nedge; ++e) {
    // of more than two sides, two say nothing about the others
    if (sides[e] <= 2 && !edge_convex(s, e)) continue;
    edge_first[e] = first[s.edge[2 * size_t{e}]] = first[s.edge[2 * size_t{e} + 1]] = 1;
  }
  for (uint32_t t = 0; t < s.ntri; ++t)
    for (int k = 0; k < 3; ++k) {
      if (!first[s.tri[3 * size_t{t} + k]]) s.tri_owns[t] &= ~(1u << k);
      if (!edge_first[s.tri_edge[3 * size_t{t} + k]]) s.tri_owns[t] &= ~(8u << k);
    }
}

}  // namespace

ObstacleMesh::ObstacleMesh(const Memory &memory, uint32_t npoint, const double *points, uint32_t ntri,
                           const uint32_t *tris)
    : local(memory) {
  make_surface(memory, npoint, points, tris, ntri, surface);
  closed = is_closed(surface);
  keep_first_features(surface);
  local.resize(size_t{3} * surface.nsurfel);
  double most = 0;
  for (uint32_t s = 0; s < surface.nsurfel; ++s) {
    const Vec3 p = load3(&surface.x[4 * size_t{s}]);
    store3(&local[3 * size_t{s}], p);
    most = std::max(most, norm2(p));
  }
  extent = std::sqrt(most);
}

void ObstacleMesh::place(Vec3 at, Quat turned, Vec3 velocity, Vec3 spin) {
  const bool stays = norm2(at - position) == 0 && turned.x == rotation.x && turned.y == rotation.y &&
                     turned.z == rotation.z && turned.w == rotation.w;
  const bool moves = norm2(velocity) != 0 || norm2(spin) != 0;
  if (!stays) {
    position = at;
    rotation = turned;
    for (uint32_t s = 0; s < surface.nsurfel; ++s)
      store3(&surface.x[4 * size_t{s}], at + rotate(turned, load3(&local[3 * size_t{s}])));
    bounded_ = false;
  }
  if (!moves && !moving) return;
  for (uint32_t s = 0; s < surface.nsurfel; ++s)
    store3(&surface.v[4 * size_t{s}], velocity + cross(spin, load3(&surface.x[4 * size_t{s}]) - at));
  moving = moves;
}

void ObstacleMesh::make_tree(const Memory &memory) {
  Array<double> x(size_t{4} * surface.nsurfel, 0.0, memory);
  for (uint32_t s = 0; s < surface.nsurfel; ++s) store3(&x[4 * size_t{s}], load3(&local[3 * size_t{s}]));
  auto made = std::make_unique<BoxTree>(memory);
  made->build(surface.tri, x.data());
  tree = std::move(made);
}

uint64_t ObstacleMesh::triangles_near(Vec3 lo, Vec3 hi, std::vector<uint32_t> &out) const {
  out.clear();
  const Vec3 axis[] = {rotate_back(rotation, {1, 0, 0}), rotate_back(rotation, {0, 1, 0}),
                       rotate_back(rotation, {0, 0, 1})};  // of the world, in the obstacle's frame
  const double slack = kSlack * (norm(position) + extent);
  struct Span { double lo, hi; };
  const auto around = [&](const Box &box, int k) -> Span {
    const Vec3 a = axis[k], from = load3(box.lo), to = load3(box.hi), wide = to - from;
    const double middle = position[k] + 0.5 * dot(a, from + to);
    const double half =
        0.5 * (std::fabs(a.x) * wide.x + std::fabs(a.y) * wide.y + std::fabs(a.z) * wide.z) + slack;
    return {middle - half, middle + half};
  };
  uint64_t visits = 0;
  const auto near = [&](const Box &box) {
    ++visits;
    for (int k = 0; k < 3; ++k)
      if (const Span s = around(box, k); !(s.lo <= hi[k] && s.hi >= lo[k])) return false;
    return true;
  };
  const auto within = [&](const Box &box) {
    for (int k = 0; k < 3; ++k)
      if (const Span s = around(box, k); !(s.lo >= lo[k] && s.hi <= hi[k])) return false;
    return true;
  };
  if (!tree || within(tree->root())) {
    out.resize(surface.ntri);
    std::iota(out.begin(), out.end(), 0u);
    return visits;
  }
  walk(*tree, near, [&](uint32_t place) {
    out.push_back(tree->triangles()[place]);
    return true;
  });
  std::sort(out.begin(), out.end());
  return visits;
}

const Extent &ObstacleMesh::bounds() {
  if (!bounded_) bounds_ = extent_of(surface.x.data(), surface.nsurfel, 4);
  bounded_ = true;
  return bounds_;
}

}  // namespace dfm
