#include "scene/write.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstring>

#include "core/error.h"
#include "core/file.h"
#include "core/handle.h"
#include "core/path.h"
#include "friction/laws.h"
#include "mesh/mesh.h"
#include "plugin/context.h"
#include "plugin/shared_object.h"
#include "scene/keys.h"
#include "scene/node.h"
#include "scene/scene.h"
#include "snapshot/snapshot.h"
#include "snapshot/snapshot_structure.h"
#include "state/partner.h"
#include "state/tool.h"
#include "world/create.h"

namespace dfm::writing {

// ---- values -----------------------------------------------------------------------------------------------

bool same_bits(const void *a, const void *b, size_t bytes) { return std::memcmp(a, b, bytes) == 0; }

Written vector_of(const double *v) { return {v[0], v[1], v[2]}; }

// Whether a quaternion turns anything; one of length zero is none, as in dfm_pose.
bool turned(const double *q) { return q[0] != 0 || q[1] != 0 || q[2] != 0 || (q[3] != 0 && q[3] != 1); }

Written rotation_of(const double *q) { return {{"quaternion", {q[0], q[1], q[2], turned(q) ? q[3] : 1.0}}}; }

Written pose_of(const dfm_pose &pose) {
  Written out;
  const double *const p = pose.position, *const q = pose.rotation;
  if (p[0] != 0 || p[1] != 0 || p[2] != 0) out["position"] = vector_of(p);
  if (turned(q)) out["rotation"] = rotation_of(q);
  return out;
}

Written pose_of(const Pose &pose) {
  dfm_pose out{};
  store_pose(out, pose);
  return pose_of(out);
}

void put(Written &out, const char *key, Written value) {
  if (!value.is_null()) out[key] = std::move(value);
}

void put_integrator(Written &out, int64_t integrator) {
  if (integrator > DFM_INTEGRATOR_AUTO && integrator <= DFM_INTEGRATOR_TR_BDF2)
    out["integrator"] = scene::word_of("integrator", uint32_t(integrator));
}

Written key_of(const dfm_pose_key &k) {
  return {{"t", k.t}, {"position", vector_of(k.pose.position)}, {"rotation", rotation_of(k.pose.rotation)}};
}

bool moves(const dfm_sine &s) { return s.amplitude[0] != 0 || s.amplitude[1] != 0 || s.amplitude[2] != 0; }

Written sine_of(const dfm_sine &s, bool scalar) {
  Written out;
  out["amplitude"] = scalar ? Written(s.amplitude[0]) : vector_of(s.amplitude);
  out["frequency"] = s.frequency;
  if (s.phase != 0) out["phase"] = s.phase;
  return out;
}

Written value_of(const dfm_param &row, const double *values, uint32_t n) {
  const bool whole = row.flags & (DFM_PARAM_INTEGER | DFM_PARAM_ENUM);
  const auto number = [&](double x) { return whole ? Written(int64_t(x)) : Written(x); };
  if ((row.flags & DFM_PARAM_AUTO) && values[0] == row.def) return "auto";
  if (row.width == 1) {
    if ((row.flags & DFM_PARAM_ENUM) && row.names) return row.names[size_t(values[0])];
    return number(values[0]);
  }
  Written out = Written::array();
  for (uint32_t k = 0; k < n; ++k) out.push_back(number(values[k]));
  return out;
}

Written params_of(const dfm_type &type, const std::vector<double> &values) {
  Written out = Written::object();
  size_t at = 0;
  for (uint32_t i = 0; i < type.nparam; at += type.params[i++].width) {
    const dfm_param &row = type.params[i];
    if (std::any_of(&values[at], &values[at] + row.width, [&](double x) { return x != row.def; }))
      out[row.key] = value_of(row, &values[at], row.width);
  }
  return out;
}

// ---- the writer -------------------------------------------------------------------------------------------

void SceneWriter::note(const char *text, ...) {
  va_list rest;
  va_start(rest, text);
  const std::string line = vformat(text, rest);
  va_end(rest);
  if (notes++ == 0) first = line;
  remark(line);
}

void SceneWriter::note(const Named &whose, const char *text, ...) {
  va_list rest;
  va_start(rest, text);
  const std::string line = vformat(text, rest);
  va_end(rest);
  note("%s '%s'%s", whose.kind, whose.name, line.c_str());
}

namespace {

std::string folder_name(const std::string &path) { return name_of(path_of(path).stem()) + "_files"; }

// Where a file of the folder beside the scene lies; makes the folder.
std::string beside(const std::string &path, const std::string &name) {
  const std::filesystem::path where = path_of(path).parent_path() / path_of(folder_name(path));
  std::error_code error;
  std::filesystem::create_directory(where, error);
  if (!std::filesystem::is_directory(where, error))
    fail(DFM_E_IO, "%s: the folder %s for its meshes cannot be created beside it; give another path",
         path.c_str(), name_of(where).c_str());
  return name_of(where / path_of(name));
}

}  // namespace

std::string SceneWriter::file(const std::string &name, std::function<void(const std::string &)> write) {
  std::string fresh = name;  // a body may be called as the surface of another one
  const size_t end = std::min(name.rfind('.'), name.size());
  for (int k = 2; !file_names.insert(fresh).second; ++k)
    fresh = name.substr(0, end) + "_" + std::to_string(k) + name.substr(end);
  files.push_back({fresh, std::move(write)});
  return folder_name(path) + "/" + fresh;
}

std::string SceneWriter::text_file(const std::string &name, std::string text) {
  return file(name, [text = std::move(text)](const std::string &to_path) {
    AtomicFile out(to_path);
    out.write(text);
    out.commit();
  });
}

std::string SceneWriter::triangles(const std::string &name, const Obstacle &of) {
  RestMesh mesh;
  mesh.points.assign(of.points.begin(), of.points.end());
  mesh.tris.assign(of.triangles.begin(), of.triangles.end());
  mesh.tri_group.assign(mesh.ntri(), kNoGroup);
  return file(name + ".vtu",
              [mesh = std::move(mesh)](const std::string &to_path) { write_mesh(mesh, to_path); });
}

bool SceneWriter::has(const std::string &name) const {
  const Body *const b = w.find_body(name);
  const Obstacle *const o = w.find_obstacle(name);
  return (b && !b->emptied) || (o && shape_in_scene(w, *o));
}

void SceneWriter::check_name(const char *kind, const std::string &name) const {
  scene::json text = name;
  try {
    if (name.empty()) fail(DFM_E_ARG, "it is empty");
    scene::Node(&text, "", &path).name();
  } catch (const Error &) {
    fail(DFM_E_ARG,
         "%s: the name of %s '%s' cannot be used in a scene: a name has 1 to 100 bytes of UTF-8, does not "
         "begin with a dot, and contains no control characters and none of / \\ , : * = \"; create it under "
         "another name",
         path.c_str(), kind, name.c_str());
  }
}

namespace {

// ---- materials --------------------------------------------------------------------------------------------

Material plain_material() {
  Material m;
  m.def = dfm_material_def_default();
  return m;
}

Written material_of(const Material &m) {
  Written out;
  out["density"] = m.def.density;
  out["young"] = m.def.young;
  out["poisson"] = m.def.poisson;
  if (m.def.damping_mass != 0) out["damping"]["mass"] = m.def.damping_mass;
  if (m.def.damping_stiffness != 0) out["damping"]["stiffness"] = m.def.damping_stiffness;
  for (size_t i = 0; i < m.extra_keys.size(); ++i)
    out[m.extra_keys[i]] =
        m.extra_values[i].size() == 1 ? Written(m.extra_values[i][0]) : Written(m.extra_values[i]);
  return out;
}

}  // namespace

// Entries that no loaded model has as a parameter are left out, since a scene refuses them.
std::string SceneWriter::material(const Material &m) {
  const Material plain = plain_material();
  Written value = material_of(m);
  if (m.name.empty() && value == material_of(plain)) return "";
  if (!m.name.empty()) check_name("material", m.name);
  for (const auto &[key, known] : material_keys)
    if (known.first == m.name && known.second == value) return key;
  const auto taken = [&](const std::string &key) {
    return material_keys.count(key) ||
           std::any_of(w.materials.begin(), w.materials.end(),
                       [&](const auto &other) { return other->name == key && key != m.name; });
  };
  const bool second = !m.name.empty() && material_keys.count(m.name);
  if (second)
    note(
        "there have been two materials '%s', one of which is destroyed; the scene has the second one without "
        "a name, so that rules for \"material=%s\" do not mean it",
        m.name.c_str(), m.name.c_str());
  std::string key = m.name.empty() ? "unnamed" : m.name;
  for (int i = 2; taken(key); ++i) key = (m.name.empty() ? "unnamed" : m.name) + format(" %d", i);
  material_keys[key] = {m.name, value};
  for (const std::string &extra : m.extra_keys)
    if (extra != "friction" && extra != "tear" && extra != "fracture_energy" && !model_keys.count(extra)) {
      note("material '%s': its entry '%s' is left out, since no loaded model has such a parameter",
           key.c_str(), extra.c_str());
      value.erase(extra);
    }
  Written entry;
  if (key != m.name) entry["name"] = nullptr;
  entry.update(value);
  materials[key] = std::move(entry);
  return key;
}

std::string SceneWriter::material(const std::string &name, std::optional<double> friction) {
  for (const auto &[key, known] : material_keys) {
    const auto at = known.second.find("friction");
    const double of_it = at == known.second.end() ? kDefaultFriction : at->get<double>();
    if (!name.empty() && known.first == name && of_it == friction.value_or(of_it)) return key;
  }
  Material m = plain_material();
  m.name = name;
  if (friction.value_or(kDefaultFriction) != kDefaultFriction) {
    m.extra_keys = {"friction"};
    m.extra_values = {{*friction}};
  }
  return material(m);
}

void SceneWriter::put_material(Written &out, const Obstacle &of) {
  if (const std::string key = material(of.material, of.zone.friction); !key.empty()) out["material"] = key;
}

namespace {

// Those with a name first, so that the first of each name has it as its key, and rules of friction find it.
void write_materials(SceneWriter &to) {
  for (const bool named : {true, false}) {
    for (const auto &b : to.w.bodies)
      for (const Material &m : b->composition.materials)
        if (m.name.empty() != named) to.material(m);
    for (const auto &m : to.w.materials)
      if (named && !m->name.empty()) to.material(*m);
  }
}

// ---- contact ----------------------------------------------------------------------------------------------

// group: ":NAME"; empty: the whole body.
bool has_group(const Body &b, const std::string &group) {
  const SurfaceZones &zones = b.zones;
  for (uint32_t z = 0; z < zones.list.size(); ++z)
    if (":" + zones.list[z].group == group &&
        (zones.of.empty() ? z == 0 : std::ranges::find(zones.of, z) != zones.of.end()))
      return true;
  return group.empty();
}

bool in_scene(const SceneWriter &to, const std::string &side) {
  if (side == "*") return true;
  if (side.rfind("material=", 0) == 0) return to.materials.contains(side.substr(9));
  const size_t colon = side.find(':');
  const Body *const whole = colon == side.npos ? nullptr : to.w.find_body(side.substr(0, colon));
  return to.has(side) || (whole && !whole->emptied && has_group(*whole, side.substr(colon)));
}

// What a side of the world's rules means in the scene: the same, and the pieces of the body that it names,
// which are bodies like any other there.
std::vector<std::string> sides_in_scene(const SceneWriter &to, const std::string &side) {
  std::vector<std::string> out;
  if (in_scene(to, side)) out.push_back(side);
  for (const auto &b : to.w.bodies) {
    if (b->whole_name.empty() || !names(side, b->whole_name)) continue;
    const std::string group = side.substr(b->whole_name.size());
    if (has_group(*b, group)) out.push_back(b->name + group);
  }
  return out;
}

// A rule for each two sides that the scene has; it refuses others. kept, if not null, gets the world's rules
// that are there as a whole. Of others, with several bodies on both sides, only what they say of a body with
// itself is: the caller says what pairs need, whose number grows with the square.
template <class Rule>
std::vector<Rule> rules_in_scene(SceneWriter &to, const char *what, const std::vector<Rule> &rules,
                                 std::vector<Rule> *kept = nullptr) {
  std::vector<Rule> out;
  for (const Rule &r : rules) {
    const std::vector<std::string> a = sides_in_scene(to, r.between[0]), b = sides_in_scene(to, r.between[1]);
    const bool same = r.between[0] == r.between[1], alone = kept && a.size() > 1 && b.size() > 1;
    if (a.empty() || b.empty())
      to.note("the %s for '%s' and '%s' is left out, since the scene does not have both of them", what,
              r.between[0].c_str(), r.between[1].c_str());
    else if (kept && !alone) kept->push_back(r);
    for (size_t i = 0; i < a.size(); ++i)
      for (size_t k = same ? i : 0; k < (!alone ? b.size() : same ? i + 1 : 0); ++k) {
        out.push_back(r);
        out.back().between[0] = a[i];
        out.back().between[1] = b[k];
      }
  }
  return out;
}

Written write_friction(SceneWriter &to) {
  Written out = Written::array();
  for (const FrictionRule &r : rules_in_scene(to, "friction rule", to.w.friction)) {
    const LawInstance &law = *to.w.laws[r.law];
    const dfm_type &type = law.requested_type ? *law.requested_type : *law.type;
    Written entry;
    entry["between"] = {r.between[0], r.between[1]};
    entry["law"] = type.id;
    const Written params = params_of(type, law.requested_type ? law.requested : law.params);
    if (!params.empty()) entry["params"] = params;
    if (law.restitution != kNoRestitution) entry["restitution"] = law.restitution;
    out.push_back(std::move(entry));
  }
  return out;
}

// Things of the scene, and their names there.
using Touching = std::pair<Partner, std::string>;
std::vector<Touching> touching_of(const World &w) {
  std::vector<Touching> out;
  for (const auto &b : w.bodies) out.push_back({partner_of(*b), b->name});
  for (const auto &o : w.obstacles)
    if (const Obstacle *const s = shape_in_scene(w, *o); s && s->def.shape != DFM_SHAPE_NONE)
      out.push_back({partner_of(*s), o->name});
  return out;
}

// Whether anything would keep them apart: no two obstacles, nor two shapes of a rigid body or a tool.
bool may_meet(const Partner &a, const Partner &b) {
  if (!a.shape || !b.shape) return true;
  const RigidSet *const set = a.shape->rigid;
  if (!set || set != b.shape->rigid) return set || b.shape->rigid;
  return !set->of_tool && a.shape->rigid_body != b.shape->rigid_body;
}

// The world's rules, and one for each pair of which they would say something else in the scene: it has no
// masks, no answers of a host, and no pieces of one body.
Written write_filters(SceneWriter &to) {
  const World &w = to.w;
  std::vector<FilterRule> kept, rules = rules_in_scene(to, "filter", w.filters, &kept), pairs;
  std::set<std::pair<uint64_t, uint64_t>> refused;
  for (const PairDecision &p : w.may_touch.decisions)
    if (!p.touch) refused.insert(std::minmax(p.a, p.b));
  const std::vector<Touching> things = touching_of(w);
  for (size_t i = 0; i < things.size(); ++i)
    for (size_t k = i + 1; k < things.size(); ++k) {
      const auto &[a, name_a] = things[i];
      const auto &[b, name_b] = things[k];
      if (!may_meet(a, b)) continue;
      const bool touch = a.meets(b, w.filters) && !refused.contains(std::minmax(a.id, b.id));
      const FilterRule *const written = best_rule(kept, {name_a, {}, a.side.material, a.side.whole},
                                                  {name_b, {}, b.side.material, b.side.whole});
      if (touch != (!written || written->collide)) pairs.push_back({{name_a, name_b}, touch});
    }
  Written out = Written::array();
  for (const auto *const list : {&rules, &pairs})
    for (const FilterRule &r : *list)
      out.push_back({{"between", {r.between[0], r.between[1]}}, {"collide", r.collide}});
  return out;
}

Written write_contact(SceneWriter &to) {
  const dfm_world_def &d = to.w.def, usual = dfm_world_def_default();
  Written out;
  if (d.self_contact == DFM_SELF_ON) out["self"] = true;
  if (d.self_contact == DFM_SELF_AUTO) out["self"] = "auto";
  if (d.flags & DFM_WORLD_UNTANGLE) out["untangle"] = true;
  if (d.flags & DFM_WORLD_UNGUARDED) out["guard"] = false;
  if (d.sleep) out["sleep"] = true;
  if (d.contact_tolerance > 0) out["tolerance"] = d.contact_tolerance;
  if (d.contact_offset > 0) out["offset"] = d.contact_offset;
  if (d.energy_watch == 0) out["energy_watch"] = false;
  else if (d.energy_watch != usual.energy_watch) out["energy_watch"] = d.energy_watch;
  if (d.recovery_speed > 0) out["recovery_speed"] = d.recovery_speed;
  if (d.obstacle_speed > 0) out["obstacle_speed"] = d.obstacle_speed;
  if (d.max_sweeps != usual.max_sweeps) out["max_sweeps"] = d.max_sweeps;
  if (Written friction = write_friction(to); !friction.empty()) out["friction"] = std::move(friction);
  if (Written filter = write_filters(to); !filter.empty()) out["filter"] = std::move(filter);
  return out;
}

// ---- the rest ---------------------------------------------------------------------------------------------

Written write_gravity(const World &w) {
  if (w.gravity.keys.empty()) return vector_of(w.def.gravity);
  Written out;
  for (const dfm_vector_key &k : w.gravity.keys)
    out["keyframes"].push_back({{"t", k.t}, {"value", vector_of(k.value)}});
  return out;
}

Written write_time(const SceneWriter &to) {
  const World &w = to.w;
  Written out;
  if (w.time > 0) out["start"] = w.time;
  out["duration"] = to.options.duration;
  if (to.options.step > 0) out["step"] = to.options.step;
  else out["step"] = "auto";
  put_integrator(out, w.def.integrator);
  if (to.options.beside.equilibrium) out["mode"] = "static";
  if (w.def.max_time > 0 && std::isfinite(w.def.max_time)) out["max_time"] = w.def.max_time;
  if (w.def.max_work > 0) out["max_work"] = double(w.def.max_work);
  return out;
}

Written write_solver(const World &w) {
  const ImplicitOptions usual;
  Written out;
  if (w.implicit.solver != usual.solver) out["type"] = w.implicit.solver;
  if (w.implicit.tolerance != usual.tolerance) out["tolerance"] = w.implicit.tolerance;
  if (w.implicit.solver_iterations != usual.solver_iterations)
    out["max_iterations"] = w.implicit.solver_iterations;
  if (w.implicit.newton != usual.newton) out["newton"] = w.implicit.newton;
  return out;
}

// Points of probes are in the frame of the body's mesh, which is written as it was read.
Written write_probes(SceneWriter &to) {
  Written out;
  if (to.options.beside.probes.empty()) return out;
  size_t i = 0;
  for (Written probe : Written::parse(to.options.beside.probes)) {
    const std::string &now = to.options.beside.probe_bodies[i++], was = probe.at("body");
    probe["body"] = now;
    if (!now.empty()) out.push_back(std::move(probe));
    else
      to.note("probe '%s' is left out, since its cell of body '%s' is gone",
              probe.at("name").get<std::string>().c_str(), was.c_str());
  }
  return out;
}

// What a scene has no word for.
void note_omissions(SceneWriter &to) {
  const World &w = to.w;
  const dfm_world_def usual = dfm_world_def_default();
  if (w.may_touch.call)
    to.note(
        "a callback of the host decides which pairs may touch: the scene contains its decisions so far, "
        "and does not filter later pairs");
  if (w.pre_solve.call)
    to.note("a callback of the host changes contacts before they are solved; a scene has none");
  const std::pair<const char *, bool> members[] = {{"max_passes", w.def.max_passes != usual.max_passes},
                                                   {"max_substeps", w.def.max_substeps != usual.max_substeps},
                                                   {"sleep_speed", w.def.sleep_speed != usual.sleep_speed},
                                                   {"sleep_time", w.def.sleep_time != usual.sleep_time}};
  for (const auto &[member, set] : members)
    if (set) to.note("dfm_world_def.%s is not its default; a scene has no such key", member);
  struct Used {
    std::set<std::string> ids, noted;
    SceneWriter *to;
    std::string shipped;
  } used{{}, {}, &to, default_plugin_directory()};
  for (const auto &b : w.bodies) used.ids.insert(b->model.type->id);
  for (const FrictionRule &r : w.friction) used.ids.insert(w.laws[r.law]->type->id);
  dfm_plugin_visit(
      w.context,
      [](void *user, const dfm_type *type, const char *file) {
        Used &u = *static_cast<Used *>(user);
        const std::string path = file ? file : "";
        if (path.empty() || !u.ids.count(type->id)) return;
        const bool registered = path.rfind("static:", 0) == 0;
        if (registered ? is_bundled(path) : path_of(path).parent_path() == path_of(u.shipped)) return;
        if (!u.noted.insert(type->id).second) return;
        if (registered)
          u.to->remark(
              format("'%s' is registered by this program: to run the scene, name the folder of a "
                     "plugin that offers it in DEFORM_PLUGIN_PATH",
                     type->id));
        else
          u.to->remark(
              format("'%s' comes from %s, which must be loaded to run the scene: name its folder in "
                     "DEFORM_PLUGIN_PATH",
                     type->id, path.c_str()));
      },
      &used);
}

Written write_root(SceneWriter &to) {
  Written root;
  root["format"] = "deform-scene";
  root["version"] = 1;
  root["gravity"] = write_gravity(to.w);
  root["time"] = write_time(to);
  if (to.w.selection.listed()) root["effects"] = to.w.selection.names();
  write_materials(to);
  root["materials"] = nullptr;  // their place; obstacles may add some
  for (const auto &b : to.w.bodies) root["bodies"].push_back(write_body(to, *b));
  for (const auto &o : to.w.obstacles)
    if (!o->rigid) root["obstacles"].push_back(write_obstacle(to, *o));
  put(root, "rigid", write_rigid(to));
  for (const auto &t : to.w.tools) root["tools"].push_back(write_tool(to, *t));
  for (const auto &b : to.w.bodies)
    if (!b->planned_cuts.empty()) write_cuts(to, *b, root["cuts"]);
  put(root, "contact", write_contact(to));
  put(root, "solver", write_solver(to.w));
  put(root, "probes", write_probes(to));
  if (const std::string &output = to.options.beside.output; !output.empty())
    root["output"] = Written::parse(output);
  note_omissions(to);
  if (to.materials.empty()) root.erase("materials");
  else root["materials"] = to.materials;
  return root;
}

// Indented, but for lists of numbers and what holds no further lists or objects.
void print(const Written &value, const std::string &before, std::string &out) {
  const auto leaf = [](const Written &v) { return !v.is_structured(); };
  if (leaf(value) || std::all_of(value.begin(), value.end(), leaf)) {
    out += value.dump(-1, ' ', false, Written::error_handler_t::strict);
    return;
  }
  const std::string inside = before + "  ";
  out += value.is_object() ? "{" : "[";
  bool first = true;
  for (const auto &entry : value.items()) {
    out += first ? "\n" : ",\n";
    first = false;
    out += inside;
    if (value.is_object()) out += Written(entry.key()).dump() + ": ";
    print(entry.value(), inside, out);
  }
  out += "\n" + before + (value.is_object() ? "}" : "]");
}

// Those of an earlier scene stay until all are written. Nothing is allocated while an error is on its way.
void write_files(const SceneWriter &to) {
  if (to.files.empty()) return;
  struct Fresh {
    std::vector<std::filesystem::path> paths;  // of the files, then their folder
    std::error_code error;
    ~Fresh() {
      for (const auto &p : paths) std::filesystem::remove(p, error);
    }
  } fresh;
  const std::filesystem::path folder = path_of(beside(to.path, ".part"));
  for (const SceneWriter::File &f : to.files) fresh.paths.push_back(folder / path_of(f.name));
  fresh.paths.push_back(folder);
  std::filesystem::create_directory(folder, fresh.error);
  for (size_t i = 0; i < to.files.size(); ++i) to.files[i].write(name_of(fresh.paths[i]));
  for (size_t i = 0; i < to.files.size(); ++i) {
    const std::string into = beside(to.path, to.files[i].name);
    std::filesystem::rename(fresh.paths[i], path_of(into), fresh.error);
    if (fresh.error)
      fail(DFM_E_IO, "%s: cannot be replaced: %s", into.c_str(), fresh.error.message().c_str());
  }
}

constexpr const char *kSnapshot = "snapshot.state";

// A snapshot fits a world that was made in the same way, so the scene is read and compared.
void write_snapshot(SceneWriter &to) {
  scene::Scene back(to.w.context, to.path, nullptr);
  const World &made = resolve<World>(Kind::world, back.world());
  if (snapshot_structure(made) != snapshot_structure(to.w)) {
    to.note(
        "no snapshot is written, since rounding of meshes or poses, or what a scene cannot describe, makes "
        "the world of the scene differ from this one");
    if (!to.options.partial)
      fail(DFM_E_UNSUPPORTED, "%s is written, but %s", to.path.c_str(), to.first.c_str());
    return;
  }
  std::vector<unsigned char> bytes;
  world_snapshot(to.w, bytes);
  AtomicFile file(beside(to.path, kSnapshot));
  file.write(bytes.data(), bytes.size());
  file.commit();
}

}  // namespace

void write_scene(World &w, const std::string &path, const WriteOptions &options, uint32_t &notes) {
  const std::filesystem::path whole = path_of(path);
  if (whole.extension() != ".json" || whole.stem().empty())
    fail(DFM_E_ARG, "%s: the name of a scene file must end in .json", path.c_str());
  SceneWriter to{w, path, options, notes};
  for (const std::string &key : scene::model_keys(w.context->registry)) to.model_keys.insert(key);
  AtomicFile scene(path);  // what cannot be written is found out first
  std::string text;
  try {
    print(write_root(to), "", text);
  } catch (const Written::type_error &) {
    fail(DFM_E_ARG,
         "%s: the name of this file, or of a group of a surface, is not UTF-8, which a scene must be; rename "
         "it",
         path.c_str());
  }
  if (notes > 0 && !options.partial) {
    const std::string more = notes > 1 ? format(" (and %u more like it)", notes - 1) : "";
    fail(DFM_E_UNSUPPORTED,
         "%s is not written: %s%s; with DFM_SCENE_PARTIAL (partial=True in Python) the scene is written "
         "without it",
         path.c_str(), to.first.c_str(), more.c_str());
  }
  write_files(to);
  scene.write(text + "\n");
  scene.commit();
  std::error_code absent;  // that of an earlier scene
  std::filesystem::remove(whole.parent_path() / path_of(folder_name(path)) / kSnapshot, absent);
  if (options.snapshot) write_snapshot(to);
}

}  // namespace dfm::writing
