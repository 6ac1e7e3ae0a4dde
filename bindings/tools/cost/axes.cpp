#include "axes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "messages.h"

namespace cli::cost {
namespace {

// Effects that a model may do without: they make it a better or worse model of the same body. One that a
// scene asks for beyond these (fibers, relaxation, plastic flow) is another body without it.
const char *const kOwnMeans[] = {"volume", "damping", "large_rotation"};

// What the bodies need and the model does not offer; "" where it offers all.
std::string lacks(const Subject &subject, const Offered &model) {
  for (const SubjectBody &body : subject.bodies)
    for (const std::string &effect : body.effects) {
      const auto is = [&](const std::string &name) { return name == effect; };
      if (std::ranges::none_of(kOwnMeans, is) && std::ranges::none_of(model.effects, is)) return effect;
    }
  return "";
}

class Finder {
 public:
  Finder(const Subject &subject, const std::vector<std::string> &wanted) : s_(subject), wanted_(wanted) {}

  Axes find(const std::string &mesh_left_out) {
    add({}, "scene");
    choose_reference();
    axis("model", {"model"}, model_reason(), [&] { models(); });
    out_.steps = axis("time", {"time"}, time_reason(), [&] { steps(); });
    numbers_ = axis("mesh", {"space"}, mesh_left_out, [&] { meshes(); });
    const std::string left_out = mesh_left_out.empty() ? kinds_reason() : mesh_left_out;
    out_.meshes = axis("cells", {"space"}, left_out, [&] { kinds(); }) || numbers_;
    axis("volume", {"model"}, volume_reason(), [&] { volumes(); });
    axis("contact", {"contact"}, contact_reason(), [&] { contacts(); });
    axis("law", {"contact"}, law_reason(), [&] { laws(); });
    axis("self", {"contact"}, contact_reason(), [&] { selves(); });
    axis("guard", {"contact"}, contact_reason(), [&] { guards(); });
    axis("precision", {"precision"}, precision_reason(), [&] { precisions(); });
    fronts();
    return out_;
  }

 private:
  void add(const Knobs &knobs, const std::string &axis) {
    for (Candidate &c : out_.candidates)
      if (c.knobs == knobs) {
        c.axes.push_back(axis);
        return;
      }
    out_.candidates.push_back({knobs, {axis}});
  }

  template <class Fill>
  bool axis(const std::string &name, std::vector<std::string> kinds, std::string reason, Fill fill) {
    if (!wanted_.empty() && std::ranges::find(wanted_, name) == wanted_.end())
      reason = "not asked for (--axes)";
    if (reason.empty()) fill();
    out_.axes.push_back({name, reason, std::move(kinds)});
    return reason.empty();
  }

  std::string model_reason() const {
    for (size_t i = 0; i < s_.bodies.size(); ++i) {
      const std::string body = "/bodies/" + std::to_string(i);
      if (s_.find(body + "/switch"))
        return "body '" + s_.bodies[i].name + "' changes its model itself (switch)";
      if (s_.find(body + "/anisotropy"))
        return "body '" + s_.bodies[i].name + "' has an anisotropy, whose parameters belong to its model";
      if (s_.find(body + "/fields"))
        return "body '" + s_.bodies[i].name + "' has fields, which belong to its model";
    }
    return "";
  }

  std::string time_reason() const {
    if (s_.at_rest) return "the scene is static: nothing moves";
    for (size_t i = 0; i < s_.bodies.size(); ++i)
      if (s_.find("/bodies/" + std::to_string(i) + "/integrator"))
        return "body '" + s_.bodies[i].name + "' names an integrator of its own";
    return "";
  }

  std::string volume_reason() const {
    for (const SubjectBody &body : s_.bodies)
      if (body.model == "msm") return "";
    return "no body is of the model msm, which has this term";
  }

  std::string precision_reason() const {
    for (const SubjectBody &body : s_.bodies)
      if (body.model == "msm") return "";
    return "no body is of the model msm, which alone has single precision";
  }

  std::string contact_reason() const { return s_.contact ? "" : "nothing can touch anything"; }
  std::string law_reason() const {
    if (!s_.contact) return contact_reason();
    return s_.friction ? "" : "the scene names no law of friction";
  }

  void choose_reference() {
    const Offered *const corot = s_.model("corotational_fem");
    const std::string own = models_of(s_);
    if (own == "corotational_fem") {
      out_.reference_why = "the scene's own model";
    } else if (!model_reason().empty()) {
      out_.reference_why = "the scene's own models: " + model_reason();
    } else if (!corot) {
      out_.reference_why = "the scene's own models: corotational_fem is not loaded";
    } else if (const std::string effect = lacks(s_, *corot); !effect.empty()) {
      out_.reference_why = "the scene's own models: corotational_fem does not offer " + effect;
    } else if (!wanted_.empty() && std::ranges::find(wanted_, "model") == wanted_.end()) {
      out_.reference_why = "the scene's own models: the axis model is not asked for";
    } else {
      out_.reference_model = "corotational_fem";
      out_.reference_why = "corotational_fem: linear elasticity that turns with the material";
    }
  }

