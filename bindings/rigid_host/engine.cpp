#include "engine.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace dfm_rigid_detail {
namespace {

constexpr double kForget = 0.05;  // s
// share of a jointed body's change by contact that may be missing before contact is solved again
constexpr double kResidual = 0.01;
// m/s: the error of a body is relative to at least this change by contact (1e-6 m/s, as in the solve)
constexpr double kSlow = 1e-4;
constexpr double kDrifts = 1, kFellAsleep = 2;  // extra[12]
constexpr int kMaxCorrections = 3;  // per sub-step; more than one only where joints or motors jump

// Principal axes of a symmetric matrix by Jacobi's rotations.
void principal(double a[3][3], Vec &moments, Quat &axes) {
  double e[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < 30; ++sweep) {
    if (a[0][1] == 0 && a[0][2] == 0 && a[1][2] == 0) break;
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        if (std::fabs(a[p][q]) <= 1e-18 * std::sqrt(std::fabs(a[p][p] * a[q][q]))) {
          a[p][q] = a[q][p] = 0;
          continue;
        }
        const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (theta >= 0 ? 1 : -1) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1);
        const double s = t * c;
        const auto turn = [&](double &x, double &y) {
          const double before = x;
          x = c * before - s * y;
          y = s * before + c * y;
        };
        for (int k = 0; k < 3; ++k) turn(a[k][p], a[k][q]);
        for (int k = 0; k < 3; ++k) turn(a[p][k], a[q][k]);
        for (int k = 0; k < 3; ++k) turn(e[k][p], e[k][q]);
      }
  }
  moments = {a[0][0], a[1][1], a[2][2]};
  // Columns of e, made right-handed, as a quaternion by the largest of its four parts.
  const Vec x{e[0][0], e[1][0], e[2][0]}, y{e[0][1], e[1][1], e[2][1]};
  Vec z{e[0][2], e[1][2], e[2][2]};
  if (dot(cross(x, y), z) < 0) z = -1.0 * z;
  const double w = 1 + x.x + y.y + z.z;
  const double i = 1 + x.x - y.y - z.z;
  const double j = 1 - x.x + y.y - z.z;
  const double k = 1 - x.x - y.y + z.z;
  if (w >= i && w >= j && w >= k) axes = unit({y.z - z.y, z.x - x.z, x.y - y.x, w});
  else if (i >= j && i >= k) axes = unit({i, x.y + y.x, z.x + x.z, y.z - z.y});
  else if (j >= k) axes = unit({x.y + y.x, j, y.z + z.y, z.x - x.z});
  else axes = unit({z.x + x.z, y.z + z.y, k, x.y - y.x});
}

// Mean spin over h with angular momentum L: w = I^-1(q half way) L.
Vec mean_spin(Quat q, Vec inverse_moments, Vec L, double h) {
  Vec w = in_axes(q, inverse_moments, L);
  for (int k = 0; k < 60; ++k) {
    const Vec next = in_axes(turn_by(0.5 * h * w) * q, inverse_moments, L), change = next - w;
    w = next;
    if (dot(change, change) <= 1e-31 * dot(w, w)) break;
  }
  return w;
}

}  // namespace

Quat rotation_of(const dfm_rigid_state &s) { return load_quat(s.rotation); }

dfm_rigid_state state_of(Vec x, Quat q, Vec v, Vec w) {
  return {{x.x, x.y, x.z}, {q.x, q.y, q.z, q.w}, {v.x, v.y, v.z}, {w.x, w.y, w.z}};
}

bool same(const dfm_rigid_state &a, const dfm_rigid_state &b) { return std::memcmp(&a, &b, sizeof a) == 0; }

Pose in_principal_frame(const Inertia &inertia, const Pose &in_body) {
  const Quat back = conjugate(inertia.axes);
  return {rotate(back, in_body.position), unit(back * in_body.rotation)};
}

Inertia inertia_of(double mass, const double tensor[3][3]) {
  Inertia out;
  out.mass = mass;
  if (tensor[0][1] == 0 && tensor[0][2] == 0 && tensor[1][2] == 0) {
    out.moments = {tensor[0][0], tensor[1][1], tensor[2][2]};
    return out;
  }
  double a[3][3];
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) a[r][c] = 0.5 * (tensor[r][c] + tensor[c][r]);
  principal(a, out.moments, out.axes);
  return out;
}

Motion Member::response_of(const Motion &p) const {
  if (is_none(p.w)) return {(1 / inertia.mass) * each(moves_along, p.v), {}};
  const Vec turned = in_axes(rotation_of(start), inverse(inertia.moments), each(turns_about, p.w));
  return {(1 / inertia.mass) * each(moves_along, p.v), each(turns_about, turned)};
}

