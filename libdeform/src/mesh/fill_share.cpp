// The share of material of a cell: a cell crossed by a triangle is divided into eight, repeatedly; a part
// that no triangle crosses is inside or outside by the winding number at its middle. Parts that are still
// crossed at the last level count as inside or outside by one sample point, whose place differs between
// parts: samples at a fixed place would all be on one side of a face along a lattice plane.
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/lists.h"
#include "mesh/fill_lattice.h"

namespace dfm {
namespace {

// above this number of crossed cells one level less is enough: errors average out
constexpr uint32_t kFineCells = 20000;

class Sampler {
 public:
  Sampler(const FillSurface &surface, const Lattice &lattice, int cuts)
      : surface_(surface),
        lattice_(lattice),
        cuts_(cuts),
        level_(size_t(cuts) + 1, Array<uint32_t>(surface.memory)) {}

  // Shares of the whole cell, in parts of one.
  void run(Site key, const uint32_t *tris, uint32_t ntri, double *share, double *loose) {
    Site site[4];
    corners_of(key, site);
    Vec3 corner[4];
    for (int k = 0; k < 4; ++k) corner[k] = place_of(site[k]);
    share_ = loose_ = 0;
    level_[0].assign(tris, tris + ntri);
    part(corner, 0, 1, {}, 0);
    *share = share_;
    *loose = loose_;
  }

 private:
  void triangle(uint32_t t, Vec3 c[3]) const {
    for (int k = 0; k < 3; ++k)
      c[k] = lattice_.from_box(load3(&surface_.points[3 * size_t(surface_.tris[3 * size_t(t) + k])]));
  }
  bool meets(const TetShape &shape, uint32_t t) const {
    Vec3 c[3];
    triangle(t, c);
    return shape.meets(c, 0);
  }

  // Evenly distributed over tetrahedra: steps of the generalized golden ratio in the cube, sorted, so that
  // the gaps are weights that sum to one.
  Vec3 any_place(const Vec3 corner[4]) {
    double u[3];
    for (int k = 0; k < 3; ++k) {
      constexpr double kStep[3] = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
      step_[k] += kStep[k];
      step_[k] -= std::floor(step_[k]);
      u[k] = step_[k];
    }
    std::sort(u, u + 3);
    return u[0] * corner[0] + (u[1] - u[0]) * corner[1] +
           ((u[2] - u[1]) * corner[2] + (1 - u[2]) * corner[3]);
  }

  // The winding number at `place` from the one at `known`, both in the part at `level`: it increases by one
  // where the segment enters through a triangle. Only for closed surfaces. Returns false if the segment hits
  // an edge, or begins or ends on a triangle.
  bool go(int level, Vec3 known, Vec3 place, double *winding) const {
    const Vec3 way = place - known;
    for (const uint32_t t : level_[size_t(level)]) {
      Vec3 c[3];
      triangle(t, c);
      const Vec3 normal = cross(c[1] - c[0], c[2] - c[0]);
      const double from = dot(normal, known - c[0]);
      const double to = dot(normal, place - c[0]);
      const double thin = 1e-10 * norm(normal);
      if ((from > thin && to > thin) || (from < -thin && to < -thin)) continue;
      int left = 0, right = 0, on = 0;
      for (int k = 0; k < 3; ++k) {
        const Vec3 a = c[k] - known, b = c[(k + 1) % 3] - known;
        const double side = dot(way, cross(a, b)), zero = 1e-12 * std::sqrt(norm2(way) * norm2(a) * norm2(b));
        (side > zero ? left : side < -zero ? right : on) += 1;
      }
      if (left && right) continue;
      if (on || std::fabs(from) <= thin || std::fabs(to) <= thin) return false;
      *winding += from > 0 ? 1 : -1;
    }
    return true;
  }

  double winding_at(Vec3 place) const { return surface_.winding.at(lattice_.to_box(place)); }

