// A blade opens faces along its edge (cut/blade_sweep.h), in the direction of the edge only. A blade that
// does not move or moves back cuts nothing, and what touches its side stays whole (doc/decisions/cutting.md).
#include "cut/tool_cut.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/lists.h"
#include "cut/blade_sweep.h"
#include "cut/cut_ahead.h"
#include "cut/separate.h"
#include "math/extent.h"
#include "math/turn.h"
#include "state/obstacle.h"
#include "state/tool.h"
#include "state/world.h"
#include "step/solve/cut_drag.h"
#include "step/stages.h"
#include "world/may_cut.h"

namespace dfm {
namespace {

constexpr double kTurn = 0.1;   // rad: a solid that turns by more in a step is placed at several poses
constexpr int kMaxPlaces = 64;  // of a solid in a step

bool has_edge(const Tool &t) { return t.def.shape == DFM_TOOL_BLADE || t.def.shape == DFM_TOOL_SCISSORS; }

// ---- edges ----------------------------------------------------------------------------------------------

// A cutting part in its frame: the edge, and the far side of the blade behind it.
struct Plate { Vec3 edge[2], back[2]; };
Plate plate_of(const Tool &t, size_t part) {
  const Vec3 h = load3(t.def.half_size);
  if (part == 0) return {{{0, -h.y, -h.z}, {0, h.y, -h.z}}, {{0, -h.y, h.z}, {0, h.y, h.z}}};
  // of scissors: in the plane in which the jaws pass each other, on the side of the other jaw
  const double s = part == 1 ? 1 : -1;
  return {{{-s * h.x, -s * h.y, h.z}, {-s * h.x, -s * h.y, -h.z}},
          {{s * h.x, -s * h.y, h.z}, {s * h.x, -s * h.y, -h.z}}};
}

// The way of a part's edge in the step, and where its blade looks at the start and at the end.
struct Edge {
  CutShape blade;
  Vec3 forward[2];
  Edge(const Tool &t, size_t part) {
    const Plate plate = plate_of(t, part);
    const Pose places[2] = {t.cuts.from[part], load_pose(t.set->state[part])};
    for (size_t i = 0; i < 2; ++i) {
      const auto at = [&](Vec3 x) { return places[i].position + rotate(places[i].rotation, x); };
      for (size_t k = 0; k < 2; ++k) blade.corner[i ? 3 - k : k] = at(plate.edge[k]);
      forward[i] = rotate(places[i].rotation, plate.edge[0] - plate.back[0]);
    }
    blade.kind = CutKind::blade;
  }
};

// The faces that an edge opens in a step, and what that takes.
class Opening {
 public:
  // Before they open: the corners by which the cells see them.
  Opening(const Body &b, const std::vector<SweptFace> &faces, double energy) {
    double sum = 0;
    for (const SweptFace &f : faces) sum += std::max(0.0, f.work);
    if (!(energy > 0 && sum > 0)) return;
    for (const SweptFace &f : faces) {
      if (!(f.work > 0)) continue;
      Part part{{}, f.work / sum * energy, f.way};
      const size_t cells[2] = {size_t(f.face >> 32), size_t(f.face & kNone)};
      for (const size_t side : {size_t{0}, size_t{1}})
        for (size_t k = 0; k < 4; ++k) {
          const size_t corner = 4 * cells[side] + k;
          const auto other = b.tets.begin() + std::ptrdiff_t(4 * cells[1 - side]);
          if (std::find(other, other + 4, b.tets[corner]) != other + 4) part.corners.push_back(corner);
        }
      parts_.push_back(std::move(part));
    }
  }
  // After they have opened: the work is charged to the points that these corners have now, equal shares. That
  // of a point within the body would have to wait, so those at the surface come first.
  void charge(const Body &b, const Pose &place, BladeTrack &to) const {
    const auto &surface = b.surface.point;
    for (const Part &part : parts_) {
      std::vector<uint32_t> points, outside;
      for (const size_t corner : part.corners) points.push_back(b.tets[corner]);
      std::copy_if(points.begin(), points.end(), std::back_inserter(outside),
                   [&](uint32_t p) { return std::binary_search(surface.begin(), surface.end(), p); });
      if (!outside.empty()) points.swap(outside);
      const Vec3 way = rotate_back(place.rotation, normalized(part.way));
      for (const uint32_t p : points) add(b, p, part.energy / double(points.size()), way, to);
    }
  }

 private:
  struct Part {
    std::vector<size_t> corners;  // of all cells: a split changes their points, but no cell's number
    double energy;
    Vec3 way;
  };
  std::vector<Part> parts_;

