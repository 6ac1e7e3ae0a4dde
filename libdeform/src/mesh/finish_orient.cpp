// Which side of a surface is outside. Triangles are joined to patches across edges of exactly two triangles,
// breadth first, and turned to agree. The holes of a patch are closed virtually by fans over its boundary
// loops; if these are small relative to the patch, it bounds a solid and the sign of its volume distinguishes
// outside from inside. A patch inside an odd number of others is the wall of a hole and faces into it:
//
//      +--------------+      depth 0 faces outward, depth 1 into the hole, depth 2 (a kernel in the hole)
//      | ^  +----+    |      outward again. Inside is where the winding number of the
//      | |  | <- |    |      other patch is one (geometry/winding.h). Patches that only
//      |    +----+    |      cross each other are not nested.
//      +--------------+
#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "core/disjoint_sets.h"
#include "geometry/winding.h"
#include "math/extent.h"
#include "math/vec3.h"
#include "mesh/finish.h"
#include "mesh/topology_tri.h"

namespace dfm {
namespace {

// area of the fans over the area of the patch, up to which it still bounds a solid
constexpr double kSmallOpening = 0.25;
// triple product of the unit vectors to the corners, up to which a triangle that contains the point counts 0
// instead of half a turn whose sign rounding decides
constexpr double kOnTriangle = 1e-10;

struct Corners { Vec3 a, b, c; };

bool holds(const Extent &box, const Extent &o) {
  for (int k = 0; k < 3; ++k)
    if (o.lo[k] < box.lo[k] || o.hi[k] > box.hi[k]) return false;
  return true;
}

struct Patch {
  uint32_t begin = 0, end = 0;  // in order_
  uint32_t turned = 0;          // against the file, before its side is chosen
  bool two_sided = true, solid = false;
  double volume6 = 0, area2 = 0, fan_area2 = 0;
  Extent box;
  std::vector<Corners> fans;          // over its openings, facing like the patch
  std::unique_ptr<WindingTree> tree;  // made when first used
  uint32_t depth = 0;
};

struct Rim { uint32_t patch, from, to; };  // a boundary edge as its patch runs along it

double volume6(const Corners &t, Vec3 o) { return dot(cross(t.a - o, t.b - o), t.c - o); }
double area2(const Corners &t) { return norm(cross(t.b - t.a, t.c - t.a)); }

class Orienter {
 public:
  Orienter(const Memory &memory, const Array<double> &points, Array<uint32_t> &tris)
      : memory_(memory),
        points_(points),
        tris_(tris),
        ntri_(uint32_t(tris.size() / 3)),
        flip_(ntri_, 0, memory),
        patch_of_(ntri_, UINT32_MAX, memory),
        order_(memory) {
    const Extent box = extent_of(points);
    origin_ = box.lo;
    scale_ = 1 / box.longest();
  }

  uint32_t run(uint32_t *twisted) {
    const Array<TriEdge> edges = sorted_edges(memory_, ntri_, tris_.data());
    find_patches(edge_twins(memory_, edges));
    close_patches(edges);
    for (Patch &p : patches_) measure(p);
    nest();
    return turn(twisted);
  }

 private:
  // Scaled to a box of edge one at the origin, so that neither nanometers nor light years leave the
  // range of a double.
  Vec3 at(uint32_t p) const { return scale_ * (load3(&points_[3 * size_t(p)]) - origin_); }
  Corners corners(uint32_t t) const {
    const uint32_t *c = &tris_[3 * size_t(t)];
    return flip_[t] ? Corners{at(c[0]), at(c[2]), at(c[1])} : Corners{at(c[0]), at(c[1]), at(c[2])};
  }
  // from the lower to the higher point
  bool runs_up(uint32_t half) const { return tris_[half] < tris_[next_half_edge(half)]; }

