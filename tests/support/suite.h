// The stability suite: scenes in tests/stability/suite/NAME.json, and beside each what it asks and what must
// hold of its end, in NAME.expect.json. doc/reference/stability.md explains the keys.
#pragma once
#include <filesystem>

#include "json_text.h"
#include "suite_run.h"
#include "support.h"

namespace test::suite {

inline std::string folder() { return std::string(DEFORM_SOURCE_DIR) + "/tests/stability/suite/"; }

// Names of the scenes, sorted.
inline std::vector<std::string> names() {
  std::vector<std::string> out;
  const std::string end = ".expect.json";
  for (const auto &file : std::filesystem::directory_iterator(folder())) {
    const std::string name = file.path().filename().string();
    if (name.size() > end.size() && name.ends_with(end))
      out.push_back(name.substr(0, name.size() - end.size()));
  }
  std::sort(out.begin(), out.end());
  return out;
}

class Expectations {
 public:
  explicit Expectations(const std::string &scene) : scene_(scene) {
    std::string why;
    if (!cli::parse_json(read_file(folder() + scene + ".expect.json"), root_, nullptr, &why))
      ADD_FAILURE() << scene << ".expect.json: " << why;
    static const char *const known[] = {
        "asks",           "why",     "least_contacts", "energy_input_J", "rest_speed",   "places",
        "accelerates",    "volume",  "recovers",       "keeps_spin",     "same_path_as", "stops",
        "within_reach",   "stretch", "hand",           "variants",       "models",       "combinations",
        "known_failures", "set",     "soak_seconds",   "jitter_velocity"};
    const auto check = [&](const cli::JsonValue &object) {
      for (const cli::JsonMember &m : object.members)
        EXPECT_TRUE(
            std::any_of(std::begin(known), std::end(known), [&](const char *k) { return m.name == k; }))
            << scene << ".expect.json has the unknown key " << m.name;
    };
    check(root_);
    for (const char *key : {"variants", "models"})
      if (const cli::JsonValue *v = root_.find(key))
        for (const cli::JsonMember &m : v->members) check(m.value);
  }
  const std::string &scene() const { return scene_; }
  std::string path() const { return folder() + scene_ + ".json"; }
  std::string asks() const { return root_.get("asks"); }

  // At least one, without a name where the scene has none.
  std::vector<std::string> variants() const {
    std::vector<std::string> out;
    if (const cli::JsonValue *v = root_.find("variants"))
      for (const cli::JsonMember &m : v->members) out.push_back(m.name);
    if (out.empty()) out.emplace_back();
    return out;
  }
  // "MODEL INTEGRATOR STEP", as `make test` runs them.
  std::vector<Combination> combinations(const std::string &variant) const {
    std::vector<Combination> out;
    if (const cli::JsonValue *v = find("combinations", variant, ""))
      for (const cli::JsonValue &item : v->items) out.push_back(combination(item.text));
    return out;
  }
  static Combination combination(const std::string &text) {
    char model[64], integrator[64];
    double over = 1, under = 0;
    if (std::sscanf(text.c_str(), "%63s %63s %lf/%lf", model, integrator, &over, &under) < 4)
      ADD_FAILURE() << text << ": expected MODEL INTEGRATOR 1/N";
    return {model, integrator, over / under};
  }
  Settings settings(const std::string &variant, const Combination &c, uint64_t jitter) const {
    Settings s;
    s.combination = c;
    s.jitter = jitter;
    s.jitter_velocity = number("jitter_velocity", variant, c.model, 0);
    for (const char *const level : {"", variant.c_str()}) {
      const cli::JsonValue *list = *level ? variant_of(level)->find("set") : root_.find("set");
      for (size_t i = 0; list && i < list->items.size(); ++i) s.set.push_back(list->items[i].text);
    }
    if (const cli::JsonValue *v = find("stretch", variant, c.model))
      for (const cli::JsonMember &m : v->members) s.stretch[m.name] = vector(m.value);
    if (const cli::JsonValue *v = find("hand", variant, c.model)) {
      s.hand.obstacle = v->get("obstacle");
      s.hand.begin = std::stod(v->get("begin"));
      s.hand.end = std::stod(v->get("end"));
      s.hand.velocity = vector(*v->find("velocity"));
    }
    return s;
  }
  // Why this is known to fail; empty: it must hold.
  std::string known_failure(const std::string &variant, const Combination &c) const {
    const cli::JsonValue *v = find("known_failures", variant, "");
    if (!v) return "";
    for (const cli::JsonMember &m : v->members) {
      if ((name_of(c) + " ").starts_with(m.name + " ")) return m.value.text;
    }
    return "";
  }

