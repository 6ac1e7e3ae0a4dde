// The topology of a surface is found by sorting and not by hashing, so that numbers depend on the input
// alone.
#include "body/make_surface.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <span>

#include "core/disjoint_sets.h"
#include "core/lists.h"
#include "geometry/closest.h"
#include "math/vec3.h"
#include "mesh/topology_tri.h"

namespace dfm {
namespace {

constexpr double kPatchCosine = 0.5;  // faces within 60 degrees are one patch (doc/concepts/detection.md)

void number_surfels(uint32_t npoint, const uint32_t *tris, uint32_t ntri, Surface &out) {
  Array<uint32_t> number(size_t{npoint}, kNone, out.tri.get_allocator());
  for (size_t i = 0; i < size_t{3} * ntri; ++i) number[tris[i]] = 0;
  out.point.clear();
  for (uint32_t p = 0; p < npoint; ++p) {
    if (number[p] == kNone) continue;
    number[p] = uint32_t(out.point.size());
    out.point.push_back(p);
  }
  out.nsurfel = uint32_t(out.point.size());
  out.ntri = ntri;
  out.tri.resize(size_t{3} * ntri);
  for (size_t i = 0; i < out.tri.size(); ++i) out.tri[i] = number[tris[i]];
}

void find_edges(Surface &out) {
  const Array<TriEdge> sides = sorted_edges(*out.tri.get_allocator().memory, out.ntri, out.tri.data());
  out.edge.clear();
  out.edge_tri.clear();
  out.tri_edge.assign(size_t{3} * out.ntri, kNone);
  out.tri_owns.assign(out.ntri, 0);
  for (size_t s = 0; s < sides.size(); ++s) {
    const auto [key, half] = sides[s];
    if (s == 0 || key != sides[s - 1].key) {
      out.edge.push_back(uint32_t(key >> 32));
      out.edge.push_back(uint32_t(key));
      out.edge_tri.insert(out.edge_tri.end(), {kNone, kNone});
      out.tri_owns[half / 3] |= 8u << half % 3;
    }
    const uint32_t e = uint32_t(out.edge.size() / 2 - 1);
    out.tri_edge[half] = e;
    uint32_t &slot = out.edge_tri[2 * e + (out.tri[half] < out.tri[next_half_edge(half)] ? 0 : 1)];
    if (slot == kNone) slot = half / 3;
  }
  out.nedge = uint32_t(out.edge.size() / 2);
  Array<uint8_t> owned(out.nsurfel, 0, out.tri.get_allocator());
  for (uint32_t t = 0; t < out.ntri; ++t)
    for (int k = 0; k < 3; ++k) {
      uint8_t &taken = owned[out.tri[3 * t + k]];
      if (!taken) out.tri_owns[t] |= 1u << k;
      taken = 1;
    }
}

// Patches are numbered in the order of their lowest triangles.
void find_patches(const Array<Vec3> &normal, Surface &out) {
  DisjointSets patches(*out.tri.get_allocator().memory, out.ntri);
  for (uint32_t e = 0; e < out.nedge; ++e) {
    const uint32_t s = out.edge_tri[2 * e], t = out.edge_tri[2 * e + 1];
    if (s == kNone || t == kNone || dot(normal[s], normal[t]) < kPatchCosine) continue;
    patches.join(s, t);
  }
  patches.number();
  out.patch = std::move(patches.of);
}

void find_fans(Surface &out) {
  const auto each = [&](const auto &use) {
    for (uint32_t k = 0; k < 3 * out.ntri; ++k) use(out.tri[k], k / 3);
  };
  make_lists(out.nsurfel, each, out.fan_begin, out.fan);
}

}  // namespace

void make_surface(const Memory &memory, uint32_t npoint, const double *rest, const uint32_t *boundary_tris,
                  uint32_t ntri, Surface &out) {
  use_memory(memory, out.tri, out.edge, out.edge_tri, out.tri_edge, out.tri_owns, out.patch, out.point,
             out.row, out.col, out.weight, out.fan_begin, out.fan, out.rest, out.x, out.v);
  for (auto &names : out.name) use_memory(memory, names);
  number_surfels(npoint, boundary_tris, ntri, out);
  find_edges(out);

  const auto at = [&](uint32_t surfel) { return load3(rest + size_t{3} * out.point[surfel]); };
  Array<Vec3> normal(ntri, Vec3{}, memory);
  for (uint32_t t = 0; t < ntri; ++t) normal[t] = normalized(out.area2(t, at));
  find_patches(normal, out);
  find_fans(out);

  Array<double> length{memory};
  for (uint32_t e = 0; e < out.nedge; ++e)
    length.push_back(norm(at(out.edge[2 * e + 1]) - at(out.edge[2 * e])));
  if (!length.empty()) {
    std::nth_element(length.begin(), length.begin() + length.size() / 2, length.end());
    out.median_edge = length[length.size() / 2];
  }
  out.x.assign(size_t{4} * out.nsurfel, 0.0);
  out.v.assign(size_t{4} * out.nsurfel, 0.0);
  for (uint32_t s = 0; s < out.nsurfel; ++s) store3(&out.x[4 * s], at(s));
}

void wear_coupling(Coupling &&coupling, Surface &surface) {
  surface.row = std::move(coupling.row);
  surface.col = std::move(coupling.col);
  surface.weight = std::move(coupling.weight);
  surface.rest = Array<double>(size_t{3} * surface.nsurfel, 0.0, surface.weight.get_allocator());
  for (uint32_t s = 0; s < surface.nsurfel; ++s)
    store3(&surface.rest[size_t{3} * s], load3(&surface.x[size_t{4} * s]));
  surface.point.clear();
  surface.point.shrink_to_fit();
  for (uint32_t s = 0; s < surface.nsurfel; ++s) {
    double sum = 0;
    surface.each_phyxel(s, [&](uint32_t, double w) { sum += std::fabs(w); });
    surface.weight_sum = std::max(surface.weight_sum, sum);
  }
}

void gather_rows(Surface &surface, const double *x, const double *v, uint32_t begin, uint32_t end) {
  // Half a point: with vectors of 16 bytes, gcc 12 keeps sums of whole points (32 bytes) in memory at ten
  // times the cost. Every width performs the same operations on each component; the fourth stays zero.
  using Half = double __attribute__((vector_size(16)));
  Half *const xs = reinterpret_cast<Half *>(surface.x.data());
  Half *const vs = reinterpret_cast<Half *>(surface.v.data());
  const uint32_t *const row = surface.row.data(), *const col = surface.col.data();
  const double *const weight = surface.weight.data();
  const Half *const xp = reinterpret_cast<const Half *>(x), *const vp = reinterpret_cast<const Half *>(v);
  for (uint32_t s = begin; s < end; ++s) {
    const size_t to = size_t{2} * s;
    Half x0{0, 0}, x1{0, 0}, v0{0, 0}, v1{0, 0};
    for (uint32_t i = row[s]; i < row[s + 1]; ++i) {
      const size_t from = size_t{2} * col[i];
      x0 += weight[i] * xp[from];
      x1 += weight[i] * xp[from + 1];
      if (v) {
        v0 += weight[i] * vp[from];
        v1 += weight[i] * vp[from + 1];
      }
    }
    xs[to] = x0;
    xs[to + 1] = x1;
    if (v) {
      vs[to] = v0;
      vs[to + 1] = v1;
    }
  }
}

namespace {

// distance of the hull of normals from 0 below which it says less and less of a direction
constexpr double kNarrow = 0.05;
constexpr double kMaxBack = 3;  // limit on the way of a surfel of a slit, in units of Surface::back

// The corners of a simplex whose hull has the point nearest to 0, and that point.
struct Nearest {
  Vec3 corner[4], point;
  int n = 0;

