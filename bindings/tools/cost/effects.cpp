// What `deform explain --costs` measures: the scene without each of its effects, beside the scene as it is.
#include "effect_costs.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <memory>
#include <utility>

#include "json_text.h"
#include "messages.h"
#include "progress.h"
#include "state_file.h"
#include "step_size.h"

namespace cli {
namespace {

constexpr unsigned kPairs = 11;
// Of 11 independent differences the second least and the second largest enclose the median with a probability
// of 1 - 2 (1 + 11) / 2^11 = 98.8 %, whatever their distribution.
constexpr unsigned kOutside = 1;
constexpr double kChunk = 0.03;  // s of processor time; shorter ones are hard to distinguish
constexpr unsigned kMaxSteps = 20000;

double processor_time() { return double(std::clock()) / CLOCKS_PER_SEC; }

// A world that starts again and again from where it was.
class Course {
 public:
  Course(const SceneFile &scene, double step)
      : world_(scene.world()), step_(step), start_(snapshot_of(world_)) {}
  // s for n steps from the start
  double run(unsigned n) {
    need(dfm_world_restore(world_, start_.data(), start_.size()));
    const double begin = processor_time();
    for (unsigned i = 0; i < n; ++i) {
      const dfm_status status = dfm_world_step(world_, step_, nullptr);
      need(status);
      if (status != DFM_OK) throw Failure(kBadInput, "a step is discarded");
    }
    return processor_time() - begin;
  }

 private:
  dfm_world world_;
  double step_;
  std::string start_;
};

bool works(const JsonValue &plan, const std::string &body, const std::string &effect) {
  for (const JsonValue &b : plan.list("bodies"))
    for (const JsonValue &e : b.list("effects"))
      if (b.get("name") == body && e.get("name") == effect) return e.get("works") == "true";
  return false;
}

std::vector<std::string> names_of(const JsonValue &plan, const char *list) {
  std::vector<std::string> out;
  for (const JsonValue &row : plan.list(list)) out.push_back(row.get("name"));
  return out;
}

bool is_in(const std::vector<std::string> &names, const std::string &name) {
  return std::ranges::find(names, name) != names.end();
}

bool planned(const JsonValue &plan, const std::string &effect) {
  return is_in(names_of(plan, "effects"), effect);
}

std::string text_of(const JsonValue &value) {
  return value.kind == JsonValue::string ? quoted(value.text) : value.text;
}

// What switches an effect off.
struct Off {
  std::vector<std::string> set;                        // of the scene
  std::vector<std::string> params;                     // of the scene's model
  std::vector<std::pair<std::string, double>> values;  // the same of the body
};

class Meter {
 public:
  Meter(const Globals &globals, SceneFile &scene, const std::vector<std::string> &set)
      : globals_(globals), scene_(scene), set_(set), step_(full_step(scene)) {}

  // still_on: of the plan without the effect
  EffectCost measure(const std::string &body, const std::string &effect, const Off &off,
                     const std::function<bool(const JsonValue &)> &still_on) {
    EffectCost out;
    out.body = body;
    out.effect = effect;
    try {
      // Both are new: beside a world whose memory is older than the other's, 10 % are the caches'.
      const std::unique_ptr<SceneFile> with = open({}), without = switched(body, off);
      JsonValue plan;
      parse_json(without->explain(), plan);
      if (still_on(plan))
        throw Failure(kBadInput, "a field by cell brings it, and no parameter of the scene takes its place");
      compare(*with, *without, out);
    } catch (const Failure &why) {
      out.why_not = why.what();
    }
    return out;
  }

 private:
  const Globals &globals_;
  SceneFile &scene_;
  const std::vector<std::string> &set_;
  double step_;

  std::unique_ptr<SceneFile> open(const std::vector<std::string> &more) const {
    std::vector<std::string> set = set_;
    set.insert(set.end(), more.begin(), more.end());
    return std::make_unique<SceneFile>(globals_, scene_.path(), set, 0);
  }

  // In the scene's model where that may be said there, for materials and cells then follow; else in the body.
  std::unique_ptr<SceneFile> switched(const std::string &body, const Off &off) const {
    std::vector<std::string> all = off.set;
    all.insert(all.end(), off.params.begin(), off.params.end());
    try {
      return open(all);
    } catch (const Failure &) {
      if (off.values.empty()) throw;
    }
    std::unique_ptr<SceneFile> out = open(off.set);
    std::vector<dfm_param_value> rows;
    for (const auto &[key, value] : off.values) rows.push_back({key.c_str(), &value, 1});
    const dfm_params params = {sizeof(dfm_params), uint32_t(rows.size()), rows.data()};
    for (const BodyView &b : out->bodies())
      if (b.name == body) need(dfm_body_set_params(b.handle, &params));
    return out;
  }