  // What does not hold, a sentence each.
  std::vector<std::string> complaints(const std::string &variant, const Combination &c, const Settings &how,
                                      const Seen &seen) const {
    std::vector<std::string> out;
    const auto say = [&](const char *format, auto... values) {
      char text[400];
      std::snprintf(text, sizeof text, format, values...);
      out.emplace_back(text);
    };
    const auto get = [&](const char *key, double otherwise) {
      return number(key, variant, c.model, otherwise);
    };
    if (!seen.loaded) {
      say("not loaded: %.300s", seen.reason.c_str());
      return out;
    }
    if (seen.crossings) say("%zu crossings", seen.crossings);
    if (!seen.finite) say("not finite");
    if (!seen.in_time) say("not done in time: %g s simulated", seen.time);
    const bool stops = find("stops", variant, c.model) != nullptr;
    if (stops && seen.status == DFM_OK) say("must stop itself, and does not");
    if (!stops && seen.status != DFM_OK) say("stopped at %g s: %.300s", seen.time, seen.reason.c_str());
    const double allowed = get("energy_input_J", 0) + 0.01 * seen.energy_most;
    if (seen.gain > allowed) say("gained %g J beyond its start; at most %g J are put in", seen.gain, allowed);
    const double reach = get("within_reach", HUGE_VAL);
    if (seen.reach > reach) say("something got %g m away, at most %g m", seen.reach, reach);
    if (seen.stats.contacts_max < get("least_contacts", 0))
      say("%u contacts at once at most: the scene does not do what it is for", seen.stats.contacts_max);
    if (seen.status != DFM_OK) return out;
    if (seen.stats.unconverged)
      say("%llu of %llu sub-steps are not solved", static_cast<unsigned long long>(seen.stats.unconverged),
          static_cast<unsigned long long>(seen.stats.substeps));
    const double speed = get("rest_speed", HUGE_VAL);
    if (seen.speed_last > speed)
      say("the fastest point moves with %g m/s at the end, at most %g", seen.speed_last, speed);
    for (const BodySeen &b : seen.bodies) {
      if (const cli::JsonValue *v = of_body("places", b.name, variant, c.model)) {
        const cli::JsonValue &com = *v->find("com");
        const double within = std::stod(v->get("within"));
        for (size_t k = 0; k < 3; ++k)
          if (com.items[k].kind == cli::JsonValue::literal &&
              !(std::fabs(b.com[k] - std::stod(com.items[k].text)) <= within))
            say("%s ends at %c = %g; expected %s within %g", b.name.c_str(), "xyz"[k], b.com[k],
                com.items[k].text.c_str(), within);
      }
      if (const cli::JsonValue *v = of_body("accelerates", b.name, variant, c.model)) {
        const std::array<double, 3> by = vector(*v->find("by"));
        const double within = std::stod(v->get("within"));
        const double h = seen.time / double(std::max<uint64_t>(1, seen.stats.substeps));
        for (size_t k = 0; k < 3; ++k) {
          const double went = b.com[k] - b.com_start[k], expected = 0.5 * by[k] * seen.time * (seen.time + h);
          if (!(std::fabs(went - expected) <= within))
            say("%s goes %g m along %c; expected %g within %g", b.name.c_str(), went, "xyz"[k], expected,
                within);
        }
      }
      if (const cli::JsonValue *v = of_body("volume", b.name, variant, c.model)) {
        const double lo = std::stod(v->items[0].text), hi = std::stod(v->items[1].text);
        if (!(b.volume_ratio >= lo && b.volume_ratio <= hi))
          say("%s ends with %g of its volume; expected %g to %g", b.name.c_str(), b.volume_ratio, lo, hi);
      }
      if (const cli::JsonValue *v = of_body("recovers", b.name, variant, c.model)) {
        if (!(b.misfit <= std::stod(v->text)) || b.inverted)
          say("%s does not recover: an edge is off by %g of its length, %u cells are inside out",
              b.name.c_str(), b.misfit, b.inverted);
      }
      const double keeps = get("keeps_spin", HUGE_VAL);
      double off = 0, all = 0;
      for (size_t k = 0; k < 3; ++k) {
        off = std::hypot(off, b.spin[k] - b.spin_start[k]);
        all = std::hypot(all, b.spin_start[k]);
      }
      if (off > keeps * all) say("%s loses %g of its angular momentum", b.name.c_str(), off / all);
    }
    compare_paths(variant, c, how, seen, out);
    return out;
  }