  void keep(std::initializer_list<int> which) {
    Vec3 kept[3];
    n = 0;
    for (const int k : which) kept[n++] = corner[k];
    std::copy_n(kept, n, corner);
  }
  void add(Vec3 p) {
    corner[n++] = p;
    if (n == 1) point = p;
    else if (n == 2) of_edge();
    else if (n == 3) of_triangle();
    else of_tetrahedron();
  }
  void of_edge() {
    const double t = closest_on_segment({}, corner[0], corner[1]);
    point = corner[0] + t * (corner[1] - corner[0]);
    if (t == 0) keep({0});
    else if (t == 1) keep({1});
  }
  void of_triangle() {
    const TrianglePoint at = closest_on_triangle({}, corner[0], corner[1], corner[2]);
    point = at.point;
    const int f = int(at.feature);
    if (f >= 4) keep({f - 4});
    else if (f > 0) keep({f - 1, f % 3});
  }
  void of_tetrahedron() {
    constexpr int kFace[4][4] = {{0, 1, 2, 3}, {0, 3, 1, 2}, {0, 2, 3, 1}, {1, 3, 2, 0}};
    bool inside = true;
    double least = HUGE_VAL;
    const int *nearest = kFace[0];
    for (const auto &f : kFace) {
      const Vec3 a = corner[f[0]], b = corner[f[1]], c = corner[f[2]];
      inside = inside && tet_volume(a, b, c, corner[f[3]]) * tet_volume(a, b, c, {}) > 0;
      const double d2 = closest_on_triangle({}, a, b, c).distance2;
      if (d2 < least) nearest = f;
      least = std::min(least, d2);
    }
    point = {};
    if (inside) return;
    keep({nearest[0], nearest[1], nearest[2]});
    of_triangle();
  }
};

// The point of the hull of these normals that is nearest to 0: n.c >= c.c for each of them (Gilbert 1966).
Vec3 nearest_of_normals(const double *normals, std::span<const uint32_t> which) {
  constexpr int kMax = 32;
  constexpr double kSame = 1e-9;
  Nearest hull;
  for (int k = 0; k < kMax; ++k) {
    double least = HUGE_VAL;
    Vec3 next;
    for (const uint32_t l : which) {
      const Vec3 n = load3(normals + 3 * size_t{l});
      const double height = dot(n, hull.point);
      if (!(norm2(n) > 0) || !(height < least)) continue;
      least = height;
      next = n;
    }
    if (!(least < HUGE_VAL) || (k > 0 && !(least < norm2(hull.point) - kSame))) break;
    hull.add(next);
  }
  return hull.point;
}

// The shortest w with n.w = -1, in the least-squares sense; no longer than kMaxBack.
Vec3 least_squares_of(const double *normals, std::span<const uint32_t> which) {
  constexpr double kTilt = 1e-3;  // share of the trace; distinguishes nearly parallel planes
  double sum[9] = {};
  for (const uint32_t l : which) {
    const Vec3 n = load3(normals + 3 * size_t{l});
    const double add[9] = {n.x, n.y, n.z, n.x * n.x, n.y * n.y, n.z * n.z, n.x * n.y, n.y * n.z, n.z * n.x};
    for (size_t k = 0; k < 9; ++k) sum[k] += add[k];
  }
  const double tilt = kTilt * (sum[3] + sum[4] + sum[5]);
  if (!(tilt > 0)) return {};
  const Vec3 a{sum[3] + tilt, sum[6], sum[8]}, b{sum[6], sum[4] + tilt, sum[7]},
      c{sum[8], sum[7], sum[5] + tilt}, r = load3(sum);
  const double det = dot(a, cross(b, c));
  const Vec3 way = (-1 / det) * Vec3{dot(r, cross(b, c)), dot(r, cross(c, a)), dot(r, cross(a, b))};
  const double far = norm(way);
  return far > kMaxBack ? (kMaxBack / far) * way : way;
}

}  // namespace

void ways_back(Surface &s, const double *x, const std::function<void(uint32_t surfel, Vec3 way)> &use) {
  const auto at = [&](uint32_t i) { return load3(x + 4 * size_t{i}); };
  for (size_t l = 0; l < s.coincident.size(); ++l)
    store3(&s.coincident_normal[3 * l], normalized(s.area2(s.coincident[l], at)));
  for (size_t i = 0; i < s.coincident_surfel.size(); ++i) {
    const std::span<const uint32_t> around{s.coincident_around.data() + s.coincident_begin[i],
                                           s.coincident_around.data() + s.coincident_begin[i + 1]};
    if (around.empty()) continue;
    if (std::any_of(around.begin(), around.end(),
                    [&](uint32_t l) { return s.coincident_tip[l] & kOfSlit; })) {
      use(s.coincident_surfel[i], least_squares_of(s.coincident_normal.data(), around));
      continue;
    }
    const Vec3 c = nearest_of_normals(s.coincident_normal.data(), around);
    const double margin = norm(c);
    if (!(margin > 0)) continue;
    use(s.coincident_surfel[i], (-1 / std::max(margin, kNarrow)) * c);
  }
}

void gather_surface(Surface &surface, const double *x, const double *v) {
  if (!surface.identity()) return gather_rows(surface, x, v, 0, surface.nsurfel);
  // whole points: the fourth double is zero on both sides
  constexpr size_t kPoint = 4 * sizeof(double);
  const uint32_t *const point = surface.point.data();
  for (uint32_t s = 0; s < surface.nsurfel; ++s) {
    const size_t to = size_t{4} * s, from = size_t{4} * point[s];
    std::memcpy(&surface.x[to], x + from, kPoint);
    if (v) std::memcpy(&surface.v[to], v + from, kPoint);
  }
  if (!surface.place.empty()) std::memcpy(surface.place.data(), surface.x.data(), kPoint * surface.nsurfel);
  if (surface.back > 0)
    ways_back(surface, surface.x.data(),
              [&](uint32_t surfel, Vec3 way) { add3(&surface.x[4 * size_t{surfel}], surface.back * way); });
}

}  // namespace dfm
