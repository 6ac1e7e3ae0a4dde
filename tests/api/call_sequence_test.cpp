// Calls in random order: each works, or fails with a sentence and has changed nothing; values stay finite; a
// snapshot goes on with the same bits, and a second run of the calls has the same results.
//
// A seed is a sequence. DEFORM_SEQUENCES="FIRST COUNT CALLS" runs others than the few below; with COUNT 1
// each call is printed, and DEFORM_LEFT_OUT="3 17 .." leaves some out: others draw what they drew before.
#include <cstdlib>
#include <cstring>
#include <map>
#include <sstream>

#include "call_sequence.h"
#include "support.h"
#include "tool.h"

namespace {

using test::Random;
using test::Sequence;

struct Call {
  const char *name;
  uint32_t weight;
  dfm_status (*make)(Sequence &, Random &);
  bool keeps = false;  // where it fails, what it did up to there remains
};

// Two snapshots; beyond the head, which has their checksum.
void expect_same(const std::string &a, const std::string &b, const std::string &what) {
  if (a == b) return;
  size_t at = std::min<size_t>(40, b.size());
  while (at < std::min(a.size(), b.size()) && a[at] == b[at]) ++at;
  ADD_FAILURE() << what << ": " << a.size() << " and " << b.size() << " bytes, different from " << at
                << " on";
}

// 1 to 8 of one length, some of them twice: from a snapshot they end in the same bits.
dfm_status step(Sequence &s, Random &r) {
  const double h = r.one_in(40) ? r.power(-7, -1) : r.power(-4.3, -2.3);
  const bool again = r.one_in(3);
  dfm_status status = DFM_OK;
  for (uint32_t n = 1 + r.below(8); n && status == DFM_OK; --n) {
    const std::string before = again ? test::snapshot(s.world) : "";
    if (r.one_in(60)) test::ok(dfm_world_interrupt(s.world));
    uint32_t trouble = 0;
    status = dfm_world_step(s.world, h, &trouble);
    if (!again || (trouble & DFM_TROUBLE_INTERRUPTED)) continue;
    const uint64_t after = dfm_world_hash(s.world);
    const double time = dfm_world_time(s.world);
    test::ok(dfm_world_restore(s.world, before.data(), before.size()));
    expect_same(test::snapshot(s.world), before, "a snapshot that was restored");
    EXPECT_EQ(dfm_world_step(s.world, h, &trouble), status) << dfm_last_error();
    EXPECT_EQ(dfm_world_hash(s.world), after) << "a step from a snapshot";
    EXPECT_EQ(dfm_world_time(s.world), time);
  }
  return status;
}

dfm_status equilibrium(Sequence &s, Random &r) {
  dfm_equilibrium_def d = dfm_equilibrium_def_default();
  d.load_steps = r.below(3);
  d.max_iterations = 20 + r.below(200);
  d.time = r.one_in(3) ? r.number(0, 0.05) : 0;
  return dfm_world_equilibrium(s.world, &d, nullptr);
}

dfm_status make_body(Sequence &s, Random &r) {
  const std::vector<dfm_body> there = test::listed(dfm_world_bodies, s.world);
  if (there.size() > 5) return dfm_body_destroy(r.of(there));
  dfm_body_def d = dfm_body_def_default();
  const dfm_mesh_info mesh = test::lend(r.of(s.meshes), d);
  const dfm_type *const model = r.of(s.models);
  const test::RandomParams params(r, model, r.one_in(2) ? 0 : 3);
  d.model = model->id;
  d.model_params = params.params();
  d.material = s.material(r);
  d.pose = s.pose(r);
  s.vector(r, d.velocity, 1);
  s.vector(r, d.spin, r.one_in(2) ? 0 : 5);
  if (r.one_in(3)) d.category = d.collides_with = uint32_t(r.bits());
  if (r.one_in(2)) d.integrator = int32_t(r.below(4));
  if (r.one_in(8)) d.mass_scaling = r.number(0, 0.1);
  if (r.one_in(4)) d.smooth = r.number(0, 60);
  std::vector<uint8_t> fixed(mesh.npoint);
  for (uint8_t &f : fixed) f = r.one_in(8) ? uint8_t(r.below(8)) : 0;
  if (r.one_in(4)) d.fixed = fixed.data();
  std::vector<double> share(mesh.ntet), young(mesh.ntet);
  for (double &x : share) x = r.number(0.3, 1);
  for (double &x : young) x = r.power(3.5, 5);
  if (r.one_in(10)) d.cell_share = share.data();
  const dfm_cell_field field{"young", young.data(), 1};
  if (r.one_in(6)) d.fields = &field;
  d.nfield = d.fields ? 1 : 0;
  std::vector<dfm_material> materials(mesh.ntet);
  for (dfm_material &m : materials) m = s.material(r);
  if (r.one_in(8)) d.cell_materials = materials.data();
  const dfm_mesh_info shell = test::info_of(s.shell);
  dfm_surface_def surface{};
  surface.size = sizeof surface;
  surface.coupling = int32_t(r.below(3));
  surface.npoint = shell.npoint;
  surface.ntriangle = shell.nface;
  surface.points = shell.points;
  surface.triangles = shell.faces;
  if (d.npoint && r.one_in(4)) d.surface = &surface;
  const char *const part = "part";
  const dfm_mesh_info &skin = d.surface ? shell : mesh;
  std::vector<uint32_t> some(3 * size_t{skin.nface ? 10u : 0u}), group(some.size() / 3);
  for (size_t i = 0; i < some.size(); ++i) some[i] = skin.faces[i];
  const dfm_surface_groups groups{sizeof groups, 1,           &part, uint32_t(group.size()), 0,
                                  some.data(),   group.data()};
  if (!group.empty()) d.groups = &groups;
  dfm_body b = 0;
  return s.made(dfm_body_create(s.world, &d, &b), b);
}

dfm_status make_obstacle_def(Sequence &s, Random &r,
                             const std::function<dfm_status(const dfm_obstacle_def &)> &use) {
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.shape = r.below(DFM_SHAPE_VOXELS + 1);
  d.pose = s.pose(r);
  if (d.shape == DFM_SHAPE_PLANE) d.pose = {{0, 0, r.number(-0.1, 0.02)}, {r.number(-0.1, 0.1), 0, 0, 1}};
  for (double &h : d.half_size) h = r.number(0.01, 0.1);
  d.radius = r.number(0.01, 0.06);
  d.half_length = r.number(0, 0.05);
  const test::tools::BoxMesh box({d.half_size[0], d.half_size[1], d.half_size[2]});
  if (d.shape >= DFM_SHAPE_MESH) {
    const uint32_t shape = d.shape;
    box.put(d);
    d.shape = shape;
    d.cells = 500;
    if (r.one_in(3)) d.ntriangle -= 2;  // open
  }
  const std::vector<dfm_pose_key> keys = s.pose_keys(r);
  if (r.one_in(3)) {
    d.nkey = uint32_t(keys.size());
    d.keys = keys.data();
  }
  if (r.one_in(4)) d.sine = s.sine(r);
  if (r.one_in(4)) s.vector(r, d.velocity_surface, 0.5);
  if (r.one_in(4)) d.category = d.collides_with = uint32_t(r.bits());
  d.material = s.material(r);
  return use(d);
}

dfm_status make_tool(Sequence &s, Random &r) {
  dfm_tool_def d = dfm_tool_def_default();
  d.shape = r.below(DFM_TOOL_BLADE + 1);
  d.pose = s.pose(r);
  for (double &h : d.half_size) h = r.number(0.003, 0.03);
  d.radius = r.number(0.002, 0.02);
  d.half_length = r.number(0, 0.03);
  d.opening = r.number(0, 1);
  const test::tools::BoxMesh box({d.half_size[0], d.half_size[1], d.half_size[2]});
  if (d.shape == DFM_TOOL_MESH) box.put(d);
  if (r.one_in(2)) {
    d.stiffness = r.power(1, 3);
    d.damping = r.power(-1, 1);
    d.turn_stiffness = r.power(-2, 0);
    d.turn_damping = r.power(-4, -2);
    d.late = r.one_in(3) ? r.number(0, 0.1) : 0;
    d.flags = r.one_in(3) ? DFM_TOOL_PASSIVE : 0;
  }
  const std::vector<dfm_pose_key> keys = s.pose_keys(r);
  const std::vector<dfm_scale_key> opening = s.scale_keys(r);
  d.nkey = uint32_t(keys.size());
  d.keys = keys.data();
  d.nopening = uint32_t(opening.size());
  d.opening_keys = opening.data();
  d.material = s.material(r);
  dfm_tool t = 0;
  return s.made(dfm_tool_create(s.world, &d, &t), t);
}

dfm_status make_rigids(Sequence &s, Random &r) {
  std::vector<dfm_rigid_def> bodies(r.below(4));
  for (dfm_rigid_def &d : bodies) {
    const uint32_t shapes[] = {DFM_SHAPE_SPHERE, DFM_SHAPE_BOX, DFM_SHAPE_CAPSULE, DFM_SHAPE_NONE};
    d = dfm_rigid_def_default();
    d.shape = r.of(shapes);
    d.pose = s.pose(r);
    for (double &h : d.half_size) h = r.number(0.01, 0.04);
    d.radius = r.number(0.01, 0.03);
    d.half_length = r.number(0.005, 0.03);
    d.mass = r.power(-2, 0.5);
    if (d.shape == DFM_SHAPE_NONE)
      for (double &i : d.inertia) i = 1e-4;
    s.vector(r, d.velocity, 0.5);
    d.fixed = r.one_in(5);
    d.material = s.material(r);
  }
  std::vector<dfm_joint_def> joints(bodies.empty() ? 0 : r.below(3));
  for (dfm_joint_def &j : joints) {
    const uint32_t with = r.one_in(2) ? DFM_RIGID_WORLD : r.below(bodies.size());
    j = test::joint(r.below(4), r.below(bodies.size()), with, {0, 0, 0});
    s.vector(r, j.anchor, 0.1);
    j.motor = j.type <= DFM_JOINT_SLIDER ? r.below(2) : 0;
    j.velocity = r.number(-2, 2);
    j.max = r.number(0, 2);
  }
  const dfm_rigid_set_def set{
      sizeof set, uint32_t(bodies.size()), uint32_t(joints.size()), 0, bodies.data(), joints.data(), nullptr};
  std::vector<dfm_rigid> out(bodies.size() + 1);
  const dfm_status status = dfm_rigid_create(s.world, nullptr, &set, out.data());
  for (size_t i = 0; i < bodies.size(); ++i) s.made(status, out[i]);
  return status;
}

dfm_status make_material(Sequence &s, Random &r) {
  dfm_material_def d = dfm_material_def_default();
  const char *const names[] = {nullptr, "one", "two"};
  d.name = r.of(names);
  d.density = r.power(2, 3.5);
  d.young = r.power(3.5, 5.5);
  d.poisson = r.number(0, 0.45);
  d.damping_mass = r.number(0, 5);
  d.damping_stiffness = r.one_in(2) ? r.power(-4, -2.5) : 0;
  const double friction = r.number(0, 1), tear = r.power(-1.3, 0), fracture = r.power(-1, 2);
  const dfm_param_value all[] = {
      {"friction", &friction, 1}, {"tear", &tear, 1}, {"fracture_energy", &fracture, 1}};
  const uint32_t n = r.one_in(3) ? r.below(4) : 1;
  d.extra = {sizeof(dfm_params), n, all};
  dfm_material m = 0;
  const dfm_status status = s.made(dfm_material_create(s.world, &d, &m), m);
  if (status == DFM_OK) s.materials.push_back(m);
  return status;
}

dfm_status destroy(Sequence &s, Random &r) {
  switch (r.below(5)) {
    case 0: return dfm_body_destroy(s.body(r));
    case 1: return dfm_obstacle_destroy(s.obstacle(r));
    case 2: return dfm_tool_destroy(s.tool(r));
    case 3: return dfm_rigid_destroy(s.rigid(r));
    default: return dfm_material_destroy(s.any(r, s.materials));
  }
}

dfm_status attach(Sequence &s, Random &r) {
  const dfm_body b = s.body(r);
  dfm_attach_def d = dfm_attach_def_default();
  d.to = s.thing(r);
  d.flags = r.below(2);
  const std::vector<uint32_t> points = s.indices(r, s.info(b).npoint, 4),
                              surfels = s.indices(r, s.info(b).nsurfel, 4);
  if (r.one_in(2)) d.npoint = uint32_t(points.size());
  d.points = points.data();
  d.nsurfel = uint32_t(surfels.size());
  d.surfels = surfels.data();
  if (r.one_in(5)) d.group = "part";
  double box[6] = {-0.2, -0.2, -0.2, 0.2, 0.2, 0.2};
  if (r.one_in(5)) d.box = box;
  if (r.one_in(3)) d.max_distance = r.number(0, 0.05);
  if (r.one_in(2)) {
    d.stiffness = r.power(0, 4);
    d.damping = r.power(-2, 1);
  }
  if (r.one_in(3)) d.release = r.power(-2, 2);
  return dfm_body_attach(b, &d, nullptr);
}

dfm_status set_model(Sequence &s, Random &r) {
  const dfm_body b = s.body(r);
  std::vector<test::RandomParams> params;
  const auto choice = [&](auto &to) {
    const dfm_type *const type = r.of(s.models);
    params.emplace_back(r, type, r.one_in(2) ? 0 : 2);
    to.type = type->id;
    to.params = params.back().params();
    to.integrator = int32_t(r.below(4));
  };
  params.reserve(3);
  dfm_switch_rule rule = dfm_switch_rule_default();
  dfm_switch later[3] = {dfm_switch_default(), dfm_switch_default(), dfm_switch_default()};
  double point[3];
  s.near_center(r, b, point);
  switch (r.below(8)) {
    case 0:
      if (r.one_in(4)) return dfm_body_set_switch_rule(b, nullptr);
      if (r.one_in(2)) choice(rule.touching);
      if (r.one_in(2)) choice(rule.near_by);
      choice(rule.otherwise);
      std::copy(point, point + 3, rule.point);
      rule.distance = r.number(0.01, 0.1);
      rule.wait = r.number(0, 0.02);
      return dfm_body_set_switch_rule(b, &rule);
    case 1: {
      const uint32_t n = r.below(4);
      double t = dfm_world_time(s.world);
      for (uint32_t i = 0; i < n; ++i) {
        choice(later[i]);
        later[i].t = t += r.number(0, 0.02);
        later[i].max_jump = r.one_in(2) ? r.power(-6, 0) : 0;
      }
      return dfm_body_set_switches(b, n, later);
    }
    case 2: return dfm_body_set_interest(b, point);
    default: choice(later[0]); return dfm_body_set_model(b, later[0].type, &later[0].params);
  }
}

dfm_status set_state(Sequence &s, Random &r) {
  const dfm_body b = s.body(r);
  const uint32_t n = s.info(b).npoint;
  std::vector<double> x(3 * size_t{n}), v(x);
  uint32_t got = 0;
  dfm_body_get_state(b, n, x.data(), v.data(), &got);
  const double size = r.one_in(2) ? 0 : r.power(-5, -2.5), speed = r.one_in(4) ? 0 : r.power(-2, 0.5);
  double shift[3] = {0, 0, 0};
  if (r.one_in(3)) s.vector(r, shift, 0.05);
  for (size_t i = 0; i < x.size(); ++i) {
    x[i] += shift[i % 3] + r.plain(-size, size);
    v[i] = r.one_in(3) ? 0 : r.plain(-speed, speed);
  }
  if (n && r.one_in(40)) x[r.below(x.size())] = r.one_in(2) ? NAN : 1e7;
  return dfm_body_set_state(b, r.one_in(40) ? r.count(n) : n, r.one_in(3) ? nullptr : x.data(),
                            r.one_in(3) ? nullptr : v.data());
}

dfm_status loads(Sequence &s, Random &r) {
  const dfm_body b = s.body(r);
  const std::vector<uint32_t> points = s.indices(r, s.info(b).npoint, 5);
  const uint32_t n = uint32_t(points.size());
  std::vector<double> force(3 * points.size() + 3);
  for (double &f : force) f = r.number(-0.5, 0.5);
  const dfm_sine sine = s.sine(r);
  const dfm_sine *const maybe = r.one_in(2) ? &sine : nullptr;
  const std::vector<dfm_pose_key> poses = s.pose_keys(r);
  const std::vector<dfm_scale_key> scales = s.scale_keys(r);
  const std::vector<dfm_vector_key> ends = s.vector_keys(r, 0.1);
  double point[3];
  s.near_center(r, b, point);
  switch (r.below(9)) {
    case 0: return dfm_body_hold(b, n, points.data(), uint8_t(r.below(8)));
    case 1: return dfm_body_move_held(b, n, points.data(), uint32_t(poses.size()), poses.data(), maybe);
    case 2:
      return dfm_body_add_load(b, n, points.data(), force.data(), uint32_t(scales.size()), scales.data(),
                               maybe, nullptr);
    case 3: return dfm_body_remove_load(b, s.joined(r, b));
    case 4: {
      dfm_spring_def d{};
      d.size = sizeof d;
      d.npoint = n;
      d.points = points.data();
      if (r.one_in(3)) d.weights = force.data();
      std::copy(point, point + 3, d.to);
      d.nkey = uint32_t(ends.size());
      d.keys = ends.data();
      d.stiffness = r.power(0, 3);
      d.damping = r.power(-3, 0);
      return dfm_body_add_spring(b, &d, nullptr);
    }
    case 5: return dfm_body_set_spring_target(b, s.joined(r, b), point);
    case 6: return dfm_body_get_spring_force(b, s.joined(r, b), force.data());
    case 7: return dfm_body_remove_spring(b, s.joined(r, b));
    default: return dfm_body_apply_impulse(b, point, force.data());
  }
}

dfm_status cut(Sequence &s, Random &r) {
  const dfm_body b = s.body(r);
  dfm_cut_def d = dfm_cut_def_default();
  d.shape = r.below(4);
  d.how = d.shape >= DFM_CUT_BLADE ? r.below(2) : 0;
  s.near_center(r, b, d.pose.position);
  for (double &h : d.half_size) h = r.number(0, 0.02);
  s.vector(r, d.motion, 0.02);
  s.near_center(r, b, d.blade);
  for (int k = 3; k < 12; ++k)
    d.blade[k] = r.number(-0.1, 0.1) + (d.shape == DFM_CUT_BLADE ? d.blade[k % 3] : 0);
  d.most = r.one_in(3) ? r.below(5) : 0;
  dfm_separate_def separate = dfm_separate_def_default();
  separate.least_cells = r.below(6);
  separate.crumbs = r.below(2);
  const std::vector<uint32_t> cells = s.indices(r, s.info(b).ntet, r.one_in(20) ? 400 : 5);
  dfm_cut_info info{};
  info.size = sizeof info;
  switch (r.below(10)) {
    case 0:
      return dfm_body_plan_cut(b, dfm_world_time(s.world) + r.number(0, 0.02), r.one_in(6) ? nullptr : &d);
    case 1: return dfm_body_remove_cells(b, uint32_t(cells.size()), cells.data(), &info);
    case 2: return dfm_body_separate(b, r.one_in(3) ? nullptr : &separate, &info);
    case 3: return dfm_body_set_separate(b, r.one_in(3) ? nullptr : &separate);
    case 4: return dfm_body_set_cut_delay(b, r.one_in(3) ? 0 : r.number(0, 0.02));
    default: return dfm_body_cut(b, &d, r.one_in(2) ? nullptr : &info);
  }
}

dfm_status tools(Sequence &s, Random &r) {
  const dfm_tool t = s.tool(r);
  const dfm_body b = s.body(r);
  dfm_tool_state now{};
  now.size = sizeof now;
  dfm_pose near = s.pose(r);
  if (dfm_tool_get_state(t, &now) == DFM_OK && !r.one_in(8)) {
    near = now.pose;
    for (double &x : near.position) x += r.number(-5e-3, 5e-3);
  }
  double six[6];
  s.vector(r, six, 0.5);
  s.vector(r, six + 3, 0.5);
  uint32_t held[3], n = 0;
  dfm_body bodies[3] = {b, s.body(r), s.body(r)};
  static const dfm_device device = {sizeof device, 0, nullptr,
                                    [](void *, double time, dfm_device_sample *out) -> dfm_status {
                                      out->pose = {{0.05 * std::sin(9 * time), 0, 0.08}, {0, 0, 0, 1}};
                                      return dfm_status(int64_t(time * 1e4) % 3 == 0);
                                    },
                                    nullptr};
  switch (r.below(12)) {
    case 0: return dfm_tool_set_opening(t, r.number(0, 1));
    case 1: return dfm_tool_follow_keys(t);
    case 2: return dfm_tool_teleport(t, &near);
    case 3: return dfm_tool_set_device(t, r.one_in(2) ? nullptr : &device);
    case 4:
    case 5:
      return dfm_tool_grab(t, b, r.one_in(2) ? 0 : r.number(0, 0.03), r.one_in(2) ? 0 : r.power(-2, 2), 3,
                           held, &n);
    case 6: return dfm_tool_set_cuts(t, r.below(2), r.below(3), r.below(4), bodies);
    case 7: return dfm_tool_force(t, six, six + 3);
    case 8: return dfm_tool_feedback(t, six, six + 3);
    default: return dfm_tool_set_pose(t, &near, r.one_in(2) ? six : nullptr);
  }
}

dfm_status obstacles(Sequence &s, Random &r) {
  const dfm_obstacle o = s.obstacle(r);
  dfm_pose p = s.pose(r);
  if (!r.one_in(6) && dfm_obstacle_get_pose(o, &p) == DFM_OK)
    for (double &x : p.position) x += r.number(-5e-3, 5e-3);
  double v[3];
  s.vector(r, v, 1);
  switch (r.below(5)) {
    case 0: return dfm_obstacle_teleport(o, &p);
    case 1: return dfm_obstacle_set_velocity_surface(o, v);
    case 2: return dfm_obstacle_set_filter(o, uint32_t(r.bits()), r.one_in(4) ? 0 : UINT32_MAX);
    case 3: return dfm_obstacle_set_material(o, s.material(r));
    default: return dfm_obstacle_move_to(o, &p);
  }
}

dfm_status rigids(Sequence &s, Random &r) {
  const dfm_rigid body = s.rigid(r);
  dfm_rigid_state state{};
  double x[3];
  switch (r.below(5)) {
    case 0: {
      const dfm_pose p = s.pose(r);
      std::memcpy(&state, &p, sizeof p);
      s.vector(r, state.velocity, 0.5);
      s.vector(r, state.spin, 5);
      return dfm_rigid_set_state(body, &state);
    }
    case 1: return dfm_rigid_set_motor(body, r.below(3), r.number(-3, 3), r.number(0, 2));
    case 2: return dfm_rigid_joint(body, r.below(3), &x[0], &x[1], &x[2]);
    default:
      return make_obstacle_def(s, r, [&](const dfm_obstacle_def &d) {
        dfm_obstacle o = 0;
        return s.made(dfm_rigid_add_shape(r.one_in(3) ? s.obstacle(r) : body, &d, &o), o);
      });
  }
}

dfm_status rules(Sequence &s, Random &r) {
  const std::string a = s.name(r), b = s.name(r);
  const dfm_type *const law = r.of(s.laws);
  const test::RandomParams params(r, law, 3);
  const dfm_params given = params.params();
  dfm_friction_def d{};
  d.size = sizeof d;
  d.between[0] = a.c_str();
  d.between[1] = b.c_str();
  d.law = law->id;
  d.params = given;
  if (r.one_in(3)) {
    d.flags = DFM_FRICTION_RESTITUTION;
    d.restitution = r.number(0, 1);
  }
  switch (r.below(7)) {
    case 0: return dfm_world_set_friction(s.world, a.c_str(), b.c_str(), &given);
    case 1: return dfm_world_remove_friction(s.world, a.c_str(), b.c_str());
    case 2: return dfm_world_filter_pair(s.world, a.c_str(), b.c_str(), r.below(2));
    case 3: return dfm_world_remove_filter(s.world, a.c_str(), b.c_str());
    default: return dfm_world_add_friction(s.world, &d);
  }
}

// What a step calls; from there the world cannot be changed.
bool may_touch(void *user, uint64_t a, uint64_t b) {
  Sequence &s = *static_cast<Sequence *>(user);
  s.callbacks.push_back(dfm_body_wake(a));
  const auto number = [&](uint64_t thing) {
    return std::find(s.ever.begin(), s.ever.end(), thing) - s.ever.begin();
  };
  return (number(a) + number(b)) % 5 != 0;
}
void pre_solve(void *user, dfm_contact_choice *c) {
  Sequence &s = *static_cast<Sequence *>(user);
  s.callbacks.push_back(dfm_world_set_sleep(s.world, true));
  c->enabled = c->key % 7 != 0;
  c->friction_scale = double(c->key % 3);
  c->surface_velocity[0] = 0.1;
}

dfm_status world(Sequence &s, Random &r) {
  const dfm_world w = s.world;
  double g[3];
  s.vector(r, g, 10);
  const std::vector<dfm_vector_key> keys = s.vector_keys(r, 10);
  const dfm_body b = s.body(r);
  const test::RandomParams params(r, r.of(s.models), 2);
  const dfm_params given = params.params();
  double creep = 0;
  switch (r.below(18)) {
    case 0: return dfm_world_set_gravity(w, g);
    case 1: return dfm_world_set_gravity_keys(w, uint32_t(keys.size()), keys.data());
    case 2: return dfm_world_set_sleep(w, r.below(3));
    case 3: return dfm_world_set_budget(w, 0, uint64_t(r.plain(1e3, 1e4)));
    case 4: return dfm_world_untangle(w, nullptr);
    case 5: return dfm_world_find_overlaps(w, nullptr);
    case 6: return dfm_world_set_may_touch(w, r.one_in(2) ? nullptr : may_touch, &s);
    case 7: return dfm_world_ask_again(w, s.thing(r), r.one_in(2) ? 0 : s.thing(r));
    case 8: return dfm_world_set_pre_solve(w, r.one_in(2) ? nullptr : pre_solve, &s);
    case 9: return dfm_world_hold_begin(w);
    case 10: return dfm_world_hold(w, &creep, nullptr);
    case 11: return dfm_body_wake(b);
    case 12: return dfm_body_set_sensor(b, r.one_in(3));
    case 13: return dfm_obstacle_set_sensor(s.obstacle(r), r.one_in(3));
    case 14: return dfm_body_set_filter(b, uint32_t(r.bits()), r.one_in(4) ? 0 : UINT32_MAX);
    case 15: return dfm_world_stable_step(w, &creep, nullptr, nullptr);
    default: return dfm_body_set_params(b, &given);
  }
}

dfm_status snapshots(Sequence &s, Random &r) {
  if (s.snapshots.empty() || r.one_in(2)) {
    s.snapshots.push_back(test::snapshot(s.world));
    if (s.snapshots.size() > 6) s.snapshots.erase(s.snapshots.begin());
    return DFM_OK;
  }
  std::string bytes = r.of(s.snapshots);
  if (r.one_in(10)) bytes[r.below(bytes.size())] ^= char(1 << r.below(8));
  if (r.one_in(10)) bytes.resize(r.below(bytes.size()));
  return dfm_world_restore(s.world, bytes.data(), bytes.size());
}

dfm_status ask(Sequence &s, Random &r) {
  dfm_query_shape shape = dfm_query_shape_default();
  const uint32_t shapes[] = {DFM_SHAPE_SPHERE, DFM_SHAPE_BOX, DFM_SHAPE_CAPSULE, DFM_SHAPE_POINT,
                             DFM_SHAPE_CONVEX};
  shape.shape = r.of(shapes);
  shape.pose = s.pose(r);
  shape.flags = r.below(4);
  shape.radius = shape.shape == DFM_SHAPE_POINT ? 0 : r.number(0, 0.05);
  for (double &h : shape.half_size) h = r.number(0, 0.05);
  const double hull[12] = {0, 0, 0, 0.02, 0, 0, 0, 0.03, 0, 0, 0, 0.04};
  if (shape.shape == DFM_SHAPE_CONVEX) {
    shape.npoint = r.below(5);
    shape.points = hull;
  }
  double path[3];
  s.vector(r, path, 0.3);
  dfm_query_filter filter = dfm_query_filter_default();
  filter.what = r.below(16);
  if (r.one_in(4)) filter.only = s.thing(r);
  std::vector<dfm_query_hit> out(8);
  dfm_query_hits hits{sizeof hits, sizeof(dfm_query_hit), 8, 0, out.data()};
  const double from[3] = {0, 0, 0};
  double force[3];
  bool flag = false;
  uint64_t things[64];
  uint32_t n = 0;
  switch (r.below(6)) {
    case 0: return dfm_world_pair_wrench(s.world, s.thing(r), s.thing(r), from, force, nullptr);
    case 1: return dfm_sensor_things(s.thing(r), 64, things, &n);
    case 2: return dfm_body_is_asleep(s.body(r), &flag);
    default:
      return dfm_world_query(s.world, &shape, r.one_in(2) ? path : nullptr,
                             r.one_in(2) ? 0 : r.number(0, 0.5), r.one_in(2) ? &filter : nullptr, nullptr,
                             &hits);
  }
}

dfm_status events(Sequence &s, Random &) {
  size_t bytes = 0;
  // refused where something is too far from the origin, as a step is
  if (const dfm_status status = dfm_world_explain(s.world, nullptr, &bytes); status != DFM_OK) return status;
  test::listed(dfm_world_events, s.world);
  test::listed(dfm_world_swaps, s.world);
  test::listed(dfm_world_overlaps, s.world);
  return DFM_OK;
}

dfm_status stream(Sequence &s, Random &r) {
  dfm_stream_def d = dfm_stream_def_default();
  d.kind = r.below(2);
  d.flags = r.below(4);
  d.packet = r.one_in(2) ? 0 : 256 + r.below(2000);
  if (r.one_in(4)) d.body = s.thing(r);
  size_t bytes = 0;
  const dfm_status status = dfm_world_stream(s.world, &d, nullptr, &bytes);
  if (status != DFM_OK) return status;
  std::vector<uint8_t> out(bytes);
  return dfm_world_stream(s.world, &d, out.data(), &bytes);
}

// The world as a scene, in which a restored snapshot goes on with the same bits.
dfm_status write_scene(Sequence &s, Random &) {
  const std::string file = test::scratch("call_sequence") + "/w.json";
  dfm_scene_write_def d = dfm_scene_write_def_default();
  d.note = [](void *, const char *) {};
  const dfm_status status = dfm_world_write_scene(s.world, file.c_str(), &d, nullptr);
  if (status != DFM_OK) return status;
  dfm_world copy = 0;
  test::ok(dfm_scene_load(s.context, file.c_str(), &copy));
  if (!copy) return DFM_OK;
  const std::string state = test::snapshot(s.world);
  test::ok(dfm_world_restore(copy, state.data(), state.size()));
  EXPECT_EQ(dfm_world_hash(copy), dfm_world_hash(s.world));
  uint32_t trouble = 0;
  const dfm_status here = dfm_world_step(s.world, 1e-4, &trouble);
  EXPECT_EQ(dfm_world_step(copy, 1e-4, &trouble), here) << dfm_last_error();
  EXPECT_EQ(dfm_world_hash(copy), dfm_world_hash(s.world)) << "a step of the world that was written";
  test::ok(dfm_world_destroy(copy));
  return here;
}

const Call kCalls[] = {
    {"step", 60, step, true},
    {"equilibrium", 1, equilibrium, true},
    {"make_material", 4, make_material},
    {"make_body", 8, make_body},
    {"make_obstacle", 4,
     [](Sequence &s, Random &r) {
       return make_obstacle_def(s, r, [&](const dfm_obstacle_def &d) {
         dfm_obstacle o = 0;
         return s.made(dfm_obstacle_create(s.world, &d, &o), o);
       });
     }},
    {"make_tool", 4, make_tool},
    {"make_rigids", 3, make_rigids},
    {"destroy", 10, destroy},
    {"attach", 8, attach},
    {"detach", 2,
     [](Sequence &s, Random &r) {
       const dfm_body b = s.body(r);
       return dfm_body_detach(b, s.joined(r, b));
     }},
    {"set_model", 10, set_model},
    {"set_state", 6, set_state},
    {"loads", 14, loads},
    {"cut", 14, cut},
    {"tools", 16, tools},
    {"obstacles", 6, obstacles},
    {"rigids", 6, rigids},
    {"rules", 10, rules},
    {"world", 14, world},
    {"snapshots", 6, snapshots},
    {"ask", 6, ask},
    {"events", 2, events},
    {"stream", 2, stream},
    {"write_scene", 1, write_scene, true},
};

using Counts = std::map<std::pair<std::string, dfm_status>, int>;

// Hashes of the world after each call.
std::vector<uint64_t> run(dfm_context *context, uint64_t seed, uint32_t calls, bool print, Counts *counts) {
  std::set<uint32_t> left_out;
  if (const char *const list = std::getenv("DEFORM_LEFT_OUT")) {
    std::istringstream in(list);
    for (uint32_t i = 0; in >> i;) left_out.insert(i);
  }
  Sequence s(context, Random(seed, 0));
  std::vector<uint64_t> hashes;
  for (uint32_t i = 1; i <= calls && !testing::Test::HasFailure(); ++i) {
    if (left_out.contains(i)) continue;
    Random r(seed, i);
    uint32_t at = 0;
    for (const Call &c : kCalls) at += c.weight;
    at = r.below(at);
    const Call *call = kCalls;
    for (; at >= call->weight; ++call) at -= call->weight;
    if (i <= 12) call = &kCalls[2 + i % 5];  // first of all something there
    SCOPED_TRACE("seed " + std::to_string(seed) + ", call " + std::to_string(i) + ": " + call->name);
    if (print) std::fprintf(stderr, "%u %s\n", i, call->name);
    const std::string before = test::snapshot(s.world);
    const dfm_status status = call->make(s, r);
    const std::string said = status == DFM_OK ? "" : dfm_last_error();
    if (print && status != DFM_OK)
      std::fprintf(stderr, "    %s: %s\n", dfm_status_name(status), said.c_str());
    if (counts) ++(*counts)[{call->name, status}];
    if (status != DFM_OK) {
      EXPECT_FALSE(said.empty());
      EXPECT_EQ(said.find('\n'), std::string::npos) << said;
      EXPECT_NE(status, DFM_E_NOMEM) << said;
      EXPECT_NE(status, DFM_E_BUSY) << said;
      if (!call->keeps) {
        expect_same(test::snapshot(s.world), before, "changed by a call that failed: " + said);
      }
    }
    for (const dfm_status inner : s.callbacks) EXPECT_EQ(inner, DFM_E_BUSY);
    s.callbacks.clear();
    s.check();
    hashes.push_back(dfm_world_hash(s.world));
  }
  return hashes;
}

struct Asked {
  uint64_t first = 1;
  uint32_t count = 10, calls = 100;
  Asked() {
    if (const char *const given = std::getenv("DEFORM_SEQUENCES"))
      std::istringstream(given) >> first >> count >> calls;
  }
};

}  // namespace

TEST(CallSequence, OfAnySeed_WorksOrFailsWithASentence) {
  const test::Context c;
  const Asked asked;
  Counts counts;
  for (uint64_t seed = asked.first; seed < asked.first + asked.count && !HasFailure(); ++seed)
    run(c, seed, asked.calls, asked.count == 1, &counts);
  std::map<std::string, std::pair<int, int>> sums;
  for (const auto &[key, n] : counts) {
    (key.second == DFM_OK ? sums[key.first].first : sums[key.first].second) += n;
    if (asked.first != 1) std::printf("%-14s %-16s %d\n", key.first.c_str(), dfm_status_name(key.second), n);
  }
  if (HasFailure() || asked.count < 100) return;
  for (const Call &call : kCalls) EXPECT_GT(sums[call.name].first, 0) << call.name << " never works";
}

TEST(CallSequence, OnSeveralThreads_HasTheSameBits) {
  const test::Context one(1), several(3);
  const Asked asked;
  for (uint64_t seed = asked.first; seed < asked.first + (asked.count + 3) / 4 && !HasFailure(); ++seed)
    EXPECT_EQ(run(one, seed, asked.calls, false, nullptr), run(several, seed, asked.calls, false, nullptr))
        << seed;
}
