#include "step/rigid/rigid.h"
#include "core/lists.h"
#include "step/rigid/tool_touch.h"

#include <algorithm>
#include <cmath>

#include "body/obstacle_mesh.h"
#include "dynamics/rigid/rigid_set.h"
#include "geometry/closest.h"
#include "math/turn.h"
#include "state/partner.h"
#include "state/tool.h"
#include "state/world.h"
#include "step/budget.h"
#include "step/context.h"
#include "step/pair_table.h"
#include "step/solve/solve_islands.h"
#include "step/solve/tolerance.h"

namespace dfm {
namespace {

constexpr double kDone = 1e-2;       // of what slips may be off by at rest: less changes nothing
constexpr double kDent = 5e-4;       // m, Pair::dent, of what is not thin
constexpr double kSmallTurn = 0.05;  // rad in a sub-step, up to which a series has less rounding
constexpr double kNear = 0.5;    // of the least thickness: no row with an impulse is longer, no dent deeper
constexpr double kFaster = 0.5;  // of the change by the pass before: else passes end
constexpr uint32_t kMaxPasses = 6;  // over what turning adds, until it changes no more

bool builtin(const Obstacle &o) { return o.rigid && !o.rigid->of_tool && o.rigid->host_name == "builtin"; }
bool of_tool(const Obstacle &o) { return o.rigid && o.rigid->of_tool; }
// Part 0 is the frame.
bool is_jaw(const Obstacle &o) { return of_tool(o) && o.rigid_body > 0; }

// Whether contact moves it, as far as its joints allow.
bool is_free(const Obstacle &o) { return builtin(o) && is_moved(o); }
// Does not yield, whatever touches it.
bool is_wall(const Obstacle &o) { return !is_moved(o); }

// Whether the rows of this file keep the two apart, filters aside.
bool kept_apart(const Obstacle &a, const Obstacle &b) {
  if (a.sensor || b.sensor || (a.rigid && a.rigid == b.rigid && a.rigid_body == b.rigid_body)) return false;
  if (of_tool(a) && of_tool(b)) return a.rigid != b.rigid;
  if (of_tool(a) || of_tool(b)) {
    const Obstacle &other = of_tool(a) ? b : a;
    return is_free(other) || is_wall(other);
  }
  return (is_free(a) && (is_free(b) || is_wall(b))) || (is_free(b) && is_wall(a));
}

// Planes and voxels have neither corners nor edges, so two of them have no rows.
bool without_corners(const Obstacle &o) { return o.def.shape == DFM_SHAPE_PLANE || o.grid; }

// The rotation vector nearest to `like` among those that end in the same attitude, whole turns apart: a ball
// that rolls fast turns more than once in a sub-step.
Vec3 nearest_turn(Vec3 turn, Vec3 like) {
  constexpr double kWhole = 2 * 3.14159265358979323846;
  const double angle = norm(turn), length = norm(like);
  if (!(length > 0.5 * kWhole)) return turn;
  const Vec3 axis = angle > 1e-6 ? (1 / angle) * turn : (1 / length) * like;
  return turn + kWhole * std::round((dot(axis, like) - dot(axis, turn)) / kWhole) * axis;
}

// Whether a rigid body of another host passes through something, because neither this file nor its host keeps
// the two apart. A host with a world of its own knows what is in that world.
bool passes(const Obstacle &a, const Obstacle &b) {
  if (a.sensor || b.sensor || of_tool(a) || of_tool(b) || a.rigid == b.rigid) return false;
  const auto held = [](const Obstacle &o) { return !is_wall(o) && !is_free(o) && !o.rigid->elsewhere; };
  if (!held(a) && !held(b)) return false;
  return held(a) ? is_wall(b) || is_free(b) || held(b) : is_wall(a) || is_free(a);
}

}  // namespace

void ToolTouch::Things::start() {
  slot.clear();
  corners.clear();
}

void ToolTouch::Things::add(uint32_t s) {
  const uint32_t lo = static_cast<uint32_t>(2 * slot.size());
  corners.insert(corners.end(), {lo, lo, lo + 1});
  slot.push_back(s);
}

void ToolTouch::Things::renew(std::span<const ObstacleView> views, std::span<const double> more) {
  box.resize(8 * slot.size());
  for (size_t k = 0; k < slot.size(); ++k) {
    const ObstacleView &v = views[slot[k]];
    const double r = ball_around(v) + more[slot[k]];
    store3(&box[8 * k], v.position - Vec3{r, r, r});
    store3(&box[8 * k + 4], v.position + Vec3{r, r, r});
  }
  if (tree.triangles().size() == slot.size()) tree.renew(corners, box.data());
  else tree.build(corners, box.data());
}

ToolTouch::ToolTouch(const Memory &m) : moved_(m), still_(m), islands_(m), next_(m), next_touching_(m) {
  use_memory(m, stack_, start_, tangents_, match_, points_);
  state_.use(m);
}

void ToolTouch::prepare(World &w, SceneFacts &facts) {
  pairs_.clear();
  near_.clear();
  planar_.clear();
  rows_.clear();  // of bodies that may be gone
  sides_.clear();
  sets_.clear();
  walls_.clear();
  w.pairs.tool_law.clear();
  if (w.rigid_sets.empty()) return;
  offset_ = w.offset;
  for (const auto &t : w.tools)
    if (t->has_jaws()) sets_.push_back(t->set);
  side_of_.assign(w.obstacles.size(), {kNone, 0, {}, {}});
  const auto take_part = [&](uint32_t slot) {
    const Obstacle &o = *w.obstacles[slot];
    Side &side = side_of_[slot];
    if (side.tool != kNone) return;
    if (of_tool(o) || is_free(o)) {
      side.tool = static_cast<size_t>(std::find(sets_.begin(), sets_.end(), o.rigid) - sets_.begin());
      side.part = o.rigid_body;
      if (side.tool == sets_.size()) sets_.push_back(o.rigid);
    } else {
      side.tool = 0;  // behind the sets, once their number is known
      side.part = static_cast<uint32_t>(walls_.size());
      walls_.push_back(slot);
    }
  };
  moved_.start();
  still_.start();
  for (uint32_t i = 0; i < w.obstacles.size(); ++i) {
    const Obstacle &a = *w.obstacles[i];
    if (a.def.shape != DFM_SHAPE_PLANE) (is_wall(a) ? still_ : moved_).add(i);
    for (uint32_t j = i + 1; j < w.obstacles.size(); ++j) {
      const Obstacle &b = *w.obstacles[j];
      const bool cornerless = kept_apart(a, b) && without_corners(a) && without_corners(b);
      const bool apart = kept_apart(a, b) && !cornerless;
      if (!apart && !cornerless && !passes(a, b)) continue;
      if (!partner_of(a).meets(partner_of(b), w.filters) || belong_together(w, a, b)) continue;
      Pair pair{i, j, {a.id, b.id}};
      pair.passes = !apart;
      if (!apart) {
        for (const Obstacle *const o : {&a, &b})
          if (!is_wall(*o) && (cornerless || !is_free(*o)) && (o == &a ? is_wall(b) : is_wall(a)) &&
              std::find(facts.rigid_alone.begin(), facts.rigid_alone.end(), o->name) ==
                  facts.rigid_alone.end())
            facts.rigid_alone.push_back(o->name);
      } else {
        const uint32_t nb = static_cast<uint32_t>(w.bodies.size());
        pair.law = law_of_zones(w, nb + i, 0, nb + j, 0);
        pair.frees = !of_tool(a) && !of_tool(b);
        pair.jaw = is_jaw(a) || is_jaw(b);
        pair.b_first = b_first(a, b);
        pair.thin = std::min(thickness(a), thickness(b));
        pair.dent = std::min(kDent, kNear * pair.thin);
        take_part(i);
        take_part(j);
        facts.rigid_pairs += pair.frees;
        facts.rigid_rows = true;
        w.pairs.tool_law.push_back(pair.law);
      }
      if (a.def.shape == DFM_SHAPE_PLANE || b.def.shape == DFM_SHAPE_PLANE)
        planar_.push_back(static_cast<uint32_t>(pairs_.size()));
      pairs_.push_back(pair);
    }
  }
  for (const uint32_t slot : walls_) side_of_[slot].tool = sets_.size();
  for (const Pair &pair : pairs_)
    for (const uint32_t slot : {pair.a, pair.b})
      if (ObstacleMesh *const mesh = w.obstacles[slot]->mesh.get(); mesh && !mesh->tree)
        mesh->make_tree(w.meters.obstacles.memory());
}

// The velocity of the places of a row against each other, by these velocities of their bodies.
Vec3 ToolTouch::speed(const Row &row, const std::vector<double> Moved::*of) const {
  const auto at = [&](const Side &side) {
    return velocity_at(&(sides_[side.tool].*of)[6 * size_t{side.part}], side.arm);
  };
  return at(row.a) - at(row.b);
}

bool ToolTouch::Moved::gives(const Obstacle &to) const { return responds || (to.rigid && !jaws.empty()); }

Vec3 ToolTouch::center(const Side &side) const {
  const Moved &m = sides_[side.tool];
  return m.set ? load3(m.set->state[side.part].position) : m.center[side.part];
}

void ToolTouch::add_impulses() const {
  for (const Row &row : rows_)
    for (const Side *side : {&row.a, &row.b}) {
      RigidSet *const set = sides_[side->tool].set;
      if (!set) continue;
      const Vec3 p = side == &row.a ? row.given() : -row.given();
      double *const to = &set->impulse[6 * size_t{side->part}];
      add3(to, p);
      add3(to + 3, cross(side->arm, p));
    }
}

// The mean spin of a free rigid body is not linear in its impulses, because its moments of inertia turn with
// it; the mean velocities of bodies with joints are not either, because joints hold at the end of the
// sub-step. The difference between what the host computes from the present impulses and what was assumed here
// counts in the next pass; otherwise a thin body would oscillate. Returns the largest change, m/s.
double ToolTouch::follow_spin() {
  double most = 0;
  for (Moved &m : sides_) {
    if (!m.set || m.set->of_tool || !m.touched) continue;
    bool again = false;
    if (m.set->end_state(again)) continue;  // the host reports this at the end of the sub-step
    for (uint32_t i = 0; i < m.set->defs.size(); ++i) {
      if (!(m.reach[i] > 0)) continue;
      const size_t at = 6 * size_t{i} + 3;
      if (m.jointed[m.set->group[i]]) {
        const Vec3 goes = load3(m.set->next[i].position) - load3(m.set->state[i].position);
        const Vec3 change = (1 / h_) * goes - load3(&m.now[at - 3]);
        add3(&m.now[at - 3], change);
        add3(&m.turn[at - 3], change);
        most = std::max(most, norm(change));
      }
      const Quat turned = load_quat(m.set->next[i].rotation) * conjugate(load_quat(m.set->state[i].rotation));
      const Vec3 taken = load3(&m.now[at]);
      const Vec3 change = (1 / h_) * nearest_turn(rotation_vector(turned), h_ * taken) - taken;
      add3(&m.now[at], change);
      add3(&m.turn[at], change);
      most = std::max(most, m.reach[i] * norm(change));
      if (m.jointed[m.set->group[i]]) off_ = std::max(off_, h_ * most);
    }
  }
  return most;
}

Vec3 ToolTouch::spin(const Side &side) const {
  return load3(&sides_[side.tool].now[6 * size_t{side.part} + 3]);
}

// (exp(h w) - 1) r / h less its first term. Without it, what a turning tool holds would creep outwards.
Vec3 ToolTouch::bend(Vec3 spin, Vec3 arm) const {
  if (h_ * h_ * norm2(spin) > kSmallTurn * kSmallTurn)
    return (1 / h_) * (rotate(turned(Quat{}, h_ * spin), arm) - arm) - cross(spin, arm);
  const Vec3 second = cross(spin, cross(spin, arm)), third = cross(spin, second), fourth = cross(spin, third);
  return (h_ / 2) * second + (h_ * h_ / 6) * third + (h_ * h_ * h_ / 24) * fourth +
         (h_ * h_ * h_ * h_ / 120) * cross(spin, fourth);
}

// For the material at the place. On a rounded corner the place moves with the normal, which turns with the
// other side: a rolling ball has no bend, and a rod that turns with the jaws that hold it has that of a
// corner.
Vec3 ToolTouch::bend(const Side &side, const Side &other) const {
  const Moved &m = sides_[side.tool];
  if (m.set && m.responds && !m.jaws.empty()) {
    const Side frame{side.tool, 0, {}, {}};
    return bend(spin(frame), side.bone + center(side) - center(frame));
  }
  const Vec3 own = spin(side), round = side.arm - side.bone;
  Vec3 out = bend(own, side.bone);
  if (norm2(round) == 0) return out;
  const Vec3 first = cross(spin(other), round);
  return out + cross(own, (0.5 * h_) * first + (h_ * h_ / 6) * cross(spin(other), first));
}

// Derivative of bend(spin, arm) with respect to the spin, along `by`, to second order.
Vec3 ToolTouch::bend_slope(Vec3 spin, Vec3 arm, Vec3 by) const {
  const Vec3 first = cross(spin, by),
             goes = arm + h_ * (cross(spin, arm) + (0.5 * h_) * cross(spin, cross(spin, arm)));
  return cross(by + (0.5 * h_) * first + (h_ * h_ / 6) * cross(spin, first), goes) - cross(by, arm);
}

// Updates what turning adds to the speeds of a row, from the present spins. Returns the change, m/s.
double ToolTouch::follow_arc(Row &row) const {
  const Vec3 now = bend(row.a, row.b) + belt(row.a) - bend(row.b, row.a) - belt(row.b);
  const double changed = norm(now - row.bend);
  row.bend = now;
  if (row.pair->frees)
    row.lift = dot(row.normal, bend(spin(row.a), row.a.bone) - bend(spin(row.b), row.b.bone));
  return changed;
}

Vec3 ToolTouch::belt(const Side &side) const {
  const Moved &m = sides_[side.tool];
  return m.set ? Vec3{} : m.belt[side.part];
}

// m/s, of the points of it that are within `reach` around a place.
double ToolTouch::fastest(const Side &side, Vec3 around, double reach) const {
  const double *const v = &sides_[side.tool].free[6 * size_t{side.part}];
  return norm(load3(v)) + norm(load3(v + 3)) * (norm(around - center(side)) + reach);
}

void ToolTouch::add_row(const Pair &pair, Name name, Side a, Side b, const Place &place, Vec3 normal,
                        double gap, double reach) {
  if (!(gap - offset_ < reach)) return;
  a.arm = place.at - center(a);
  b.arm = place.at - center(b);
  a.bone = pair.jaw ? a.arm : place.bone_a - center(a);
  b.bone = pair.jaw ? b.arm : place.bone_b - center(b);
  Row row{};
  row.pair = &pair;
  row.a = a;
  row.b = b;
  row.at = place.at;
  row.gap = gap;
  row.far = gap > kNear * pair.thin;
  row.normal = normal;
  row.key = key_of(pair.id, name);
  if (pair.jaw) row.rate = (offset_ - gap) / h_;
  else if (gap >= offset_) row.rate = -(gap - offset_) / h_;
  else if (gap < 0.5 * offset_) row.rate = std::min(0.5 * offset_ - gap, kOpens * offset_) / planned_;
  row.tangent[0] = any_tangent(normal);
  row.tangent[1] = cross(normal, row.tangent[0]);
  rows_.push_back(row);
}

// Finds the features of each shape that are this near to the box of the other. Returns false if there are
// none.
bool ToolTouch::cull_facing(ToolShape &a, ToolShape &b, double far, bool flat) {
  if (a.endless() || b.endless()) {
    const ToolShape &plane = a.endless() ? a : b;
    ToolShape &body = a.endless() ? b : a;
    ObstaclePoint o;
    if (!plane.closest(body.position(), HUGE_VAL, o) || o.distance - body.reach() > far) return false;
    body.select_below(o.normal, dot(o.normal, body.position()) - o.distance + far, flat);
    return true;
  }
  if (norm(a.position() - b.position()) - a.reach() - b.reach() > far) return false;
  const Vec3 wide = {far, far, far};
  Extent of_a = a.bounds(), of_b = b.bounds();
  if (!of_a.meets(of_b, far)) return false;
  of_a.grow(wide);
  of_b.grow(wide);
  a.look_at(of_b, flat);
  b.look_at(of_a, flat);
  return true;
}

// Adds rows of the corners of each against the other, and of edges that cross. Returns m, the depth of the
// deepest of them; 0: none is inside.
double ToolTouch::add_rows(Pair &pair, ToolShape &a, ToolShape &b, Side at_a, Side at_b) {
  const ToolShape &near_a = a.endless() ? b : a, &near_b = b.endless() ? a : b;
  const double speeds =
      fastest(at_a, near_a.position(), near_a.reach()) + fastest(at_b, near_b.position(), near_b.reach());
  const double reach = pair.reach = kReach * h_ * speeds + offset_;
  const auto turns = [&](const Side &side) {
    return h_ * norm(load3(&sides_[side.tool].free[6 * size_t{side.part} + 3]));
  };
  pair.turn = kAlong + kReach * (turns(at_a) + turns(at_b));
  const double far = reach + offset_;
  if (!cull_facing(a, b, far, pair.jaw)) return 0;
  for (const Side *side : {&at_a, &at_b}) take_response(*side);
  double deepest = 0;
  ObstaclePoint o;
  // A corner meets an edge or a corner of the other only on its leading side. Other near features are not in
  // the way, such as the vertices of a floor beside the lower edge of a box that slides over it.
  bool face = true;
  const auto add_corners = [&](const ToolShape &own, const ToolShape &other, bool of_a) {
    for (const ToolShape::Corner &c : own.corners()) {
      if (!other.closest(c.at, far + own.round(), o, &face) || !(face || own.may_meet(c, -o.normal)))
        continue;
      const double gap = o.distance - own.round();
      deepest = std::max(deepest, -gap);
      const Vec3 met = o.point - other.round() * o.normal;
      add_row(pair, {of_a ? kCornerOfA : kCornerOfB, c.number, 0}, at_a, at_b,
              {o.point + 0.5 * gap * o.normal, of_a ? c.at : met, of_a ? met : c.at},
              of_a ? o.normal : -o.normal, gap, reach);
    }
  };
  add_corners(a, b, true);
  add_corners(b, a, false);
  const double round = a.round() + b.round();
  for (const ToolShape::Edge &p : a.edges())
    for (const ToolShape::Edge &q : b.edges()) {
      if (!segments_within(p.from, p.to, q.from, q.to, far + round)) continue;
      const SegmentPoints near_by = closest_segments(p.from, p.to, q.from, q.to);
      if (!(near_by.s > 0 && near_by.s < 1 && near_by.t > 0 && near_by.t < 1)) continue;
      const Vec3 on_a = p.from + near_by.s * (p.to - p.from), on_b = q.from + near_by.t * (q.to - q.from);
      Vec3 n;
      if (!between(p, q, on_a - on_b, pair.turn, n)) continue;
      const double gap = dot(n, on_a - on_b) - round;
      if (round == 0 && gap < -pair.dent) continue;  // of round ones the side is known until the axes pass
      deepest = std::max(deepest, -gap);
      add_row(pair, {kEdges, p.number, q.number}, at_a, at_b,
              {on_b + (b.round() + 0.5 * gap) * n, on_a, on_b}, n, gap, reach);
    }
  return deepest;
}

bool ToolTouch::is_of_set(const Obstacle &o) const { return side_of_[o.slot].tool < sets_.size(); }

// Adds the pairs of which the balls around the two meet that are larger by reach_.
void ToolTouch::find_near(const Views &views) {
  for (Things *const things : {&moved_, &still_}) things->renew(views.obstacle_views, reach_);
  const auto add = [&](uint32_t a, uint32_t b) {
    if (a > b) std::swap(a, b);
    const auto at = std::lower_bound(
        pairs_.begin(), pairs_.end(), std::pair(a, b),
        [](const Pair &p, const std::pair<uint32_t, uint32_t> &of) { return std::pair(p.a, p.b) < of; });
    if (at != pairs_.end() && at->a == a && at->b == b)
      near_.push_back(static_cast<uint32_t>(at - pairs_.begin()));
  };
  near_pairs(moved_.tree, still_.tree, 0, stack_,
             [&](uint32_t p, uint32_t q, double) { add(moved_.at(p), still_.at(q)); });
  near_self_pairs(moved_.tree, 0, stack_,
                  [&](uint32_t p, uint32_t q, double) { add(moved_.at(p), moved_.at(q)); });
  sort_unique(near_);
}

// Calls f(pair, the two shapes, their sides) for all pairs that may touch and of which one yields.
void ToolTouch::each_pair(const Entities &entities, const Views &views, const Visit &f) {
  for (const uint32_t k : near_) {
    Pair &pair = pairs_[k];
    const Obstacle &a = *entities.obstacles[pair.a], &b = *entities.obstacles[pair.b];
    const ObstacleView &va = views.obstacle_views[a.slot], &vb = views.obstacle_views[b.slot];
    if (pair.passes || !ToolShape::takes_part(va) || !ToolShape::takes_part(vb)) continue;
    const Side &at_a = side_of_[pair.a], &at_b = side_of_[pair.b];
    if (!sides_[at_a.tool].gives(b) && !sides_[at_b.tool].gives(a)) continue;
    shapes_[0].take(va, a.mesh.get());
    shapes_[1].take(vb, b.mesh.get());
    f(pair, shapes_[0], shapes_[1], at_a, at_b);
  }
}

// The terms of turning beyond the first order and spins depend on the solution.
bool ToolTouch::follow(World &w, StepContext &step) {
  if (rows_.empty()) return false;
  double changed = 0;
  off_ = h_ * left_;
  for (Row &row : rows_) {
    const double lift = row.lift;
    changed = std::max(changed, follow_arc(row));
    if (row.impulse > 0) off_ = std::max(off_, h_ * std::fabs(row.lift - lift));
  }
  changed = std::max(changed, follow_spin());
  charge(w, step, 0);
  if (!(changed > kDone * tangent_at_rest(w, w, h_)) || !(changed < kFaster * changed_) ||
      passes_ == kMaxPasses || is_used_up(step))
    return false;
  changed_ = changed;
  ++passes_;
  return true;
}

// Takes velocities and responses of the sets that take part, and the motion of everything else.
void ToolTouch::take_sets(const Entities &entities, const Views &views) {
  sides_.resize(sets_.size() + !walls_.empty());
  for (size_t k = 0; k < sides_.size(); ++k) {
    Moved &m = sides_[k];
    m.set = k < sets_.size() ? sets_[k] : nullptr;
    const size_t n = m.set ? m.set->defs.size() : walls_.size();
    m.free.assign(6 * n, 0.0);
    m.turn.assign(6 * n, 0.0);
    m.reach.assign(n, 0.0);
    m.touched = m.responds = m.drives = false;
    m.jaws.clear();
    m.response.clear();
    m.jointed.clear();
    if (!m.set) {
      m.center.resize(n);
      m.belt.resize(n);
      for (size_t i = 0; i < n; ++i) {
        const ObstacleView &v = views.obstacle_views[walls_[i]];
        m.center[i] = v.position;
        m.belt[i] = v.belt;
        store3(&m.free[6 * i], v.velocity);
        store3(&m.free[6 * i + 3], v.spin);
      }
      m.now = m.free;
      continue;
    }
    RigidSet &set = *m.set;
    std::copy(set.velocity.begin(), set.velocity.end(), m.free.begin());
    m.first.assign(set.ngroup, kNone);
    m.wide.assign(set.ngroup, 0);
    list_joints(m);
    bool later = false;
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t g = set.group[i];
      if (g == DFM_RIGID_STILL || m.wide[g] > 0) continue;
      m.wide[g] = 6 * size_t{views.rigid_groups[set.first_group + g]};
      if (m.jointed[g]) later = true;  // where something is near
      else request_response(m, g);
    }
    m.responds = later || std::any_of(m.response.begin(), m.response.end(), [](double x) { return x != 0; });
    for (const auto &t : entities.tools)
      if (t->set == m.set && t->has_jaws()) list_jaws(m);
    straighten(m);
    m.now = m.free;
  }
}