  void models() {
    for (const Offered &m : s_.models)
      if (lacks(s_, m).empty()) add(model_knobs(m.name), "model");
  }

  // A body that is of this model already keeps its settings.
  Knobs model_knobs(const std::string &model) const {
    Knobs k;
    if (models_of(s_) != model) k.model = model;
    return k;
  }

  // Steps of implicit schemes that are shorter than the motion and longer than explicit ones.
  std::vector<double> long_steps() const {
    std::vector<double> out;
    for (const double h : {1.0 / 30, 1.0 / 60, 0.01, 0.005, 0.0025, 0.001})
      if (h <= s_.duration / 10 && h > 4 * s_.stable) out.push_back(h);
    if (out.size() > 4) out.resize(4);
    return out;
  }

  void steps() {
    Knobs k;
    k.integrator = "symplectic_euler";
    k.step = "\"auto\"";
    add(k, "time");
    for (const double part : {0.5, 0.25}) {
      if (s_.stable <= 0) break;
      k.step = seconds(part * s_.explicit_step());
      add(k, "time");
    }
    for (const char *integrator : {"implicit_euler", "tr_bdf2"})
      for (const double h : long_steps()) {
        k.integrator = integrator;
        k.step = seconds(h);
        add(k, "time");
      }
  }

  void meshes() {
    for (const double times : kCells) {
      Knobs k;
      k.cells = times;
      add(k, "mesh");
    }
  }

  std::string at_body(size_t i, const char *key) const { return "/bodies/" + std::to_string(i) + key; }

  // Whether every body can have such cells, and one has others. The boundary of a lattice is not the shape.
  bool can_be(Cells kind) const {
    bool other = false;
    for (size_t i = 0; i < s_.bodies.size(); ++i) {
      const JsonValue &mesh = *s_.find(at_body(i, "/mesh"));
      const bool made = mesh.kind == JsonValue::object, hexahedra = has_hexahedra(s_, i);
      if (kind == Cells::second_order ? !made || hexahedra : s_.find(at_body(i, "/surface/from")) != nullptr)
        return false;
      other |= kind == Cells::hexahedra ? !hexahedra : mesh.get("order") != "2";
    }
    return other;
  }

  // The scene's own models where they take such cells, else that of the reference.
  bool model_for(Cells kind, Knobs &knobs) const {
    const auto takes = [&](const std::string &name) {
      const Offered *const model = s_.model(name);
      return model && (kind == Cells::hexahedra ? model->lattices : model->second_order) &&
             lacks(s_, *model).empty();
    };
    if (std::ranges::all_of(s_.bodies, [&](auto &body) { return takes(body.model); })) return true;
    knobs.model = out_.reference_model;
    return takes(knobs.model);
  }

  // Only first-order tetrahedra can be cut or torn.
  bool may_be_cut() const {
    const auto any = [](const std::vector<JsonValue> &rows, const char *key) {
      return std::ranges::any_of(rows, [&](auto &row) { return row.find(key); });
    };
    const JsonValue *const materials = s_.find("/materials");
    return !s_.scene.list("cuts").empty() || any(s_.scene.list("tools"), "cuts") ||
           any(s_.scene.list("bodies"), "separate") || any(s_.scene.list("bodies"), "cut_delay") ||
           (materials && std::ranges::any_of(materials->members,
                                             [](const JsonMember &m) { return m.value.find("tear"); }));
  }

  std::string kinds_reason() const {
    if (may_be_cut()) return "a body may be cut or torn, which only first-order tetrahedra can be";
    bool can = false;
    for (const Cells kind : {Cells::second_order, Cells::hexahedra}) {
      Knobs k;
      can |= can_be(kind);
      if (can_be(kind) && model_for(kind, k)) return "";
    }
    return can ? "no model of this study takes other cells than first-order tetrahedra"
               : "bodies have such cells, show the boundary of theirs, or come from different sources";
  }

  // Hexahedra with as many points as the scene's tetrahedra or fewer, and such second-order tetrahedra.
  void kinds() {
    for (const auto &[kind, numbers] : kKinds) {
      Knobs k;
      k.kind = kind;
      if (!can_be(kind) || !model_for(kind, k)) continue;
      for (const double times : numbers) {
        k.cells = times;
        add(k, "cells");
      }
      out_.lattices |= kind == Cells::hexahedra;
    }
  }