void Engine::begin(double time) {
  begun_ = time;
  open_ = false;
  in_step = true;
}

void Engine::end(double time) {
  if (open_ && time != t_ && time == begun_) take_first();
  if (open_ && (time == t_ || time == begun_)) {
    restore(true);
    stepped_ = false;  // friction forgets what it has seen of it
  }
  if (time == begun_) restore_forces();
  close();
  stepped_ = false;
  ended();
  open_ = in_step = false;
}

void Engine::open(const dfm_rigid_step &step) {
  const bool repeated = open_ && step.t == t_, as_long = step.h == h_;  // from the same states
  if (repeated && (stepped_ || !as_long)) restore(!as_long);
  if (!repeated || !as_long) {
    Timer timer(engine_seconds);
    stepped_ &= !repeated;
    if (open_ && !repeated && t_ == begun_) keep_first();
    prepare(step);
  }
  open_ = true;
  stepped_ = dirty_ = again_ = false;
  rounds_ = 0;
  t_ = step.t;
  h_ = step.h;
}

void Engine::classify(Member &m, const dfm_rigid_step &step, const double *extra) {
  const Facts f = m.facts();
  const bool moves = !f.kinematic && (f.enabled || m.wakes);
  m.asleep = !f.enabled && !m.wakes;
  m.kinematic = f.kinematic;
  m.kind = !moves ? Member::still : f.plain ? Member::free : Member::jointed;
  m.turns = m.kind == Member::free && f.turns;
  // the engine turns it; the difference is in b
  if (m.kind == Member::free && !m.turns) m.kind = Member::jointed;
  m.bias = {load(extra), load(extra + 3)};
  const bool was_asleep = extra[12] != 0;
  // woken by the caller; a body that was only pulled sleeps again as soon as it is idle
  const bool woken = was_asleep && f.enabled && !m.pulled;
  m.idle = woken ? std::array<double, 2>{} : std::array<double, 2>{extra[13], extra[14]};
  m.impulse = {};
  const Vec v = load(m.start.velocity), w = load(m.start.spin);
  const Quat q = rotation_of(m.start);
  if (m.turns) m.turn_momentum = in_axes(q, m.inertia.moments, w) + step.h * f.torque;
  const Motion pull = m.response({f.force, f.torque});
  m.plain.v = v + step.h * (f.gravity + pull.v);
  m.plain.w =
      m.turns ? mean_spin(q, inverse(m.inertia.moments), m.turn_momentum, step.h) : w + step.h * pull.w;
  const Motion kept{load(extra + 6), load(extra + 9)};
  const bool drifts = m.asleep && extra[12] == kDrifts;
  m.drift = m.drifted = drifts ? kept : Motion{};
  if (drifts || !m.asleep) return;
  const Motion carried = m.response(kept);  // b is what was in balance with this
  m.bias = {-1.0 * carried.v - (1 / step.h) * (m.plain.v - v),
            -1.0 * carried.w - (1 / step.h) * (m.plain.w - w)};
}

void Engine::predict(Member &m, const dfm_rigid_step &step, uint32_t number, double *velocity) {
  if (!open_ || step.t != t_ || step.h != h_ || (stepped_ && !again_)) open(step);
  if (again_ && stepped_) {
    restore(false);
    stepped_ = false;
  }
  const double *const extra = step.extra + size_t{Member::kExtra} * number;
  if (!again_) {
    m.wakes = false;
    take(m, step.state[number], extra);
  }
  if (!again_ || (m.wakes && m.asleep)) classify(m, step, extra);
  else if (m.kind == Member::jointed) m.bias = m.next_bias;
  if (m.kind == Member::still)
    m.used = m.asleep ? Motion{} : Motion{load(m.start.velocity), load(m.start.spin)};
  else if (m.kind == Member::free) m.used = m.plain;
  else m.used = {m.plain.v + step.h * m.bias.v, m.plain.w + step.h * m.bias.w};
  store(velocity, m.used.v);
  store(velocity + 3, m.used.w);
}

void Engine::respond(const Member &m, double matrix[36]) const {
  std::fill_n(matrix, 36, 0.0);
  if (m.kind == Member::still) return;
  const double along[3] = {m.moves_along.x, m.moves_along.y, m.moves_along.z};
  for (int k = 0; k < 3; ++k) {
    matrix[7 * k] = along[k] / m.inertia.mass;
    const Vec column = m.response({{}, {k == 0 ? 1.0 : 0, k == 1 ? 1.0 : 0, k == 2 ? 1.0 : 0}}).w;
    matrix[6 * 3 + 3 + k] = column.x;
    matrix[6 * 4 + 3 + k] = column.y;
    matrix[6 * 5 + 3 + k] = column.z;
  }
  for (int r = 3; r < 6; ++r)  // symmetric to the last bit
    for (int c = 3; c < r; ++c)
      matrix[6 * r + c] = matrix[6 * c + r] = 0.5 * (matrix[6 * r + c] + matrix[6 * c + r]);
}