// A corner moves along an arc. The rounds of the solve over it converge by a factor of about h w each; from
// about a radian on they do not, the corner ends inside a floor, and energy is created. False: something that
// touches turns so far that the sub-step must be repeated, shorter. The arc leaves its tangent by at most (h
// w)^2 r / 2: what stays farther away than that does not touch. Where places are off by what the passes have
// left, the sub-step goes on in its shortest pieces, which then grow again.
bool ToolTouch::follows_arcs(const Entities &entities, const Derived &derived, const Awake &awake,
                             SubStepTimes &times, Budget &budget) const {
  double turn = 0, arrives = 1;
  for (const Row &row : rows_) {
    if (row.pair->jaw) continue;
    if (row.far && row.impulse > 0) {
      const double closes = -h_ * dot(row.normal, speed(row, &Moved::free)), gap = offset_ - h_ * row.rate;
      arrives = std::min(arrives, closes > gap ? kAims * gap / closes : 0.5);
    }
    double most = 0, leaves = 0;
    for (const Side *side : {&row.a, &row.b}) {
      const double r = norm(side->bone), way = h_ * norm(cross(spin(*side), side->bone));
      if (!(way > kArc * r)) continue;
      most = std::max(most, way / r);
      leaves += 0.5 * way * way / r;
    }
    const double room = std::max(0.0, -h_ * row.rate);
    const double closes = std::min(0.0, h_ * dot(row.normal, speed(row)));
    if (row.impulse > 0 || room + closes < leaves) turn = std::max(turn, most);
  }
  if (off_ > kOff * offset_) arrives = std::min(arrives, kMinRepeated * times.length.planned / times.h);
  if ((!(turn > 0) && arrives == 1) || !may_shorten(times) || !may_repeat(entities, derived, awake, budget))
    return true;
  times.length.repeat_grown(turn > 0 ? std::min(arrives, kAims * kArc / turn) : arrives);
  return false;
}