  // known: a place in the part above and its winding number, for closed surfaces.
  void part(const Vec3 corner[4], int level, double fraction, Vec3 known, double known_winding) {
    const bool crossed = !level_[size_t(level)].empty();
    const Vec3 place =
        crossed ? any_place(corner) : 0.25 * ((corner[0] + corner[1]) + (corner[2] + corner[3]));
    double w = known_winding;
    if (level == 0 || !surface_.closed || !go(level - 1, known, place, &w)) {
      w = winding_at(place);
      if (surface_.closed) w = std::floor(w + 0.5);
    }
    if (level == cuts_ || (!crossed && (surface_.closed || std::fabs(w - 0.5) > 0.25))) {
      if (w > 0.5) share_ += fraction;
      if (crossed) loose_ += fraction;
      return;
    }
    const auto child = [&](Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
      const Vec3 p[4] = {a, b, c, d};
      const TetShape shape(p);
      Array<uint32_t> &mine = level_[size_t(level) + 1];
      mine.clear();
      for (const uint32_t t : level_[size_t(level)])
        if (meets(shape, t)) mine.push_back(t);
      part(p, level + 1, fraction / 8, place, w);
    };
    // Corners keep the shape; the octahedron between is cut around its shortest diagonal, between the middles
    // of the two lattice edges.
    const auto mid = [&](int i, int j) { return 0.5 * (corner[i] + corner[j]); };
    const Vec3 m = mid(0, 1), n = mid(2, 3), ring[4] = {mid(0, 2), mid(1, 2), mid(1, 3), mid(0, 3)};
    child(corner[0], m, ring[0], ring[3]);
    child(m, corner[1], ring[1], ring[2]);
    child(ring[0], ring[1], corner[2], n);
    child(ring[3], ring[2], n, corner[3]);
    for (int k = 0; k < 4; ++k) child(m, n, ring[k], ring[(k + 1) % 4]);
  }

  const FillSurface &surface_;
  Lattice lattice_;
  double step_[3] = {0.5, 0.5, 0.5};
  int cuts_;
  double share_ = 0, loose_ = 0;
  std::vector<Array<uint32_t>> level_;  // triangles of the part being cut at each level
};

}  // namespace

FillShares sample_shares(const FillSurface &surface, const FillCover &cover, const Lattice &lattice) {
  struct Pair {
    uint32_t cell, tri;
    bool operator<(const Pair &o) const { return cell != o.cell ? cell < o.cell : tri < o.tri; }
    bool operator==(const Pair &o) const { return cell == o.cell && tri == o.tri; }
  };
  const Memory &memory = surface.memory;
  Array<Pair> pairs{memory};
  // Cutting a cell costs some 170 tests for each triangle in it.
  const uint64_t most = 128 * (surface.tris.size() / 3 + cover.cells.size());
  const uint64_t work = 8 * crossing_work(surface, cover.cells.size());
  const uint64_t left = each_crossing(surface, lattice, nullptr, work, [&](uint64_t key, uint32_t tri, bool) {
    const Pair pair{cover.cells.find(key), tri};
    if (cover.kind[pair.cell] == LatticeCell::crossed && (pairs.empty() || !(pairs.back() == pair)))
      pairs.push_back(pair);
    return pairs.size() <= most;
  });
  if (left == 0 || pairs.size() > most)
    fail(DFM_E_FORMAT,
         "the %zu triangles enter %u cells more than %llu times: a tangle of long triangles bounds no body; "
         "remove those that reach across it, or ask for more cells",
         surface.tris.size() / 3, cover.cells.size(), static_cast<unsigned long long>(most));
  sort_unique(pairs);
  const auto sampled = uint32_t(std::count_if(cover.kind.begin(), cover.kind.end(), [](LatticeCell k) {
    return k == LatticeCell::crossed || k == LatticeCell::mixed;
  }));
  const uint32_t n = cover.cells.size();
  FillShares out{Array<double>(n, 0.0, memory), Array<double>(n, 0.0, memory), 1};
  const int cuts = sampled > kFineCells ? 2 : 3;
  out.piece = cuts == 2 ? 1.0 / 64 : 1.0 / 512;
  Sampler sampler(surface, lattice, cuts);
  Array<uint32_t> tris{memory};
  size_t at = 0;
  for (uint32_t i = 0; i < n; ++i) {
    tris.clear();
    for (; at < pairs.size() && pairs[at].cell == i; ++at) tris.push_back(pairs[at].tri);
    if (cover.kind[i] == LatticeCell::inside) out.share[i] = 1;
    else if (cover.kind[i] != LatticeCell::outside)
      sampler.run(unpack(cover.cells[i]), tris.data(), uint32_t(tris.size()), &out.share[i], &out.loose[i]);
  }
  return out;
}

}  // namespace dfm
