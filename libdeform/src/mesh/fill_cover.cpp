// Finds the cells of the lattice that a surface needs. Triangles are assigned to cells by separating axes,
// and enclosed cells are reached from there across faces without triangles, so that work and memory grow with
// the number of kept cells and not with the bounding box.
#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <utility>

#include "core/disjoint_sets.h"
#include "math/extent.h"
#include "mesh/fill_lattice.h"
#include "mesh/topology_tri.h"

namespace dfm {
namespace {

constexpr double kDecided = 0.25;  // a winding number farther than this from 1/2 is decided

Vec3 middle_of(const RestMesh &surface, double *size, double *reach) {
  Extent box;
  for (const uint32_t p : surface.tris) box.add(load3(&surface.points[3 * size_t{p}]));
  const Vec3 lo = box.lo, hi = box.hi;
  *reach = 0;
  for (int k = 0; k < 3; ++k) *reach = std::max({*reach, std::fabs(lo[k]), std::fabs(hi[k])});
  const double longest = box.longest();
  if (!(longest > 0)) {
    *size = 0;
    return Vec3{};
  }
  const Vec3 extent = (1 / longest) * Vec3{hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]};
  *size = longest * norm(extent);
  return {lo[0] + 0.5 * (hi[0] - lo[0]), lo[1] + 0.5 * (hi[1] - lo[1]), lo[2] + 0.5 * (hi[2] - lo[2])};
}

Array<double> local_points(const RestMesh &surface, Vec3 middle, double size) {
  Array<double> out{*surface.memory};
  out.reserve(surface.points.size());
  for (size_t i = 0; i < surface.points.size(); ++i)
    out.push_back(size > 0 ? (surface.points[i] - middle[int(i % 3)]) / size : 0);
  return out;
}

// Shapes of the twelve kinds of cells about their middle.
struct Kinds {
  std::array<TetShape, 18> shape;
  static int number(int a, int b, bool upper) { return (a * 3 + b) * 2 + upper; }
  static TetShape make(int kind) {
    int a = kind / 6, b = kind / 2 % 3;
    if (a == b) b = (a + 1) % 3;  // six of these numbers are never used
    int32_t key[3];
    key[a] = 0;
    key[b] = 2;
    key[3 - a - b] = kind % 2 ? 3 : 1;
    Site corner[4];
    const Site at{key[0], key[1], key[2]};
    corners_of(at, corner);
    Vec3 place[4];
    for (int k = 0; k < 4; ++k) place[k] = place_of(corner[k]) - 0.5 * place_of(at);
    return TetShape(place);
  }
  template <size_t... K>
  explicit Kinds(std::index_sequence<K...>) : shape{make(int(K))...} {}
  static const Kinds &all() {
    static const Kinds kinds{std::make_index_sequence<18>()};
    return kinds;
  }
};

int32_t first_at_least(double x, int32_t modulus, int32_t rest) {
  return int32_t(std::ceil((x - rest) / modulus)) * modulus + rest;
}

// Tests a piece of a triangle, no longer than a few cells, against all cells whose boxes meet its own.
class PieceTest {
 public:
  PieceTest(double tolerance, const KeySet *skip, uint64_t work, const VisitCrossing &visit)
      : tolerance_(tolerance), skip_(skip), work_(work), visit_(visit) {}
  uint64_t work() const { return work_; }

  bool run(const Vec3 corner[3], uint32_t triangle) {
    Extent box;
    for (int i = 0; i < 3; ++i) box.add(corner[i]);
    if (box.longest() > kLongestPiece) {  // split at the longest edge
      int k = 0;
      for (int i = 1; i < 3; ++i)
        if (norm2(corner[(i + 1) % 3] - corner[i]) > norm2(corner[(k + 1) % 3] - corner[k])) k = i;
      const Vec3 a = corner[k], b = corner[(k + 1) % 3], c = corner[(k + 2) % 3], m = 0.5 * (a + b);
      const Vec3 part[2][3] = {{a, m, c}, {m, b, c}};
      return run(part[0], triangle) && run(part[1], triangle);
    }
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        if (a != b && !run_axes(corner, triangle, box.lo, box.hi, a, b)) return false;
    return true;
  }

 private:
  static constexpr double kLongestPiece = 3;

  // A cell of axes a, b, c reaches 1, 1 and 1/2 from its middle, which is half its key.
  bool run_axes(const Vec3 corner[3], uint32_t triangle, Vec3 lo, Vec3 hi, int a, int b) {
    const int c = 3 - a - b;
    const double t = tolerance_;
    int32_t key[3];
    for (key[a] = first_at_least(2 * (lo[a] - 1 - t), 4, 0); key[a] <= 2 * (hi[a] + 1 + t); key[a] += 4)
      for (key[b] = first_at_least(2 * (lo[b] - 1 - t), 4, 2); key[b] <= 2 * (hi[b] + 1 + t); key[b] += 4)
        for (key[c] = first_at_least(2 * (lo[c] - 0.5 - t), 2, 1); key[c] <= 2 * (hi[c] + 0.5 + t);
             key[c] += 2) {
          const Site at{key[0], key[1], key[2]};
          if (work_ == 0) return false;
          --work_;
          if (skip_ && skip_->find(pack(at)) != UINT32_MAX) continue;
          const Vec3 middle = 0.5 * place_of(at);
          const Vec3 moved[3] = {corner[0] - middle, corner[1] - middle, corner[2] - middle};
          const TetShape &shape = Kinds::all().shape[size_t(Kinds::number(a, b, (key[c] & 2) != 0))];
          if (shape.meets(moved, t) && !visit_(pack(at), triangle, shape.meets(moved, -t))) return false;
        }
    return true;
  }

