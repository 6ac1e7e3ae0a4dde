// The builtin rigid host by its own table, against closed forms for one sub-step: free motion, responses to
// impulses, ends. Motions over time (pendulums, motors, loops) are tests/analytic/rigid_test.cpp.
#include <gtest/gtest.h>

#include <cstring>
#include <numbers>

#include "dense.h"
#include "dynamics/rigid/host.h"
#include "math/turn.h"
#include "near.h"
#include "rigid.h"

namespace {

using namespace dfm;
using test::Dense;
using test::expect_near;

constexpr double kStep = 1e-3;
constexpr Vec3 kGravity{0.5, -1, -9.81};
constexpr double kRounding = 1e-13;  // of values near 1

struct End {
  std::vector<dfm_rigid_state> state;
  std::vector<double> extra;
};

// A set of the builtin host, and one sub-step of it.
class Host {
 public:
  explicit Host(std::vector<dfm_rigid_def> bodies, const std::vector<dfm_joint_def> &joints = {})
      : bodies_(std::move(bodies)) {
    for (dfm_rigid_def &d : bodies_) {
      solid_inertia(d, d.inertia);
      dfm_rigid_state s{};
      std::copy_n(d.pose.position, 3, s.position);
      std::copy_n(d.pose.rotation, 4, s.rotation);
      std::copy_n(d.velocity, 3, s.velocity);
      std::copy_n(d.spin, 3, s.spin);
      state.push_back(s);
    }
    const uint32_t n = uint32_t(bodies_.size());
    group.resize(n);
    dfm_rigid_set_def set{};
    set.size = sizeof set;
    set.nbody = n;
    set.njoint = uint32_t(joints.size());
    set.bodies = bodies_.data();
    set.joints = joints.data();
    uint32_t nextra = 0;
    test::ok(table_.create(table_.user, &set, &self_, group.data(), &nextra));
    extra.resize(nextra);
  }
  ~Host() { table_.destroy(self_); }
  Host(const Host &) = delete;
  Host &operator=(const Host &) = delete;

  std::vector<double> predict() {
    std::vector<double> v(6 * state.size(), 7.0);
    const dfm_rigid_step s = step();
    test::ok(table_.predict(self_, &s, v.data()));
    return v;
  }
  Dense respond(uint32_t number) {
    const size_t width = 6 * size_t(std::count(group.begin(), group.end(), number));
    Dense out(width, width);
    const dfm_rigid_step s = step();
    test::ok(table_.respond(self_, &s, number, out.value.data()));
    return out;
  }
  End commit(const std::vector<double> &impulse) {
    End end{std::vector<dfm_rigid_state>(state.size()), std::vector<double>(extra.size())};
    const dfm_rigid_step s = step();
    test::ok(table_.commit(self_, &s, impulse.data(), end.state.data(), end.extra.data()));
    return end;
  }
  const dfm_rigid_def &def(size_t i) const { return bodies_[i]; }

  std::vector<dfm_rigid_state> state;
  std::vector<double> extra;
  std::vector<uint32_t> group;

 private:
  dfm_rigid_host table_ = builtin_host();
  std::vector<dfm_rigid_def> bodies_;
  void *self_ = nullptr;

  dfm_rigid_step step() const {
    dfm_rigid_step s{};
    s.size = sizeof s;
    s.nbody = uint32_t(state.size());
    s.h = kStep;
    store3(s.gravity, kGravity);
    s.state = state.data();
    s.extra = extra.data();
    return s;
  }
};

Quat rotation(const dfm_rigid_state &s) {
  return {s.rotation[0], s.rotation[1], s.rotation[2], s.rotation[3]};
}
Vec3 moments(const dfm_rigid_def &d) { return load3(d.inertia); }
Vec3 inverse(Vec3 v) { return {1 / v.x, 1 / v.y, 1 / v.z}; }
Vec3 spin_momentum(const dfm_rigid_def &d, const dfm_rigid_state &s) {
  return in_axes(rotation(s), moments(d), load3(s.spin));
}

// A box that moves and spins about no axis of its own.
dfm_rigid_def tumbling(const char *name, double mass, test::Vec position) {
  dfm_rigid_def d = test::box(name, {0.1, 0.25, 0.4}, mass, position);
  const Quat q = turned({0, 0, 0, 1}, {0.3, -0.5, 0.7});
  d.pose.rotation[0] = q.x;
  d.pose.rotation[1] = q.y;
  d.pose.rotation[2] = q.z;
  d.pose.rotation[3] = q.w;
  store3(d.velocity, {1, -2, 0.5});
  store3(d.spin, {3, 7, -2});
  return d;
}

dfm_joint_def ball_joint(Vec3 at) { return test::joint(DFM_JOINT_BALL, 0, 1, {at.x, at.y, at.z}); }

// Change of a body's velocity (6 values) per unit of each impulse: symmetric, and no impulse p is answered
// against itself.
void expect_symmetric_and_passive(const Dense &r) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (size_t i = 0; i < r.rows; ++i)
    for (size_t k = 0; k < i; ++k) EXPECT_EQ(r(i, k), r(k, i)) << i << " " << k;
  for (int round = 0; round < 20; ++round) {
    std::vector<double> p(r.columns);
    for (double &x : p) x = normal(random);
    const std::vector<double> v = r * p;
    double work = 0;
    for (size_t k = 0; k < p.size(); ++k) work += p[k] * v[k];
    EXPECT_GE(work, -kRounding);
  }
}

}  // namespace