// Rows without a response take no part in the solve, and one without a solution ends at its budget: both go
// on closing. Faces of jaws and motors yield by intent, and what nothing drives yields in the end.
uint32_t ToolTouch::jammed_row(const Derived &derived) {
  driven_.assign(start_speeds_.size(), 0);
  const auto is_driven = [&](const Side &side) {
    const Moved &m = sides_[side.tool];
    const double *const v = &m.free[6 * size_t{side.part}];
    return !m.responds && std::any_of(v, v + 6, [](double x) { return x != 0; });
  };
  for (const Row &row : rows_)
    if (const uint32_t island = island_of(row); island != kNone && (is_driven(row.a) || is_driven(row.b)))
      driven_[island] = 1;
  const double slow = normal_at_rest(derived, h_);
  double deepest = offset_;
  uint32_t worst = kNone;
  for (uint32_t i = 0; i < rows_.size(); ++i) {
    const Row &row = rows_[i];
    const uint32_t island = island_of(row);
    const double closes = -(dot(row.normal, speed(row)) + row.lift), deep = h_ * closes - row.gap;
    if (island == kNone || !driven_[island] || row.pair->jaw || row.soft > 0) continue;
    if (!(closes > slow && deep > deepest)) continue;
    deepest = deep;
    worst = i;
  }
  return worst;
}

