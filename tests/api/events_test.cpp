// What a step reports: contacts, pairs, events, surface forces; each against the momentum that the bodies
// really exchanged.
#include <map>

#include "stack.h"

namespace {

using Vec = std::array<double, 3>;

Vec momentum(dfm_body b) {
  const dfm_body_measure m = test::measure(b);
  return {m.momentum[0], m.momentum[1], m.momentum[2]};
}

Vec operator-(Vec a, Vec b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vec operator+(Vec a, Vec b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
void near(Vec a, Vec b, double tolerance, const char *what) {
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(a[size_t(k)], b[size_t(k)], tolerance) << what << ", component " << k;
}

// World-frame force on side a of a contact.
Vec force(const dfm_contact &c) {
  const Vec n{c.normal[0], c.normal[1], c.normal[2]}, t{c.tangent[0], c.tangent[1], c.tangent[2]};
  const Vec u{n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]};
  Vec f;
  for (size_t k = 0; k < 3; ++k) f[k] = c.fn * n[k] + c.ft[0] * t[k] + c.ft[1] * u[k];
  return f;
}

// Two balls that meet off center in free space, with spin so that friction acts.
struct Impact {
  test::Context context;
  dfm_world world;
  dfm_body left, right;
  Impact() {
    world = test::make_world(context, {0, 0, 0});
    test::set_friction(world, 0.4);
    test::BodyOptions o;
    o.young = 5e4;
    o.damping_stiffness = 2e-4;
    o.name = "left";
    o.position = {-0.0503, 0, 0};
    o.velocity = {0.4, 0, 0.1};
    o.spin = {0, 10, 5};
    left = test::make_body(context, world, "ball", {0.05, 0, 0}, 200, o);
    o.name = "right";
    o.position = {0.0503, 0.02, 0.005};
    o.velocity = {-0.3, 0.05, 0};
    o.spin = {2, 0, -8};
    o.density = 700;
    right = test::make_body(context, world, "ball", {0.05, 0, 0}, 200, o);
  }
  // A step of one sub-step, so that what is reported of the last sub-step is what the step did.
  double dt() {
    double h = 0;
    test::ok(dfm_world_stable_step(world, &h, nullptr, nullptr));
    return std::min(5e-4, 0.99 * h);
  }
};

}  // namespace

TEST(Report, OfAFreeImpact_IsTheMomentumThatWasExchanged) {
  Impact s;
  const Vec start = momentum(s.left) + momentum(s.right);
  const double scale = 0.4 * test::measure(s.left).mass;
  int touching = 0;
  double largest = 0;
  for (int i = 0; i < 200; ++i) {
    const Vec l = momentum(s.left), r = momentum(s.right);
    const dfm_body_measure before = test::measure(s.left);
    const double h = s.dt();
    ASSERT_EQ(dfm_world_step(s.world, h, nullptr), DFM_OK) << dfm_last_error();
    ASSERT_EQ(test::stats(s.world).last_substeps, 1u);
    const Vec dl = momentum(s.left) - l, dr = momentum(s.right) - r;
    near(dl + dr, {0, 0, 0}, 1e-12 * scale, "action and reaction");
    const dfm_body_measure after = test::measure(s.left);
    Vec counted;
    for (size_t k = 0; k < 3; ++k) counted[k] = after.contact_impulse[k] - before.contact_impulse[k];
    near(counted, dl, 1e-12 * scale, "contact_impulse");

    // contacts, one by one; a contact between bodies may stand on either side
    Vec sum{};
    uint32_t sticking = 0;
    double normal = 0;
    const auto contacts = test::contacts(s.world);
    for (size_t k = 1; k < contacts.size(); ++k)
      EXPECT_LT(contacts[k - 1].key, contacts[k].key) << "in key order";
    for (const dfm_contact &c : contacts) {
      ASSERT_TRUE((c.body_a == s.left && c.body_b == s.right) || (c.body_a == s.right && c.body_b == s.left));
      const Vec f = force(c);
      for (size_t k = 0; k < 3; ++k) sum[k] += (c.body_a == s.left ? h : -h) * f[k];
      sticking += (c.flags & DFM_CONTACT_STICKING) != 0;
      normal += c.fn;
      EXPECT_GE(c.fn, 0);
      EXPECT_LE(std::hypot(c.ft[0], c.ft[1]), 0.4 * c.fn * (1 + 1e-9) + 1e-12) << "inside Coulomb's cone";
      EXPECT_LT(c.kind, 2u);
    }
    near(sum, dl, 1e-12 * scale, "sum over contacts");

    const auto pairs = test::pairs(s.world);
    ASSERT_EQ(pairs.size(), contacts.empty() ? 0u : 1u);
    if (pairs.empty()) continue;
    const dfm_pair_report &p = pairs[0];
    EXPECT_EQ(p.a, s.left);
    EXPECT_EQ(p.b, s.right);
    EXPECT_EQ(p.count, contacts.size());
    EXPECT_EQ(p.sticking, sticking);
    EXPECT_NEAR(p.normal, normal, 1e-12 * (1 + normal));
    near({h * p.force[0], h * p.force[1], h * p.force[2]}, dl, 1e-12 * scale, "resultant of the pair");
    EXPECT_LE(p.friction_work, 1e-12) << "friction takes energy";

    // forces on surfels, of both bodies
    for (const auto &[body, change] : {std::pair{s.left, dl}, std::pair{s.right, dr}}) {
      std::vector<double> f(3 * 4096);
      uint32_t n = 0;
      test::ok(dfm_surface_forces(body, 4096, f.data(), &n));
      Vec total{};
      for (uint32_t j = 0; j < n; ++j)
        for (size_t k = 0; k < 3; ++k) total[k] += h * f[3 * j + k];
      near(total, change, 1e-12 * scale, "forces on surfels");
    }
    touching += p.count > 0;
    largest = std::max(largest, p.normal);
  }
  EXPECT_GT(touching, 5);
  EXPECT_GT(largest, 0.1);
  near(momentum(s.left) + momentum(s.right), start, 1e-12 * scale, "momentum of all");
  EXPECT_EQ(test::contacts(s.world).size(), 0u) << "they have parted";
}

TEST(Events, BeginAndEndOfEachContact_AlternateAndBalance) {
  Impact s;
  std::map<uint64_t, bool> open;
  size_t begins = 0, ends = 0;
  for (int i = 0; i < 200; ++i) {
    ASSERT_EQ(dfm_world_step(s.world, s.dt(), nullptr), DFM_OK) << dfm_last_error();
    for (const dfm_contact_event &e : test::events(s.world)) {
      ASSERT_TRUE(e.kind == DFM_EVENT_BEGIN || e.kind == DFM_EVENT_END);
      EXPECT_EQ(open[e.key], e.kind == DFM_EVENT_END)
          << "a contact begins when it is not there and ends when it is";
      open[e.key] = e.kind == DFM_EVENT_BEGIN;
      (e.kind == DFM_EVENT_BEGIN ? begins : ends) += 1;
      EXPECT_TRUE((e.a == s.left && e.b == s.right) || (e.a == s.right && e.b == s.left));
      EXPECT_DOUBLE_EQ(e.t, dfm_world_time(s.world));
    }
    size_t now = 0;
    for (const auto &[key, is] : open) now += is;
    const auto contacts = test::contacts(s.world);
    ASSERT_EQ(contacts.size(), now) << "the events tell what touches";
    for (const dfm_contact &c : contacts) EXPECT_TRUE(open[c.key]);
    EXPECT_EQ(test::stats(s.world).contacts, now);
  }
  EXPECT_GT(begins, 3u);
  EXPECT_EQ(begins, ends);
}

TEST(Events, NotRead_AreKeptUntilTheyAre) {
  Impact s;
  for (int i = 0; i < 200; ++i) ASSERT_EQ(dfm_world_step(s.world, s.dt(), nullptr), DFM_OK);
  uint32_t n = 0, again = 0;
  dfm_contact_event one;
  EXPECT_EQ(dfm_world_events(s.world, 1, &one, &n), DFM_E_ARG);
  EXPECT_GT(n, 1u);
  std::vector<dfm_contact_event> all(n);
  test::ok(dfm_world_events(s.world, n, all.data(), &again));
  EXPECT_EQ(again, n) << "a refused call takes none away";
  for (size_t i = 1; i < all.size(); ++i) EXPECT_LE(all[i - 1].t, all[i].t);
  test::ok(dfm_world_events(s.world, 0, nullptr, &n));
  EXPECT_EQ(n, 0u);
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Report, OfABodyAtRest_CarriesItsWeight) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  test::run(s.world, 1.0, 1e-3);
  const double before = test::measure(s.lower).contact_impulse[2];
  double floor_force = 0, between = 0, moment = 0;
  for (int i = 0; i < 500; ++i) {
    ASSERT_EQ(dfm_world_step(s.world, 1e-3, nullptr), DFM_OK);
    const auto pairs = test::pairs(s.world);
    ASSERT_EQ(pairs.size(), 2u);
    EXPECT_TRUE(pairs[0].a == s.lower && pairs[0].b == s.floor && pairs[1].a == s.lower &&
                pairs[1].b == s.upper)
        << "in order of creation";
    for (const auto &p : pairs) {
      (p.b == s.floor ? floor_force : between) += p.force[2] / 500;
      if (p.b == s.floor) moment += std::hypot(p.moment[0], p.moment[1]) / 500;
    }
  }
  const double weight = test::measure(s.upper).mass * 9.81;
  EXPECT_NEAR(floor_force, 2 * weight, 0.01 * weight);
  EXPECT_NEAR(between, -weight, 0.01 * weight) << "the upper one presses the lower one down";
  EXPECT_NEAR((test::measure(s.lower).contact_impulse[2] - before) / 0.5, weight, 0.01 * weight)
      << "net: carries itself";
  EXPECT_NEAR(moment, weight * std::hypot(0.013, 0.007), 0.1 * weight * 0.015)
      << "the upper one stands off center";
}