  void compare(const SceneFile &with_scene, const SceneFile &without_scene, EffectCost &out) {
    Course with(with_scene, step_), without(without_scene, step_);
    const double most = std::min(double(kMaxSteps), std::max(1.0, scene_.settings().duration / step_));
    unsigned steps = 1;
    // also what the first steps have to make once is out of the way then
    for (double took = 0; (took = with.run(steps)) < kChunk && steps < most;)
      steps =
          unsigned(std::min(most, double(steps) * std::clamp(1.2 * kChunk / std::max(took, 1e-6), 2.0, 8.0)));
    (void)without.run(steps);
    std::array<double, kPairs> difference = {}, whole = {};
    for (unsigned i = 0; i < kPairs; ++i) {
      double a = 0, b = 0;
      if (i % 2 == 0) a = with.run(steps);
      b = without.run(steps);
      if (i % 2 != 0) a = with.run(steps);
      whole[i] = a / steps;
      difference[i] = (a - b) / steps;
    }
    std::ranges::sort(difference);
    std::ranges::sort(whole);
    out.median = difference[kPairs / 2];
    out.low = difference[kOutside];
    out.high = difference[kPairs - 1 - kOutside];
    out.with = whole[kPairs / 2];
    out.steps = steps;
    out.pairs = kPairs;
  }
};

// "/bodies/3/model/params/" of the body of this name
std::string params_of(const SceneFile &scene, const std::string &body) {
  for (size_t k = 0;; ++k) {
    const std::string pointer = "/bodies/" + std::to_string(k), name = scene.value(pointer + "/name");
    if (name.empty()) throw Failure(kBadInput, "the scene has no body \"" + body + "\"");
    if (name == quoted(body)) return pointer + "/model/params/";
  }
}

// The plan's effects as a list that leaves some out.
std::string list_without(const JsonValue &plan, const std::vector<std::string> &gone) {
  std::vector<std::string> names;
  for (const std::string &name : names_of(plan, "effects"))
    if (!is_in(gone, name)) names.push_back(quoted(name));
  return "/effects=" + json_array(names);
}

bool is_listed(const SceneFile &scene) { return scene.value("/effects").rfind('[', 0) == 0; }

// What bodies or laws of the plan bring.
std::vector<std::string> brought(const JsonValue &plan, const char *by) {
  std::vector<std::string> out;
  for (const JsonValue &thing : plan.list(by))
    for (std::string &name : names_of(thing, "effects")) out.push_back(std::move(name));
  return out;
}

bool law_has(const JsonValue &plan, const std::string &effect) {
  for (const JsonValue &law : plan.list("laws"))
    for (const JsonValue &e : law.list("effects"))
      if (e.get("name") == effect && e.get("works") == "true") return true;
  return false;
}

}  // namespace

std::vector<EffectCost> measure_effects(Globals &globals, SceneFile &scene,
                                        const std::vector<std::string> &set, const JsonValue &plan) {
  std::vector<EffectCost> out;
  if (scene.value("/time/mode") == "\"static\"")
    throw Failure(kBadInput,
                  "--costs measures steps, and a scene in static mode has none; set /time/mode to dynamic");
  const Patience patience(!globals.quiet && !globals.json, "measuring effects");
  const Quiet quiet(globals);
  Meter meter(globals, scene, set);
  for (const JsonValue &b : plan.list("bodies")) {
    const std::string body = b.get("name");
    for (const JsonValue &effect : b.list("effects")) {
      const std::string name = effect.get("name");
      const std::vector<JsonValue> &switches = effect.list("switches");
      if (effect.get("works") != "true" || switches.empty()) continue;
      Off off;
      if (is_listed(scene)) {
        off.set.push_back(list_without(plan, {name}));
      } else {
        for (const JsonValue &s : switches) {
          off.params.push_back(params_of(scene, body) + s.get("key") + "=" + text_of(*s.find("off")));
          off.values.emplace_back(s.get("key"), s.scalar("off_value"));
        }
      }
      out.push_back(
          meter.measure(body, name, off, [&](const JsonValue &other) { return works(other, body, name); }));
    }
  }
  // those of the laws and of contact
  const std::vector<std::string> of_bodies = brought(plan, "bodies"), of_laws = brought(plan, "laws");
  for (const std::string &name : names_of(plan, "effects")) {
    if (is_in(of_bodies, name)) continue;
    std::vector<std::string> gone = {name};
    if (name == "friction") gone.insert(gone.end(), of_laws.begin(), of_laws.end());
    Off off;
    off.set.push_back(list_without(plan, gone));
    out.push_back(meter.measure("", name, off, [&](const JsonValue &other) {
      if (law_has(other, name)) throw Failure(kBadInput, "it is the law's own");
      return planned(other, name);
    }));
  }
  return out;
}

}  // namespace cli
