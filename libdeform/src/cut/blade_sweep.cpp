// A cut must have no gaps, even if the body moves between two steps of the blade. So cells take a side, and
// faces follow: each cell takes the side of the blade on which its center lies when the edge passes it, and
// keeps it; a face opens if the sides of its two cells differ. Around each edge of the mesh the number of
// faces that open is then even, however the body moves. If each face tested by itself whether the blade has
// crossed it, two faces tested in different steps could disagree (doc/decisions/cutting.md).
//
//                forward
//       . |  .      ^        ahead: may still change sides
//   ------+---------+-edge-- passed: has its side. The face between two of different sides opens where the
//    .    |   .              line between their centers meets the blade's way behind the edge and between
//      +  | -                its ends.
//
// A cell that the edge has left far behind, or far to its side, loses its side: the blade may come again.
#include "cut/blade_sweep.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "cut/cut.h"
#include "dynamics/symplectic_euler.h"
#include "math/elementary.h"
#include "math/extent.h"
#include "mesh/cut_mesh.h"
#include "state/material.h"
#include "state/world.h"

namespace dfm {
namespace {

constexpr auto kMaxTracks = 8;  // of blades of no tool that cut a body by turns
// of the largest distance between neighbors: how far from the edge sides are kept
constexpr double kKept = 2;
// of the median edge: a blade that has moved forward this far has begun to cut; a body this far from it is
// skipped
constexpr double kBegun = 1e-3, kReach = 8;

// The motion of the line from a to b: the smallest rotation, and a scale.
class LineMotion {
 public:
  LineMotion(Vec3 a0, Vec3 b0, Vec3 a1, Vec3 b1) : from_(0.5 * (a0 + b0)), to_(0.5 * (a1 + b1)) {
    const double l0 = norm(b0 - a0), l1 = norm(b1 - a1);
    still_ = !(l0 > 0 && l1 > 0) || (norm2(a1 - a0) == 0 && norm2(b1 - b0) == 0);
    if (still_) return;
    const Vec3 u = (1 / l0) * (b0 - a0), v = (1 / l1) * (b1 - a1);
    scale_ = l1 / l0;
    axis_ = cross(u, v);
    cosine_ = std::max(dot(u, v), -0.5);
  }
  Vec3 operator()(Vec3 p) const {
    if (still_) return p;
    const Vec3 r = p - from_;
    return to_ + scale_ * (cosine_ * r + cross(axis_, r) + (dot(axis_, r) / (1 + cosine_)) * axis_);
  }