  void precisions() {
    Knobs k;
    k.precision = precision_of(s_) == "single" ? "double" : "single";
    add(k, "precision");
  }

  void volumes() {
    for (const char *value : {"0", "1"}) {
      Knobs k;
      k.volume = value;
      bool same = true;
      for (size_t i = 0; i < s_.bodies.size(); ++i) {
        const JsonValue *const v = s_.find("/bodies/" + std::to_string(i) + "/model/params/volume");
        same &= v && std::strtod(v->text.c_str(), nullptr) == std::strtod(value, nullptr);
      }
      if (!same) add(k, "volume");
    }
  }

  void contacts() {
    Knobs k;
    for (const char *tolerance : {"1e-2", "1e-4", "1e-6"}) {
      k.tolerance = tolerance;
      add(k, "contact");
    }
  }

  void laws() {
    const std::string own = laws_of(s_);
    for (const Offered &law : s_.laws) {
      if (law.name == own) continue;
      Knobs k;
      k.law = law.name;
      add(k, "law");
    }
  }

  void selves() {
    const JsonValue *const own = s_.find("/contact/self");
    const std::string now = own ? own->text : "false";
    for (const char *value : {"false", "true", "auto"}) {
      if (now == value) continue;
      Knobs k;
      k.self = std::string(value) == "auto" ? "\"auto\"" : value;
      add(k, "self");
    }
  }

  void guards() {
    const JsonValue *const own = s_.find("/contact/guard");
    Knobs k;
    k.guard = own && own->text == "false" ? "true" : "false";
    add(k, "guard");
  }

  // Such cells with the steps that cells of their size allow, and with long ones.
  void front_of_kinds() {
    if (!out_.steps) return;
    const std::vector<Candidate> given = out_.candidates;
    std::vector<double> steps = long_steps();
    if (steps.size() > 2) steps.resize(2);
    for (const Candidate &c : given) {
      if (c.knobs.kind == Cells::own) continue;
      Knobs k = c.knobs;
      k.integrator = "symplectic_euler";
      k.step = "\"auto\"";
      add(k, "front");
      k.integrator = "tr_bdf2";
      for (const double step : steps) {
        k.step = seconds(step);
        add(k, "front");
      }
    }
  }

  // What a person would try: each model on fewer cells and with long steps.
  void fronts() {
    front_of_kinds();
    const bool models = out_.axes[0].left_out.empty();
    std::vector<std::string> names;
    if (models)
      for (const Offered &m : s_.models)
        if (lacks(s_, m).empty()) names.push_back(model_knobs(m.name).model);
    if (!models) names.push_back("");
    for (const std::string &name : names) {
      Knobs k;
      k.model = name;
      if (out_.steps) {
        k.integrator = "symplectic_euler";
        k.step = "\"auto\"";
        add(k, "front");
        for (const double times : {0.5, 0.25, 0.125}) {
          if (!numbers_) break;
          k.cells = times;
          add(k, "front");
        }
        const std::vector<double> steps = long_steps();
        if (steps.empty()) continue;
        k.integrator = "implicit_euler";
        k.step = seconds(steps[std::min<size_t>(1, steps.size() - 1)]);
        for (const double times : {1.0, 0.5, 0.25}) {
          if (times != 1 && !numbers_) break;
          k.cells = times;
          add(k, "front");
        }
      } else if (numbers_) {
        for (const double times : {0.5, 0.25}) {
          k.cells = times;
          add(k, "front");
        }
      }
    }
  }

  static constexpr double kCells[] = {0.125, 0.25, 0.5, 2};
  static constexpr std::pair<Cells, std::array<double, 3>> kKinds[] = {
      {Cells::second_order, {1.0 / 64, 1.0 / 16, 1.0 / 8}},
      {Cells::hexahedra, {kHexahedron / 16, kHexahedron / 4, kHexahedron}}};
  const Subject &s_;
  const std::vector<std::string> &wanted_;
  Axes out_;
  bool numbers_ = false;  // of cells may vary
};

}  // namespace

const std::vector<std::string> &axis_names() {
  static const std::vector<std::string> names = {"model",   "time", "mesh", "cells", "volume",
                                                 "contact", "law",  "self", "guard", "precision"};
  return names;
}

Axes find_axes(const Subject &subject, const std::string &mesh_left_out,
               const std::vector<std::string> &wanted) {
  for (const std::string &name : wanted)
    if (std::ranges::find(axis_names(), name) == axis_names().end()) {
      std::string all;
      for (const std::string &n : axis_names()) all += (all.empty() ? "" : ", ") + n;
      throw Failure(kBadInput, "--axes: there is no axis \"" + name + "\", expected " + all +
                                   did_you_mean(name, axis_names()));
    }
  return Finder(subject, wanted).find(mesh_left_out);
}

}  // namespace cli::cost