  void find_patches(const Array<uint32_t> &twin) {
    order_.reserve(ntri_);
    for (uint32_t seed = 0; seed < ntri_; ++seed) {
      if (patch_of_[seed] != UINT32_MAX) continue;
      const uint32_t self = uint32_t(patches_.size());
      Patch patch;
      patch.begin = uint32_t(order_.size());
      patch_of_[seed] = self;
      order_.push_back(seed);
      for (uint32_t i = patch.begin; i < order_.size(); ++i) {
        const uint32_t t = order_[i];
        for (uint32_t h = 3 * t; h < 3 * t + 3; ++h) {
          if (twin[h] >= kCrowdedEdge) continue;
          const uint32_t u = twin[h] / 3;
          const uint8_t flip = flip_[t] ^ uint8_t(runs_up(h) == runs_up(twin[h]));
          if (patch_of_[u] == UINT32_MAX) {
            patch_of_[u] = self;
            flip_[u] = flip;
            order_.push_back(u);
          } else if (flip_[u] != flip) patch.two_sided = false;
        }
      }
      patch.end = uint32_t(order_.size());
      for (uint32_t i = patch.begin; i < patch.end; ++i) {
        if (!patch.two_sided) flip_[order_[i]] = 0;
        patch.turned += flip_[order_[i]];
      }
      patches_.push_back(std::move(patch));
    }
  }

  // An edge bounds a patch where the patch's triangles at it do not cancel: one triangle, or three
  // where two cancel.
  void close_patches(const Array<TriEdge> &edges) {
    std::vector<Rim> rims;
    std::vector<std::pair<uint32_t, uint32_t>> here;  // patch and half-edge
    for (size_t i = 0, j = 0; i < edges.size(); i = j) {
      here.clear();
      for (; j < edges.size() && edges[j].key == edges[i].key; ++j)
        here.emplace_back(patch_of_[edges[j].half / 3], edges[j].half);
      if (here.size() == 2 && here[0].first == here[1].first) continue;
      std::sort(here.begin(), here.end());
      for (size_t k = 0, m = 0; k < here.size(); k = m) {
        int up = 0;
        for (; m < here.size() && here[m].first == here[k].first; ++m)
          up += runs_up(here[m].second) != bool(flip_[here[m].second / 3]) ? 1 : -1;
        const uint32_t low = uint32_t(edges[i].key >> 32), high = uint32_t(edges[i].key);
        for (; up > 0; --up) rims.push_back({here[k].first, low, high});
        for (; up < 0; ++up) rims.push_back({here[k].first, high, low});
      }
    }
    std::stable_sort(rims.begin(), rims.end(), [](const Rim &a, const Rim &b) { return a.patch < b.patch; });
    DisjointSets loops(memory_, uint32_t(points_.size() / 3));
    for (size_t i = 0, j = 0; i < rims.size(); i = j) {
      while (j < rims.size() && rims[j].patch == rims[i].patch) ++j;
      add_fans(&rims[i], &rims[i] + (j - i), loops);
    }
  }

  // One fan per loop (boundary edges joined by points) from the mean of its points.
  void add_fans(const Rim *begin, const Rim *end, DisjointSets &loops) {
    for (const Rim *r = begin; r < end; ++r) {  // not joined by a patch before
      loops.of[r->from] = r->from;
      loops.of[r->to] = r->to;
    }
    for (const Rim *r = begin; r < end; ++r) loops.join(r->from, r->to);
    std::vector<std::pair<uint32_t, const Rim *>> by_loop;
    for (const Rim *r = begin; r < end; ++r) by_loop.emplace_back(loops.root(r->from), r);
    std::sort(by_loop.begin(), by_loop.end());
    std::vector<Corners> &fans = patches_[begin->patch].fans;
    for (size_t i = 0, j = 0; i < by_loop.size(); i = j) {
      Vec3 mean;
      for (; j < by_loop.size() && by_loop[j].first == by_loop[i].first; ++j)
        mean += at(by_loop[j].second->from);
      mean = (1 / double(j - i)) * mean;
      for (size_t k = i; k < j; ++k)
        fans.push_back({at(by_loop[k].second->to), at(by_loop[k].second->from), mean});
    }
  }

  void measure(Patch &p) const {
    const Vec3 o = at(tris_[3 * size_t(order_[p.begin])]);
    for (uint32_t i = p.begin; i < p.end; ++i) {
      const Corners t = corners(order_[i]);
      p.volume6 += volume6(t, o);
      p.area2 += area2(t);
      p.box.add(t.a);
      p.box.add(t.b);
      p.box.add(t.c);
    }
    for (const Corners &t : p.fans) {
      p.volume6 += volume6(t, o);
      p.fan_area2 += area2(t);
    }
    p.solid = p.two_sided && p.fan_area2 <= kSmallOpening * p.area2;
    if (!p.solid) p.fans = {};
  }

