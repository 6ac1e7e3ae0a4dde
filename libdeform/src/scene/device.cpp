#include "scene/device.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/handle.h"
#include "plugin/context.h"
#include "plugin/params.h"
#include "plugin/quiet.h"
#include "scene/build.h"
#include "scene/planner/planner.h"
#include "state/world.h"
#include "world/body_effects.h"

namespace dfm::scene {
namespace {

// Effects that work in this body with this model, in a world without other things. Warnings come when the
// scene is built.
std::vector<std::string> effects_of(dfm_context *context, const Definition &def, const Body &body,
                                    const std::string &model, Params params) {
  const Quiet quiet;
  const Built built = build_alone(context, def, body, model, std::move(params));
  std::vector<std::string> out;
  for (const BodyEffect &e : body_effects(*resolve<World>(Kind::world, built.world).find_body(body.name)))
    if (e.works) out.push_back(e.name);
  dfm_world_destroy(built.world);
  return out;
}

std::string lost(const std::vector<std::string> &here, const std::vector<std::string> &there) {
  for (const std::string &effect : here)
    if (std::ranges::find(there, effect) == there.end()) return effect;
  return "";
}

class Chooser {
 public:
  Chooser(dfm_context *context, const Definition &def, MeshFiles &files, json &tree)
      : context_(context), def_(def), types_(context->registry), tree_(tree), files_(files) {}

  json run() {
    json out = json::array();
    for (size_t i = 0; i < def_.bodies.size(); ++i) {
      const Body &b = def_.bodies[i];
      if (!b.device) continue;
      const dfm_type &own = files_.model(b);
      const dfm_type *const card = on_card(types_, own);
      const bool requested = *b.device == "gpu";
      std::string why = card ? "" : no_model(own);
      if (card && !requested) why = slower_on(own, *card, i);
      if (why.empty()) why = differs(b, own, *card, requested);
      if (requested && !why.empty()) def_.refuse(b.pointer + "/device", why, DFM_E_UNSUPPORTED);
      const bool on_card = why.empty();
      if (on_card) why = requested ? "the scene asks for it" : faster_;
      if (on_card) move(b, own, *card);
      tree_[json::json_pointer(b.pointer + "/device")] = on_card ? "gpu" : "cpu";
      out.push_back({{"name", b.name},
                     {"device", on_card ? "gpu" : "cpu"},
                     {"model", short_name(on_card ? *card : own)},
                     {"why", why}});
    }
    return out;
  }

 private:
  std::string no_model(const dfm_type &own) const {
    std::vector<std::string> able;
    for (const dfm_type *t : types_.list(DFM_KIND_MODEL))
      if (on_card(types_, *t)) able.push_back(short_name(*t));
    return format("no loaded model computes what %s does on a graphics card%s%s; take \"device\": \"cpu\"",
                  short_name(own).c_str(), able.empty() ? "" : "; that exists for ", join(able).c_str());
  }

  // Why the processor is taken by the costs; empty: it is not, and faster_ says why.
  std::string slower_on(const dfm_type &own, const dfm_type &card, size_t body) {
    if (def_.equilibrium) return "the processor finds equilibria";
    if (regimes_.empty()) {
      measured_ = read_costs();
      regimes_ = regimes(context_, def_, files_, measured_);
    }
    const BodyRegime &b = regimes_[body];
    const double step = def_.step > 0 ? def_.step : kFrame;
    const double here = 1e3 * step * predicted_cost(measured_, short_name(own), b, step),
                 there = 1e3 * step * predicted_cost(measured_, short_name(card), b, step);
    if (!std::isfinite(here) || !std::isfinite(there))
      return format("no costs of %s are known; deform calibrate measures them where there is a card",
                    std::isfinite(here) ? short_name(card).c_str() : short_name(own).c_str());
    const std::string times = format(
        "%u points that touch %s: %.2g ms per step of %.3g s on a card (costs of %s), %.2g ms on the "
        "processor (%s)",
        b.points, touches(b), there, step, machine(card).c_str(), here, machine(own).c_str());
    if (!(there < here)) return times;
    faster_ = times;
    return "";
  }

  std::string machine(const dfm_type &model) const {
    for (const MeasuredModel &m : measured_.models)
      if (m.id == short_name(model) && !m.machine.empty()) return m.machine;
    return measured_.machine;
  }

  static const char *touches(const BodyRegime &b) {
    constexpr const char *kWhat[kMeets] = {"nothing", "the ground", "a probe", "another body"};
    return kWhat[static_cast<size_t>(what_it_meets(b))];
  }

