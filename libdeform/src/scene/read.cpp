#include "scene/read.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/names.h"
#include "core/path.h"
#include "plugin/params.h"
#include "plugin/registry.h"
#include "scene/keys.h"
#include "state/step_sizes.h"

namespace dfm::scene {

// ---- loaded types and their parameters --------------------------------------------------------------------

namespace {
constexpr std::string_view kOnCard = "_gpu";
}

const dfm_type *on_card(const Registry &types, const dfm_type &model) {
  return types.try_find(DFM_KIND_MODEL, std::string(model.id).append(kOnCard));
}

const dfm_type *off_card(const Registry &types, const dfm_type &model) {
  const std::string_view id = model.id;
  if (!id.ends_with(kOnCard)) return nullptr;
  return types.try_find(DFM_KIND_MODEL, id.substr(0, id.size() - kOnCard.size()));
}

std::vector<std::string> model_keys(const Registry &types) {
  std::vector<std::string> out;
  for (const dfm_type *t : types.list(DFM_KIND_MODEL))
    for (uint32_t i = 0; i < t->nparam; ++i) out.push_back(t->params[i].key);
  return out;
}

dfm_params Params::view() {
  rows.clear();
  for (size_t i = 0; i < keys.size(); ++i)
    rows.push_back({keys[i].c_str(), values[i].data(), uint32_t(values[i].size())});
  return {sizeof(dfm_params), uint32_t(rows.size()), rows.data()};
}

// The word for the default of a row that means a choice by the plugin.
constexpr const char *kAuto = "auto";

// A word of an enumeration; its number otherwise.
static double enum_value(const Node &value, const char *const *names) {
  std::vector<std::string> words;
  for (const char *const *n = names; *n; ++n) words.push_back(*n);
  const std::string word = value.text();
  const auto found = std::find(words.begin(), words.end(), word);
  if (found == words.end())
    value.fail("expected one of: %s; found \"%s\"", join(words).c_str(), word.c_str());
  return double(found - words.begin());
}

std::vector<double> read_param(const Node &value, const dfm_param &p) {
  if (value.value().is_string()) {
    if ((p.flags & DFM_PARAM_AUTO) && value.text() == kAuto)
      return std::vector<double>(p.width ? p.width : 1, p.def);
    const std::string unit = p.unit && std::string(p.unit) != "1" ? p.unit : "";
    if (!(p.flags & DFM_PARAM_ENUM) || !p.names)
      value.fail("expected a number%s%s, found \"%s\"", unit.empty() ? "" : " in ", unit.c_str(),
                 value.text().c_str());
    return {enum_value(value, p.names)};
  }
  std::vector<double> out;
  const Range range{p.min, p.max, false, false};
  if (value.value().is_boolean() && (p.flags & DFM_PARAM_INTEGER))
    out.push_back(value.value().get<bool>() ? 1 : 0);
  else if (value.value().is_array())
    for (const Node &item : value.items()) out.push_back(item.number(range));
  else out.push_back(value.number(range));
  const uint32_t width = p.width ? p.width : 1;
  if (p.flags & DFM_PARAM_LIST ? out.empty() || out.size() > width : out.size() != width)
    value.fail("expected %s%u number%s, found %zu", p.flags & DFM_PARAM_LIST ? "1 to " : "", width,
               width == 1 ? "" : "s", out.size());
  for (double x : out)
    if ((p.flags & (DFM_PARAM_INTEGER | DFM_PARAM_ENUM)) && x != std::floor(x))
      value.fail("expected a whole number, found %g", x);
  return out;
}

uint32_t read_count(const Node &node, double least, double most) {
  const double n = node.number();
  if (!(n >= least && n <= most) || n != std::floor(n))
    node.fail("expected a whole number from %.0f to %.0f, found %g", least, most, n);
  return uint32_t(n);
}

Params read_params(const Node &params, const dfm_type *type) {
  Params out;
  if (!params.value().is_object()) params.fail("expected an object of parameters by key");
  std::vector<std::string> valid;
  for (uint32_t i = 0; i < type->nparam; ++i) valid.push_back(type->params[i].key);
  // "mu" is shorthand for mu_C = mu_S; the law's own table may hold one or both.
  const bool shorthand = !find_row(*type, "mu") && find_row(*type, "mu_C");
  if (shorthand) valid.push_back("mu");
  for (const auto &entry : params.value().items()) {
    const Node value = params.member(entry.key());
    const dfm_param *p = find_row(*type, shorthand && entry.key() == "mu" ? "mu_C" : entry.key().c_str());
    if (!p) value.fail("%s", no_parameter(*type, "parameter", entry.key(), valid).c_str());
    out.keys.push_back(entry.key());
    out.values.push_back(read_param(value, *p));
  }
  return out;
}

// A file that was not loaded and why: the one that names this type, else the first; "": all were.
static std::string passed_over(const Registry &types, const std::string &name) {
  std::string first;
  for (const PassedFile &p : types.passed()) {
    const std::string line = p.file + ": " + p.reason;
    if (line.find(name) != std::string::npos) return line;
    if (first.empty()) first = line;
  }
  return first;
}

const dfm_type *read_type(const Node &name, uint32_t kind, const Registry &types) {
  const std::string wanted = name.text();
  if (const dfm_type *type = types.try_find(kind, wanted)) return type;
  std::vector<std::string> loaded;
  for (const dfm_type *type : types.list(kind)) loaded.push_back(short_name(*type));
  const char *what = kind == DFM_KIND_MODEL ? "model" : "law";
  const std::string meant = did_you_mean(wanted, loaded);
  const std::string passed = passed_over(types, wanted);
  // A name in reverse-DNS form that nothing resembles is that of a plugin in a folder of its own.
  const bool elsewhere = meant.empty() && passed.empty() && wanted.find('.') != std::string::npos;
  fail(DFM_E_UNSUPPORTED, "%s: %s: no loaded plugin offers the %s \"%s\"; loaded: %s%s%s%s",
       name.file().c_str(), name.pointer().c_str(), what, wanted.c_str(),
       loaded.empty() ? "none (see: deform plugin list)" : join(loaded).c_str(), meant.c_str(),
       passed.empty() ? "" : ("; not loaded: " + passed).c_str(),
       elsewhere ? "; set DEFORM_PLUGIN_PATH to the folder of its plugin" : "");
}

// ---- small shared parts -----------------------------------------------------------------------------------

std::string known(const Node &name, const std::vector<std::string> &valid, const char *what) {
  const std::string s = name.text();
  if (listed(valid, s)) return s;
  const std::string near = nearest(s, valid);
  if (!near.empty()) name.fail("there is no %s \"%s\"; did you mean \"%s\"?", what, s.c_str(), near.c_str());
  name.fail("there is no %s \"%s\"; there %s: %s", what, s.c_str(), valid.size() == 1 ? "is" : "are",
            valid.empty() ? "none" : join(valid).c_str());
}

void check_fresh(const Node &name, const std::string &value, const std::vector<std::string> &taken,
                 const char *what) {
  if (listed(taken, value))
    name.fail("the name \"%s\" is taken by another %s; names are unique", value.c_str(), what);
}

void check_keys_of(const Node &node, const std::vector<KeyOf> &keys, const char *what,
                   const std::string &word) {
  for (const auto &[key, words] : keys)
    if (node.has(key) && !listed(words, word))
      node.member(key).fail("%s %s has no \"%s\"; that is for %s", what, word.c_str(), key,
                            join(words).c_str());
}

void check_rising(const Node &key, double previous, double t) {
  if (!(t > previous)) key.at("t").fail("times of keyframes must increase; found %g after %g", t, previous);
}

int32_t integrator_of(const Node &holder) {
  return int32_t(number_of("integrator", holder.word("integrator", "auto", "integrator")));
}

void read_direction(const Node &node, const char *what, double out[3]) {
  node.vector(out);
  if (out[0] == 0 && out[1] == 0 && out[2] == 0) node.fail("%s cannot be zero", what);
}

void read_sizes(const Node &node, const char *what, double out[3]) {
  node.vector(out);
  for (int k = 0; k < 3; ++k)
    if (!(out[k] > 0)) node.fail("%s are above 0, found %g", what, out[k]);
}

void read_thing(const Node &node, ReadContext &context, Thing &out) {
  out.pointer = node.pointer();
  out.name = node.at("name").name();
  check_fresh(node.at("name"), out.name, context.sides, "body or obstacle");
  context.sides.push_back(out.name);
  if (node.has("material")) out.material = known(node.member("material"), context.materials, "material");
  out.sensor = node.boolean("sensor", false);
  out.id = read_id(node);
}

dfm_sine read_sine(const Node &sine, bool scalar) {
  dfm_sine out = {};
  sine.object("sine");
  if (scalar) out.amplitude[0] = sine.at("amplitude").number();
  else sine.at("amplitude").vector(out.amplitude);
  out.frequency = sine.at("frequency").number();
  out.phase = sine.number("phase", 0.0);
  return out;
}

// ---- parts of the scene -----------------------------------------------------------------------------------

namespace {

void read_gravity(const Node &scene, Definition &def) {
  const Node gravity = scene.member("gravity", 0.0, 0.0, -9.81);
  if (gravity.value().is_array()) return gravity.vector(def.world.gravity);
  if (!gravity.value().is_object())
    gravity.fail("expected [x, y, z] in m/s2 or an object with keyframes, found %s",
                 gravity.kind_found().c_str());
  gravity.object("gravity").at("keyframes");
  def.gravity_keys = read_keyframes<dfm_vector_key>(
      gravity, "gravity_key",
      [](const Node &node, dfm_vector_key &key) { node.at("value").vector(key.value); });
  std::copy_n(def.gravity_keys[0].value, 3, def.world.gravity);
}

void read_time(const Node &scene, Definition &def) {
  const Node time = scene.at("time").object("time");
  def.begin = time.number("start", 0.0, kNotNegative);
  def.duration = time.at("duration").number(kPositive);
  if (time.has("max_time")) def.world.max_time = time.member("max_time").number(kPositive);
  if (time.has("max_work")) {
    const double work = time.member("max_work").number(Range{1, HUGE_VAL, false, true});
    def.world.max_work = work < 1.8e19 ? static_cast<uint64_t>(work) : UINT64_MAX;
  }
  const Node step = time.member("step", "auto");
  if (step.value().is_string()) {
    if (step.text() != "auto")
      step.fail("expected a number of seconds or \"auto\", found \"%s\"", step.text().c_str());
  } else {
    def.step = step.number(kPositive);
    if (def.step < kShortestStep) step.fail("%s", short_step(def.step, kShortestStep).c_str());
    if (def.duration / def.step > 1e12)
      step.fail("%g s at %g s a step are more than 1e12 steps", def.duration, def.step);
  }
  def.equilibrium = time.word("mode", "dynamic", "mode") == "static";
  def.world.integrator = integrator_of(time);
}

// How many times the relative error of positions that of a quantity is: energies go with squares, and forces
// of contact and the work of friction follow them. Names are those of `deform cost`: a probe, or a family,
// with or without whose it is.
// force: whether a force of contact counts.
double weight_of(const Node &quantity, const std::vector<Probe> &probes, bool &force) {
  static const std::vector<std::string> once = {"com", "volume", "touch", "slip", "liftoff", "rest"},
                                        twice = {"energy", "force", "work"};
  const std::string name = quantity.text(), family = name.substr(0, name.find('.'));
  std::vector<std::string> valid;
  for (const Probe &p : probes) valid.push_back(p.name);
  valid.insert(valid.end(), once.begin(), once.end());
  valid.insert(valid.end(), twice.begin(), twice.end());
  const bool probe =
      std::any_of(probes.begin(), probes.end(), [&](const Probe &p) { return p.name == name; });
  if (probe) return 1;
  json stem = family;
  known(Node(&stem, quantity.pointer(), &quantity.file()), valid, "quantity");
  force = family == "force" || family == "work";
  return listed(twice, family) ? 2 : 1;
}

void read_wanted(const Node &scene, Definition &def) {
  const bool accuracy = scene.has_value("accuracy"), budget = scene.has_value("budget");
  if (accuracy && budget)
    scene.member("budget").fail(
        "\"accuracy\" is given too, and the planner aims at one of the two; keep one");
  const char *const key = scene.has("accuracy") ? "accuracy" : "budget";
  if (!scene.has(key)) return;
  const Node wanted = scene.member(key);
  if (def.equilibrium) wanted.fail("a static scene has no step to choose; remove \"%s\" or /time/mode", key);
  wanted.object(key);
  if (scene.items("bodies").empty()) wanted.fail("there is no body to plan for; remove \"%s\"", key);
  if (scene.has("accuracy")) {
    def.wanted.target = wanted.at("target").number(Range{0, 1, true, true});
  } else {
    def.wanted.ms_per_step = wanted.at("ms_per_step").number(kPositive);
    def.wanted.force = true;  // the scene names no quantity: a dent counts by both
  }
}

void read_solver(const Node &scene, Definition &def) {
  if (!scene.has("solver")) return;
  const Node solver = scene.member("solver").object("solver");
  if (solver.has("type")) def.solver = solver.member("type").text();
  if (solver.has("tolerance"))
    def.world.solver_tolerance = solver.member("tolerance").number(Range{0, 1, true, true});
  if (solver.has("max_iterations"))
    def.world.solver_iterations = read_count(solver.member("max_iterations"), 1, UINT32_MAX);
  if (solver.has("newton")) def.world.newton_iterations = read_count(solver.member("newton"), 1, UINT32_MAX);
}

void read_effects(const Node &scene, Definition &def) {
  const Node effects = scene.member("effects", "auto");
  if (effects.value().is_string()) {
    if (effects.text() != "auto")
      effects.fail("expected \"auto\" or a list of effects, found \"%s\"", effects.text().c_str());
    return;
  }
  def.effects_auto = false;
  for (const Node &effect : effects.items()) {
    const std::string name = effect.text();
    check_fresh(effect, name, def.effects, "effect of this list");
    def.effects.push_back(name);
  }
}

// A further entry of a material: numbers, or a word of an enumeration that some model has under this key.
std::vector<double> read_extra(const Node &value, const std::string &key, const Registry &types) {
  std::vector<double> out;
  if (value.value().is_string()) {
    for (const dfm_type *model : types.list(DFM_KIND_MODEL)) {
      const dfm_param *row = find_row(*model, key.c_str());
      const bool automatic = row && (row->flags & DFM_PARAM_AUTO) && value.text() == kAuto;
      if (!automatic && (!row || !(row->flags & DFM_PARAM_ENUM) || !row->names)) continue;
      const double number = automatic ? row->def : enum_value(value, row->names);
      if (!out.empty() && out[0] != number)
        value.fail("this word has different values in different models; give it in the body's model params");
      out = {number};
    }
    if (out.empty())
      value.fail("expected a number, found a string; no loaded model has words for this parameter");
  } else if (value.value().is_array()) {
    for (const Node &item : value.items()) out.push_back(item.number());
  } else {
    out.push_back(value.number());
  }
  return out;
}

void read_materials(const Node &scene, Definition &def, ReadContext &context) {
  if (!scene.has("materials")) return;
  const Node materials = scene.member("materials");
  if (!materials.value().is_object()) materials.fail("expected an object of materials by name");
  const std::vector<std::string> of_models = model_keys(context.types);
  for (const auto &entry : materials.value().items()) {
    const Node node = materials.member(entry.key()).object("material", of_models);
    Material m;
    m.pointer = node.pointer();
    m.name = m.title = entry.key();
    if (node.has("name")) m.title = node.value()["name"].is_null() ? "" : node.member("name").text();
    json copy = entry.key();
    Node(&copy, node.pointer(), &node.file()).name();
    m.def.density = node.number("density", m.def.density, kPositive);
    m.def.young = node.number("young", m.def.young, kPositive);
    m.def.poisson = node.number("poisson", m.def.poisson, Range{-1, 0.5, true, true});
    const Node damping = node.part("damping");
    m.def.damping_mass = damping.number("mass", 0.0, kNotNegative);
    m.def.damping_stiffness = damping.number("stiffness", 0.0, kNotNegative);
    for (const auto &further : node.value().items()) {
      const std::string &key = further.key();
      const std::vector<Key> &own = keys_of("material");
      if (key != "friction" && key != "tear" && key != "fracture_energy" &&
          std::any_of(own.begin(), own.end(), [&](const Key &k) { return key == k.name; }))
        continue;
      const Node value = node.member(key);
      if (key == "damping_mass" || key == "damping_stiffness")
        value.fail("of a material it is \"damping\": {\"%s\": ..}", key.c_str() + 8);
      m.extra.keys.push_back(key);
      m.extra.values.push_back(key == "friction" || key == "fracture_energy"
                                   ? std::vector<double>{value.number(kNotNegative)}
                               : key == "tear" ? std::vector<double>{value.number(kPositive)}
                                               : read_extra(value, key, context.types));
    }
    context.materials.push_back(m.name);
    def.materials.push_back(std::move(m));
  }
}

// The world knows materials, and groups of a surface once the body is there.
void read_between(const Node &entry, const ReadContext &context, std::string out[2]) {
  const Node between = entry.at("between");
  const std::vector<Node> sides = between.items();
  if (sides.size() != 2) between.fail("expected two sides [a, b], found %zu", sides.size());
  for (int i = 0; i < 2; ++i) {
    out[i] = sides[i].text();
    if (out[i] != "*" && out[i].find_first_of(":=") == std::string::npos)
      known(sides[i], context.sides, "body or obstacle");
  }
}

void read_contact(const Node &scene, Definition &def, const ReadContext &context) {
  const Node contact = scene.part("contact");
  dfm_world_def &w = def.world;
  const std::string method = contact.word("method", "auto", "method");  // for one version
  if (method == "rollback")
    contact.member("method").fail(
        "\"rollback\" is a program of its own now: remove \"method\" and run `deform rollback`");
  if (method != "auto" && w.integrator == DFM_INTEGRATOR_AUTO)
    w.integrator = method == "implicit" ? DFM_INTEGRATOR_IMPLICIT_EULER : DFM_INTEGRATOR_SYMPLECTIC_EULER;
  w.sleep = contact.boolean("sleep", false);
  const bool self_given = contact.has("self");
  const bool requested = listed(def.effects, "self_contact");
  if (self_given && contact.value()["self"] == "auto") w.self_contact = DFM_SELF_AUTO;
  else if (self_given && !contact.value()["self"].is_boolean())
    contact.member("self").fail("expected true, false or \"auto\"");
  else w.self_contact = contact.boolean("self", requested) ? DFM_SELF_ON : DFM_SELF_OFF;
  if (self_given && w.self_contact != DFM_SELF_ON && requested)
    contact.member("self").fail(
        "\"self\" is not true, but /effects asks for \"self_contact\"; remove one of the two");
  if (contact.boolean("untangle", false)) w.flags |= DFM_WORLD_UNTANGLE;
  if (!contact.boolean("guard", true)) w.flags |= DFM_WORLD_UNGUARDED;
  if (contact.has("energy_watch")) {
    const Node watch = contact.member("energy_watch");
    if (watch.value().is_boolean()) w.energy_watch = watch.value().get<bool>() ? w.energy_watch : 0;
    else w.energy_watch = watch.number(kNotNegative);
  }
  if (contact.has("tolerance")) w.contact_tolerance = contact.member("tolerance").number(kPositive);
  if (contact.has("offset")) w.contact_offset = contact.member("offset").number(kPositive);
  if (contact.has("recovery_speed")) w.recovery_speed = contact.member("recovery_speed").number(kPositive);
  if (contact.has("obstacle_speed")) w.obstacle_speed = contact.member("obstacle_speed").number(kPositive);
  if (contact.has("max_sweeps")) w.max_sweeps = read_count(contact.member("max_sweeps"), 1, UINT32_MAX);
  if (contact.has("friction") && !contact.value()["friction"].is_array())
    contact.member("friction")
        .fail(
            "expected an array of rules, such as [{\"between\": [\"*\", \"*\"], \"law\": \"coulomb\", "
            "\"params\": {\"mu\": 0.5}}], found %s",
            contact.member("friction").kind_found().c_str());
  for (const Node &entry : contact.items("friction")) {
    entry.object("friction");
    Friction f;
    f.pointer = entry.pointer();
    read_between(entry, context, f.between);
    const dfm_type *type = read_type(entry.at("law"), DFM_KIND_FRICTION, context.types);
    f.law = type->id;
    if (entry.has("params")) f.params = read_params(entry.member("params"), type);
    if (entry.has("restitution")) {
      f.def.flags = DFM_FRICTION_RESTITUTION;
      f.def.restitution = entry.member("restitution").number({0, 1});
    }
    def.friction.push_back(std::move(f));
  }
  for (const Node &entry : contact.items("filter")) {
    entry.object("filter");
    Filter f;
    f.pointer = entry.pointer();
    read_between(entry, context, f.between);
    f.collide = entry.boolean("collide", false);
    def.filters.push_back(std::move(f));
  }
}

void read_probes(const Node &scene, Definition &def) {
  std::vector<std::string> bodies, names;
  for (const Body &b : def.bodies) bodies.push_back(b.name);
  for (const Node &entry : scene.items("probes")) {
    entry.object("probe");
    Probe p;
    p.pointer = entry.pointer();
    p.name = entry.at("name").name();
    check_fresh(entry.at("name"), p.name, names, "probe");
    names.push_back(p.name);
    p.body = known(entry.at("body"), bodies, "body");
    entry.at("point").vector(p.point);
    def.probes.push_back(std::move(p));
  }
}

void check_places(const Node &scene, const Definition &def) {
  std::vector<std::string> names;
  for (const Obstacle &o : def.obstacles) names.push_back(o.name);
  for (const Node &body : scene.items("bodies"))
    if (body.has("place")) known(body.member("place").at("on"), names, "obstacle");
}

// Whoever draws reads it with dfm_scene_value.
void read_color_range(const Node &range, const std::string &color) {
  const std::vector<Node> ends = range.items();
  if (ends.size() != 2 || !(ends[0].number() < ends[1].number()))
    range.fail("expected two numbers, the second one larger, as [0, 2.5]");
  if (color == "body")
    range.fail("bodies have colors of their own here; give \"color\" a quantity, such as \"speed\"");
}

void read_output(const Node &scene, Definition &def) {
  const Node output = scene.part("output");
  def.every = output.number("every", 0.02, kPositive);
  const Node frames = output.member("frames", false);
  if (frames.value().is_number()) {
    def.frame_rate = frames.number(Range{0, 1e6, true, false});
    def.frames = true;
  } else {
    def.frames = frames.boolean();
  }
  def.states = output.boolean("states", false);
  def.nodes = output.boolean("nodes", false);
  def.contacts = output.boolean("contacts", true);
  def.check = output.boolean("check", false);
  def.color = output.word("color", "body", "color");
  if (output.has("color_range")) read_color_range(output.member("color_range"), def.color);
  if (output.has("camera")) {
    const Node camera = output.member("camera").object("camera");
    camera.at("eye").vector(def.eye);
    camera.vector("look_at", def.look_at, 0, 0, 0);
    if (std::equal(def.eye, def.eye + 3, def.look_at))
      camera.fail("\"eye\" and \"look_at\" are the same point");
    def.has_camera = true;
  }
}

}  // namespace

Definition read_scene(json &tree, const std::string &file, const Registry &types) {
  const Node scene(&tree, "", &file);
  scene.object("scene");
  const Node format = scene.at("format"), version = scene.at("version");
  if (format.text() != "deform-scene")
    format.fail("expected \"deform-scene\", found \"%s\"", format.text().c_str());
  if (version.number() != 1) version.fail("this reader knows version 1, found %g", version.number());
  Definition def;
  def.file = file;
  def.folder = name_of(path_of(file).parent_path());
  ReadContext context{types, {}, {}, {}};
  read_gravity(scene, def);
  read_time(scene, def);
  read_wanted(scene, def);
  context.planned = def.wanted.any();
  read_effects(scene, def);
  read_solver(scene, def);
  read_materials(scene, def, context);
  for (const Node &node : scene.items("bodies")) def.bodies.push_back(read_body(node, context));
  for (const Node &node : scene.items("obstacles")) def.obstacles.push_back(read_obstacle(node, context));
  check_places(scene, def);
  def.rigid = read_rigid(scene, context);
  for (const Node &node : scene.items("tools")) def.tools.push_back(read_tool(node, context));
  for (const Node &node : scene.items("cuts")) def.cuts.push_back(read_cut(node, context, def.begin));
  if (def.equilibrium && !def.cuts.empty())
    scene.member("cuts").fail(
        "cuts are made in steps, and /time/mode \"static\" takes none; remove one of the two");
  read_contact(scene, def, context);
  read_probes(scene, def);
  if (scene.has("accuracy") && scene.member("accuracy").has("quantity"))
    def.wanted.weight = weight_of(scene.member("accuracy").member("quantity"), def.probes, def.wanted.force);
  read_output(scene, def);
  return def;
}

}  // namespace dfm::scene
