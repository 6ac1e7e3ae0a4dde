#include "choice.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>

#include "messages.h"

namespace cli::cost {
namespace {

// Friction keys that every law understands; others belong to the law that the scene names.
const char *const kSharedLawKeys[] = {"mu", "mu_C", "mu_S", "v_s", "delta", "sigma2"};

std::string law_params(const JsonValue &rule, const std::string &law) {
  const JsonValue *const params = rule.find("params");
  JsonObject out;
  for (const JsonMember &m : params ? params->members : std::vector<JsonMember>()) {
    const bool shared = std::ranges::any_of(kSharedLawKeys, [&](const char *key) { return m.name == key; });
    // dahl has neither a static coefficient nor a viscous part
    const bool dahl = law == "dahl" && m.name != "mu" && m.name != "mu_C";
    if (law != "none" && shared && !dahl) out.add(m.name, json_text(m.value));
  }
  return out.text();
}

void set_model(const Subject &subject, const std::string &body, size_t i, const Knobs &knobs, Settings &out) {
  const std::string own = subject.bodies[i].model;
  const std::string model = knobs.model.empty() ? own : knobs.model;
  JsonValue value;
  if (const JsonValue *const given = subject.find(body + "/model"); given && model == own) value = *given;
  JsonValue type;
  type.kind = JsonValue::string;
  type.text = model;
  set_pointer(value, "/type", type);
  if (!knobs.volume.empty() && model == "msm") {
    JsonValue volume;
    volume.kind = JsonValue::literal;
    volume.text = knobs.volume;
    set_pointer(value, "/params/volume", volume);
  }
  const bool precision = !knobs.precision.empty() && model == "msm";
  if (precision) {
    type.text = knobs.precision;
    set_pointer(value, "/precision", type);
  }
  if (model != own || !knobs.volume.empty() || precision) out.emplace_back(body + "/model", json_text(value));
}

void set_cells(const Subject &subject, size_t i, const Knobs &knobs, Settings &out) {
  const std::string body = "/bodies/" + std::to_string(i);
  const auto number_at = [&](const char *key, double otherwise) {
    const JsonValue *const value = subject.find(body + key);
    return value ? std::strtod(value->text.c_str(), nullptr) : otherwise;
  };
  // those that are hexahedra already are so many times as many as they are
  const bool already = knobs.kind == Cells::hexahedra && has_hexahedra(subject, i);
  const double times = already ? knobs.cells / kHexahedron : knobs.cells;
  const auto scaled = [&](double n) { return std::to_string(std::max(1L, std::lround(n * times))); };
  const JsonValue *const mesh = subject.find(body + "/mesh");
  if (const JsonValue *const lattice = subject.find(body + "/lattice")) {
    const bool counted = lattice->find("cells");
    out.emplace_back(body + (counted ? "/lattice/cells" : "/lattice/size"),
                     counted ? scaled(number_at("/lattice/cells", 1))
                             : number(number_at("/lattice/size", 1) / std::cbrt(times)));
  } else if (knobs.kind == Cells::hexahedra && !already) {
    if (subject.find(body + "/fill")) out.emplace_back(body + "/fill", "null");
    out.emplace_back(body + "/lattice", "{\"cells\": " + scaled(subject.bodies[i].cells) + "}");
  } else if (mesh && mesh->kind == JsonValue::object && !subject.find(body + "/fill")) {
    out.emplace_back(body + "/mesh/cells", scaled(number_at("/mesh/cells", 1000)));
    if (knobs.kind == Cells::second_order) out.emplace_back(body + "/mesh/order", "2");
  } else {
    out.emplace_back(body + "/fill/cells", scaled(number_at("/fill/cells", subject.bodies[i].cells)));
  }
}

}  // namespace

bool has_hexahedra(const Subject &subject, size_t i) {
  const std::string body = "/bodies/" + std::to_string(i);
  return subject.find(body + "/lattice") || subject.word(body + "/mesh/make", "") == "bricks";
}

std::string seconds(double h) { return formatted("%.6g", h); }

Settings settings_of(const Subject &subject, const Knobs &knobs) {
  Settings out;
  for (size_t i = 0; i < subject.bodies.size(); ++i) {
    const std::string body = "/bodies/" + std::to_string(i);
    set_model(subject, body, i, knobs, out);
    if (!knobs.own_mesh()) set_cells(subject, i, knobs, out);
  }
  if (!knobs.integrator.empty()) out.emplace_back("/time/integrator", quoted(knobs.integrator));
  if (!knobs.step.empty()) out.emplace_back("/time/step", knobs.step);
  if (!knobs.tolerance.empty()) out.emplace_back("/contact/tolerance", knobs.tolerance);
  if (!knobs.self.empty()) out.emplace_back("/contact/self", knobs.self);
  if (!knobs.guard.empty()) out.emplace_back("/contact/guard", knobs.guard);
  const JsonValue *const rules = subject.find("/contact/friction");
  for (size_t i = 0; rules && !knobs.law.empty() && i < rules->items.size(); ++i) {
    const std::string rule = "/contact/friction/" + std::to_string(i);
    out.emplace_back(rule + "/law", quoted(knobs.law));
    out.emplace_back(rule + "/params", law_params(rules->items[i], knobs.law));
  }
  return out;
}

std::string precision_of(const Subject &subject) {
  for (size_t i = 0; i < subject.bodies.size(); ++i)
    if (subject.word("/bodies/" + std::to_string(i) + "/model/precision", "double") == "single")
      return "single";
  return "double";
}

std::string label_of(const Knobs &knobs) {
  std::string out;
  const auto add = [&](const std::string &part) { out += (out.empty() ? "" : ", ") + part; };
  if (!knobs.model.empty()) add(knobs.model);
  if (!knobs.volume.empty()) add("volume " + knobs.volume);
  if (!knobs.precision.empty()) add(knobs.precision + " precision");
  const std::string step = knobs.step == "\"auto\"" ? "auto step" : knobs.step + " s";
  if (!knobs.integrator.empty()) add(knobs.integrator + (knobs.step.empty() ? "" : " " + step));
  else if (!knobs.step.empty()) add(step);
  if (knobs.kind == Cells::second_order) add("second-order tetrahedra");
  if (knobs.kind == Cells::hexahedra) add("lattice");
  if (knobs.cells != 1) add(formatted("cells x%.3g", knobs.cells));
  if (!knobs.tolerance.empty()) add("tolerance " + knobs.tolerance + " m/s");
  if (!knobs.law.empty()) add("law " + knobs.law);
  if (!knobs.self.empty()) add("self " + (knobs.self == "\"auto\"" ? "auto" : knobs.self));
  if (!knobs.guard.empty()) add("guard " + knobs.guard);
  return out.empty() ? "the scene as it is" : out;
}

namespace {
std::string joined(const std::set<std::string> &words) {
  std::string out;
  for (const std::string &w : words) out += (out.empty() ? "" : "+") + w;
  return out;
}
}  // namespace

std::string models_of(const Subject &subject) {
  std::set<std::string> names;
  for (const SubjectBody &body : subject.bodies) names.insert(body.model);
  return joined(names);
}

std::string laws_of(const Subject &subject) {
  std::set<std::string> names;
  const JsonValue *const rules = subject.find("/contact/friction");
  for (size_t i = 0; rules && i < rules->items.size(); ++i) names.insert(rules->items[i].get("law"));
  return names.empty() ? "default" : joined(names);
}

}  // namespace cli::cost