// By Gauss-Legendre with three points, exact to degree 5, over the discs of a cylinder with two half balls: a
// disc of radius s at z has s^2 pi, about its axis s^4 pi / 2, about a diameter of the middle plane s^4 pi /
// 4 + z^2 s^2 pi.
TEST(RigidSolid, Capsule_HasTheMomentsOfItsDiscs) {
  dfm_rigid_def d = dfm_rigid_def_default();
  d.shape = DFM_SHAPE_CAPSULE;
  d.radius = 0.3;
  d.half_length = 0.5;
  d.mass = 2;
  const double cuts[4] = {-0.8, -0.5, 0.5, 0.8};
  const double place[3] = {-std::sqrt(0.6), 0, std::sqrt(0.6)};
  const double weight[3] = {5.0 / 9, 8.0 / 9, 5.0 / 9};
  double volume = 0;
  double along = 0;
  double across = 0;
  for (int piece = 0; piece < 3; ++piece)
    for (int k = 0; k < 3; ++k) {
      const double half = 0.5 * (cuts[piece + 1] - cuts[piece]);
      const double z = cuts[piece] + half * (1 + place[k]);
      const double beyond = std::max(0.0, std::fabs(z) - 0.5);
      const double area = std::numbers::pi * (0.09 - beyond * beyond);
      const double w = half * weight[k] * area;
      volume += w;
      along += w * area / (2 * std::numbers::pi);
      across += w * (area / (4 * std::numbers::pi) + z * z);
    }
  double found[3];
  solid_inertia(d, found);
  EXPECT_NEAR(solid_volume(d), volume, 1e-15);
  EXPECT_NEAR(found[0], d.mass / volume * across, 1e-14);
  EXPECT_NEAR(found[1], d.mass / volume * across, 1e-14);
  EXPECT_NEAR(found[2], d.mass / volume * along, 1e-14);
}

// The rotation vector of a turn by a rotation vector shorter than half a turn is that vector.
TEST(RigidTurn, RotationVector_IsTheInverseOfTheTurn) {
  for (const double angle : {0.0, 1e-9, 1e-3, 1.0, 3.0, 3.14}) {
    const Vec3 r = angle * normalized({1, -2, 0.5});
    expect_near(rotation_vector(turned({0, 0, 0, 1}, r)), r, 1e-14 * (1 + angle));
  }
}

// The mean spin w is I^-1(q_m) L with the rotation q_m half way, exp(h w / 2) q. For a round body it is L / I
// at any time.
TEST(RigidTurn, MeanSpin_IsThatOfTheRotationHalfWay) {
  const Quat q = turned({0, 0, 0, 1}, {0.3, -0.5, 0.7});
  const Vec3 momentum{0.2, 0.5, -0.1};
  const Vec3 inverse_moments{4, 10, 25};
  const Vec3 w = mean_spin(q, inverse_moments, momentum, 0.05);
  expect_near(w, in_axes(turned(q, 0.025 * w), inverse_moments, momentum), 1e-14);
  EXPECT_GT(norm(w - in_axes(q, inverse_moments, momentum)), 1e-2) << "the spin changes within the step";
  expect_near(mean_spin(q, {4, 4, 4}, momentum, 0.05), 4.0 * momentum, 1e-15);
}