  // The parameters that its materials give to a model.
  std::vector<const Params *> of_materials(const Body &b) const {
    std::vector<const Params *> out;
    for (const Material &m : def_.materials)
      if (m.name == b.material ||
          std::ranges::any_of(b.by_group, [&](const GroupMaterial &g) { return g.material == m.name; }))
        out.push_back(&m.extra);
    return out;
  }

  // A parameter that the card's model lacks and that is not 0, which leaves out what it is for.
  static std::string lacking(const Params &params, const dfm_type &own, const dfm_type &card) {
    for (size_t k = 0; k < params.keys.size(); ++k)
      if (find_row(own, params.keys[k].c_str()) && !find_row(card, params.keys[k].c_str()) &&
          std::ranges::any_of(params.values[k], [](double v) { return v != 0; }))
        return params.keys[k];
    return "";
  }

  // Why the card would not move the body as the processor does; empty: it would. A driver that computes on
  // the processor counts where the card is asked for. Throws Error where the model of the processor refuses.
  std::string differs(const Body &b, const dfm_type &own, const dfm_type &card, bool any_driver) const {
    const std::string name = short_name(card);
    std::string key = lacking(b.params, own, card);
    for (const Params *given : of_materials(b))
      if (key.empty()) key = lacking(*given, own, card);
    for (const FieldFile &f : b.fields)
      if (const dfm_param *row = find_row(card, f.key.c_str()); !row || !(row->flags & DFM_PARAM_PER_CELL))
        key = f.key;
    if (!key.empty())
      return format("%s has no \"%s\" here; leave it out, or take \"device\": \"cpu\"", name.c_str(),
                    key.c_str());
    if (moved_by(b) > DFM_INTEGRATOR_SYMPLECTIC_EULER)
      return format(
          "%s is moved by symplectic_euler alone; leave \"integrator\" out, or take \"device\": \"cpu\"",
          name.c_str());
    Params left = left_for(b.params, own, card);
    if (!any_driver) set_hardware(card, left);
    const std::vector<std::string> here = effects_of(context_, def_, b, own.id, b.params);
    std::vector<std::string> there;
    try {
      there = effects_of(context_, def_, b, card.id, std::move(left));
    } catch (const Error &e) {
      const std::string why = e.what(), where = def_.file + ": ";
      return (why.starts_with(where) ? why.substr(where.size()) : why) + "; or take \"device\": \"cpu\"";
    }
    const std::string effect = lost(here, there);
    if (!effect.empty())
      return format(
          "%s has no %s; switch it off in %s (deform explain says by what), take \"device\": "
          "\"cpu\", or name the model %s",
          name.c_str(), effect.c_str(), short_name(own).c_str(), name.c_str());
    return "";
  }

  static void set_hardware(const dfm_type &card, Params &params) {
    const dfm_param *const row = find_row(card, "device");
    for (int k = 0; row && row->names && row->names[k]; ++k) {
      if (std::string_view(row->names[k]) != "hardware") continue;
      params.keys.push_back(row->key);
      params.values.push_back({double(k)});
    }
  }

  int32_t moved_by(const Body &b) const {
    return b.def.integrator != DFM_INTEGRATOR_AUTO ? b.def.integrator : def_.world.integrator;
  }

  // All but what the processor's model has for itself.
  static Params left_for(const Params &params, const dfm_type &own, const dfm_type &card) {
    Params out;
    for (size_t k = 0; k < params.keys.size(); ++k)
      if (find_row(card, params.keys[k].c_str()) || !find_row(own, params.keys[k].c_str())) {
        out.keys.push_back(params.keys[k]);
        out.values.push_back(params.values[k]);
      }
    return out;
  }

  void move(const Body &b, const dfm_type &own, const dfm_type &card) {
    tree_[json::json_pointer(b.pointer)].erase("integrator");  // it says what the card does anyway
    json &model = tree_[json::json_pointer(b.pointer + "/model")];
    model["type"] = card.id;
    for (const std::string &key : b.params.keys)
      if (find_row(own, key.c_str()) && !find_row(card, key.c_str())) model["params"].erase(key);
  }

  dfm_context *context_;
  const Definition &def_;
  const Registry &types_;
  json &tree_;
  MeshFiles &files_;
  Measured measured_;
  std::vector<BodyRegime> regimes_;
  std::string faster_;
};

}  // namespace

bool whole_on_card(dfm_context *context, const Definition &def, const Body &body, const dfm_type &own) {
  const dfm_type *const card = on_card(context->registry, own);
  if (!card) return false;
  const std::vector<std::string> here = effects_of(context, def, body, own.id, {});
  try {
    return lost(here, effects_of(context, def, body, card->id, {})).empty();
  } catch (const Error &) {
    return true;
  }
}

json choose_devices(dfm_context *context, const Definition &def, MeshFiles &files, json &tree) {
  return Chooser(context, def, files, tree).run();
}

}  // namespace dfm::scene
