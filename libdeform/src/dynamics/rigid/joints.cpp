#include "dynamics/rigid/joints.h"

#include "math/turn.h"

namespace dfm {
namespace {

// Present poses of the two sides of a joint; its anchor from their origins, and how far a's is from b's.
struct Sides {
  Pose a, b;
  Vec3 arm_a, arm_b, apart;
  Sides(const RigidJoint &j, std::span<const dfm_rigid_state> state)
      : a(load_pose(state[j.a])),
        b(j.b == DFM_RIGID_WORLD ? Pose{} : load_pose(state[j.b])),
        arm_a(rotate(a.rotation, j.anchor_a)),
        arm_b(rotate(b.rotation, j.anchor_b)),
        apart(a.position + arm_a - (b.position + arm_b)) {}
  // rotation vector, beyond that of the joint as it was created
  Vec3 turned(const RigidJoint &j) const {
    return rotation_vector(a.rotation * conjugate(b.rotation * j.turn));
  }
};

// share of a row's diagonal that remains after elimination by earlier rows
constexpr double kRedundant = 1e-12;

Vec3 unit_vector(int k) {
  Vec3 e;
  e[k] = 1;
  return e;
}

// (p_a - p_b) . t with p_a of a's anchor and p_b the point of b that the force of the row acts on.
JointRow point_row(const RigidJoint &j, Vec3 arm_a, Vec3 arm_b, Vec3 t, double error) {
  return {j.a, j.b, t, cross(arm_a, t), -t, -cross(arm_b, t), error};
}

JointRow spin_row(const RigidJoint &j, Vec3 t, double error) { return {j.a, j.b, {}, t, {}, -t, error}; }

// Adds M^-1 J^T of one side to a velocity [6].
void respond(Vec3 l, Vec3 a, const RigidPart &part, const dfm_rigid_state &state, double *velocity) {
  add3(velocity, part.inverse_mass * l);
  add3(velocity + 3, in_axes(load_quat(state.rotation), part.inverse_moments, a));
}

}  // namespace

RigidJoint make_joint(const dfm_joint_def &def, std::span<const dfm_rigid_def> bodies) {
  RigidJoint j{};
  j.type = def.type;
  j.a = def.body;
  j.b = def.with;
  auto pose = [&](uint32_t part) { return part == DFM_RIGID_WORLD ? Pose{} : to_pose(bodies[part].pose); };
  const Pose a = pose(j.a), b = pose(j.b);
  const Vec3 anchor = load3(def.anchor), axis = j.can_drive() ? normalized(load3(def.axis)) : Vec3{0, 0, 1};
  const Vec3 side = any_tangent(axis);
  j.anchor_a = rotate_back(a.rotation, anchor - a.position);
  j.anchor_b = rotate_back(b.rotation, anchor - b.position);
  j.axis_a = rotate_back(a.rotation, axis);
  j.axis_b = rotate_back(b.rotation, axis);
  j.side_b[0] = rotate_back(b.rotation, side);
  j.side_b[1] = rotate_back(b.rotation, cross(axis, side));
  j.turn = conjugate(b.rotation) * a.rotation;
  return j;
}

void hold_rows(const RigidJoint &j, std::span<const dfm_rigid_state> state, std::vector<JointRow> &out) {
  const Sides now(j, state);
  const auto &[a, b, arm_a, arm_b, apart] = now;
  if (j.type == DFM_JOINT_SLIDER) {
    // Sides and axis belong to b, so the force acts on b where a's anchor is.
    for (const Vec3 &s : j.side_b) {
      const Vec3 t = rotate(b.rotation, s);
      out.push_back(point_row(j, arm_a, arm_b + apart, t, dot(apart, t)));
    }
  } else {
    for (int k = 0; k < 3; ++k) out.push_back(point_row(j, arm_a, arm_b, unit_vector(k), apart[k]));
  }
  if (j.type == DFM_JOINT_HINGE) {
    const Vec3 n = rotate(a.rotation, j.axis_a);
    for (const Vec3 &s : j.side_b) {
      const Vec3 t = rotate(b.rotation, s);
      out.push_back(spin_row(j, cross(n, t), dot(n, t)));  // d/dt (n . t) = (w_a - w_b) . (n x t)
    }
  } else if (j.type != DFM_JOINT_BALL) {
    const Vec3 off = now.turned(j);
    for (int k = 0; k < 3; ++k) out.push_back(spin_row(j, unit_vector(k), off[k]));
  }
}

JointRow drive_row(const RigidJoint &j, std::span<const dfm_rigid_state> state) {
  const Sides now(j, state);
  const Vec3 axis = rotate(now.b.rotation, j.axis_b);
  if (j.type == DFM_JOINT_HINGE) return spin_row(j, axis, dot(now.turned(j), axis));
  return point_row(j, now.arm_a, now.arm_b + now.apart, axis, dot(now.apart, axis));
}

double row_rate(const JointRow &r, std::span<const double> v) {
  const double *const a = &v[6 * size_t{r.a}];
  double rate = dot(r.la, load3(a)) + dot(r.aa, load3(a + 3));
  if (r.b == DFM_RIGID_WORLD) return rate;
  const double *const b = &v[6 * size_t{r.b}];
  return rate + dot(r.lb, load3(b)) + dot(r.ab, load3(b + 3));
}

void JointSystem::build(std::span<const JointRow> rows, std::span<const RigidPart> parts,
                        std::span<const dfm_rigid_state> state) {
  n_ = rows.size();
  factor_.assign(n_ * n_, 0.0);
  responses_.assign(12 * n_, 0.0);
  for (size_t i = 0; i < n_; ++i) {
    const JointRow &r = rows[i];
    double *const m = &responses_[12 * i];
    respond(r.la, r.aa, parts[r.a], state[r.a], m);
    if (r.b != DFM_RIGID_WORLD) respond(r.lb, r.ab, parts[r.b], state[r.b], m + 6);
  }
  // Lower triangle of A: row i times the response of row k, for the parts that they share.
  for (size_t i = 0; i < n_; ++i)
    for (size_t k = 0; k <= i; ++k) {
      const JointRow &r = rows[i], &q = rows[k];
      const double *const m = &responses_[12 * k];
      double sum = 0;
      auto add = [&](uint32_t part, Vec3 l, Vec3 a) {
        if (part == DFM_RIGID_WORLD) return;
        if (part == q.a) sum += dot(l, load3(m)) + dot(a, load3(m + 3));
        if (part == q.b) sum += dot(l, load3(m + 6)) + dot(a, load3(m + 9));
      };
      add(r.a, r.la, r.aa);
      add(r.b, r.lb, r.ab);
      factor_[i * n_ + k] = sum;
    }
  // L D L^T in place: D on the diagonal, 0 if the row is left out.
  for (size_t i = 0; i < n_; ++i) {
    double *const row = &factor_[i * n_];
    const double own = row[i];
    for (size_t k = 0; k < i; ++k) {
      const double *const other = &factor_[k * n_];
      double sum = row[k];
      for (size_t m = 0; m < k; ++m) sum -= row[m] * other[m] * factor_[m * n_ + m];
      row[k] = other[k] > 0 ? sum / other[k] : 0;
    }
    double pivot = own;
    for (size_t k = 0; k < i; ++k) pivot -= row[k] * row[k] * factor_[k * n_ + k];
    row[i] = pivot > kRedundant * own ? pivot : 0;
  }
}

void JointSystem::solve(std::span<double> x) const {
  auto d = [&](size_t i) { return factor_[i * n_ + i]; };
  for (size_t i = 0; i < n_; ++i) {
    if (!(d(i) > 0)) {
      x[i] = 0;
      continue;
    }
    for (size_t k = 0; k < i; ++k) x[i] -= factor_[i * n_ + k] * x[k];
  }
  for (size_t i = 0; i < n_; ++i) x[i] = d(i) > 0 ? x[i] / d(i) : 0;
  for (size_t i = n_; i-- > 0;) {
    if (!(d(i) > 0)) continue;
    for (size_t k = i + 1; k < n_; ++k) x[i] -= factor_[k * n_ + i] * x[k];
  }
}

void JointSystem::push(std::span<const JointRow> rows, std::span<const double> x,
                       std::span<const RigidPart> parts, std::span<const dfm_rigid_state> state,
                       std::span<double> velocity) {
  for (size_t i = 0; i < rows.size(); ++i) {
    const JointRow &r = rows[i];
    auto add = [&](uint32_t part, Vec3 l, Vec3 a) {
      if (part != DFM_RIGID_WORLD)
        respond(x[i] * l, x[i] * a, parts[part], state[part], &velocity[6 * size_t{part}]);
    };
    add(r.a, r.la, r.aa);
    add(r.b, r.lb, r.ab);
  }
}

}  // namespace dfm
