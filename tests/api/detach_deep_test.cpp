// A body that is let go while what held it stands deep in it comes out of it, whatever that does then.
#include "deform/tool.h"
#include "rigid.h"

namespace {

struct Case {
  const char *model;
  double half_width;  // m, of the box: 0.004 stands within the body, 0.03 reaches beyond its sides
  double depth;       // m, by which the box has moved into the body
  double speed;       // m/s, upwards, with which it goes on
  double dt;          // s
};

// A block on a table, one side of its top attached to a box, which goes down through the rest of the top.
struct Held {
  test::Context context;
  dfm_world w;
  dfm_body block;
  dfm_tool box = 0;
  dfm_pose pose;
  uint32_t number = 0;
  explicit Held(const Case &c) : w(test::make_world(context)) {
    test::set_friction(w, 0.4);
    test::add_plane(w, "table");
    test::BodyOptions o;
    o.name = "block";
    o.model = c.model;
    o.young = 3e4;
    o.damping_stiffness = 2e-3;
    o.position = {-0.02, -0.02, 0.0005};
    block = test::make_body(context, w, "beam", {0.04, 0.04, 0.04}, 400, o);
    dfm_tool_def d = dfm_tool_def_default();
    d.name = "box";
    d.shape = DFM_TOOL_BOX;
    d.half_size[0] = d.half_size[2] = 0.01;
    d.half_size[1] = c.half_width;
    d.pose.position[2] = 0.0512;
    test::ok(dfm_tool_create(w, &d, &box));
    pose = d.pose;
    const double around[] = {0.008, -1, 0.035, 1, 1, 1};
    dfm_attach_def a = dfm_attach_def_default();
    a.to = test::listed(dfm_tool_parts, box)[0];
    a.box = around;
    test::ok(dfm_body_attach(block, &a, &number));
  }
  void step(double way, double dt) {
    pose.position[2] = std::max(pose.position[2] + way, 0.03);
    test::ok(dfm_tool_set_pose(box, &pose, nullptr));
    test::ok(dfm_world_step(w, dt, nullptr));
  }
};

}  // namespace

// Before the guard let out what reaches into a box, most of these ended at a thousand meters a second.
TEST(Detach, DeepInABox_TheBodyComesOutOfItQuietly) {
  const Case cases[] = {{"msm", 0.03, 0.005, 0.2, 1e-3},
                        {"msm", 0.004, 0.005, 0, 1e-3},
                        {"msm", 0.004, 0.015, -0.1, 1e-3},
                        {"msm", 0.03, 0.015, 0, 1.0 / 60},
                        {"corotational_fem", 0.03, 0.005, 0.2, 1e-3},
                        {"msm", 0.004, 0.005, -1, 1e-3}};
  for (const Case &c : cases) {
    SCOPED_TRACE(std::string(c.model) + " " + std::to_string(c.half_width) + " " + std::to_string(c.depth) +
                 " " + std::to_string(c.speed) + " " + std::to_string(c.dt));
    Held h(c);
    for (double way = 0; way < c.depth; way += 0.1 * c.dt) h.step(-0.1 * c.dt, c.dt);
    const double stored = test::measure(h.block).elastic;
    test::ok(dfm_body_detach(h.block, h.number));
    double most = 0;
    for (double t = 0; t < 0.15; t += c.dt) {
      h.step(c.speed * c.dt, c.dt);
      const dfm_body_measure m = test::measure(h.block);
      most = std::max(most, m.kinetic);
      ASSERT_LT(m.speed_max, 10) << "after " << t << " s";
    }
    // what moves is what was stored, and what the box puts in where it goes on
    EXPECT_LT(most, c.speed < 0 ? 0.1 : stored);
    if (c.speed > 0) {
      const std::vector<double> x = test::points(h.block);
      double top = 0;
      for (size_t i = 2; i < x.size(); i += 3) top = std::max(top, x[i]);
      EXPECT_LT(top, h.pose.position[2] - 0.01) << "it has left the box";
    }
  }
}