void Engine::push(Member &m, const double *impulse) {
  m.impulse = {load(impulse), load(impulse + 3)};
  dirty_ = true;
}

void Engine::advance(double h) {
  Timer timer(engine_seconds);
  if (stepped_) restore(false);
  put_forces(h);
  stepped_ = true;
  dirty_ = false;
  run(h);
  ++steps;
  turn_free(h);
}

void Engine::turn_free(double h) {
  for (Member *m : members) {
    if (!m->turns || !m->enabled()) continue;
    const Vec L = m->turn_momentum + each(m->turns_about, m->impulse.w);
    const Vec inverse_moments = inverse(m->inertia.moments);
    if (dot(L, L) == 0) continue;
    const Quat from = rotation_of(m->start);
    const Quat to = unit(turn_by(h * mean_spin(from, inverse_moments, L, h)) * from);
    turned(*m, to, in_axes(to, inverse_moments, L));
  }
}

// What constraints added to the motion of a jointed body beside its response to contact. Returns the share of
// the change by contact that was not predicted, by energy.
double Engine::judge(Member &m, double h) {
  m.next_bias = m.kind == Member::still ? m.bias : Motion{};
  if (m.kind != Member::jointed || !m.enabled()) return 0;
  const dfm_rigid_state &end = m.end();
  const Motion got{(1 / h) * (load(end.position) - load(m.start.position)),
                   (1 / h) * turn_of(rotation_of(end) * conjugate(rotation_of(m.start)))};
  const Motion own = m.response(m.impulse);
  m.next_bias = {(1 / h) * (got.v - m.plain.v - own.v), (1 / h) * (got.w - m.plain.w - own.w)};
  const double contact = dot(m.impulse.v, own.v) + dot(m.impulse.w, own.w);
  if (!(contact > 0)) return 0;
  const double scale = std::max(contact, m.inertia.mass * (kSlow * kSlow));
  const Vec dv = got.v - m.used.v - own.v, dw = got.w - m.used.w - own.w;
  const double missing =
      m.inertia.mass * dot(dv, dv) + dot(dw, in_axes(rotation_of(m.start), m.inertia.moments, dw));
  return std::sqrt(missing / scale);
}

bool Engine::wake_sleepers(double h) {
  bool woken = false;
  for (Member *m : members) {
    if (!m->asleep || m->kinematic) continue;
    const Motion push = m->response(m->impulse);
    const double left = std::max(0.0, 1 - h / kForget);
    m->drift.v = left * m->drifted.v + (m->plain.v - load(m->start.velocity)) + push.v + h * m->bias.v;
    m->drift.w = left * m->drifted.w + (m->plain.w - load(m->start.spin)) + push.w + h * m->bias.w;
    const auto [speed, spin] = m->idle_limits();
    m->wakes = norm(m->drift.v) > speed || norm(m->drift.w) > spin;
    woken |= m->wakes;
  }
  return woken;
}

bool Engine::commit(Member &m, uint32_t number, dfm_rigid_state *state, double *extra, double h) {
  bool again = false;
  if (dirty_ || !stepped_) {
    const bool woken = rounds_ == 0 && wake_sleepers(h);
    advance(h);
    residual = 0;
    for (Member *each : members) residual = std::max(residual, judge(*each, h));
    again_ = again = woken || (residual > kResidual && rounds_ < kMaxCorrections);
    if (again) {
      ++corrections;
      ++rounds_;
    } else {
      residual_max = std::max(residual_max, residual);
    }
    if (!again) rest(h);
  }
  state[number] = m.end();
  double *const keep = extra + size_t{Member::kExtra} * number;
  const bool sleeps = !m.enabled();
  const Motion load_or_drift =
      m.asleep && sleeps ? m.drift : Motion{(1 / h) * m.impulse.v, (1 / h) * m.impulse.w};
  store(keep, m.next_bias.v);
  store(keep + 3, m.next_bias.w);
  store(keep + 6, load_or_drift.v);
  store(keep + 9, load_or_drift.w);
  keep[12] = !sleeps ? 0 : m.asleep ? kDrifts : kFellAsleep;
  keep[13] = m.next_idle[0];
  keep[14] = m.next_idle[1];
  return again;
}

}  // namespace dfm_rigid_detail
