// The energy that a hand puts into a coupled tool, watched from both ends, with devices that jitter or are late.
#include <deque>
#include <random>

#include "rigid.h"

namespace {

constexpr double kStep = 1e-3;

// A block on a table, and a ball above it that hangs on a device.
struct Scene {
  test::Context context;
  dfm_world w = test::make_world(context, {0, 0, 0});
  dfm_body block;
  dfm_tool tool = 0;
  Scene(double young, double stiffness, double damping, uint32_t flags, double late = 0) {
    test::set_friction(w, 0.5);
    test::BodyOptions o;
    o.name = "block";
    o.young = young;
    o.damping_stiffness = 1e-4;
    o.position = {-0.03, -0.03, -0.03};
    o.integrator = DFM_INTEGRATOR_IMPLICIT_EULER;
    o.model = "corotational_fem";
    block = test::make_body(context, w, "beam", {0.06, 0.06, 0.03}, 60, o);
    test::hold_bottom(block);
    dfm_tool_def d = dfm_tool_def_default();
    d.name = "ball";
    d.radius = 0.01;
    d.pose.position[2] = 0.011;
    d.stiffness = stiffness;
    d.damping = damping;
    d.turn_stiffness = 0.2;
    d.turn_damping = 1e-3;
    d.flags = flags;
    d.late = late;
    test::ok(dfm_tool_create(w, &d, &tool));
  }
  dfm_tool_state state() const {
    dfm_tool_state s{};
    s.size = sizeof s;
    test::ok(dfm_tool_get_state(tool, &s));
    return s;
  }
};

// A hand: mass on a spring and a damper towards where it wants to be; what it feels acts for a step.
struct Hand {
  double x, v = 0, mass = 0.2, stiffness = 150, damping = 3;
  double given = 0, most = 0;  // J into the device so far, and the most that it ever was
  double move(double want, double felt) {
    v = (mass * v + kStep * (stiffness * (want - x - kStep * v) + felt)) / (mass + kStep * damping);
    x += kStep * v;
    given -= felt * kStep * v;
    most = std::max(most, given);
    return x;
  }
};

}  // namespace

TEST(ToolPassive, Explore) {
  for (const double stiffness : {300.0, 1000.0, 3000.0})
    for (const int late : {0, 10})
      for (const uint32_t flags : {0u, uint32_t(DFM_TOOL_PASSIVE)}) {
        Scene s(2e6, stiffness, 1.0, flags, 1e-3 * late);
        Hand hand{0.011};
        std::mt19937 random(7);
        std::deque<double> force(size_t(late) + 1, 0.0);
        double least = 0, port = 0, swing = 0, top = -1, low = 1;
        for (int i = 0; i < 2000; ++i) {
          const double want = i < 300 ? 0.011 - 1e-2 * i / 300 : 0.001;
          hand.move(want, force.front());
          const dfm_pose p = {{0, 0, hand.x}, {0, 0, 0, 1}};
          test::ok(dfm_tool_set_pose(s.tool, &p, nullptr));
          test::ok(dfm_world_step(s.w, kStep, nullptr));
          double f[3], t[3];
          test::ok(dfm_tool_feedback(s.tool, f, t));
          force.push_back(f[2]);
          force.pop_front();
          least = std::min(least, hand.given);
          port = std::min(port, s.state().port_work);
          if (i >= 1500) top = std::max(top, hand.x), low = std::min(low, hand.x);
        }
        swing = top - low;
        std::printf(
            "k %5.0f late %2d passive %u: hand %9.2e J least %9.2e, port least %9.2e, work %9.2e, swing "
            "%8.2e m, at %g force %g\n",
            stiffness, late, flags, hand.given, least, port, s.state().work, swing, hand.x, force.back());
      }
}
