#include "step/tool_touch.h"

#include <algorithm>
#include <cmath>

#include "geometry/closest.h"
#include "geometry/obstacle_shape.h"
#include "state/world.h"
#include "step/context.h"

namespace dfm {
namespace {

constexpr uint32_t kMostSweeps = 500;
constexpr double kDone = 1e-13;  // of the largest speed that a row asks to change
constexpr double kSame = 1e-9;   // of it: soft bodies need not be asked again
constexpr double kOpens = 0.1;   // of d_c in a sub-step, where two tools are in each other
constexpr double kAlong = 1e-9;  // of a normal that is beside the cone of an edge

bool takes_part(const ObstacleView &o) {
  return o.shape == Shape::sphere || o.shape == Shape::capsule || o.shape == Shape::box;
}
// Those of a host that is asked for velocities and impulses alone.
bool plain(const RigidSet &set) { return set.of_tool || (set.host_name == "builtin" && set.njoint == 0); }
double round_of(const ObstacleShape &s) { return s.view().shape == Shape::box ? 0 : s.view().radius; }
double reach_of(const ObstacleShape &s) {
  return s.view().shape == Shape::sphere ? s.view().radius : s.extent() + round_of(s);
}
uint32_t corners_of(const ObstacleShape &s) {
  return s.view().shape == Shape::box ? 8 : s.view().shape == Shape::capsule ? 2 : 1;
}
Vec3 corner_of(const ObstacleShape &s, uint32_t i) {
  return s.view().shape == Shape::box ? s.corner(i) : s.end(int(i));
}
uint32_t edges_of(const ObstacleShape &s) {
  return s.view().shape == Shape::box ? 12 : s.view().shape == Shape::capsule ? 1 : 0;
}

struct Edge {
  Vec3 from, to, face[2];  // normals of a box beside it
  bool sharp = false;
  // Does the direction leave the shape here?
  bool leaves(Vec3 n) const { return !sharp || (dot(n, face[0]) > kAlong && dot(n, face[1]) > kAlong); }
};
Edge edge_of(const ObstacleShape &s, uint32_t i) {
  Edge e;
  if (s.view().shape != Shape::box) {
    e.from = s.end(0);
    e.to = s.end(1);
    return e;
  }
  uint32_t faces[2];
  s.edge(i, e.from, e.to, faces);
  for (int k = 0; k < 2; ++k) e.face[k] = s.face_normal(faces[k]);
  e.sharp = true;
  return e;
}

}  // namespace

double ToolTouch::speed(const Row &row) const {
  const auto at = [&](const Side &side) {
    const double *const v = &sides_[side.tool].base[6 * size_t{side.part}];
    const double *const d = &sides_[side.tool].change[6 * size_t{side.part}];
    return load3(v) + load3(d) + cross(load3(v + 3) + load3(d + 3), side.arm);
  };
  return dot(row.normal, at(row.a) - at(row.b));
}

void ToolTouch::push(const Side &side, Vec3 impulse, Vec3 moment, std::vector<double> Moved::*to) {
  Moved &m = sides_[side.tool];
  std::vector<double> &v = m.*to;
  const size_t width = v.size();
  const double p[6] = {impulse.x, impulse.y, impulse.z, moment.x, moment.y, moment.z};
  for (size_t i = 0; i < width; ++i)
    for (size_t k = 0; k < 6; ++k) v[i] += m.response[i * width + 6 * size_t{side.part} + k] * p[k];
}

void ToolTouch::push(const Row &row, double impulse) {
  const Vec3 p = impulse * row.normal;
  push(row.a, p, cross(row.a.arm, p), &Moved::change);
  push(row.b, -p, -cross(row.b.arm, p), &Moved::change);
}

Vec3 ToolTouch::center(const Side &side) const {
  return load3(sides_[side.tool].set->state[side.part].position);
}

double ToolTouch::fastest(const ObstacleShape &shape, const Side &side) const {
  const double *const v = &sides_[side.tool].free[6 * size_t{side.part}];
  const double arm = norm(shape.view().position - center(side)) + reach_of(shape);
  return norm(load3(v)) + norm(load3(v + 3)) * arm;
}

void ToolTouch::add_row(Side a, Side b, Vec3 at, Vec3 normal, double gap, double reach) {
  if (!(gap - offset_ < reach)) return;
  a.arm = at - center(a);
  b.arm = at - center(b);
  Row row{a, b, normal, 0, 0, 0, 0};
  if (gap >= offset_) row.rate = -(gap - offset_) / h_;
  else if (gap < 0.5 * offset_) row.rate = std::min(0.5 * offset_ - gap, kOpens * offset_) / h_;
  // how fast the two part by an impulse of one
  push(row, 1);
  std::vector<double> &va = sides_[a.tool].change, &vb = sides_[b.tool].change;
  const auto moved = [](const Side &s, const std::vector<double> &v) {
    return load3(&v[6 * size_t{s.part}]) + cross(load3(&v[6 * size_t{s.part} + 3]), s.arm);
  };
  const double w = dot(normal, moved(a, va) - moved(b, vb));
  std::fill(va.begin(), va.end(), 0.0);
  std::fill(vb.begin(), vb.end(), 0.0);
  if (!(w > 0)) return;  // neither gives way
  row.inverse = 1 / w;
  rows_.push_back(row);
}

// Corners of each against the other, and edges that cross. A sphere is one corner with a radius, a capsule
// two and an edge between them.
void ToolTouch::add_rows(const ObstacleShape &a, const ObstacleShape &b, Side at_a, Side at_b) {
  const double reach = 2 * h_ * (fastest(a, at_a) + fastest(b, at_b)) + offset_;
  const double apart = norm(a.view().position - b.view().position);
  if (apart - reach_of(a) - reach_of(b) - offset_ > reach) return;
  for (uint32_t i = 0; i < corners_of(a); ++i) {
    const ObstaclePoint o = b.closest(corner_of(a, i));
    const double gap = o.distance - round_of(a);
    add_row(at_a, at_b, o.point + 0.5 * gap * o.normal, o.normal, gap, reach);
  }
  for (uint32_t i = 0; i < corners_of(b); ++i) {
    const ObstaclePoint o = a.closest(corner_of(b, i));
    const double gap = o.distance - round_of(b);
    add_row(at_a, at_b, o.point + 0.5 * gap * o.normal, -o.normal, gap, reach);
  }
  for (uint32_t i = 0; i < edges_of(a); ++i)
    for (uint32_t j = 0; j < edges_of(b); ++j) {
      const Edge p = edge_of(a, i), q = edge_of(b, j);
      const SegmentPoints near = closest_segments(p.from, p.to, q.from, q.to);
      if (!(near.s > 0 && near.s < 1 && near.t > 0 && near.t < 1)) continue;
      const Vec3 on_a = p.from + near.s * (p.to - p.from), on_b = q.from + near.t * (q.to - q.from);
      const double d = norm(on_a - on_b), gap = d - round_of(a) - round_of(b);
      if (!(d > 0)) continue;
      const Vec3 n = (1 / d) * (on_a - on_b);
      if (!q.leaves(n) || !p.leaves(-n)) continue;
      add_row(at_a, at_b, on_b + (round_of(b) + 0.5 * gap) * n, n, gap, reach);
    }
}

void ToolTouch::find(const World &w, const StepContext &step) {
  const auto side = [&](const Obstacle &o, Side &out) {
    if (!o.rigid || !takes_part(step.obstacle_views[o.slot])) return false;
    for (out.tool = 0; out.tool < sides_.size() && sides_[out.tool].set != o.rigid;) ++out.tool;
    out.part = o.rigid_body;
    return out.tool < sides_.size();
  };
  for (size_t i = 0; i < w.obstacles.size(); ++i) {
    const Obstacle &a = *w.obstacles[i];
    Side at_a{}, at_b{};
    if (!side(a, at_a)) continue;
    const ObstacleView &va = step.obstacle_views[a.slot];
    for (size_t j = i + 1; j < w.obstacles.size(); ++j) {
      const Obstacle &b = *w.obstacles[j];
      if (a.rigid == b.rigid || !side(b, at_b) || !(a.rigid->of_tool || b.rigid->of_tool)) continue;
      const ObstacleView &vb = step.obstacle_views[b.slot];
      if ((va.category & vb.collides_with) && (vb.category & va.collides_with))
        add_rows(ObstacleShape(va), ObstacleShape(vb), at_a, at_b);
    }
  }
}

// Gauss-Seidel: the rows are few.
void ToolTouch::solve() {
  double scale = 0;
  for (const Row &row : rows_)
    scale = std::max(scale, std::fabs(row.rate) + std::fabs(speed(row)) + row.impulse / row.inverse);
  for (uint32_t sweep = 0; sweep < kMostSweeps; ++sweep) {
    double most = 0;
    for (Row &row : rows_) {
      const double next = std::max(0.0, row.impulse + row.inverse * (row.rate - speed(row)));
      const double more = next - row.impulse;
      if (more == 0) continue;
      row.impulse = next;
      push(row, more);
      most = std::max(most, std::fabs(more) / row.inverse);
    }
    if (!(most > kDone * scale)) return;
  }
}

void ToolTouch::begin(World &w, StepContext &step) {
  rows_.clear();
  size_t n = 0;
  if (!w.tools.empty())
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
  find(w, step);
  if (rows_.empty()) {
    sides_.clear();
    return;
  }
  solve();
  for (Row &row : rows_) row.before = row.impulse;
  for (Moved &m : sides_)
    for (size_t i = 0; i < m.free.size(); ++i) m.set->velocity[i] = m.free[i] + m.change[i];
}

void ToolTouch::correct() {
  for (Moved &m : sides_) {
    m.free.assign(m.set->velocity.begin(), m.set->velocity.end());
    for (size_t i = 0; i < m.free.size(); ++i) m.set->velocity[i] += m.change[i];
  }
  for (Row &row : rows_) row.before = row.impulse;
}

bool ToolTouch::answer() {
  if (rows_.empty()) return false;
  for (size_t k = 0; k < sides_.size(); ++k) {
    Moved &m = sides_[k];
    m.base = m.free;
    for (uint32_t i = 0; i < m.set->defs.size(); ++i) {
      const double *const p = &m.set->impulse[6 * size_t{i}];
      push({k, i, {}}, load3(p), load3(p + 3), &Moved::base);
    }
  }
  solve();
  double scale = 0, most = 0;
  for (const Row &row : rows_) {
    scale = std::max(scale, std::fabs(row.rate) + row.impulse / row.inverse);
    most = std::max(most, std::fabs(row.impulse - row.before) / row.inverse);
    for (const Side *side : {&row.a, &row.b}) {
      const Vec3 p = (side == &row.a ? row.impulse : -row.impulse) * row.normal;
      double *const to = &sides_[side->tool].set->impulse[6 * size_t{side->part}];
      store3(to, load3(to) + p);
      store3(to + 3, load3(to + 3) + cross(side->arm, p));
    }
  }
  return most > kSame * scale;
}

}  // namespace dfm
