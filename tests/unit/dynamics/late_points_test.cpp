// Held bodies of the models modal and condensed: a step moves the points that a surfel hangs on or that are
// held, and looks at no other one; who asks for the others sees them where a host that moves all of them has
// them.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "../world/inside.h"
#include "support.h"
#include "world.h"

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// The shipped block under its probe, coarser.
struct Probed {
  test::Context context;
  dfm_scene scene = 0;
  dfm_world world = 0;
  dfm_body body = 0;
  explicit Probed(const char *model, std::vector<std::string> more = {}, dfm_context *other = nullptr) {
    std::vector<std::string> set{std::string("/bodies/0/model/type=\"") + model + '"',
                                 "/bodies/0/mesh/cells=1500", "/contact/tolerance=1e-12",
                                 "/materials/tissue/damping/stiffness=0.001"};
    set.insert(set.end(), more.begin(), more.end());
    std::vector<const char *> texts;
    for (const std::string &s : set) texts.push_back(s.c_str());
    dfm_scene_options options{};
    options.size = sizeof options;
    options.nset = uint32_t(texts.size());
    options.set = texts.data();
    const std::string path = std::string(DEFORM_SOURCE_DIR) + "/examples/scenes/probe_block.json";
    test::ok(dfm_scene_open(other ? other : context, path.c_str(), &options, &scene));
    test::ok(dfm_scene_world(scene, &world));
    uint32_t n = 0;
    test::ok(dfm_world_bodies(world, 1, &body, &n));
  }
  ~Probed() { dfm_scene_close(scene); }
  dfm::Body &inside() const { return *test::inside(world).bodies[0]; }

  test::State state() const { return test::State(body); }
  // An impact without a force: the points lead in the next step.
  void touch() const {
    const double point[3] = {}, none[3] = {};
    test::ok(dfm_body_apply_impulse(body, point, none));
  }
  uint32_t contacts() const { return test::stats(world).contacts; }
};

// Largest component of the difference over that of the way since the start.
double apart(const Probed &a, const Probed &b) {
  const auto at = a.state(), with = b.state();
  double most = 0, way = 0;
  for (size_t j = 0; j < at.x.size(); ++j) {
    most = std::max(most, std::fabs(at.x[j] - with.x[j]));
    way = std::max(way, std::fabs(at.x[j] - a.inside().p.rest[j]));
  }
  return most / way;
}

class LatePoints : public testing::TestWithParam<const char *> {};

// Numbers that are not finite in all points that a step has no need of: it reads none and writes none.
TEST_P(LatePoints, StepWithContact_LeavesInnerPointsAlone) {
  const Probed w(GetParam()), whole(GetParam());
  test::run(w.world, 0.05, 1e-3);
  test::run(whole.world, 0.05, 1e-3);
  dfm::Body &b = w.inside();
  std::vector<uint8_t> near(b.p.n, 0);
  for (uint32_t s = 0; s < b.surface.nsurfel; ++s) near[b.surface.point[s]] = 1;
  uint32_t inner = 0;
  for (uint32_t i = 0; i < b.p.n; ++i) {
    if (near[i] || b.p.held[i]) continue;
    ++inner;
    for (dfm::Array<double> *a : {&b.p.x, &b.p.v, &b.p.x_end, &b.p.v_end})
      for (size_t k = 0; k < 3; ++k) (*a)[4 * size_t(i) + k] = kNan;
  }
  ASSERT_GT(inner, 100u);
  test::run(w.world, 0.1, 1e-3);
  test::run(whole.world, 0.1, 1e-3);
  ASSERT_GT(w.contacts(), 0u);
  uint32_t untouched = 0;
  for (uint32_t i = 0; i < b.p.n; ++i) untouched += std::isnan(b.p.x[4 * size_t(i)]);
  EXPECT_EQ(untouched, inner);
  EXPECT_EQ(dfm_world_hash(w.world), dfm_world_hash(whole.world));
  for (const double x : w.state().x) ASSERT_TRUE(std::isfinite(x));
}