  double winding(Patch &p, Vec3 at) const {
    if (!p.tree) {
      Array<double> points{memory_};
      const auto add = [&](const Corners &t) {
        for (const Vec3 &c : {t.a, t.b, t.c}) points.insert(points.end(), {c.x, c.y, c.z});
      };
      for (uint32_t i = p.begin; i < p.end; ++i) add(corners(order_[i]));
      for (const Corners &t : p.fans) add(t);
      Array<uint32_t> tris(points.size() / 3, 0, memory_);
      std::iota(tris.begin(), tris.end(), 0u);
      p.tree = std::make_unique<WindingTree>(memory_, points.data(), uint32_t(tris.size() / 3), tris.data());
    }
    return p.tree->at(at, kOnTriangle);
  }

  // Samples triangles at the ends of the box and some between: if a patch only intersects another, one of
  // them is outside.
  std::vector<Vec3> samples(const Patch &p) const {
    constexpr uint32_t kBetween = 6;
    uint32_t end[6];
    double best[6];
    std::fill_n(end, 6, order_[p.begin]);
    std::fill_n(best, 6, HUGE_VAL);
    const auto middle = [&](uint32_t t) {
      const Corners c = corners(t);
      return (1.0 / 3) * (c.a + c.b + c.c);
    };
    for (uint32_t i = p.begin; i < p.end; ++i) {
      const Vec3 m = middle(order_[i]);
      for (int k = 0; k < 6; ++k) {
        const double reach = k < 3 ? m[k] : -m[k - 3];
        if (reach < best[k]) {
          best[k] = reach;
          end[k] = order_[i];
        }
      }
    }
    std::vector<Vec3> out;
    for (const uint32_t t : end) out.push_back(middle(t));
    for (uint32_t k = 0; k < kBetween; ++k)
      out.push_back(middle(order_[p.begin + uint32_t(uint64_t(p.end - p.begin) * k / kBetween)]));
    return out;
  }

  // Near one half the sample is on the other surface and decides nothing.
  bool inside(const std::vector<Vec3> &of_patch, Patch &other) const {
    bool any = false;
    for (const Vec3 &s : of_patch) {
      const double w = std::fabs(winding(other, s));
      if (w < 0.25) return false;
      any |= w > 0.75;
    }
    return any;
  }

  // Sweep along x: only patches whose boxes are open there can hold the next one.
  void nest() {
    std::vector<uint32_t> order, open;
    for (uint32_t i = 0; i < patches_.size(); ++i)
      if (patches_[i].solid) order.push_back(i);
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
      const Extent &x = patches_[a].box, &y = patches_[b].box;
      return x.lo.x != y.lo.x ? x.lo.x < y.lo.x : x.hi.x != y.hi.x ? x.hi.x > y.hi.x : a < b;
    });
    for (const uint32_t i : order) {
      Patch &p = patches_[i];
      std::erase_if(open, [&](uint32_t j) { return patches_[j].box.hi.x < p.box.lo.x; });
      std::vector<Vec3> points;
      for (const uint32_t j : open) {
        if (!holds(patches_[j].box, p.box)) continue;
        if (points.empty()) points = samples(p);
        p.depth += inside(points, patches_[j]);
      }
      open.push_back(i);
    }
  }

  uint32_t turn(uint32_t *twisted) {
    uint32_t turned = 0;
    *twisted = 0;
    for (const Patch &p : patches_) {
      *twisted += !p.two_sided;
      const bool wrong = p.solid && p.volume6 != 0 ? (p.volume6 < 0) != (p.depth % 2 == 1)
                                                   : p.turned > (p.end - p.begin) / 2;
      for (uint32_t i = p.begin; i < p.end; ++i) {
        const uint32_t t = order_[i];
        if (bool(flip_[t]) == wrong) continue;
        std::swap(tris_[3 * size_t(t) + 1], tris_[3 * size_t(t) + 2]);
        ++turned;
      }
    }
    return turned;
  }

  const Memory &memory_;
  const Array<double> &points_;
  Array<uint32_t> &tris_;
  uint32_t ntri_;
  Array<uint8_t> flip_;
  Array<uint32_t> patch_of_, order_;
  std::vector<Patch> patches_;
  Vec3 origin_;
  double scale_ = 1;
};

}  // namespace

uint32_t orient_triangles(const Memory &memory, const Array<double> &points, Array<uint32_t> &tris,
                          uint32_t *twisted) {
  return Orienter(memory, points, tris).run(twisted);
}

}  // namespace dfm
