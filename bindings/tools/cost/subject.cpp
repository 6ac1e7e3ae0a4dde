#include "subject.h"

#include <dlfcn.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>

#include "become.h"
#include "file.h"
#include "messages.h"
#include "scene_file.h"
#include "state_file.h"

namespace fs = std::filesystem;

namespace cli::cost {
namespace {

std::string short_name(const std::string &id) {
  const std::string own = "org.deform.";
  return id.rfind(own, 0) == 0 ? id.substr(own.size()) : id;
}

void read_offers(dfm_context *context, Subject &out, std::vector<std::string> &files) {
  struct Found {
    Subject &subject;
    std::vector<std::string> &files;
  } found{out, files};
  dfm_plugin_visit(
      context,
      [](void *user, const dfm_type *type, const char *file) {
        Found &f = *static_cast<Found *>(user);
        Offered offered{short_name(type->id), type->id, {}};
        if (type->kind == DFM_KIND_MODEL) {
          const dfm_model &model = *static_cast<const dfm_model *>(type->ops);
          offered.second_order = model.cells & DFM_CELL_TET10;
          offered.lattices = (model.cells & DFM_CELL_HEX8) && (model.caps & DFM_CAP_INSIDE);
        }
        for (const char *const *e = type->effects; e && *e; ++e) offered.effects.push_back(*e);
        if (type->kind == DFM_KIND_SOLVER) return;
        (type->kind == DFM_KIND_FRICTION ? f.subject.laws : f.subject.models).push_back(offered);
        if (file && *file) f.files.push_back(file);
      },
      &found);
}

// The inverse rotation of a body's pose: x, y, z, w.
std::array<double, 4> inverse_rotation(const JsonValue *pose) {
  std::array<double, 4> q{0, 0, 0, 1};
  const JsonValue *rotation = pose ? pose->find("rotation") : nullptr;
  if (const JsonValue *given = rotation ? rotation->find("quaternion") : nullptr) {
    double n = 0;
    for (size_t k = 0; k < 4; ++k) {
      q[k] = (k < 3 ? -1 : 1) * std::strtod(given->items[k].text.c_str(), nullptr);
      n += q[k] * q[k];
    }
    for (double &x : q) x /= std::sqrt(n);
    return q;
  }
  const JsonValue *axis = rotation ? rotation->find("axis") : nullptr;
  if (!axis || axis->items.size() != 3) return q;
  double a[3], n = 0;
  for (size_t k = 0; k < 3; ++k) a[k] = std::strtod(axis->items[k].text.c_str(), nullptr);
  for (const double x : a) n += x * x;
  if (!(n > 0)) return q;
  const double half = rotation->scalar("angle_deg") * std::acos(-1.0) / 360;
  for (size_t k = 0; k < 3; ++k) q[k] = -std::sin(half) * a[k] / std::sqrt(n);
  q[3] = std::cos(half);
  return q;
}

// Two points of the surface that lie far from each other at rest: the farthest one from the middle, and the
// farthest one from it, in the frame of the mesh. They replace probes where the scene has none. The body may
// have been moved since (a start, "place"), so its rest shape is found from the displacements.
void find_ends(dfm_body body, const JsonValue *pose, SubjectBody &out) {
  uint32_t n = 0, npoint = 0;
  need(dfm_surface_positions(body, 0, nullptr, &n));
  std::vector<double> x(3 * size_t(n)), moved(x.size());
  need(dfm_surface_positions(body, n, x.data(), &n));
  if (n == 0) return;
  need(dfm_debug_surface_displacements(body, n, moved.data(), &n));
  double from[3] = {0, 0, 0}, lo[3], hi[3];
  for (size_t i = 0; i < x.size(); ++i) x[i] -= moved[i];
  for (size_t k = 0; k < 3; ++k) lo[k] = hi[k] = x[k];
  for (size_t i = 0; i < x.size(); ++i) {
    from[i % 3] += x[i] / n;
    lo[i % 3] = std::min(lo[i % 3], x[i]);
    hi[i % 3] = std::max(hi[i % 3], x[i]);
  }
  out.size = std::sqrt((hi[0] - lo[0]) * (hi[0] - lo[0]) + (hi[1] - lo[1]) * (hi[1] - lo[1]) +
                       (hi[2] - lo[2]) * (hi[2] - lo[2]));
  // one point of the cells, in the frame of the mesh and placed
  need(dfm_body_get_state(body, 0, nullptr, nullptr, &npoint));
  std::vector<double> rest(3 * size_t(npoint)), placed(rest.size());
  need(dfm_body_get_rest(body, npoint, rest.data(), 0, nullptr));
  need(dfm_body_get_state(body, npoint, placed.data(), nullptr, &npoint));
  moved.resize(placed.size());
  need(dfm_debug_displacements(body, npoint, moved.data(), &npoint));
  const std::array<double, 4> back = inverse_rotation(pose);
  for (int end = 0; end < 2; ++end) {
    size_t best = 0;
    double most = -1;
    for (size_t i = 0; i < x.size(); i += 3) {
      double d = 0;
      for (size_t k = 0; k < 3; ++k) d += (x[i + k] - from[k]) * (x[i + k] - from[k]);
      if (d > most * (1 + 1e-9)) {
        most = d;
        best = i;
      }
    }
    double arm[3], turned[3];
    for (size_t k = 0; k < 3; ++k) {
      from[k] = x[best + k];
      arm[k] = from[k] - (placed[k] - moved[k]);
    }
    rotate(back.data(), arm, turned);
    out.ends.push_back({rest[0] + turned[0], rest[1] + turned[1], rest[2] + turned[2]});
  }
}

// A scene with an accuracy or a budget is studied with the planner's choice fixed: with the request in
// place, every change would be planned again.
void fix_plan(const SceneFile &scene, Subject &out) {
  for (const char *const wish : {"accuracy", "budget"}) {
    if (!out.find(std::string("/") + wish)) continue;
    const std::string text = scene.value(std::string("/") + wish + "/chosen/set");
    JsonValue set;
    if (!parse_json(text, set)) throw Failure(kBadInput, "the plan is not JSON");
    std::erase_if(out.scene.members, [&](const JsonMember &m) { return m.name == wish; });
    out.planned.push_back({std::string("/") + wish, "null"});
    for (const JsonMember &m : set.members) {
      set_pointer(out.scene, m.name, m.value);
      out.planned.push_back({m.name, json_text(m.value)});
    }
  }
}

void read_bodies(const SceneFile &scene, const JsonValue &plan, Subject &out) {
  const JsonValue *rows = plan.find("bodies");
  std::map<size_t, SubjectBody> places;  // in the file: the world and the plan have them in order of ids
  for (size_t i = 0; i < scene.bodies().size(); ++i) {
    const BodyView &view = scene.bodies()[i];
    SubjectBody body;
    body.name = view.name;
    body.cells = view.ntet;
    const JsonValue *const row = rows && i < rows->items.size() ? &rows->items[i] : nullptr;
    body.model = row ? short_name(row->get("model")) : "";
    const JsonValue *const effects = row ? row->find("effects") : nullptr;
    for (size_t e = 0; effects && e < effects->items.size(); ++e)
      if (effects->items[e].get("works") == "true") body.effects.push_back(effects->items[e].get("name"));
    const JsonValue *const integrator = row ? row->find("integrator") : nullptr;
    const std::string used = integrator ? integrator->get("used") : "";
    out.implicit |= used == "implicit_euler" || used == "tr_bdf2";
    const std::string at = scene.pointer_of(view.name);
    find_ends(view.handle, out.find(at + "/pose"), body);
    places[std::stoul(at.substr(at.rfind('/') + 1))] = std::move(body);
  }
  for (auto &[place, body] : places) out.bodies.push_back(std::move(body));
}

double stable_step(const JsonValue &plan) {
  const JsonValue *const step = plan.find("step");
  const double h = step ? step->scalar("stable_s") : 0;
  return std::isfinite(h) ? h : 0;
}

// Nothing bounds the step of implicit bodies: the plan of the same scene in explicit time has what bounds
// the reference. 0 where the scene cannot be explicit.
double explicit_step(const Globals &globals, const Subject &subject) {
  std::vector<std::string> set = {"/time/integrator=symplectic_euler", "/time/step=auto"};
  for (const auto &[pointer, value] : subject.planned) set.push_back(pointer + "=" + value);
  try {
    const SceneFile scene(globals, subject.path, set, 0);
    JsonValue plan;
    return parse_json(scene.explain(), plan) ? stable_step(plan) : 0;
  } catch (const Failure &) {
    return 0;
  }
}

}  // namespace

Hash &Hash::add(const std::string &text) {
  for (const char c : text) h_ = (h_ ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  h_ = (h_ ^ 0xff) * 1099511628211ull;
  return *this;
}

Hash &Hash::add_file(const std::string &path) {
  struct stat info = {};
  add(path);
  if (stat(path.c_str(), &info) == 0)
    add(std::to_string(info.st_size) + " " + std::to_string(info.st_mtim.tv_sec) + " " +
        std::to_string(info.st_mtim.tv_nsec));
  return *this;
}

std::string Hash::hex() const { return hash_text(h_); }

const JsonValue *at_pointer(const JsonValue &value, const std::string &pointer) {
  const JsonValue *at = &value;
  for (size_t i = 0; i < pointer.size() && at;) {
    const size_t end = std::min(pointer.find('/', i + 1), pointer.size());
    const std::string key = pointer.substr(i + 1, end - i - 1);
    i = end;
    if (at->kind == JsonValue::array) {
      const size_t k = size_t(std::strtoul(key.c_str(), nullptr, 10));
      at = k < at->items.size() ? &at->items[k] : nullptr;
    } else {
      at = at->find(key);
    }
  }
  return at;
}

void set_pointer(JsonValue &value, const std::string &pointer, const JsonValue &to) {
  JsonValue *at = &value;
  for (size_t i = 0; i < pointer.size();) {
    const size_t end = std::min(pointer.find('/', i + 1), pointer.size());
    const std::string key = pointer.substr(i + 1, end - i - 1);
    i = end;
    if (at->kind == JsonValue::array) {
      const size_t k = size_t(std::strtoul(key.c_str(), nullptr, 10));
      if (k >= at->items.size()) return;
      at = &at->items[k];
      continue;
    }
    at->kind = JsonValue::object;
    const auto found = std::ranges::find_if(at->members, [&](const JsonMember &m) { return m.name == key; });
    if (found == at->members.end()) {
      at->members.push_back({key, {}});
      at = &at->members.back().value;
    } else {
      at = &found->value;
    }
  }
  *at = to;
}

std::vector<std::string> file_pointers(const JsonValue &scene) {
  std::vector<std::string> out;
  const auto add = [&](const std::string &pointer) {
    const JsonValue *const v = at_pointer(scene, pointer);
    if (v && v->kind == JsonValue::string) out.push_back(pointer);
  };
  const JsonValue *const bodies = scene.find("bodies");
  for (size_t i = 0; bodies && i < bodies->items.size(); ++i) {
    const std::string body = "/bodies/" + std::to_string(i);
    for (const char *key : {"/mesh", "/surface/mesh", "/nodal_bc", "/anisotropy/field", "/start/state"})
      add(body + key);
    if (const JsonValue *const fields = bodies->items[i].find("fields"))
      for (const JsonMember &field : fields->members) add(body + "/fields/" + field.name);
  }
  const JsonValue *const obstacles = scene.find("obstacles");
  for (size_t i = 0; obstacles && i < obstacles->items.size(); ++i)
    add("/obstacles/" + std::to_string(i) + "/mesh");
  const JsonValue *const tools = scene.find("tools");
  for (size_t i = 0; tools && i < tools->items.size(); ++i)
    for (const char *key : {"/mesh", "/motion/file"}) add("/tools/" + std::to_string(i) + key);
  return out;
}

const Offered *Subject::model(const std::string &name) const {
  for (const Offered &m : models)
    if (m.name == name || m.id == name) return &m;
  return nullptr;
}

const JsonValue *Subject::find(const std::string &pointer) const {
  const JsonValue *const v = at_pointer(scene, pointer);
  return v && v->kind != JsonValue::null ? v : nullptr;
}

std::string Subject::word(const std::string &pointer, const std::string &otherwise) const {
  const JsonValue *const v = find(pointer);
  return v && v->kind == JsonValue::string ? v->text : otherwise;
}

Subject read_subject(const std::string &path, Globals &globals) {
  Subject out;
  out.path = path;
  out.folder = fs::path(path).parent_path().string();
  const Quiet quiet(globals);  // each run of a choice says for itself what it has to say
  const SceneFile scene(globals, path, {}, 0);
  const std::string text = read_file(path, 64u << 20, "a scene");
  if (!parse_json(text, out.scene)) throw Failure(kBadInput, path + ": this is not JSON");
  out.given = out.scene;
  fix_plan(scene, out);
  out.at_rest = out.word("/time/mode", "dynamic") == "static";
  const dfm_scene_settings &settings = scene.settings();
  out.duration = settings.duration;
  out.step = settings.step;
  out.every = settings.every;
  out.probes = settings.nprobe > 0;
  JsonValue plan;
  if (!parse_json(scene.explain(), plan)) throw Failure(kBadInput, path + ": its plan cannot be read");
  read_bodies(scene, plan, out);
  if (out.bodies.empty())
    throw Failure(kBadInput, path + ": has no deformable body whose cost could be shown");
  for (const JsonValue &stage : plan.list("stages")) out.contact |= stage.get("name") == "narrow";
  out.stable = out.implicit ? explicit_step(globals, out) : stable_step(plan);
  const JsonValue *const rules = out.find("/contact/friction");
  out.friction = out.contact && rules && !rules->items.empty();
  std::vector<std::string> files;
  read_offers(scene.context(), out, files);
  Hash hash;
  hash.add(text);
  for (const std::string &pointer : file_pointers(out.scene)) {
    fs::path file = fs::path(out.folder) / out.find(pointer)->text;
    hash.add_file(file.string());
    for (const char *part : {".ele", ".node", ".face"})  // a mesh of TetGen is several files
      hash.add_file(file.replace_extension(part).string());
  }
  Dl_info library = {};
  if (dladdr(reinterpret_cast<void *>(&dfm_scene_open), &library) != 0 && library.dli_fname)
    hash.add_file(library.dli_fname);
  hash.add_file(beside("deform")).add(dfm_version(nullptr, nullptr, nullptr));
  for (const std::string &file : files) hash.add_file(file);
  for (const auto &[pointer, value] : out.planned) hash.add(pointer).add(value);
  out.fingerprint = hash.value();
  return out;
}

}  // namespace cli::cost