bool ToolTouch::begin(const WorldMemory &memory, const WorldState &state, const Entities &entities,
                      const Derived &derived, const Awake &awake, const Views &views, SubStepTimes &times,
                      Budget &budget) {
  rows_.clear();
  off_ = left_ = 0;
  offset_ = derived.offset;
  if (sets_.empty() && pairs_.empty()) return true;
  h_ = times.h;
  planned_ = times.length.planned;
  strong_ = 1;
  take_sets(entities, views);
  for (const uint32_t k : near_) pairs_[k].reach = pairs_[k].turn = 0;
  near_ = planar_;
  reach_.assign(entities.obstacles.size(), offset_);
  for (size_t i = 0; i < reach_.size(); ++i)
    if (const ObstacleView &v = views.obstacle_views[i]; side_of_[i].tool != kNone)
      reach_[i] += kReach * h_ * fastest(side_of_[i], v.position, ball_around(v));
  find_near(views);
  const auto add = [&](Pair &pair, ToolShape &a, ToolShape &b, Side at_a, Side at_b) {
    const double deep = add_rows(pair, a, b, at_a, at_b);
    if (!pair.jaw && inside(a, b, deep)) warn_deep(memory, state, entities, pair, deep);
  };
  each_pair(entities, views, std::ref(add));
  if (rows_.empty()) return true;
  if (!follows_arcs(entities, derived, awake, times, budget)) return false;
  take_last(state, derived, views);
  for (const Moved &m : sides_)
    if (m.set) m.set->velocity.assign(m.now.begin(), m.now.end());
  return true;
}

void ToolTouch::correct() {
  for (Moved &m : sides_) {
    if (!m.set) continue;
    m.free.assign(m.set->velocity.begin(), m.set->velocity.end());
    straighten(m);
    if (m.drives) request_again(m);
  }
}

}  // namespace dfm
