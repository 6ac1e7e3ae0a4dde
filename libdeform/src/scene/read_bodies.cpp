#include <algorithm>
#include <cmath>

#include "dynamics/mass_scaling.h"
#include "scene/keys.h"
#include "scene/read.h"
#include "scene/rotation.h"

namespace dfm::scene {
namespace {

// x, y, z, w
void read_quaternion(const Node &rotation, double out[4]) {
  for (const char *key : {"axis", "angle_deg"})
    if (rotation.has(key))
      rotation.member(key).fail(
          "a rotation is given by \"axis\" and \"angle_deg\" or by \"quaternion\"; keep one");
  const Node node = rotation.member("quaternion");
  const std::vector<Node> items = node.items();
  if (items.size() != 4) node.fail("expected four numbers [x, y, z, w], found %zu", items.size());
  double square = 0;
  for (size_t k = 0; k < 4; ++k) {
    out[k] = items[k].number(Range{-1e100, 1e100, false, false});
    square += out[k] * out[k];
  }
  if (!(square > 1e-200)) node.fail("the quaternion of a rotation cannot be zero");
}

void read_rotation(const Node &holder, double out[4]) {
  Quat q;
  if (holder.has("rotation")) {
    const Node node = holder.member("rotation").object("rotation");
    if (node.has("quaternion")) return read_quaternion(node, out);
    double axis[3];
    read_direction(node.at("axis"), "the axis of a rotation", axis);
    q = rotation(axis, node.at("angle_deg").number());
  }
  store_quat(out, q);
}

}  // namespace

dfm_pose read_placed(const Node &start, const dfm_pose &otherwise, Quat turn) {
  dfm_pose pose = otherwise;
  if (start.has("position")) start.member("position").vector(pose.position);
  if (start.has("rotation")) {
    read_rotation(start, pose.rotation);
    store_quat(pose.rotation, load_quat(pose.rotation) * turn);
  }
  return pose;
}

uint64_t read_id(const Node &node) {
  return node.has("id") ? uint64_t(read_count(node.member("id"), 1, 4294967295.0)) : 0;
}

dfm_pose read_pose(const Node &holder, const char *kind, double *scale) {
  dfm_pose pose = {{0, 0, 0}, {0, 0, 0, 1}};
  if (!holder.has("pose")) return pose;
  const Node node = holder.member("pose").object(kind);
  node.vector("position", pose.position, 0, 0, 0);
  read_rotation(node, pose.rotation);
  // no default is written back: MeshFiles warns of units where the scene says no scale
  if (scale && node.has("scale")) *scale = node.member("scale").number(kPositive);
  return pose;
}

namespace {

Selection read_selection(const Node &entry) {
  Selection s;
  s.pointer = entry.pointer();
  if (int(entry.has("box")) + int(entry.has("group")) + int(entry.has("points")) != 1)
    entry.fail("expected one of \"box\", \"group\" and \"points\" to say which points");
  if (entry.has("points")) {
    const std::vector<Node> points = entry.member("points").items();
    if (points.empty()) entry.member("points").fail("expected at least one node of the mesh file");
    for (const Node &p : points) s.points.push_back(read_count(p, 0, 4294967294.0));
    return s;
  }
  if (entry.has("group")) {
    s.group = entry.member("group").text();
    return s;
  }
  const Node box = entry.member("box");
  const std::vector<Node> corners = box.items();
  if (corners.size() != 2) box.fail("expected two corners [[x, y, z], [x, y, z]], found %zu", corners.size());
  corners[0].vector(s.lo);
  corners[1].vector(s.hi);
  for (int i = 0; i < 3; ++i)
    if (s.lo[i] > s.hi[i])
      box.fail("the first corner is the lower one; in %c it has %g and the second %g", "xyz"[i], s.lo[i],
               s.hi[i]);
  return s;
}

}  // namespace

std::vector<dfm_pose_key> read_keys(const Node &motion, const dfm_pose &base, Quat turn) {
  return read_keyframes<dfm_pose_key>(motion, "motion_key", [&](const Node &node, dfm_pose_key &key) {
    key.pose = read_placed(node, base, turn);
  });
}

namespace {

Motion read_motion(const Node &motion, const dfm_pose &base, Quat turn) {
  Motion out;
  motion.object("motion");
  if (!motion.has("keyframes") && !motion.has("sine"))
    motion.fail("expected \"keyframes\", \"sine\" or both");
  out.keys = read_keys(motion, base, turn);
  if (motion.has("sine")) out.sine = read_sine(motion.member("sine"), false);
  return out;
}

uint8_t read_axes(const Node &entry) {
  const Node node = entry.member("axes", "xyz");
  uint8_t bits = 0;
  for (char c : node.text()) {
    if (c < 'x' || c > 'z') node.fail("expected letters out of \"xyz\", found \"%s\"", node.text().c_str());
    bits |= uint8_t(1u << (c - 'x'));
  }
  return bits;
}

Fix read_fix(const Node &entry) {
  Fix fix;
  entry.object("fix");
  fix.where = read_selection(entry);
  fix.axes = read_axes(entry);
  const dfm_pose still = {{0, 0, 0}, {0, 0, 0, 1}};
  if (entry.has("motion")) fix.motion = read_motion(entry.member("motion"), still, Quat{});
  return fix;
}

Force read_force(const Node &entry) {
  Force force;
  entry.object("force");
  force.where = read_selection(entry);
  entry.at("total").vector(force.total);
  force.by = entry.word("by", "auto", "by");
  const auto scale = [](const Node &node, dfm_scale_key &key) { key.value = node.at("scale").number(); };
  force.keys = read_keyframes<dfm_scale_key>(entry, "force_key", scale, false);
  if (entry.has("sine")) force.sine = read_sine(entry.member("sine"), true);
  return force;
}

Spring read_spring(const Node &entry) {
  Spring spring;
  entry.object("spring");
  spring.pointer = entry.pointer();
  spring.at_point = entry.has("point");
  int said = 0;
  for (const char *key : {"point", "points", "box", "group"}) said += entry.has(key);
  if (said != 1)
    entry.fail("expected one of \"point\", \"points\", \"box\" and \"group\" to say where the spring pulls");
  if (spring.at_point) entry.member("point").vector(spring.point);
  else spring.where = read_selection(entry);
  if (entry.has("to") == entry.has("keyframes"))
    entry.fail("expected either \"to\" or \"keyframes\" to say where the spring ends");
  if (entry.has("to")) entry.member("to").vector(spring.def.to);
  spring.keys = read_keyframes<dfm_vector_key>(
      entry, "spring_key",
      [](const Node &node, dfm_vector_key &key) { node.at("position").vector(key.value); });
  spring.def.stiffness = entry.at("stiffness").number(kNotNegative);
  spring.def.damping = entry.number("damping", 0.0, kNotNegative);
  return spring;
}

Attach read_attach(const Node &entry) {
  Attach attach;
  entry.object("attach");
  attach.pointer = entry.pointer();
  attach.to = entry.at("to").text();
  attach.where = read_selection(entry);
  attach.def.max_distance = entry.number("max_distance", 0.0, kNotNegative);
  attach.def.stiffness = entry.number("stiffness", 0.0, kNotNegative);
  attach.def.damping = entry.number("damping", 0.0, kNotNegative);
  attach.def.release = entry.number("release", 0.0, kNotNegative);
  if (entry.boolean("touch", false)) attach.def.flags = DFM_ATTACH_TOUCH;
  return attach;
}

dfm_separate_def read_separate(const Node &node) {
  dfm_separate_def def = dfm_separate_def_default();
  node.object("separate");
  def.least_cells = node.has("least_cells") ? read_count(node.at("least_cells"), 1, UINT32_MAX) : 1;
  def.crumbs = number_of("crumbs", node.word("crumbs", "stay", "crumbs"));
  return def;
}

constexpr double kLargestSeed = 4294967295.0;

// {"make": "cylinder", "radius", "length", "cells"} and so on, with the keys of that shape and no others.
MadeMesh read_made(const Node &node) {
  MadeMesh made;
  node.object("made_mesh");
  made.kind = node.at("make").word("make");
  static const std::vector<KeyOf> kKeys = {{"radius", {"cylinder", "ball", "tube"}},
                                           {"inner", {"tube"}},
                                           {"length", {"cylinder", "tube"}},
                                           {"size", {"beam", "bricks"}}};
  check_keys_of(node, kKeys, "a", made.kind);
  const bool tube = made.kind == "tube";
  if (made.kind == "beam" || made.kind == "bricks") {
    read_sizes(node.at("size"), "edges", made.size);
  } else {
    const double radius = node.at("radius").number(kPositive);
    size_t k = 0;
    if (tube) made.size[k++] = node.at("inner").number({0, radius, true, true});
    made.size[k++] = radius;
    if (tube || made.kind == "cylinder") made.size[k] = node.at("length").number(kPositive);
  }
  made.cells = read_count(node.member("cells", 1000), 1, 1e8);
  made.order = read_count(node.member("order", 1), 1, 2);
  return made;
}

Start read_start(const Node &node) {
  node.object("start");
  Start out;
  out.pointer = node.pointer();
  if (node.value().size() != 1)
    node.fail(
        "expected one of \"scramble\", \"flatten\", \"invert\" and \"state\" to say how the body begins");
  if (node.has("scramble")) {
    out.kind = StartKind::scramble;
    out.seed = read_count(node.member("scramble"), 0, kLargestSeed);
  } else if (node.has("flatten")) {
    constexpr StartKind kOnto[] = {StartKind::plane, StartKind::line, StartKind::point};
    out.kind = kOnto[number_of("flatten", node.member("flatten").word("flatten"))];
  } else if (node.has("state")) {
    out.kind = StartKind::state;
    out.state = node.member("state").text();
  } else if (node.member("invert").boolean()) {
    out.kind = StartKind::invert;
  }
  return out;
}

// The key of the library among the parameters of the model.
void read_precision(const Node &model, Params &params) {
  if (!model.has("precision") || model.member("precision").word("precision") == "double") return;
  params.keys.push_back("precision");
  params.values.push_back({1});
}

ModelWords read_model(const Node &node, const Registry &types) {
  ModelWords out;
  const dfm_type *const type = read_type(node.at("type"), DFM_KIND_MODEL, types);
  out.type = type->id;
  if (node.has("params")) out.params = read_params(node.member("params"), type);
  read_precision(node, out.params);
  if (!node.has("integrator")) return out;
  out.integrator = integrator_of(node);
  if (out.integrator == DFM_INTEGRATOR_AUTO)
    node.member("integrator")
        .fail(
            "a change of model names symplectic_euler, implicit_euler or tr_bdf2, or leaves the body's own");
  return out;
}

void read_switches(const Node &list, const Registry &types, Body &b) {
  for (const Node &entry : list.items()) {
    Switch s;
    entry.object("switch");
    s.pointer = entry.pointer();
    s.t = entry.at("t").number(Range{0, HUGE_VAL, false, true});
    s.model = read_model(entry, types);
    if (entry.has("max_jump")) s.max_jump = entry.member("max_jump").number(kPositive);
    b.switches.push_back(std::move(s));
  }
}

// A model by name only, or with its inputs.
ModelWords read_word(const Node &rule, const char *key, const Registry &types) {
  if (!rule.has(key)) return {};
  const Node node = rule.member(key);
  if (node.value().is_object()) return read_model(node.object("switch_model"), types);
  ModelWords out;
  out.type = read_type(node, DFM_KIND_MODEL, types)->id;
  return out;
}

void read_rule(const Node &rule, const Registry &types, SwitchRule &out) {
  rule.object("switch_rule");
  out.touching = read_word(rule, "touching", types);
  out.near = read_word(rule, "near", types);
  rule.at("far");
  out.far = read_word(rule, "far", types);
  if (!out.near.type.empty()) {
    rule.at("point").vector(out.values.point);
    out.values.distance = rule.at("distance").number(kPositive);
    out.values.hysteresis = rule.number("hysteresis", out.values.hysteresis, kNotNegative);
  } else {
    for (const char *key : {"point", "distance", "hysteresis"})
      if (rule.has(key)) rule.member(key).fail("this is for \"near\", which names no model here");
  }
  out.values.wait = rule.number("wait", out.values.wait, kNotNegative);
  if (rule.has("max_jump")) out.values.max_jump = rule.member("max_jump").number(kPositive);
}

// Keys that belong to one model leave nothing to choose.
void check_open(const Node &body, const Node &model) {
  const char *const sentence =
      "this goes with one model, which the planner would choose; name it in /model/type";
  for (const char *key : {"params", "precision"})
    if (model.has(key)) model.member(key).fail("%s", sentence);
  for (const char *key : {"fields", "anisotropy", "switch"})
    if (body.has(key)) body.member(key).fail("%s", sentence);
}

// The model of a card has its own defaults: it is no other name for that of the processor.
void read_device(const Node &body, const dfm_type *named, const Registry &types, Body &b) {
  if (!body.has("device")) return;
  const Node node = body.member("device");
  const std::string device = node.word("device");
  const dfm_type *const other = named ? off_card(types, *named) : nullptr;
  if (device != "gpu" && other)
    node.fail("%s is the model of a graphics card; name %s in /model/type, or take \"device\": \"gpu\"",
              named->id, other->id);
  if (device != "cpu" && !other) b.device = device;
}

}  // namespace

Body read_body(const Node &node, ReadContext &context) {
  Body b;
  read_thing(node.object("body"), context, b);
  context.bodies.push_back(b.name);
  const Node mesh = node.at("mesh");
  if (mesh.value().is_object()) b.made = read_made(mesh);
  else b.mesh = mesh.text();
  const Node model = node.part("model");
  if (context.planned) b.model_open = !model.has("type") || model.value()["type"] == "auto";
  if (b.model_open) check_open(node, model);
  // Parameters are read as those of a model before the cells are known.
  if (!model.has("type") && (model.has("params") || node.has("fields") || node.has("anisotropy")))
    model.value()["type"] = "msm";
  const dfm_type *type = nullptr;
  if (model.has("type") && !b.model_open)
    type = read_type(model.member("type"), DFM_KIND_MODEL, context.types);
  read_device(node, type, context.types, b);
  if (type) b.model = type->id;
  b.def.integrator = integrator_of(node);
  if (model.has("params")) b.params = read_params(model.member("params"), type);
  read_precision(model, b.params);
  b.has_scale = node.has("pose") && node.member("pose").has("scale");
  b.def.pose = read_pose(node, "pose", &b.scale);
  if (node.has("place")) b.on = node.member("place").object("place").at("on").text();
  node.vector("velocity", b.def.velocity, 0, 0, 0);
  node.vector("spin", b.def.spin, 0, 0, 0);
  for (const Node &entry : node.items("fix")) b.fixes.push_back(read_fix(entry));
  for (const Node &entry : node.items("forces")) b.forces.push_back(read_force(entry));
  for (const Node &entry : node.items("springs")) b.springs.push_back(read_spring(entry));
  for (const Node &entry : node.items("attach")) b.attach.push_back(read_attach(entry));
  b.def.mass_scaling = node.number("mass_scaling", 0.0, Range{0, kMaxScaled, false, false});
  b.def.smooth = node.number("smooth", 0.0, Range{0, 180, false, false});
  b.cut_delay = node.number("cut_delay", 0.0, kNotNegative);
  if (node.has("separate")) b.separate = read_separate(node.member("separate"));
  read_carriers(node, type, context, b);
  if (node.has("switch")) {
    const Node change = node.member("switch");
    if (!change.value().is_object() && !change.value().is_array())
      change.fail(
          "expected an array of changes by time, as [{\"t\": 1.0, \"type\": \"msm\"}], or a rule, as "
          "{\"far\": \"msm\", \"touching\": \"corotational_fem\"}");
    if (change.value().is_object()) read_rule(change, context.types, b.rule);
    else read_switches(change, context.types, b);
  }
  if (node.has("start")) b.start = read_start(node.member("start"));
  if (node.has("nodal_bc")) b.nodal_bc = node.member("nodal_bc").text();
  return b;
}

void check_shape_keys(const Node &node, const std::string &shape) {
  static const std::vector<KeyOf> kKeys = {
      {"point", {"plane"}},   {"normal", {"plane"}},        {"radius", {"sphere", "capsule"}},
      {"half_size", {"box"}}, {"half_length", {"capsule"}}, {"mesh", {"mesh", "voxels"}},
      {"cells", {"voxels"}}};
  check_keys_of(node, kKeys, "the shape", shape);
}

template <class Def>
void read_solid(const Node &node, const std::string &shape, Def &def) {
  def.shape = number_of("shape", shape);
  if (shape == "box") return read_sizes(node.at("half_size"), "half sizes", def.half_size);
  def.radius = node.at("radius").number(kPositive);
  if (shape == "capsule") def.half_length = node.at("half_length").number(kNotNegative);
}
template void read_solid(const Node &node, const std::string &shape, dfm_obstacle_def &def);
template void read_solid(const Node &node, const std::string &shape, dfm_rigid_def &def);

namespace {

Quat read_plane(const Node &node, dfm_obstacle_def &def) {
  double normal[3];
  if (node.has("pose") && node.has("point"))
    node.member("point").fail("a plane is placed by \"point\" or by \"pose\", not by both");
  if (!node.has("pose")) node.vector("point", def.pose.position, 0, 0, 0);
  read_direction(node.member("normal", 0.0, 0.0, 1.0), "the normal of a plane", normal);
  const Quat turn = rotation_to(normal);
  store_quat(def.pose.rotation, load_quat(def.pose.rotation) * turn);
  return turn;
}

constexpr double kFewestVoxels = 64, kMaxVoxels = 1 << 28;

}  // namespace

Obstacle read_obstacle(const Node &node, ReadContext &context) {
  Obstacle o;
  o.def = dfm_obstacle_def_default();
  read_thing(node.object("obstacle"), context, o);
  const std::string shape = node.at("shape").word("shape");
  check_shape_keys(node, shape);
  const bool of_triangles = shape == "mesh" || shape == "voxels";
  if (node.has("pose") && !of_triangles && node.member("pose").has("scale"))
    node.member("pose").at("scale").fail("a %s has its own size; \"scale\" is for the shapes mesh and voxels",
                                         shape.c_str());
  o.def.pose = read_pose(node, "obstacle_pose", of_triangles ? &o.scale : nullptr);
  o.def.shape = number_of("shape", shape);
  Quat turn;
  if (shape == "plane") {
    turn = read_plane(node, o.def);
  } else if (of_triangles) {
    o.mesh = node.at("mesh").text();
    if (node.has("cells")) o.def.cells = read_count(node.at("cells"), kFewestVoxels, kMaxVoxels);
  } else {
    read_solid(node, shape, o.def);
  }
  if (node.has("motion")) {
    Motion motion = read_motion(node.member("motion"), o.def.pose, turn);
    o.keys = std::move(motion.keys);
    o.def.sine = motion.sine;
  }
  node.vector("velocity_surface", o.def.velocity_surface, 0, 0, 0);
  if (node.has("start")) {
    const Node start = node.member("start").object("obstacle_start");
    if (node.has("motion"))
      start.fail("a \"motion\" gives the place of the obstacle at every time; remove one of the two");
    o.start = read_placed(start, o.def.pose, turn);
  }
  return o;
}

}  // namespace dfm::scene