  double tolerance_;
  const KeySet *skip_;
  uint64_t work_;
  const VisitCrossing &visit_;
};

}  // namespace

FillSurface::FillSurface(const RestMesh &surface)
    : memory(*surface.memory),
      middle(middle_of(surface, &size, &resolution)),
      points(local_points(surface, middle, size)),
      tris(surface.tris),
      winding(memory, points.data(), surface.ntri(), tris.data()) {
  resolution = size > 0 ? DBL_EPSILON * resolution / size : 0;
  for (size_t t = 0; t < tris.size(); t += 3) {
    const auto [a, b, c] = corners_of(points.data(), &tris[t]);
    area += 0.5 * norm(cross(b - a, c - a));
    volume += dot(a, cross(b, c)) / 6;
  }
  measure_openings();
}

// Edges that are traversed more often in one direction than in the other form closed loops; the vector area
// of a loop is that of any patch that closes it, at most the patch's area. A triangle with wrong orientation
// counts twice.
void FillSurface::measure_openings() {
  struct Edge {
    uint32_t a, b;
    int32_t way;
  };
  Array<Edge> edges{memory};
  const Array<TriEdge> all = sorted_edges(memory, uint32_t(tris.size() / 3), tris.data());
  for (size_t i = 0, j; i < all.size(); i = j) {
    const auto low = uint32_t(all[i].key >> 32), high = uint32_t(all[i].key);
    int32_t way = 0;
    for (j = i; j < all.size() && all[j].key == all[i].key; ++j) way += tris[all[j].half] == low ? 1 : -1;
    if (way != 0) edges.push_back({low, high, way});
  }
  closed = edges.empty();
  if (closed) return;
  DisjointSets loops(memory, uint32_t(points.size() / 3));
  for (const Edge &e : edges) loops.join(e.a, e.b);
  std::sort(edges.begin(), edges.end(), [&](const Edge &e, const Edge &f) {
    const uint32_t p = loops.root(e.a), q = loops.root(f.a);
    return p != q ? p < q : e.a != f.a ? e.a < f.a : e.b < f.b;
  });
  for (size_t i = 0, j; i < edges.size(); i = j) {
    const uint32_t loop = loops.root(edges[i].a);
    const Vec3 origin = load3(&points[3 * size_t(loop)]);
    Vec3 patch;
    Extent box;
    for (j = i; j < edges.size() && loops.root(edges[j].a) == loop; ++j) {
      const Vec3 a = load3(&points[3 * size_t(edges[j].a)]), b = load3(&points[3 * size_t(edges[j].b)]);
      patch += (0.5 * edges[j].way) * cross(a - origin, b - origin);
      box.add(a);
      box.add(b);
    }
    ++openings;
    opening_area += norm(patch);
    opening_width = std::max(opening_width, norm(box.hi - box.lo));
  }
}

double touch_tolerance(const FillSurface &surface, const Lattice &lattice) {
  return 1e-9 + 4 * surface.resolution / lattice.half_pitch;
}

uint64_t each_crossing(const FillSurface &surface, const Lattice &lattice, const KeySet *skip, uint64_t work,
                       const VisitCrossing &visit) {
  PieceTest test(touch_tolerance(surface, lattice), skip, work, visit);
  for (uint32_t t = 0; t < surface.tris.size() / 3; ++t) {
    Vec3 corner[3];
    for (int k = 0; k < 3; ++k)
      corner[k] = lattice.from_box(load3(&surface.points[3 * size_t(surface.tris[3 * size_t(t) + k])]));
    if (!test.run(corner, t)) break;
  }
  return test.work();
}

FillCover cover(const FillSurface &surface, const Lattice &lattice, uint32_t limit) {
  FillCover out(surface.memory);
  KeySet touched(surface.memory);
  const uint64_t most_touched = 8 * uint64_t(limit);
  out.hopeless = each_crossing(surface, lattice, &out.cells, crossing_work(surface, limit),
                               [&](uint64_t key, uint32_t, bool deep) {
                                 (deep ? out.cells : touched).add(key);
                                 return out.cells.size() <= limit && touched.size() <= most_touched;
                               }) == 0;
  const uint32_t crossed = out.kept = out.cells.size();
  out.complete = !out.hopeless && crossed <= limit && touched.size() <= most_touched;
  if (!out.complete) return out;
  out.kind.assign(crossed, LatticeCell::crossed);
  const auto look = [&](uint64_t key, bool surely_inside) {
    bool is_new = false;
    out.cells.add(key, &is_new);
    if (!is_new) return;
    LatticeCell kind = LatticeCell::inside;
    if (!surely_inside) {
      const double w = surface.winding.at(lattice.to_box(0.5 * place_of(unpack(key))));
      kind = w > 0.5 ? LatticeCell::inside : LatticeCell::outside;
      if (!surface.closed && std::fabs(w - 0.5) < kDecided) kind = LatticeCell::mixed;
    }
    out.kind.push_back(kind);
    out.kept += kind != LatticeCell::outside;
  };
  for (uint32_t i = 0; i < touched.size(); ++i) look(touched[i], false);
  const uint32_t near = out.cells.size();
  for (uint32_t i = 0; i < out.cells.size() && out.kept <= limit; ++i)
    // no surface separates neighbors that no triangle touches
    for (uint32_t face = 0; face < 4 && out.kind[i] != LatticeCell::outside; ++face)
      look(pack(neighbor(unpack(out.cells[i]), face)),
           i >= near && surface.closed && out.kind[i] == LatticeCell::inside);
  out.complete = out.kept <= limit;
  return out;
}

}  // namespace dfm