 private:
  static std::array<double, 3> vector(const cli::JsonValue &v) {
    return {std::stod(v.items[0].text), std::stod(v.items[1].text), std::stod(v.items[2].text)};
  }
  const cli::JsonValue *variant_of(const std::string &name) const {
    const cli::JsonValue *all = root_.find("variants");
    return all ? all->find(name) : nullptr;
  }
  // The variant's, else the model's, else the scene's.
  const cli::JsonValue *find(const char *key, const std::string &variant, const std::string &model) const {
    if (const cli::JsonValue *v = variant.empty() ? nullptr : variant_of(variant))
      if (const cli::JsonValue *found = v->find(key))
        return found->kind == cli::JsonValue::null ? nullptr : found;
    if (const cli::JsonValue *models = model.empty() ? nullptr : root_.find("models"))
      if (const cli::JsonValue *v = models->find(model))
        if (const cli::JsonValue *found = v->find(key))
          return found->kind == cli::JsonValue::null ? nullptr : found;
    return root_.find(key);
  }
  double number(const char *key, const std::string &variant, const std::string &model,
                double otherwise) const {
    const cli::JsonValue *v = find(key, variant, model);
    return v ? std::stod(v->text) : otherwise;
  }
  const cli::JsonValue *of_body(const char *key, const std::string &body, const std::string &variant,
                                const std::string &model) const {
    const cli::JsonValue *v = find(key, variant, model);
    return v ? v->find(body) : nullptr;
  }
  void compare_paths(const std::string &variant, const Combination &c, const Settings &how, const Seen &seen,
                     std::vector<std::string> &out) const {
    const cli::JsonValue *v = find("same_path_as", variant, c.model);
    if (!v) return;
    Settings other = how;
    for (const cli::JsonValue &item : v->find("set")->items) other.set.push_back(item.text);
    const Seen twin = run(path(), other);
    const double within = std::stod(v->get("within"));
    double most = 0;
    for (size_t b = 0; b < seen.bodies.size() && b < twin.bodies.size(); ++b)
      for (size_t i = 0; i < std::min(seen.bodies[b].path.size(), twin.bodies[b].path.size()); ++i)
        for (size_t k = 0; k < 3; ++k)
          most = std::max(most, std::fabs(seen.bodies[b].path[i][k] - twin.bodies[b].path[i][k]));
    if (!twin.loaded || twin.steps != seen.steps) most = HUGE_VAL;
    if (!(most <= within)) {
      char text[200];
      std::snprintf(text, sizeof text, "its path is up to %g m off the path that it must follow, at most %g",
                    most, within);
      out.emplace_back(text);
    }
  }

  std::string scene_;
  cli::JsonValue root_;
};

}  // namespace test::suite
