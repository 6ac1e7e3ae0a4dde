// A blade opens faces along its edge. The quadrilaterals of a step are, in the plane of the blade:
//
//      back    +-----------+
//              |           |        swept   from the edge before the step to the edge now
//              |           |        strip   from the edge now one edge length of the body's surface back
//              |:::strip:::|        (in the strip, faces are found that a limit has left, or that a moving
//      edge    +-----------+        body has carried past the swept quadrilateral)
//              |///swept///|
//
// A face opens where the blade crosses the line between the middles of its cells and the edge moves forward
// there, seen from the cells. So a blade that stands still or is drawn back cuts nothing, and what leans on
// it from the side stays whole (decision 0403).
#include "world/tool_cut.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "geometry/closest.h"
#include "math/turn.h"
#include "mesh/cut_mesh.h"
#include "state/world.h"
#include "step/stages.h"
#include "world/separate.h"

namespace dfm {
namespace {

constexpr double kTurn = 0.1;  // rad: a solid that turns by more in a step is placed at several poses
constexpr double kRounding = 64 * 2.220446049250313e-16;  // of a coordinate, in a step
constexpr int kMostPlaces = 64;                           // of a solid in a step

struct Box {
  Vec3 lo{HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  void add(Vec3 x) {
    for (int k = 0; k < 3; ++k) {
      lo[k] = std::min(lo[k], x[k]);
      hi[k] = std::max(hi[k], x[k]);
    }
  }
  void grow(Vec3 by) {
    lo = lo - by;
    hi = hi + by;
  }
  bool meets(const Box &o) const {
    for (int k = 0; k < 3; ++k)
      if (hi[k] < o.lo[k] || o.hi[k] < lo[k]) return false;
    return true;
  }
};

size_t cells_of(const Body &b) { return b.tets.size() / 4; }
size_t point_of(const Body &b, size_t cell, size_t k) { return size_t{kStride} * b.tets[4 * cell + k]; }
Box box_of(const Body &b, size_t cell) {
  Box out;
  for (size_t k = 0; k < 4; ++k) out.add(load3(&b.p.x[point_of(b, cell, k)]));
  return out;
}
Box box_of(const Body &b) {
  Box out;
  for (uint32_t i = 0; i < b.p.n; ++i) out.add(load3(&b.p.x[size_t{kStride} * i]));
  return out;
}
// The mean of a cell's corners, of positions or velocities.
Vec3 middle_of(const Body &b, const Array<double> &values, size_t cell) {
  Vec3 sum[2];
  for (size_t k = 0; k < 4; ++k) sum[k / 2] += load3(&values[point_of(b, cell, k)]);
  return 0.25 * (sum[0] + sum[1]);
}

bool has_edge(const Tool &t) { return t.def.shape == DFM_TOOL_BLADE || t.def.shape == DFM_TOOL_SCISSORS; }

// ---- edges ----------------------------------------------------------------------------------------------

// Of a part, in its frame: the edge, and the far side of the blade behind it.
struct Plate { Vec3 edge[2], back[2]; };
Plate plate_of(const Tool &t, size_t part) {
  const Vec3 h = load3(t.def.half_size);
  if (part == 0) return {{{0, -h.y, -h.z}, {0, h.y, -h.z}}, {{0, -h.y, h.z}, {0, h.y, h.z}}};
  // of scissors: in the plane in which the jaws pass each other, on the side of the other jaw
  const double s = part == 1 ? 1 : -1;
  return {{{-s * h.x, -s * h.y, h.z}, {-s * h.x, -s * h.y, -h.z}},
          {{s * h.x, -s * h.y, h.z}, {s * h.x, -s * h.y, -h.z}}};
}

class Edge {
 public:
  Edge(const Tool &t, size_t part, double strip, double dt) {
    const Plate plate = plate_of(t, part);
    const ToolPlace from = t.cuts.from[part], to = place_of(t.set->state[part]);
    const auto at = [](const ToolPlace &p, Vec3 x) { return p.position + rotate(p.rotation, x); };
    for (size_t k = 0; k < 2; ++k) {
      now_[k] = at(to, plate.edge[k]);
      const Vec3 before = at(from, plate.edge[k]), behind = at(to, plate.back[k]) - now_[k];
      const double height = norm(behind);
      forward_[k] = (-1 / height) * behind;
      velocity_[k] = (1 / dt) * (now_[k] - before);
      swept_.corner[k] = before;
      swept_.corner[3 - k] = now_[k];
      strip_.corner[k] = now_[k];
      strip_.corner[3 - k] = now_[k] - std::min(strip, height) * forward_[k];
    }
    double far = 0;
    for (const Vec3 x : now_)
      for (int k = 0; k < 3; ++k) far = std::max(far, std::fabs(x[k]));
    still_ = kRounding * far / dt;
    for (const CutShape *s : {&swept_, &strip_})
      for (const Vec3 x : s->corner) box_.add(x);
  }
  const Box &box() const { return box_; }
  bool opens(Vec3 a, Vec3 b, Vec3 velocity) const {
    if (!crosses_blade(swept_, a, b) && !crosses_blade(strip_, a, b)) return false;
    const double s = along(0.5 * (a + b));
    const Vec3 edge = velocity_[0] + s * (velocity_[1] - velocity_[0]);
    return dot(edge - velocity, forward_[0] + s * (forward_[1] - forward_[0])) > still_;
  }
  // How far forward a place lies: what the edge meets first is lowest.
  double order(Vec3 x) const {
    const double s = along(x);
    const Vec3 forward = forward_[0] + s * (forward_[1] - forward_[0]);
    return dot(forward, x - now_[0] - s * (now_[1] - now_[0]));
  }