// unsanitized: too slow there; shorter tests run the same code
TEST_P(LatePoints, SeenAfterEachStepOrNever_AreTheSame) {
  const Probed a(GetParam()), b(GetParam());
  for (int n = 0; n < 200; ++n) {
    test::run(a.world, 1e-3, 1e-3);
    a.state();
  }
  for (int n = 0; n < 200; ++n) test::run(b.world, 1e-3, 1e-3);
  ASSERT_GT(b.contacts(), 0u);
  EXPECT_EQ(dfm_world_hash(a.world), dfm_world_hash(b.world));
}

// The same body where the points lead in each step, so that all of them are moved. The probe comes to its
// first contact with impacts, each of which sticks or slips by the last digits: without friction none does.
// Rounding grows tenfold in twenty steps, until it decides about a sweep: the two are compared before that.
// unsanitized: too slow there; shorter tests run the same code
TEST_P(LatePoints, OfASlidingProbe_AreThoseOfAStepThatMovesAll) {
  const std::vector<std::string> more{"/contact/friction/0/params/mu=0"};
  const Probed late(GetParam(), more), whole(GetParam(), more);
  for (int n = 0; n < 120; ++n) {
    test::run(late.world, 1e-3, 1e-3);
    whole.touch();
    test::run(whole.world, 1e-3, 1e-3);
  }
  ASSERT_GT(late.contacts(), 0u);
  EXPECT_LT(apart(late, whole), 1e-8);
}

// What a step cannot do near the surface alone: held points that move, a load on some points. Without
// friction, as above.
TEST_P(LatePoints, OfABodyThatIsMovedOrLoaded_AreThoseOfAStepThatMovesAll) {
  const std::vector<std::string> more{"/contact/friction/0/params/mu=0"};
  const Probed late(GetParam(), more), whole(GetParam(), more);
  std::vector<uint32_t> held, top{late.inside().surface.point[late.inside().surface.nsurfel / 2]};
  for (uint32_t i = 0; i < late.inside().p.n; ++i)
    if (late.inside().p.held[i]) held.push_back(i);
  dfm_pose_key keys[3]{};
  for (int k = 0; k < 3; ++k) {
    keys[k].t = 0.02 + 0.02 * k;
    keys[k].pose.rotation[3] = 1;
    keys[k].pose.position[0] = k ? 0.004 : 0;
  }
  const double force[] = {0, 0, 0.05};
  for (const Probed *p : {&late, &whole}) {
    const std::vector<double> x = p->state().x;
    test::ok(dfm_body_move_held(p->body, uint32_t(held.size()), held.data(), 3, keys, nullptr));
  }
  for (int n = 0; n < 110; ++n) {
    if (n == 50 || n == 80)
      for (const Probed *p : {&late, &whole}) {
        if (n == 50) test::ok(dfm_body_add_load(p->body, 1, top.data(), force, 0, nullptr, nullptr, nullptr));
        else test::ok(dfm_body_remove_load(p->body, 1));
      }
    test::run(late.world, 1e-3, 1e-3);
    whole.touch();
    test::run(whole.world, 1e-3, 1e-3);
  }
  // Points that are not moved are off by all.
  EXPECT_LT(apart(late, whole), 1e-5);
}

TEST_P(LatePoints, AfterAnImpulseOfTheHost_MoveAccordingly) {
  const Probed w(GetParam());
  test::run(w.world, 0.05, 1e-3);
  const double point[] = {0.15, 0.1, 0.1}, impulse[] = {0, 0, -0.02};
  const dfm_body_measure before = test::measure(w.body);
  test::ok(dfm_body_apply_impulse(w.body, point, impulse));
  EXPECT_NEAR(test::measure(w.body).momentum[2] - before.momentum[2], -0.02, 1e-12);
  const Probed none(GetParam());
  test::run(none.world, 0.05, 1e-3);
  test::run(w.world, 3e-3, 1e-3);
  test::run(none.world, 3e-3, 1e-3);
  EXPECT_LT(test::measure(w.body).momentum[2], test::measure(none.body).momentum[2] - 1e-3);
  test::ok(dfm_body_set_state(w.body, w.inside().p.n, w.state().x.data(),
                              std::vector<double>(3 * w.inside().p.n, 0.0).data()));
  EXPECT_EQ(test::measure(w.body).speed_max, 0);
}