// v + h g; nothing acts on the spin, whose mean keeps the angular momentum. Who is fixed moves nowhere and
// has no group.
TEST(RigidHost, FreeMotion_FallsAndKeepsAngularMomentum) {
  dfm_rigid_def wall = tumbling("wall", 1, {5, 0, 0});
  wall.fixed = 1;
  Host host({tumbling("a", 2, {}), wall, tumbling("b", 3, {1, 0, 0})});
  EXPECT_EQ(host.group, (std::vector<uint32_t>{0, DFM_RIGID_STILL, 1}));
  const std::vector<double> v = host.predict();
  for (const size_t i : {0, 2}) {
    const dfm_rigid_state &s = host.state[i];
    expect_near(load3(&v[6 * i]), load3(s.velocity) + kStep * kGravity, 1e-15);
    const Vec3 momentum = spin_momentum(host.def(i), s);
    const Vec3 mean = mean_spin(rotation(s), inverse(moments(host.def(i))), momentum, kStep);
    expect_near(load3(&v[6 * i + 3]), mean, kRounding);
  }
  for (size_t k = 6; k < 12; ++k) EXPECT_EQ(v[k], 0);
  const End end = host.commit(std::vector<double>(18));
  for (const size_t i : {0, 2}) {
    const dfm_rigid_state &from = host.state[i];
    const dfm_rigid_state &to = end.state[i];
    expect_near(load3(to.position), load3(from.position) + kStep * load3(&v[6 * i]), 1e-15);
    expect_near(spin_momentum(host.def(i), to), spin_momentum(host.def(i), from), kRounding);
    const Quat turn = rotation(to) * conjugate(rotation(from));
    expect_near(rotation_vector(turn), kStep * load3(&v[6 * i + 3]), 1e-15);
  }
}

// 1/m for the velocity, R diag(1/I) R^T for the spin, and nothing between them: the impulse acts at the
// center of mass.
TEST(RigidHost, ResponseOfAFreeBody_IsItsInverseMassAndInertia) {
  Host host({tumbling("a", 2, {})});
  host.predict();
  Dense turn(3, 3);
  Dense diagonal(3, 3);
  for (int k = 0; k < 3; ++k) {
    Vec3 e;
    e[k] = 1;
    const Vec3 column = rotate(rotation(host.state[0]), e);
    for (int r = 0; r < 3; ++r) turn(size_t(r), size_t(k)) = column[r];
    diagonal(size_t(k), size_t(k)) = 1 / host.def(0).inertia[k];
  }
  const Dense inertia = turn * (diagonal * transposed(turn));
  const Dense r = host.respond(0);
  for (size_t i = 0; i < 6; ++i)
    for (size_t k = 0; k < 6; ++k) {
      const bool spins = i >= 3 && k >= 3;
      EXPECT_NEAR(r(i, k), spins ? inertia(i - 3, k - 3) : i == k ? 0.5 : 0, 1e-12) << i << " " << k;
    }
  expect_symmetric_and_passive(r);
}

// Both momenta change by the impulse, linear at the center of mass and angular about it. Asked once more with
// another impulse the host starts from the same state.
TEST(RigidHost, Commit_ChangesMomentaByTheImpulse) {
  Host host({tumbling("a", 2, {})});
  host.predict();
  const End none = host.commit(std::vector<double>(6));
  const std::vector<double> p = {0.5, -0.25, 1, 0.02, -0.03, 0.01};
  const End end = host.commit(p);
  const dfm_rigid_def &def = host.def(0);
  const Vec3 faster = load3(end.state[0].velocity) - load3(none.state[0].velocity);
  expect_near(def.mass * faster, load3(&p[0]), kRounding);
  const Vec3 turned = spin_momentum(def, end.state[0]) - spin_momentum(def, none.state[0]);
  expect_near(turned, load3(&p[3]), kRounding);
  const End again = host.commit(std::vector<double>(6));
  EXPECT_EQ(std::memcmp(&again.state[0], &none.state[0], sizeof again.state[0]), 0);
}

// A body on a hinge to the world has one freedom, the spin about its axis u through the anchor. With c the
// center of mass from the anchor, an impulse p and a moment t about the center bring u . (c x p + t) about
// the axis, where the body has the moment u . (I + m (c.c - c c^T)) u. Its velocity is w x c.
TEST(RigidHost, ResponseOnAHinge_IsThatOfItsOneFreedom) {
  const Vec3 u = normalized({1, 2, -1});
  const test::Vec anchor = {0.3, -0.2, 0.1};
  const dfm_joint_def hinge = test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, anchor, {u.x, u.y, u.z});
  Host host({tumbling("a", 2, {})}, {hinge});
  host.predict();
  const Vec3 c = -Vec3{anchor[0], anchor[1], anchor[2]};
  const Vec3 own = in_axes(rotation(host.state[0]), moments(host.def(0)), u);
  const double about = dot(u, own) + host.def(0).mass * (norm2(c) - dot(c, u) * dot(c, u));
  const Dense r = host.respond(0);
  for (int k = 0; k < 6; ++k) {
    Vec3 p;
    Vec3 t;
    (k < 3 ? p : t)[k % 3] = 1;
    const Vec3 w = (dot(u, cross(c, p) + t) / about) * u;
    const Vec3 v = cross(w, c);
    for (int x = 0; x < 3; ++x) {
      EXPECT_NEAR(r(size_t(x), size_t(k)), v[x], 1e-11) << k;
      EXPECT_NEAR(r(size_t(x + 3), size_t(k)), w[x], 1e-11) << k;
    }
  }
  expect_symmetric_and_passive(r);
}