 private:
  double along(Vec3 x) const { return closest_on_segment(x, now_[0], now_[1]); }
  Vec3 now_[2], velocity_[2], forward_[2];
  double still_;            // m/s, below which a motion is rounding
  CutShape swept_, strip_;  // corners alone
  Box box_;
};

// Cells near the edges alone, since there is a pass over all of them in each step.
std::vector<uint32_t> cells_near(const Body &b, const std::vector<Edge> &edges) {
  std::vector<uint32_t> out;
  const Box whole = box_of(b);
  if (std::none_of(edges.begin(), edges.end(), [&](const Edge &e) { return e.box().meets(whole); }))
    return out;
  // the line between the middles of two cells lies in the box of both
  Vec3 largest;
  for (size_t c = 0; c < cells_of(b); ++c) {
    const Box box = box_of(b, c);
    for (int k = 0; k < 3; ++k) largest[k] = std::max(largest[k], box.hi[k] - box.lo[k]);
  }
  for (size_t c = 0; c < cells_of(b); ++c) {
    Box box = box_of(b, c);
    box.grow(largest);
    if (std::any_of(edges.begin(), edges.end(), [&](const Edge &e) { return e.box().meets(box); }))
      out.push_back(uint32_t(c));
  }
  return out;
}

// How many faces have opened.
uint32_t split(const Tool &t, Body &b, double dt) {
  std::vector<Edge> edges;
  for (size_t part = t.first_cutting_part(); part < t.motion.parts.size(); ++part)
    edges.emplace_back(t, part, b.surface.median_edge, dt);
  const std::vector<uint32_t> near = cells_near(b, edges);
  if (near.empty()) return 0;
  const Memory &m = b.world->memory();
  std::vector<uint32_t> tets;
  std::vector<Vec3> middle, velocity;
  for (const uint32_t c : near) {
    tets.insert(tets.end(), b.tets.begin() + std::ptrdiff_t{4} * c,
                b.tets.begin() + std::ptrdiff_t{4} * (c + 1));
    middle.push_back(middle_of(b, b.p.x, c));
    velocity.push_back(middle_of(b, b.p.v, c));
  }
  const auto is_open = [&](uint32_t i, uint32_t j) {
    return !b.cut.open.empty() &&
           std::binary_search(b.cut.open.begin(), b.cut.open.end(), open_face(b.cut.cell[i], b.cut.cell[j]));
  };
  std::vector<std::pair<double, uint64_t>> met;
  each_inner_face(m, static_cast<uint32_t>(near.size()), tets.data(), [&](uint32_t i, uint32_t j) {
    for (const Edge &e : edges) {
      if (!e.opens(middle[i], middle[j], 0.5 * (velocity[i] + velocity[j])) || is_open(near[i], near[j]))
        continue;
      met.push_back({e.order(0.5 * (middle[i] + middle[j])), open_face(near[i], near[j])});
      return;
    }
  });
  if (met.empty()) return 0;
  std::sort(met.begin(), met.end());
  if (t.cuts.most > 0 && met.size() > t.cuts.most) met.resize(t.cuts.most);
  Array<uint64_t> faces{HookAllocator<uint64_t>(m)};
  for (const auto &face : met) faces.push_back(face.second);
  open_faces(b, faces);
  return static_cast<uint32_t>(met.size());
}

// ---- solids ---------------------------------------------------------------------------------------------

struct Solid {
  CutShape shape;
  Box box;
};

// On the way from one place to the next; `at`: where it is within the part.
Solid solid_of(const Tool &t, const ToolPlace &from, const ToolPlace &to) {
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
    const ToolPlace from = t.cuts.from[part], to = place_of(t.set->state[part]);
    double places = norm(rotation_vector(to.rotation * conjugate(from.rotation))) / kTurn;
    if (t.def.shape == DFM_TOOL_CAPSULE)
      places = std::max(places, norm(to.position - from.position) / (0.5 * t.def.radius));
    const int n = int(std::clamp(std::ceil(places), 1.0, double(kMostPlaces)));
    ToolPlace last = from;
    for (int k = 1; k <= n; ++k) {
      const double share = double(k) / n;
      const ToolPlace next{from.position + share * (to.position - from.position),
                           slerp(from.rotation, to.rotation, share)};
      out.push_back(solid_of(t, last, next));
      last = next;
    }
  }
  return out;
}

// How many cells have gone.
uint32_t remove(const Tool &t, Body &b) {
  const std::vector<Solid> solids = solids_of(t);
  const Box whole = box_of(b);
  if (std::none_of(solids.begin(), solids.end(), [&](const Solid &s) { return s.box.meets(whole); }))
    return 0;
  Array<uint8_t> removed(cells_of(b), 0, HookAllocator<uint8_t>(b.world->memory()));
  uint32_t n = 0;
  for (size_t c = 0; c < cells_of(b) && (t.cuts.most == 0 || n < t.cuts.most); ++c) {
    const Box box = box_of(b, c);
    Vec3 x[4];
    for (size_t k = 0; k < 4; ++k) x[k] = load3(&b.p.x[point_of(b, c, k)]);
    const auto meets = [&](const Solid &s) { return s.box.meets(box) && meets_tetrahedron(s.shape, x); };
    if (!std::any_of(solids.begin(), solids.end(), meets)) continue;
    removed[c] = 1;
    ++n;
  }
  if (n > 0) remove_cells(b, removed);
  return n;
}

void check_shape(const Tool &t, uint32_t how) {
  const char *const name = t.name.c_str();
  if (how > DFM_CUT_SPLIT)
    fail(DFM_E_ARG, "tool '%s' is to cut in the way %u; use DFM_CUT_REMOVE or DFM_CUT_SPLIT", name, how);
  if (t.def.shape == DFM_TOOL_GRASPER || t.def.shape == DFM_TOOL_MESH)
    fail(
        DFM_E_ARG,
        "tool '%s' cannot cut: a %s has no edge, and no solid by which cells could be removed; take a blade, "
        "scissors, a sphere, a capsule, a box or an ellipsoid",
        name, t.def.shape == DFM_TOOL_MESH ? "mesh" : "grasper");
  if (how == DFM_CUT_SPLIT && !has_edge(t))
    fail(DFM_E_ARG,
         "tool '%s' cannot open faces, since it has no edge; let it remove cells (DFM_CUT_REMOVE), or take a "
         "blade or scissors",
         name);
  if (t.def.shape == DFM_TOOL_BLADE && how == DFM_CUT_SPLIT && t.def.half_size[0] > t.def.half_size[1])
    fail(DFM_E_ARG,
         "tool '%s' cannot cut: the edge of a blade runs along y, and its half_size is %g m along x, the "
         "thickness, and %g m along y; exchange the two",
         name, t.def.half_size[0], t.def.half_size[1]);
}

}  // namespace

void set_cuts(Tool &t, uint32_t how, uint32_t most, std::span<Body *const> bodies) {
  World &w = *t.world;
  check_shape(t, how);
  std::vector<uint64_t> ids;
  for (const Body *const b : bodies) {
    if (b->world != &w)
      fail(DFM_E_HANDLE, "tool '%s' and body '%s', which it is to cut, are of two worlds", t.name.c_str(),
           b->name.c_str());
    check_may_cut(*b, b->model);
    ids.push_back(b->id);
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  t.cuts.from.resize(t.motion.parts.size());
  for (auto &o : w.obstacles)
    if (o->rigid == t.set) w.overlaps.place(o->id);  // what it was in without touching it
  t.cuts.how = how;
  t.cuts.most = most;
  t.cuts.bodies.swap(ids);
  wake_all(w);
  w.changed = true;
}

bool cut_by_any(const Body &b) {
  const auto &tools = b.world->tools;
  return std::any_of(tools.begin(), tools.end(), [&](auto &t) { return t->cuts_body(b); });
}

void begin_cuts(World &w) {
  for (auto &t : w.tools)
    for (size_t part = 0; part < t->cuts.from.size(); ++part)
      t->cuts.from[part] = place_of(t->set->state[part]);
}

void cut_by_tools(World &w, double dt) {
  for (size_t k = 0; k < w.tools.size(); ++k) {
    Tool &t = *w.tools[k];
    // by id, since a body without cells leaves the list; a body is cut with its pieces
    std::vector<uint64_t> ids;
    for (auto &b : w.bodies)
      if (t.cuts_body(*b)) ids.push_back(b->id);
    for (const uint64_t id : ids) {
      const auto at = std::find_if(w.bodies.begin(), w.bodies.end(), [&](auto &b) { return b->id == id; });
      if (at == w.bodies.end()) continue;
      Body &b = **at;
      const uint32_t n = t.cuts.how == DFM_CUT_SPLIT ? split(t, b, dt) : remove(t, b);
      if (n == 0) continue;
      separate_if_asked(b);
      reserve_events(w, 1);
      add_event(w, DFM_EVENT_CUT, id, t.set->obstacle[t.first_cutting_part()], n, w.time);
    }
  }
}

}  // namespace dfm
