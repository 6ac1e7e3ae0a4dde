#include "live/sliders.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "deform/plugin.h"
#include "messages.h"
#include "render/geometry.h"

namespace live {
namespace {

void add_gravity(Simulation &simulation, std::vector<Slider> &out) {
  cli::JsonValue g;
  if (!cli::parse_json(simulation.scene().value("/gravity"), g) || g.items.size() != 3) return;  // it varies
  render::Vec way{std::strtod(g.items[0].text.c_str(), nullptr),
                  std::strtod(g.items[1].text.c_str(), nullptr),
                  std::strtod(g.items[2].text.c_str(), nullptr)};
  Slider s;
  s.name = "gravity";
  s.label = "gravity, m/s2";
  s.value = render::norm(way);
  s.high = std::max(20.0, 2 * s.value);
  way = render::unit(way, {0, 0, -1});
  s.apply = [&simulation, way](double x) {
    const double to[3] = {x * way.x, x * way.y, x * way.z};
    cli::JsonObject line;
    simulation.act(line.add("do", "\"gravity\"", "to", cli::json_vector(to)));
  };
  out.push_back(s);
}

void add_coefficient(Simulation &simulation, const std::string &a, const std::string &b, const char *key,
                     double value, std::vector<Slider> &out) {
  Slider s;
  s.name = std::string(key) + ":" + a + ":" + b;
  s.label = std::string(key) + "  " + a + ", " + b;
  s.value = value;
  s.high = std::max(1.5, 2 * value);
  s.apply = [&simulation, a, b, key](double x) {
    cli::JsonObject line;
    simulation.act(line.add("do", "\"friction\"", "between",
                            cli::json_array({cli::quoted(a), cli::quoted(b)}), "key", cli::quoted(key),
                            "value", x));
  };
  out.push_back(s);
}

// A parameter of the model or law of that id, or of an id that ends so, if it may change mid-run; or NULL.
const dfm_param *changeable(const cli::SceneFile &scene, const std::string &id, const char *key) {
  struct Sought {
    const std::string &id;
    const char *key;
    const dfm_param *found;
  } sought{id, key, nullptr};
  const auto look = [](void *user, const dfm_type *type, const char *) {
    Sought &s = *static_cast<Sought *>(user);
    if (s.id != type->id && !std::string(type->id).ends_with("." + s.id)) return;
    for (const dfm_param &row : cli::params_of(*type))
      if (std::strcmp(row.key, s.key) == 0 && (row.flags & DFM_PARAM_RUNTIME) != 0) s.found = &row;
  };
  cli::need(dfm_plugin_visit(scene.context(), look, &sought));
  return sought.found;
}

void add_friction(Simulation &simulation, std::vector<Slider> &out) {
  cli::JsonValue rules;
  if (!cli::parse_json(simulation.scene().value("/contact/friction"), rules)) return;
  for (const cli::JsonValue &rule : rules.items) {
    const cli::JsonValue *const sides = rule.find("between"), *const params = rule.find("params");
    if (!sides || sides->items.size() != 2 || rule.get("law") == "none") continue;
    const std::string &a = sides->items[0].text, &b = sides->items[1].text;
    std::vector<const dfm_param *> rows;
    for (const char *key : {"mu", "mu_C", "mu_S"})
      if (const dfm_param *row = changeable(simulation.scene(), rule.get("law"), key)) rows.push_back(row);
    const auto value = [&](const dfm_param &row) {
      for (const char *key : {row.key, "mu"})  // the file's shorthand for both
        if (const std::string text = params ? params->get(key) : std::string(); !text.empty())
          return std::strtod(text.c_str(), nullptr);
      return row.def;
    };
    const auto as_first = [&](const dfm_param *row) { return value(*row) == value(*rows[0]); };
    if (!rows.empty() && std::all_of(rows.begin(), rows.end(), as_first))
      add_coefficient(simulation, a, b, "mu", value(*rows[0]), out);
    else
      for (const dfm_param *row : rows) add_coefficient(simulation, a, b, row->key, value(*row), out);
  }
}

void add_stiffness(Simulation &simulation, std::vector<Slider> &out) {
  const cli::SceneFile &scene = simulation.scene();
  for (const cli::BodyView &body : scene.bodies()) {
    const std::string at = scene.pointer_of(body.name);
    std::string text = scene.value(at + "/model/params/young");
    const std::string material = scene.value(at + "/material");
    if (text.empty() && material.size() > 2)
      text = scene.value("/materials/" + material.substr(1, material.size() - 2) + "/young");
    const double young = std::strtod(text.c_str(), nullptr);
    if (!(young > 0) || !changeable(scene, body.model, "young")) continue;
    Slider s;
    s.name = "young:" + body.name;
    s.label = "E  " + body.name + ", Pa";
    s.value = young;
    s.low = 0.1 * young;
    s.high = 10 * young;
    s.logarithmic = true;
    s.apply = [&simulation, name = body.name](double x) {
      cli::JsonObject line;
      simulation.act(line.add("do", "\"param\"", "body", cli::quoted(name), "key", "\"young\"", "value", x));
    };
    out.push_back(s);
  }
}

}  // namespace

std::vector<Slider> make_sliders(Simulation &simulation) {
  std::vector<Slider> out;
  add_gravity(simulation, out);
  add_friction(simulation, out);
  add_stiffness(simulation, out);
  for (Slider &s : out) s.first = s.value;
  return out;
}

void set_slider(std::vector<Slider> &sliders, const cli::JsonValue &request) {
  const std::string name = request.get("name");
  const auto slider =
      std::find_if(sliders.begin(), sliders.end(), [&](const Slider &s) { return s.name == name; });
  if (slider == sliders.end()) throw cli::Failure(cli::kBadInput, "there is no slider \"" + name + "\"");
  const double value = request.number("value");
  if (!(value >= slider->low && value <= slider->high))
    throw cli::Failure(cli::kBadInput, "slider \"" + name + "\": the value is outside of its range");
  slider->apply(value);
  slider->value = value;
}

std::string slider_text(const Slider &s) {
  cli::JsonObject out;
  out.add("name", cli::quoted(s.name), "label", cli::quoted(s.label), "value", s.value, "low", s.low, "high",
          s.high);
  return out.add("logarithmic", s.logarithmic).text();
}

}  // namespace live