// Two bodies on a ball joint at a answer each other: the joint's own impulses cancel, so both momenta of the
// pair (about the origin) change by what acts from outside, and the two places at the joint get the same
// velocity.
TEST(RigidHost, ResponseOfTwoOnABallJoint_KeepsMomentaAndTheJoint) {
  const Vec3 a{0.4, 0.1, -0.2};
  Host host({tumbling("a", 2, {}), tumbling("b", 3, {1, 0.2, 0})}, {ball_joint(a)});
  EXPECT_EQ(host.group, (std::vector<uint32_t>{0, 0}));
  host.predict();
  const Dense r = host.respond(0);
  expect_symmetric_and_passive(r);
  for (size_t k = 0; k < 12; ++k) {
    const size_t struck = k / 6;
    Vec3 p;
    Vec3 t;
    (k % 6 < 3 ? p : t)[int(k % 3)] = 1;
    Vec3 linear;
    Vec3 angular;
    Vec3 at_joint[2];
    for (size_t i = 0; i < 2; ++i) {
      const Vec3 v{r(6 * i, k), r(6 * i + 1, k), r(6 * i + 2, k)};
      const Vec3 w{r(6 * i + 3, k), r(6 * i + 4, k), r(6 * i + 5, k)};
      const Vec3 x = load3(host.state[i].position);
      linear += host.def(i).mass * v;
      angular += cross(x, host.def(i).mass * v) + in_axes(rotation(host.state[i]), moments(host.def(i)), w);
      at_joint[i] = v + cross(w, a - x);
    }
    expect_near(linear, p, 1e-12);
    expect_near(angular, cross(load3(host.state[struck].position), p) + t, 1e-12);
    expect_near(at_joint[0], at_joint[1], 1e-11);
  }
}

// Joints move momenta between bodies and make none: with an impulse on one of the two the pair ends with its
// own, that impulse and h m g. The anchors are where they were to each other.
TEST(RigidHost, CommitOfTwoOnABallJoint_KeepsMomentaAndTheJoint) {
  const Vec3 a{0.4, 0.1, -0.2};
  Host host({tumbling("a", 2, {}), tumbling("b", 3, {1, 0.2, 0})}, {ball_joint(a)});
  host.predict();
  std::vector<double> p(12);
  store3(&p[0], {0.1, -0.2, 0.3});
  const End end = host.commit(p);
  Vec3 before = load3(&p[0]);
  Vec3 after;
  Vec3 anchor[2];
  for (size_t i = 0; i < 2; ++i) {
    before += host.def(i).mass * (load3(host.state[i].velocity) + kStep * kGravity);
    after += host.def(i).mass * load3(end.state[i].velocity);
    const Vec3 arm = rotate_back(rotation(host.state[i]), a - load3(host.state[i].position));
    anchor[i] = load3(end.state[i].position) + rotate(rotation(end.state[i]), arm);
  }
  expect_near(after, before, 1e-12);
  expect_near(anchor[0], anchor[1], 1e-10);  // what a joint may be off by at the end of a sub-step
}

// A rod, a plate and a box whose moments all differ turn freely: energy is kept however far they turn in a
// step, and the end is that of fine steps.
TEST(RigidTurn, FreeSpin_KeepsEnergyAtAnyTurn) {
  for (const Vec3 moments : {Vec3{1, 1, 0.02}, Vec3{1, 1, 2}, Vec3{1, 1.6, 2.4}})
    for (const double turn : {0.1, 0.4, 0.6, 1.0, 1.5, 2.0, 3.0}) {
      SCOPED_TRACE(std::to_string(moments.z) + " " + std::to_string(turn));
      const Vec3 inverse_moments = inverse(moments);
      const Vec3 start_spin = normalized({0.9, 0.3, 0.4});
      Quat q = turned({0, 0, 0, 1}, {0.3, -0.5, 0.7}), fine = q;
      const Vec3 L = in_axes(q, moments, start_spin);
      const auto energy = [&](Quat at) { return 0.5 * dot(L, in_axes(at, inverse_moments, L)); };
      const double start = energy(q);
      for (int i = 0; i < 200; ++i) {
        q = turned(q, turn * free_spin(q, inverse_moments, L, turn));
        EXPECT_NEAR(energy(q), start, 0.02 * start);
        if (i >= 3) continue;
        for (int k = 0; k < 400; ++k)
          fine = turned(fine, turn / 400 * mean_spin(fine, inverse_moments, L, turn / 400));
        // below half a radian it is one midpoint step, as in every scene that does not spin fast
        EXPECT_LT(norm(rotation_vector(q * conjugate(fine))), (turn > 0.5 ? 0.02 : 0.07) * turn * (i + 1));
      }
    }
}