 private:
  Vec3 from_, to_, axis_;
  double scale_ = 1, cosine_ = 1;
  bool still_ = true;
};

double toughness(const Body &b, uint32_t cell) {
  return b.composition.materials[b.composition.of.empty() ? 0 : b.composition.of[cell]].entry(kToughnessKey,
                                                                                              0);
}

// m2, of the face between two cells, with its normal from i to j.
Vec3 area_between(const Body &b, uint32_t i, uint32_t j, Vec3 way) {
  Vec3 x[3];
  size_t n = 0;
  const uint32_t *const c = &b.tets[size_t{4} * j];
  for (size_t k = 0; k < 4 && n < 3; ++k)
    if (const uint32_t p = b.tets[size_t{4} * i + k]; std::find(c, c + 4, p) != c + 4) x[n++] = b.p.x_at(p);
  const Vec3 area = 0.5 * cross(x[1] - x[0], x[2] - x[0]);
  return dot(area, way) < 0 ? -area : area;
}

// Or will be.
bool is_open(const Body &b, uint32_t i, uint32_t j) {
  if (b.cut.open.empty() && b.ahead.faces.empty()) return false;
  const uint64_t face = face_of_whole(b, open_face(i, j));
  return std::binary_search(b.cut.open.begin(), b.cut.open.end(), face) || b.ahead.has(face);
}

double between(const double ends[2], double along) { return ends[0] + along * (ends[1] - ends[0]); }

}  // namespace

BladeSweep::Frame::Frame(Vec3 a, Vec3 b, Vec3 towards) : origin(a), length(norm(b - a)) {
  if (!(length > 0)) return;
  along = (1 / length) * (b - a);
  const Vec3 across = towards - dot(towards, along) * along;
  if (const double size = norm(across); size > 1e-9 * norm(towards)) {
    forward = (1 / size) * across;
    normal = cross(along, forward);
  } else {
    length = 0;
  }
}

bool BladeSweep::goes_on(const BladeTrack &t) const {
  const auto same = [](Vec3 p, Vec3 q) { return p.x == q.x && p.y == q.y && p.z == q.z; };
  return same(load3(t.edge), blade_.corner[0]) && same(load3(t.edge + 3), blade_.corner[1]);
}

BladeSweep::BladeSweep(Body &b, const CutShape &blade, const Vec3 *forward) : blade_(blade), track_(0) {
  while (track_ < b.blades.size() && !goes_on(b.blades[track_])) ++track_;
  const BladeTrack *const track = track_ < b.blades.size() ? &b.blades[track_] : nullptr;
  fresh_ = !track;
  if (track) {
    lead_ = track->lead;
    std::copy_n(track->way, 2, way_);
    credit_ = track->credit;
    if (forward && std::max(way_[0], way_[1]) < kBegun * b.surface.median_edge) {
      fresh_ = true;  // it has stood, or gone sideways, so far
      way_[0] = way_[1] = 0;
    }
  }
  if (forward) strip_ = b.surface.median_edge;
  find_near(b);
  const bool looks = turn(b, forward);
  if (!near()) return;
  if (b.inner.empty()) b.inner = inner_faces(b);
  find_faces(b);
  kind_.assign(cells_.size(), SideKind::none);
  if (looks) take_sides(track);
  if (looks || !forward) compare(b, !forward && (fresh_ || still()));
  std::sort(faces.begin(), faces.end());
}

Array<uint32_t> inner_faces(const Body &b) {
  return inner_faces(sorted_faces(b.world->memory(), b.ncell(), b.tets.data()));
}

namespace {

// Points have a fourth value that is zero, so that one is two pairs.
using Pair = double __attribute__((vector_size(16)));
using Bits = int64_t __attribute__((vector_size(16)));
struct Four { Pair xy, z; };
Four four_at(const double *x) {
  Four out;
  std::memcpy(&out, x, sizeof out);
  return out;
}

// On which sides of a box that is `reach` larger a point lies: one bit for beyond its high and one for below
// its low end, by axis. A cell whose points have a bit in common does not meet the box.
class Beyond {
 public:
  Beyond(const Extent &box, double reach)
      : lo_{{box.lo.x, box.lo.y}, {box.lo.z, -HUGE_VAL}},
        hi_{{box.hi.x + reach, box.hi.y + reach}, {box.hi.z + reach, HUGE_VAL}},
        reach_{reach, reach} {}
  uint8_t operator()(const double *x) const {
    const Four at = four_at(x);
    const Bits xy = ((hi_.xy < at.xy) & Bits{1, 2}) | ((at.xy + reach_ < lo_.xy) & Bits{8, 16});
    const Bits z = ((hi_.z < at.z) & Bits{4, 0}) | ((at.z + reach_ < lo_.z) & Bits{32, 0});
    return uint8_t(xy[0] | xy[1] | z[0]);
  }

