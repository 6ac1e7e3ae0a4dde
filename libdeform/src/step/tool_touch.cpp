#include "step/tool_touch.h"

#include <algorithm>
#include <cmath>

#include "friction/limit.h"
#include "friction/pair_rules.h"
#include "geometry/closest.h"
#include "math/turn.h"
#include "state/world.h"
#include "step/context.h"

namespace dfm {
namespace {

constexpr uint32_t kMostSweeps = 500;
constexpr double kDone = 1e-13;     // of the largest speed that a row asks to change
constexpr double kSame = 1e-9;      // of it: soft bodies need not be asked again
constexpr double kOpens = 0.1;      // of d_c in a sub-step, where two tools are in each other
constexpr double kJaw = 1e4;        // N/m, of a jaw at its tip
constexpr double kFace = 1e5;       // N/m, of a place on the face of a jaw
constexpr double kDent = 5e-4;      // m, into that face: deeper it is not a place of contact
constexpr double kCross = 1e-6;     // sine between edges that have a normal
constexpr uint32_t kMostBends = 4;  // solves with what turning adds, until it changes no more

// Those of a host that is asked for velocities and impulses alone.
bool plain(const RigidSet &set) { return set.of_tool || (set.host_name == "builtin" && set.njoint == 0); }

PairSide side_of(const Obstacle &o) { return {o.name, o.zone.group, o.zone.material}; }

// The limit of the pair's law over the normal force, at 1 N and without slip.
double coefficient(const World &w, const Obstacle &a, const Obstacle &b) {
  if (const FrictionRule *const rule = best_rule(w.friction, side_of(a), side_of(b)))
    return limit_of(*w.laws[rule->law], 1);
  return w.selection.wants(kFriction) ? std::sqrt(a.zone.friction * b.zone.friction) : 0;
}

Quat rotation_of(const dfm_rigid_state &s) {
  return {s.rotation[0], s.rotation[1], s.rotation[2], s.rotation[3]};
}
// The normal of two edges, from q to p, where both are left along it. On the wrong side of each other they
// keep it: it is that of the two directions.
bool between(const ToolShape::Edge &p, const ToolShape::Edge &q, Vec3 apart, Vec3 &n) {
  n = cross(p.to - p.from, q.to - q.from);
  const double sine = norm(n), d = norm(apart);
  if (p.faces == 0 || q.faces == 0 || !(sine > kCross * norm(p.to - p.from) * norm(q.to - q.from))) {
    if (!(d > 0)) return false;
    n = (1 / d) * apart;
    return q.leaves(n) && p.leaves(-n);
  }
  n = (1 / sine) * n;
  if (q.leaves(n) && p.leaves(-n)) return true;
  n = -n;
  return q.leaves(n) && p.leaves(-n);
}

void add(Vec3 p, double *to) { store3(to, load3(to) + p); }

}  // namespace

void ToolTouch::prepare(const World &w) {
  pairs_.clear();
  if (w.tools.empty()) return;
  for (uint32_t i = 0; i < w.obstacles.size(); ++i)
    for (uint32_t j = i + 1; j < w.obstacles.size(); ++j) {
      const Obstacle &a = *w.obstacles[i], &b = *w.obstacles[j];
      if (!a.rigid || !b.rigid || a.rigid == b.rigid || !(a.rigid->of_tool || b.rigid->of_tool) || a.sensor ||
          b.sensor || !plain(*a.rigid) || !plain(*b.rigid))
        continue;
      bool touch = (a.def.category & b.def.collides_with) != 0 && (b.def.category & a.def.collides_with) != 0;
      if (const FilterRule *const rule = best_rule(w.filters, side_of(a), side_of(b))) touch = rule->collide;
      // The spin of a free rigid body is that of a midpoint rule: what sticks to it would turn it to and fro.
      const bool tools = a.rigid->of_tool && b.rigid->of_tool;
      if (touch) pairs_.push_back({i, j, tools ? coefficient(w, a, b) : 0, tools});
    }
}

Vec3 ToolTouch::speed(const Row &row) const {
  const auto at = [&](const Side &side) {
    const double *const v = &sides_[side.tool].base[6 * size_t{side.part}];
    const double *const d = &sides_[side.tool].change[6 * size_t{side.part}];
    return load3(v) + load3(d) + cross(load3(v + 3) + load3(d + 3), side.arm);
  };
  return at(row.a) - at(row.b);
}

void ToolTouch::push(const Side &side, Vec3 impulse, Vec3 moment, std::vector<double> Moved::*to,
                     bool turns_jaws) {
  Moved &m = sides_[side.tool];
  std::vector<double> &v = m.*to;
  if (turns_jaws)
    for (Moved::Jaw &jaw : m.jaws) {
      if (jaw.part != side.part) continue;
      const double turns = dot(jaw.lever, impulse) + dot(jaw.axis, moment);
      jaw.moment += turns;
      add(jaw.give * turns * jaw.lever, &v[6 * size_t{side.part}]);
      add(jaw.give * turns * jaw.axis, &v[6 * size_t{side.part} + 3]);
    }
  if (!m.responds) return;
  const size_t width = v.size();
  const double p[6] = {impulse.x, impulse.y, impulse.z, moment.x, moment.y, moment.z};
  for (size_t i = 0; i < width; ++i)
    for (size_t k = 0; k < 6; ++k) v[i] += m.response[i * width + 6 * size_t{side.part} + k] * p[k];
}

void ToolTouch::push(const Row &row, Vec3 p) {
  push(row.a, p, cross(row.a.arm, p), &Moved::change, row.tools);
  push(row.b, -p, -cross(row.b.arm, p), &Moved::change, row.tools);
}

// How the two part by this impulse, where nothing has been pushed yet.
Vec3 ToolTouch::answer_to(const Row &row, Vec3 impulse) {
  push(row, impulse);
  std::vector<double> &va = sides_[row.a.tool].change, &vb = sides_[row.b.tool].change;
  const auto moved = [](const Side &s, const std::vector<double> &v) {
    return load3(&v[6 * size_t{s.part}]) + cross(load3(&v[6 * size_t{s.part} + 3]), s.arm);
  };
  const Vec3 out = moved(row.a, va) - moved(row.b, vb);
  std::fill(va.begin(), va.end(), 0.0);
  std::fill(vb.begin(), vb.end(), 0.0);
  for (const Side *side : {&row.a, &row.b})
    for (Moved::Jaw &jaw : sides_[side->tool].jaws) jaw.moment = 0;
  return out;
}

Vec3 ToolTouch::center(const Side &side) const {
  return load3(sides_[side.tool].set->state[side.part].position);
}

// The hinge is the origin of part 0, about its y.
void ToolTouch::list_jaws(Moved &m) const {
  const dfm_rigid_state &frame = m.set->state[0];
  const Vec3 axis = rotate(rotation_of(frame), {0, 1, 0});
  for (uint32_t i = 1; i < m.set->defs.size(); ++i) {
    const Vec3 arm = load3(m.set->state[i].position) - load3(frame.position);
    const double length = 2 * m.set->defs[i].half_size[2];
    m.jaws.push_back({i, axis, cross(axis, arm), 1 / (h_ * h_ * kJaw * length * length), 0});
  }
}

// A jaw that has been turned goes back to where it is told by a large angle, and what holds it takes that
// back to first order. The way along the arc beyond it, h w x (w x r) / 2, would stay as creep.
void ToolTouch::straighten(Moved &m) const {
  const dfm_rigid_state &frame = m.set->state[0];
  for (const Moved::Jaw &jaw : m.jaws) {
    double *const v = &m.free[6 * size_t{jaw.part}];
    const Vec3 spin = load3(&m.free[3]), arm = load3(m.set->state[jaw.part].position) - load3(frame.position);
    const double rate = dot(jaw.axis, load3(v + 3) - spin);
    store3(v, load3(&m.free[0]) + cross(spin, arm) + rate * jaw.lever);
    store3(v + 3, spin + rate * jaw.axis);
  }
}

bool ToolTouch::soft(const Side &a, const Side &b) const {
  const auto is_jaw = [&](const Side &s) { return s.part > 0 && !sides_[s.tool].jaws.empty(); };
  return is_jaw(a) || is_jaw(b);
}

// (exp(h w) - 1) r / h less its first term, to third order: what is held by a tool that turns would creep
// outwards by it.
Vec3 ToolTouch::bend(const Side &side) const {
  const Moved &m = sides_[side.tool];
  const size_t at = 6 * size_t{side.part} + 3;
  const Vec3 spin = load3(&m.base[at]) + load3(&m.change[at]);
  const Vec3 second = cross(spin, cross(spin, side.arm));
  return (0.5 * h_) * second + (h_ * h_ / 6) * cross(spin, second);
}

double ToolTouch::fastest(const ToolShape &shape, const Side &side) const {
  const double *const v = &sides_[side.tool].free[6 * size_t{side.part}];
  const double arm = norm(shape.position() - center(side)) + shape.reach();
  return norm(load3(v)) + norm(load3(v + 3)) * arm;
}

void ToolTouch::add_row(const Pair &pair, Side a, Side b, Vec3 at, Vec3 normal, double gap, double reach) {
  if (!(gap - offset_ < reach)) return;
  a.arm = at - center(a);
  b.arm = at - center(b);
  Row row{};
  row.a = a;
  row.b = b;
  row.normal = normal;
  row.mu = pair.mu;
  row.tools = pair.tools;
  if (pair.tools && soft(a, b)) {
    row.soft = 1 / (h_ * h_ * kFace);
    row.rate = (offset_ - gap) / h_;
  } else if (gap >= offset_) row.rate = -(gap - offset_) / h_;
  else if (gap < 0.5 * offset_) row.rate = std::min(0.5 * offset_ - gap, kOpens * offset_) / h_;
  const double w = dot(normal, answer_to(row, normal));
  if (!(w > 0)) return;  // neither gives way
  row.inverse = 1 / (w + row.soft);
  if (row.mu > 0) {
    row.tangent[0] = any_tangent(normal);
    row.tangent[1] = cross(normal, row.tangent[0]);
    const Vec3 first = answer_to(row, row.tangent[0]), second = answer_to(row, row.tangent[1]);
    const double p = dot(row.tangent[0], first), q = dot(row.tangent[1], second),
                 both = dot(row.tangent[0], second);
    const double most = 0.5 * (p + q) + std::sqrt(0.25 * (p - q) * (p - q) + both * both);
    if (most > 0) row.inverse_t = 1 / most;
    else row.mu = 0;
  }
  rows_.push_back(row);
}

// Corners of each against the other, and edges that cross.
void ToolTouch::add_rows(const Pair &pair, ToolShape &a, ToolShape &b, Side at_a, Side at_b) {
  const double reach = 2 * h_ * (fastest(a, at_a) + fastest(b, at_b)) + offset_;
  const double far = reach + offset_;
  if (norm(a.position() - b.position()) - a.reach() - b.reach() > far) return;
  const Vec3 wide = {far, far, far};
  const ToolBox of_a = a.bounds(), of_b = b.bounds();
  const ToolBox near = {of_b.lo - wide, of_b.hi + wide};
  if (!near.holds(of_a.lo, of_a.hi)) return;
  a.look_at(near);
  b.look_at({of_a.lo - wide, of_a.hi + wide});
  ObstaclePoint o;
  for (const Vec3 corner : a.corners()) {
    if (!b.closest(corner, far + a.round(), o)) continue;
    const double gap = o.distance - a.round();
    add_row(pair, at_a, at_b, o.point + 0.5 * gap * o.normal, o.normal, gap, reach);
  }
  for (const Vec3 corner : b.corners()) {
    if (!a.closest(corner, far + b.round(), o)) continue;
    const double gap = o.distance - b.round();
    add_row(pair, at_a, at_b, o.point + 0.5 * gap * o.normal, -o.normal, gap, reach);
  }
  const double round = a.round() + b.round(),
               deep = pair.tools && soft(at_a, at_b) ? std::max(far, kDent) : far;
  for (const ToolShape::Edge &p : a.edges())
    for (const ToolShape::Edge &q : b.edges()) {
      if (!segments_within(p.from, p.to, q.from, q.to, far + round)) continue;
      const SegmentPoints near_by = closest_segments(p.from, p.to, q.from, q.to);
      if (!(near_by.s > 0 && near_by.s < 1 && near_by.t > 0 && near_by.t < 1)) continue;
      const Vec3 on_a = p.from + near_by.s * (p.to - p.from), on_b = q.from + near_by.t * (q.to - q.from);
      Vec3 n;
      if (!between(p, q, on_a - on_b, n)) continue;
      const double gap = dot(n, on_a - on_b) - round;
      if (gap < -deep) continue;
      add_row(pair, at_a, at_b, on_b + (b.round() + 0.5 * gap) * n, n, gap, reach);
    }
}

void ToolTouch::find(const World &w, const StepContext &step) {
  const auto side = [&](const Obstacle &o) {
    Side out{};
    while (sides_[out.tool].set != o.rigid) ++out.tool;
    out.part = o.rigid_body;
    return out;
  };
  for (const Pair &pair : pairs_) {
    const Obstacle &a = *w.obstacles[pair.a], &b = *w.obstacles[pair.b];
    const ObstacleView &va = step.obstacle_views[a.slot], &vb = step.obstacle_views[b.slot];
    if (!ToolShape::takes_part(va) || !ToolShape::takes_part(vb)) continue;
    const Side at_a = side(a), at_b = side(b);
    if (!sides_[at_a.tool].gives() && !sides_[at_b.tool].gives()) continue;
    ToolShape shape_a(va), shape_b(vb);
    add_rows(pair, shape_a, shape_b, at_a, at_b);
  }
}

// Gauss-Seidel: the rows are few. Largest change, m/s.
double ToolTouch::sweep() {
  double most = 0;
  for (Row &row : rows_) {
    const Vec3 u = speed(row);
    const double next =
        std::max(0.0, row.impulse + row.inverse * (row.rate - dot(row.normal, u) - row.soft * row.impulse));
    const double more = next - row.impulse;
    if (more != 0) {
      row.impulse = next;
      push(row, more * row.normal);
      most = std::max(most, std::fabs(more) / row.inverse);
    }
    if (!(row.mu > 0) || (next == 0 && norm2(row.along) == 0)) continue;
    const Vec3 slip = (more != 0 ? speed(row) : u) + row.bend;
    Vec3 along;
    for (const Vec3 t : row.tangent) along += (dot(t, row.along) - row.inverse_t * dot(t, slip)) * t;
    const double size = norm(along), limit = row.mu * next;
    if (size > limit) along = (limit / size) * along;
    const Vec3 change = along - row.along;
    if (norm2(change) == 0) continue;
    row.along = along;
    push(row, change);
    most = std::max(most, norm(change) / row.inverse_t);
  }
  return most;
}

void ToolTouch::solve() {
  double scale = 0;
  for (const Row &row : rows_)
    scale = std::max(
        scale, std::fabs(row.rate) + std::fabs(dot(row.normal, speed(row))) + row.impulse / row.inverse);
  for (uint32_t round = 0; round < kMostBends; ++round) {
    double changed = 0;
    for (Row &row : rows_) {
      if (!(row.mu > 0)) continue;
      const Vec3 now = bend(row.a) - bend(row.b);
      changed = std::max(changed, norm(now - row.bend));
      row.bend = now;
    }
    if (round > 0 && !(changed > kDone * scale)) return;
    for (uint32_t k = 0; k < kMostSweeps; ++k)
      if (!(sweep() > kDone * scale)) break;
  }
}

void ToolTouch::begin(World &w, StepContext &step) {
  rows_.clear();
  size_t n = 0;
  if (!pairs_.empty())
    for (auto &set : w.rigid_sets) n += plain(*set);
  sides_.resize(n > 1 ? n : 0);
  if (sides_.empty()) return;
  h_ = step.h;
  offset_ = w.offset;
  n = 0;
  for (auto &set : w.rigid_sets) {
    if (!plain(*set)) continue;
    Moved &m = sides_[n++];
    const size_t width = set->velocity.size();
    m.set = set.get();
    m.free.assign(set->velocity.begin(), set->velocity.end());
    m.base = m.free;
    m.change.assign(width, 0.0);
    m.response.assign(width * width, 0.0);
    for (uint32_t g = 0; g < set->ngroup; ++g) {
      const uint32_t bodies = step.rigid_groups[set->first_group + g], wide = 6 * bodies;
      m.block.assign(size_t{wide} * wide, 0.0);
      if (!set->respond(g, bodies, m.block.data())) continue;
      for (uint32_t i = 0; i < set->defs.size(); ++i)
        for (uint32_t j = 0; j < set->defs.size(); ++j) {
          if (set->group[i] != g || set->group[j] != g) continue;
          for (size_t r = 0; r < 6; ++r)
            for (size_t c = 0; c < 6; ++c)
              m.response[(6 * i + r) * width + 6 * j + c] =
                  m.block[(6 * set->place[i] + r) * wide + 6 * set->place[j] + c];
        }
    }
  }
  for (Moved &m : sides_) {
    m.responds = std::any_of(m.response.begin(), m.response.end(), [](double x) { return x != 0; });
    m.jaws.clear();
    for (const auto &t : w.tools)
      if (t->set == m.set && t->has_jaws()) list_jaws(m);
    straighten(m);
    m.base = m.free;
  }
  find(w, step);
  if (rows_.empty()) {
    sides_.clear();
    return;
  }
  solve();
  for (Row &row : rows_) row.before = row.given();
  for (Moved &m : sides_)
    for (size_t i = 0; i < m.free.size(); ++i) m.set->velocity[i] = m.free[i] + m.change[i];
}

void ToolTouch::correct() {
  for (Moved &m : sides_) {
    m.free.assign(m.set->velocity.begin(), m.set->velocity.end());
    straighten(m);
    for (size_t i = 0; i < m.free.size(); ++i) m.set->velocity[i] = m.free[i] + m.change[i];
  }
  for (Row &row : rows_) row.before = row.given();
}

bool ToolTouch::answer() {
  if (rows_.empty()) return false;
  for (size_t k = 0; k < sides_.size(); ++k) {
    Moved &m = sides_[k];
    m.base = m.free;
    for (uint32_t i = 0; i < m.set->defs.size(); ++i) {
      const double *const p = &m.set->impulse[6 * size_t{i}];
      push({k, i, {}}, load3(p), load3(p + 3), &Moved::base, false);
    }
  }
  solve();
  double scale = 0, most = 0;
  for (const Row &row : rows_) {
    const Vec3 p = row.given();
    scale = std::max(scale, std::fabs(row.rate) + norm(p) / row.inverse);
    most = std::max(most, norm(p - row.before) / row.inverse);
    for (const Side *side : {&row.a, &row.b}) {
      const Vec3 q = side == &row.a ? p : -p;
      double *const to = &sides_[side->tool].set->impulse[6 * size_t{side->part}];
      add(q, to);
      add(cross(side->arm, q), to + 3);
    }
  }
  return most > kSame * scale;
}

void ToolTouch::turn_jaws() {
  if (rows_.empty()) return;
  for (Moved &m : sides_)
    for (const Moved::Jaw &jaw : m.jaws) {
      if (jaw.moment == 0) continue;
      const dfm_rigid_state &frame = m.set->next[0];
      dfm_rigid_state &s = m.set->next[jaw.part];
      const Vec3 axis = rotate(rotation_of(frame), {0, 1, 0});
      const double rate = jaw.give * jaw.moment;
      const Quat by = turned(Quat{}, h_ * rate * axis);
      const Vec3 arm = load3(s.position) - load3(frame.position), now = rotate(by, arm);
      store3(s.position, load3(frame.position) + now);
      const Quat q = by * rotation_of(s);
      const double values[] = {q.x, q.y, q.z, q.w};
      std::copy(values, values + 4, s.rotation);
      add((1 / h_) * (now - arm), s.velocity);
      add(rate * axis, s.spin);
    }
}

}  // namespace dfm