TEST_P(LatePoints, SavedAndRestored_ContinueWithTheSameBits) {
  const Probed a(GetParam()), b(GetParam());
  test::run(a.world, 0.12, 1e-3);
  const std::string saved = test::snapshot(a.world);
  test::run(a.world, 0.1, 1e-3);
  test::run(b.world, 0.03, 1e-3);
  test::ok(dfm_world_restore(b.world, saved.data(), saved.size()));
  test::run(b.world, 0.1, 1e-3);
  EXPECT_EQ(dfm_world_hash(a.world), dfm_world_hash(b.world));
}

// Energies and the first moment by coordinates and by points, pressed, sliding, and let go of.
TEST_P(LatePoints, Sums_AreThoseOfAllPoints) {
  const Probed w(GetParam());
  for (int n = 0; n < 5; ++n) {
    test::run(w.world, 0.06, 1e-3);
    dfm::Body &b = w.inside();
    dfm::BodySums sums;
    ASSERT_TRUE(b.dynamics->sums(sums));
    b.dynamics->see_points();
    double kinetic = 0, elastic = 0, first[3] = {};
    for (uint32_t i = 0; i < b.p.n; ++i)
      for (size_t k = 0; k < 3; ++k) {
        const size_t at = 4 * size_t(i) + k;
        kinetic += 0.5 * b.p.mass[i] * b.p.v[at] * b.p.v[at];
        first[k] += b.p.mass[i] * b.p.x[at];
      }
    const dfm_kin kin = b.dynamics->kin(0, 0);
    ASSERT_EQ(b.model.ops->energy(b.model.self, &kin, &elastic), DFM_OK);
    EXPECT_NEAR(sums.kinetic, kinetic, 1e-9 * kinetic);
    EXPECT_NEAR(sums.elastic, elastic, 1e-9 * elastic);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(sums.first[k], first[k], 1e-12 * b.mass);
  }
}

// Coordinates that grow by themselves, as those of a model with a fault would: the watch looks at no inner
// point, and stops the run.
TEST_P(LatePoints, PumpedBody_IsStopped) {
  const Probed w(GetParam());
  test::run(w.world, 0.05, 1e-3);
  dfm::Body &b = w.inside();
  for (uint32_t i = 0; i < b.p.n; ++i) {
    if (b.p.held[i] || std::find(b.surface.point.begin(), b.surface.point.end(), i) != b.surface.point.end())
      continue;
    for (size_t k = 0; k < 3; ++k) b.p.x[4 * size_t(i) + k] = b.p.v[4 * size_t(i) + k] = kNan;
  }
  dfm_status status = DFM_OK;
  uint32_t trouble = 0;
  for (int n = 0; n < 2000 && status == DFM_OK; ++n) {
    for (int k = 0; k < 80; ++k) b.model.state[2 + k] *= 1.01;
    status = dfm_world_step(w.world, 1e-3, &trouble);
  }
  EXPECT_EQ(status, DFM_E_DIVERGED);
  EXPECT_TRUE(trouble & DFM_TROUBLE_ENERGY);
}

// The probe presses a tenth of the height: the log says that this is more than small, though nobody asks for
// a point.
TEST_P(LatePoints, LargeGradient_IsReportedWithoutUpdatingPoints) {
  std::string log;
  dfm_context_def def = dfm_context_def_default();
  def.threads = 1;
  def.plugin_dir = DEFORM_PLUGIN_DIR;
  def.user = &log;
  def.log = [](void *user, int32_t, const char *text) { *static_cast<std::string *>(user) += text; };
  dfm_context *context = nullptr;
  test::ok(dfm_context_create(&def, &context));
  {
    const Probed w(GetParam(),
                   {"/obstacles/0/motion/keyframes/1/position=[0.07,0.1,0.135]",
                    "/obstacles/0/motion/keyframes/2/position=[0.07,0.1,0.135]"},
                   context);
    test::run(w.world, 0.2, 1e-3);
    EXPECT_NE(log.find("the displacement gradient reaches"), std::string::npos);
  }
  dfm_context_destroy(context);
}

INSTANTIATE_TEST_SUITE_P(Of, LatePoints, testing::Values("modal", "condensed"),
                         [](const auto &one) { return std::string(one.param); });

}  // namespace