 private:
  Four lo_, hi_;
  Pair reach_;
};

}  // namespace

// Cells that may have been near the edge between the calls, alone: there is a call in each step, so what
// is done for all cells of the body is little.
void BladeSweep::find_near(const Body &b) {
  const double *const before = track_ < b.blades.size() ? b.blades[track_].x.data() : b.p.x.data();
  const double *const now = b.p.x.data();
  const PointsKernels &kernels = points_kernels();
  Extent way, whole;
  for (const Vec3 c : blade_.corner) way.add(c);
  for (const double *const x : {before, now}) {
    double low[kStride], high[kStride];
    kernels.bounds(b.p.n, x, low, high);
    whole.add(load3(low));
    whole.add(load3(high));
  }
  if (!way.meets(whole, kReach * b.surface.median_edge)) return;
  // of the diagonal of the largest box around a cell
  const double reach = kKept * std::sqrt(kernels.largest_box(b.ncell(), b.tets.data(), now));
  const Beyond beyond(way, reach);
  std::vector<uint8_t> side(b.p.n);
  for (uint32_t i = 0; i < b.p.n; ++i)
    side[i] = beyond(before + size_t{kStride} * i) & beyond(now + size_t{kStride} * i);
  cells_.resize(b.ncell());
  place_.resize(b.ncell());
  uint32_t n = 0;
  const uint32_t *p = b.tets.data();
  for (uint32_t c = 0; c < b.ncell(); ++c, p += 4) {
    const bool is_near = (side[p[0]] & side[p[1]] & side[p[2]] & side[p[3]]) == 0;
    cells_[n] = c;
    place_[c] = is_near ? n : kNone;
    n += is_near;
  }
  cells_.resize(n);
  was_ = std::make_unique_for_overwrite<double[]>(size_t{kStride} * n);
  is_ = std::make_unique_for_overwrite<double[]>(size_t{kStride} * n);
  kernels.middles(n, cells_.data(), b.tets.data(), before, was_.get());
  kernels.middles(n, cells_.data(), b.tets.data(), now, is_.get());
}

bool BladeSweep::still() const {
  for (size_t i = 0; i < kStride * cells_.size(); i += kStride)
    for (size_t k = i; k < i + 3; ++k)
      if (was_[k] != is_[k]) return false;
  return true;
}

// The blade's forward direction. Returns false if it is unknown.
bool BladeSweep::turn(const Body &b, const Vec3 *forward) {
  const Vec3 *const c = blade_.corner;
  const double share = 1 / double(cells_.size());
  Vec3 drift;
  for (size_t i = 0; i < kStride * cells_.size(); i += kStride)
    drift += share * (load3(&is_[i]) - load3(&was_[i]));
  drift_ = drift;
  Vec3 looks[2];
  if (forward) {
    std::copy_n(forward, 2, looks);
  } else {
    // The recent motion, over about the length of an edge: the body may vibrate while the blade is slow.
    const Vec3 way = 0.5 * ((c[3] - c[0]) + (c[2] - c[1])) - drift_;
    const Vec3 lead = dfm_exp(-norm(way) / b.surface.median_edge) * lead_ + way;
    if (dot(lead, lead_) < 0) {  // it has turned back, and begins again
      fresh_ = true;
      way_[0] = way_[1] = 0;
    }
    lead_ = lead;
    looks[0] = looks[1] = lead;
  }
  from_ = Frame(c[0], c[1], looks[0]);
  to_ = Frame(c[3], c[2], looks[1]);
  if (!(from_.length > 0 && to_.length > 0)) return false;
  step_[0] = dot(c[3] - c[0] - drift_, to_.forward);
  step_[1] = dot(c[2] - c[1] - drift_, to_.forward);
  return true;
}

void BladeSweep::find_faces(const Body &b) {
  const size_t n = b.inner.size() / 2;
  // a cell has four faces, a face two cells; and one more, which is written before it is known
  pairs_ = std::make_unique_for_overwrite<Face[]>(2 * cells_.size() + 1);
  const uint32_t *k = b.inner.data();
  const uint32_t *const place = place_.data();
  Face *to = pairs_.get();
  for (size_t f = 0; f < n; ++f, k += 2) {
    const uint32_t i = place[k[0]], j = place[k[1]];
    to->i = i;
    to->j = j;
    to += 1 - ((i | j) >> 31);  // none is kNone
  }
  npair_ = uint32_t(to - pairs_.get());
  static_assert(sizeof(Face) == 2 * sizeof(uint32_t));
  apart_ = std::sqrt(points_kernels().farthest(npair_, &pairs_[0].i, is_.get()));
}

// Few cells are at the edge, so of the others no more is found than that they are not.
void BladeSweep::take_sides(const BladeTrack *track) {
  const size_t n = cells_.size();
  ahead_ = std::make_unique_for_overwrite<double[]>(n);
  sides_ = std::make_unique_for_overwrite<BladeSide[]>(n);
  if (track && !fresh_)
    for (const BladeSide &side : track->sides)
      if (side.cell < place_.size() && place_[side.cell] != kNone) {
        const uint32_t i = place_[side.cell];
        kind_[i] = side.kind;
        sides_[i] = side;
      }
  const Frame from = from_, to = to_;
  const double far = kKept * apart_;
  const bool fresh = fresh_;
  const double *was_at = was_.get(), *is_at = is_.get();
  const auto along = [](const Frame &f, Vec3 r) { return dot(r, f.along) / f.length; };
  for (size_t i = 0; i < n; ++i) {
    const Vec3 is = load3(is_at + kStride * i) - to.origin;
    const double ahead = ahead_[i] = dot(is, to.forward);
    SideKind &kind = kind_[i];
    if (kind == SideKind::passed || kind == SideKind::behind) continue;
    BladeSide &side = sides_[i];
    const double off = dot(is, to.normal);
    const uint32_t cell = cells_[i];
    if (ahead > 0) {
      kind = SideKind::none;
      if (std::fabs(off) > far) continue;
      const double is_along = along(to, is);
      const double way = between(way_, is_along) + between(step_, is_along) + ahead;
      side = {cell, kind = SideKind::ahead, is_along, way, off};
      continue;
    }
    const Vec3 was = load3(was_at + kStride * i) - from.origin;
    const double was_ahead = dot(was, from.forward);
    if (!(was_ahead > 0 || kind == SideKind::ahead || (fresh && -was_ahead < far))) continue;
    const double was_off = dot(was, from.normal);
    if (was_ahead > 0 || kind == SideKind::ahead) {
      const double was_along = along(from, was);
      const double share = was_ahead > 0 ? was_ahead / (was_ahead - ahead) : 0;
      const double at = was_along + share * (along(to, is) - was_along);
      const double way = between(way_, at) + share * between(step_, at);
      side = {cell, kind = SideKind::passed, at, way, was_off + share * (off - was_off)};
    } else {
      side = {cell, kind = SideKind::behind, along(from, was), was_ahead, was_off};
    }
    if (std::fabs(side.off) > far) kind = SideKind::none;
  }
  for (int k = 0; k < 2; ++k) way_[k] += step_[k];
}

// by_shape: where the body has not moved, or nothing is known of it, the blade's quadrilateral decides.
void BladeSweep::compare(const Body &b, bool by_shape) {
  const auto was = [&](uint32_t i) { return load3(&was_[size_t{kStride} * i]); };
  const auto is = [&](uint32_t i) { return load3(&is_[size_t{kStride} * i]); };
  const auto add = [&](const Face &f, Vec3 across, Vec3 way, double along) {
    const uint32_t i = cells_[f.i], j = cells_[f.j];
    // of the face as the blade sees it: together they are the area that it has passed over, however rough
    const double area = dot(area_between(b, i, j, is(f.j) - is(f.i)), across);
    const double energy = 0.5 * (toughness(b, i) + toughness(b, j));
    faces.push_back({dot(way, is(f.i) + is(f.j)), open_face(i, j), energy * area, way, along});
  };
  if (by_shape) {
    for (const Face &f : pairs()) {
      CutShape own = blade_;
      const LineMotion moves(was(f.i), was(f.j), is(f.i), is(f.j));
      for (int k = 0; k < 2; ++k) own.corner[k] = moves(blade_.corner[k]);
      if (!crosses_blade(own, is(f.i), is(f.j)) || is_open(b, cells_[f.i], cells_[f.j])) continue;
      const Vec3 *const c = own.corner;
      const Vec3 across = normalized(cross(c[2] - c[0], c[3] - c[1])), way = is(f.j) - is(f.i);
      add(f, dot(across, way) < 0 ? -across : across, 0.5 * ((c[3] - c[0]) + (c[2] - c[1])), 0.5);
    }
    return;
  }
  const bool begins = strip_ > 0 && std::max(way_[0], way_[1]) > kBegun * strip_;
  const auto passed = [&](SideKind kind) {
    return kind == SideKind::passed || (begins && kind == SideKind::behind);
  };
  for (const Face &f : pairs()) {
    SideKind &kind_a = kind_[f.i], &kind_o = kind_[f.j];
    if (kind_a == SideKind::none || kind_o == SideKind::none) continue;
    const BladeSide &a = sides_[f.i], &o = sides_[f.j];
    if (!(passed(kind_a) || passed(kind_o)) || (a.off < 0) == (o.off < 0)) continue;
    const double share = std::fabs(a.off) / (std::fabs(a.off) + std::fabs(o.off));
    const auto at = [&](double of_a, double of_o) { return of_a + share * (of_o - of_a); };
    const double along = at(a.along, o.along);
    if (!(along >= 0 && along <= 1) || at(a.way, o.way) < -strip_) continue;
    if (!(passed(kind_a) && passed(kind_o)) && at(ahead_[f.i], ahead_[f.j]) > 0) continue;
    if (is_open(b, cells_[f.i], cells_[f.j])) continue;  // last: few faces come so far
    for (SideKind *kind : {&kind_a, &kind_o})
      if (*kind == SideKind::ahead) *kind = SideKind::passed;  // its side is settled by now
    const Vec3 *const c = blade_.corner;
    const Vec3 of_edge = (1 - along) * (c[3] - c[0]) + along * (c[2] - c[1]);
    const Vec3 way = of_edge - 0.5 * (is(f.i) - was(f.i) + is(f.j) - was(f.j));
    add(f, o.off < a.off ? -to_.normal : to_.normal, way, along);
    faces.back().order = at(a.way, o.way);
  }
}

double BladeSweep::energy(size_t n) {
  for (size_t k = 0; k < n; ++k) credit_ += faces[k].work;
  const double taken = std::max(0.0, credit_);
  credit_ -= taken;
  return taken;
}

BladeTrack &BladeSweep::keep(Body &b, uint64_t part) {
  const auto of_part = [&](const BladeTrack &t) { return t.part == part; };
  for (size_t i = b.blades.size(); part && i-- > 0;)  // a part of a tool has one
    if (i != track_ && of_part(b.blades[i])) {
      b.blades.erase(b.blades.begin() + std::ptrdiff_t(i));
      track_ -= i < track_;
    }
  if (track_ == b.blades.size()) {
    if (!part && std::count_if(b.blades.begin(), b.blades.end(), of_part) == kMaxTracks)
      b.blades.erase(std::find_if(b.blades.begin(), b.blades.end(), of_part));
    b.blades.emplace_back();
    use_memory(b.world->memory(), b.blades.back().x, b.blades.back().sides, b.blades.back().cut_work);
    track_ = b.blades.size() - 1;
  }
  BladeTrack &t = b.blades[track_];
  if (part) t.part = part;
  store3(t.edge, blade_.corner[3]);
  store3(t.edge + 3, blade_.corner[2]);
  t.x.assign(b.p.x.begin(), b.p.x.end());
  t.lead = lead_;
  t.credit = credit_;
  std::copy_n(way_, 2, t.way);
  t.sides.clear();
  const double far = kKept * apart_;
  for (size_t i = 0; i < kind_.size(); ++i) {
    const SideKind kind = kind_[i];
    if (kind == SideKind::none || ahead_[i] < -far) continue;
    const double off = to_.length > 0 ? dot(load3(&is_[kStride * i]) - to_.origin, to_.normal) : 0;
    if (std::fabs(off) > far) continue;
    const bool decided = kind == SideKind::passed || kind == SideKind::behind;
    if (decided && ahead_[i] > apart_) continue;  // drawn back from
    t.sides.push_back(sides_[i]);
    t.sides.back().kind = kind;
  }
  return t;
}

}  // namespace dfm
