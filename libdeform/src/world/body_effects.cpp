#include "world/body_effects.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "core/error.h"
#include "plugin/registry.h"
#include "plugin/tables.h"
#include "state/world.h"

namespace dfm {
namespace {

// The first fields of a row of ABI 1.
constexpr uint32_t kFactHead = offsetof(dfm_fact, value) + sizeof(double);
constexpr size_t kFactsHead = offsetof(dfm_facts, list) + sizeof(void *);  // of their table

}  // namespace

std::vector<BodyEffect> body_effects(const Body &b) {
  const dfm_type &type = *b.model.type;
  std::vector<size_t> first;  // value of each row
  size_t values = 0;
  for (uint32_t i = 0; i < type.nparam; values += type.params[i++].width) first.push_back(values);
  const std::vector<EffectRow> rows = b.model.effect_rows();
  const SwitchedOff &held = b.switched_off;
  std::vector<BodyEffect> out;
  for (const std::string &name : effects(type)) {
    BodyEffect effect;
    effect.name = name;
    effect.works = b.model.works(name);
    for (const EffectRow &row : rows) {
      if (row.effect != name) continue;
      const double now = b.model.params[first[row.param]];
      effect.switches.push_back({&type.params[row.param], row.off, now});
      if (held.requested.empty() || b.world->selection.wants(name) || now != row.off) continue;
      const double requested = held.requested[first[row.param]];
      const std::string key = type.params[row.param].key;
      if (held.by_cell[row.param]) effect.would.push_back(key + " by cell");
      else if (requested != row.off)
        effect.would.push_back(key + " " + param_text(type.params[row.param], requested));
    }
    out.push_back(std::move(effect));
  }
  return out;
}

std::vector<LeftOut> left_out_of(const Body &b) {
  std::vector<LeftOut> out;
  if (b.switched_off.requested.empty()) return out;
  for (const BodyEffect &e : body_effects(b))
    if (!e.would.empty() && !e.works) out.push_back({e.name, "body '" + b.name + "'", join(e.would)});
  return out;
}

std::vector<BodyFact> body_facts(const Body &b) {
  std::vector<BodyFact> out;
  const auto table =
      copy_table<dfm_facts>(b.model.extension(DFM_EXT_FACTS), kFactsHead, b.model.type->id, "dfm_facts");
  if (!table || !table->list || table->row_size < kFactHead) return out;
  uint32_t n = 0;
  const dfm_fact *const facts = b.model.ask("facts", [&] { return table->list(b.model.self, &n); });
  for (uint32_t i = 0; facts && i < n; ++i) {
    const dfm_fact f = row_at(facts, table->row_size, i);
    if (f.key && f.label && f.unit) out.push_back({f.key, f.label, f.unit, f.value});
  }
  return out;
}

std::string param_text(const dfm_param &row, double value) {
  if ((row.flags & DFM_PARAM_AUTO) && value == row.def) return "\"auto\"";
  if (row.flags & DFM_PARAM_ENUM)
    for (uint32_t k = 0; row.names && row.names[k]; ++k)
      if (value == k) return std::string("\"") + row.names[k] + "\"";
  return std::isfinite(value) ? format("%.9g", value) : "null";
}

}  // namespace dfm