  static void add(const Body &b, uint32_t point, double energy, Vec3 way, BladeTrack &to) {
    const auto before = [](const CutWork &d, uint32_t i) { return d.point < i; };
    auto at = std::lower_bound(to.cut_work.begin(), to.cut_work.end(), point, before);
    if (at == to.cut_work.end() || at->point != point) {
      CutWork none{};
      none.point = point;
      at = to.cut_work.insert(at, none);
    }
    store3(at->way, normalized(at->energy * load3(at->way) + energy * way));
    at->energy += energy;
    at->force = at->energy / b.surface.median_edge;
  }
};

// Points that the edge has been drawn back from are not at it any more, nor are those that it has left by a
// jump: paying takes an edge one edge length on, and the wait for a point to come to the surface two.
constexpr double kBack = 2, kJumped = 8;  // median edges
void forget_far(const Body &b, const Edge &edge, const Pose &place, BladeTrack &track) {
  if (track.cut_work.empty()) return;
  const Vec3 *const c = edge.blade.corner;
  const Vec3 along = normalized(c[2] - c[3]);
  const double unit = b.surface.median_edge;
  std::erase_if(track.cut_work, [&](const CutWork &d) {
    const Vec3 r = b.p.x_at(d.point) - c[3];
    return norm(r - dot(r, along) * along) > kJumped * unit ||
           dot(r, rotate(place.rotation, load3(d.way))) > kBack * unit;
  });
}

// n: how many faces have opened, in this step.
void split(const Tool &t, Body &b, uint32_t &n) {
  uint32_t all = 0;
  for (size_t part = t.first_cutting_part(); part < t.motion.parts.size(); ++part) {
    const Edge edge(t, part);
    BladeSweep sweep(b, edge.blade, edge.forward);
    const uint64_t id = t.set->obstacle[part];
    for (BladeTrack &track : b.blades)
      if (track.part == id && !sweep.goes_on(track))
        track.cut_work.clear();  // where it has been before a jump
    if (!sweep.near()) continue;
    std::vector<SweptFace> &met = sweep.faces;
    if (t.cuts.most > 0 && met.size() > t.cuts.most - all) met.resize(t.cuts.most - all);
    all += uint32_t(met.size());
    const Opening opening(b, met, sweep.energy(met.size()));
    if (!met.empty()) {
      Array<uint64_t> more{b.world->memory()};
      for (const SweptFace &f : met) more.push_back(f.face);
      if (b.ahead.delay > 0) {
        open_later(b, more, t.set->obstacle[t.first_cutting_part()]);
      } else {
        open_faces(b, more);
        n += uint32_t(met.size());
      }
    }
    BladeTrack &track = sweep.keep(b, id);
    const Pose place = load_pose(t.set->state[part]);
    forget_far(b, edge, place, track);
    opening.charge(b, place, track);
  }
}

// ---- solids ---------------------------------------------------------------------------------------------

struct Solid {
  CutShape shape;
  Extent box;
};

// On the way from one place to the next; `at`: where it is within the part.
Solid solid_of(const Tool &t, const Pose &from, const Pose &to) {
  Solid out;
  CutShape &s = out.shape;
  s.rotation = to.rotation;
  s.position = from.position;
  s.way = to.position - from.position;
  s.half_size = load3(t.def.half_size);
  switch (t.def.shape) {
    case DFM_TOOL_SPHERE: s.half_size = {t.def.radius, t.def.radius, t.def.radius}; break;
    case DFM_TOOL_CAPSULE: {  // a ball on its way along the axis
      const Vec3 half = rotate(to.rotation, {0, 0, t.def.half_length});
      s.half_size = {t.def.radius, t.def.radius, t.def.radius};
      s.position = to.position - half;
      s.way = 2.0 * half;
      break;
    }
    case DFM_TOOL_ELLIPSOID: break;
    default: s.kind = CutKind::box;
  }
  const double reach = norm(s.half_size);
  out.box.add(s.position);
  out.box.add(s.position + s.way);
  out.box.grow({reach, reach, reach});
  return out;
}

std::vector<Solid> solids_of(const Tool &t) {
  std::vector<Solid> out;
  for (size_t part = t.first_cutting_part(); part < t.motion.parts.size(); ++part) {
    const Pose from = t.cuts.from[part], to = load_pose(t.set->state[part]);
    double places = norm(rotation_vector(to.rotation * conjugate(from.rotation))) / kTurn;
    if (t.def.shape == DFM_TOOL_CAPSULE)
      places = std::max(places, norm(to.position - from.position) / (0.5 * t.def.radius));
    const int n = int(std::clamp(std::ceil(places), 1.0, double(kMaxPlaces)));
    Pose last = from;
    for (int k = 1; k <= n; ++k) {
      const double share = double(k) / n;
      const Pose next{from.position + share * (to.position - from.position),
                      slerp(from.rotation, to.rotation, share)};
      out.push_back(solid_of(t, last, next));
      last = next;
    }
  }
  return out;
}

// n: how many cells have gone.
void remove(const Tool &t, Body &b, uint32_t &n) {
  const std::vector<Solid> solids = solids_of(t);
  const Extent whole = extent_of(b.p.x.data(), b.p.n, kStride);
  if (std::none_of(solids.begin(), solids.end(), [&](const Solid &s) { return s.box.meets(whole); })) return;
  Array<uint8_t> removed(b.ncell(), 0, b.world->memory());
  uint32_t met = 0;
  for (size_t c = 0; c < b.ncell() && (t.cuts.most == 0 || met < t.cuts.most); ++c) {
    Extent box;
    const Vec3 x[4] = {b.corner(c, 0), b.corner(c, 1), b.corner(c, 2), b.corner(c, 3)};
    for (const Vec3 corner : x) box.add(corner);
    const auto meets = [&](const Solid &s) { return s.box.meets(box) && meets_tetrahedron(s.shape, x); };
    if (!std::any_of(solids.begin(), solids.end(), meets)) continue;
    removed[c] = 1;
    ++met;
  }
  if (met > 0) remove_cells(b, removed);
  n = met;
}

}  // namespace

void check_tool_cuts(const Tool &t, uint32_t how) {
  if (how > DFM_CUT_SPLIT)
    refuse(t, " has the unknown way of cutting %u; use DFM_CUT_REMOVE or DFM_CUT_SPLIT", how);
  if (t.def.shape == DFM_TOOL_GRASPER || t.def.shape == DFM_TOOL_MESH)
    refuse(t,
           " cannot cut: a %s has neither an edge nor a volume; use a blade, scissors, a sphere, a capsule, "
           "a box or an ellipsoid",
           t.def.shape == DFM_TOOL_MESH ? "mesh" : "grasper");
  if (how == DFM_CUT_SPLIT && !has_edge(t))
    refuse(t,
           " cannot open faces, since it has no edge; let it remove cells (DFM_CUT_REMOVE), or use a blade "
           "or scissors");
  if (t.def.shape == DFM_TOOL_BLADE && how == DFM_CUT_SPLIT && t.def.half_size[0] > t.def.half_size[1])
    refuse(t,
           " cannot cut: the edge of a blade runs along y, and its half_size is %g m along x, the thickness, "
           "and %g m along y; exchange the two",
           t.def.half_size[0], t.def.half_size[1]);
}

void set_cuts(Tool &t, uint32_t how, uint32_t most, std::span<Body *const> bodies) {
  World &w = *t.world;
  check_tool_cuts(t, how);
  std::vector<uint64_t> ids;
  for (const Body *const b : bodies) {
    if (b->world != &w)
      refuse(t, DFM_E_HANDLE, " and body '%s', which it should cut, belong to different worlds",
             b->name.c_str());
    check_may_cut(*b, b->model);
    ids.push_back(b->id);
  }
  for (const auto &b : w.bodies)  // which stay in the list when their whole is destroyed
    if (b->piece_of && std::count(ids.begin(), ids.end(), b->piece_of)) ids.push_back(b->id);
  sort_unique(ids);
  if (how == DFM_CUT_SPLIT)  // now, since it takes longer than a step
    for (Body *const b : bodies)
      if (b->inner.empty()) b->inner = inner_faces(*b);
  t.cuts.from.resize(t.motion.parts.size());
  t.cuts.waits = false;
  for (auto &o : w.obstacles)
    if (o->rigid == t.set) w.overlaps.place(o->id);  // what it was in without touching it
  t.cuts.how = how;
  t.cuts.most = most;
  t.cuts.bodies.swap(ids);
  forget_dues(w, t);
  wake_all(w);
  w.changed = true;
}

void begin_cuts(World &w) {
  for (auto &t : w.tools) {
    if (t->cuts.waits) continue;
    for (size_t part = 0; part < t->cuts.from.size(); ++part)
      t->cuts.from[part] = load_pose(t->set->state[part]);
  }
}

void cut_by_tools(World &w, double dt) {
  for (size_t k = 0; k < w.tools.size(); ++k) {
    Tool &t = *w.tools[k];
    // by id, since a body without cells leaves the list; a body is cut with its pieces
    std::vector<uint64_t> ids;
    for (auto &b : w.bodies)
      if (t.cuts_body(*b)) ids.push_back(b->id);
    for (const uint64_t id : ids) {
      Body *const found = w.body(id);
      if (!found) continue;
      Body &b = *found;
      reserve_cut_events(w, 1);
      uint32_t n = 0;
      const auto report = [&] {
        if (n > 0) add_event(w, DFM_EVENT_CUT, id, t.set->obstacle[t.first_cutting_part()], n, w.time);
      };
      try {
        if (t.cuts.how == DFM_CUT_SPLIT) split(t, b, n);
        else remove(t, b, n);
      } catch (...) {  // the second edge of scissors, where the first has opened faces
        report();
        b.separate.waits = b.separate.waits || (n > 0 && b.separate.on);
        throw;
      }
      report();
      if (n > 0) separate_if_requested(b);
    }
    t.cuts.waits = false;
  }
  open_scheduled(w, dt);
  prepare_cuts(w);
}

}  // namespace dfm
