#include "world/idle.h"

#include <algorithm>

#include "core/error.h"
#include "core/names.h"
#include "plugin/context.h"
#include "plugin/params.h"
#include "state/world.h"

namespace dfm {
namespace {

// For a key that no model knows: the nearest one that the body's model has.
std::string meant(const Body &b, const std::string &key) {
  if (is_material_member(key)) return {};
  for (const dfm_type *model : b.world->context->registry.list(DFM_KIND_MODEL))
    if (find_row(*model, key.c_str())) return {};
  std::vector<std::string> known = {"density", "friction", kTearKey, kToughnessKey};
  for (uint32_t i = 0; i < b.model.type->nparam; ++i) known.push_back(b.model.type->params[i].key);
  return did_you_mean(key, known, '\'');
}

}  // namespace

std::vector<Unused> find_unused(const dfm_type &type, const CellMaterials &cells) {
  std::vector<Unused> out;
  const dfm_material_def plain = dfm_material_def_default();
  const auto note = [&](const std::string &key, const std::string &material) {
    const auto same = [&](const Unused &u) { return u.key == key; };
    if (!find_row(type, key.c_str()) && std::none_of(out.begin(), out.end(), same))
      out.push_back({key, material});
  };
  for (const Material *m : cells.list) {
    for (const auto &[key, at] : kMaterialMembers)
      if (m->def.*at != plain.*at) note(key, m->name);
    for (const std::string &key : m->extra_keys)
      if (key != "friction" && key != kTearKey && key != kToughnessKey) note(key, m->name);
  }
  return out;
}

std::vector<IdleParam> idle_params(const Body &b) {
  std::vector<IdleParam> out;
  const dfm_type &type = *b.model.type;
  for (const Unused &u : b.unused) {
    const bool field =
        u.material.empty() &&
        std::ranges::any_of(b.composition.given, [&](const CellField &f) { return f.key == u.key; });
    const std::string by = field                ? "a field of the body"
                           : u.material.empty() ? "its material"
                                                : "material '" + u.material + "'";
    out.push_back({u.key,
                   format("%s gives it, and %s has no such parameter%s%s", by.c_str(), type.id,
                          field ? " that may differ by cell" : "", meant(b, u.key).c_str()),
                   true, true});
  }
  size_t at = 0;
  for (uint32_t i = 0; i < type.nparam; at += type.params[i++].width) {
    const dfm_param &row = type.params[i];
    const std::string why = b.model.idle_reason(i);
    if (why.empty()) continue;
    const double *const now = &b.model.params[at];
    const bool chosen = std::ranges::find(b.fields, row.key, &CellField::key) != b.fields.end() ||
                        std::any_of(now, now + row.width, [&](double x) { return x != row.def; });
    // users expect an effect of these at any value
    if (chosen || is_material_member(row.key)) out.push_back({row.key, why, chosen});
  }
  return out;
}

void warn_of_idle(const Body &b) {
  for (const IdleParam &p : idle_params(b))
    if (p.chosen)
      b.world->context->warn(b, ": %s has no effect%s: %s", p.key.c_str(),
                             p.unknown ? "" : ", or another one than it names", p.why.c_str());
}

}  // namespace dfm
