#include "plugin/selection.h"

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "core/error.h"
#include "plugin/call.h"
#include "plugin/context.h"
#include "plugin/params.h"
#include "plugin/registry.h"
#include "plugin/tables.h"

namespace dfm {
namespace {

// Laws that replace others. Of those without memory `coulomb` takes fewer instructions than `karnopp` on the
// frozen scenes with contact (tests/abi/frozen/effects.py).
constexpr char kNoFriction[] = "none", kCheapest[] = "coulomb";
constexpr char kStiction[] = "stiction";

// The first fields of the rows of ABI 1.
constexpr uint32_t kRowHead = offsetof(dfm_effect_row, off) + sizeof(double);
constexpr size_t kTableHead = offsetof(dfm_effect_rows, rows) + sizeof(void *);

std::vector<size_t> first_values(const dfm_type &type) {
  std::vector<size_t> first;
  size_t at = 0;
  for (uint32_t i = 0; i < type.nparam; at += type.params[i++].width) first.push_back(at);
  return first;
}

bool remembers(const dfm_type &type, const dfm_host &host, const std::vector<double> &values) {
  return !law_slots(type, host, values.data()).empty();
}

// The cheapest law, with the parameters that it shares with this one; none if this one has no mu_C.
std::optional<SelectedLaw> plain_law(const Registry &registry, const dfm_type &type,
                                     const std::vector<double> &values) {
  const dfm_type *const plain = registry.try_find(DFM_KIND_FRICTION, kCheapest);
  const dfm_param *const mu = find_row(type, "mu_C");
  if (!plain || !mu) return std::nullopt;
  const std::vector<size_t> first = first_values(type);
  std::vector<dfm_param_value> rows{{"mu", &values[first[size_t(mu - type.params)]], 1}};
  for (uint32_t i = 0; i < type.nparam; ++i)
    if (find_row(*plain, type.params[i].key) && type.params[i].width == 1)
      rows.push_back({type.params[i].key, &values[first[i]], 1});
  try {
    return SelectedLaw{plain, pack_params(*plain, rows)};
  } catch (const Error &) {  // a range of its own
    return std::nullopt;
  }
}

}  // namespace

Selection::Selection(const char *const *list, const Registry &registry) : listed_(list != nullptr) {
  for (; list && *list; ++list) names_.push_back(*list);
  for (const char *need : kNeedSelf) folds_ = folds_ || lists(need);
  friction_on_ = lists(kMemory);
  for (const dfm_type *law : registry.list(DFM_KIND_FRICTION))
    for (const std::string &word : effects(*law)) friction_on_ = friction_on_ || lists(word);
}

bool Selection::lists(const std::string &effect) const {
  return std::find(names_.begin(), names_.end(), effect) != names_.end();
}

void warn_of(const dfm_context &context, const LeftOut &o) {
  context.warn("%s: the list of effects does not contain %s, which the scene needs: %s", o.of.c_str(),
               o.effect.c_str(), o.by.c_str());
}

std::vector<EffectRow> copy_effect_rows(const dfm_type &type, const void *from) {
  std::vector<EffectRow> out;
  const auto table = copy_table<dfm_effect_rows>(from, kTableHead, type.id, "dfm_effect_rows");
  if (!table || !table->rows || table->row_size < kRowHead) return out;
  for (uint32_t i = 0; i < table->n; ++i) {
    const dfm_effect_row row = row_at(table->rows, table->row_size, i);
    if (row.effect && row.param < type.nparam) out.push_back({row.effect, row.param, row.off});
  }
  return out;
}

bool omit_effects(const dfm_type &type, const std::vector<EffectRow> &rows, const Selection &selection,
                  const std::function<bool(const std::string &)> &works, std::vector<double> &values,
                  std::vector<uint8_t> &by_cell) {
  const std::vector<size_t> first = first_values(type);
  const auto on = [&](const EffectRow &row) {
    return by_cell[row.param] || values[first[row.param]] != row.off;
  };
  // whether a wanted effect would be off without it
  const auto alone = [&](const EffectRow &row) {
    return std::any_of(rows.begin(), rows.end(), [&](const EffectRow &r) {
      return r.param == row.param && selection.wants(r.effect) && on(r) &&
             std::none_of(rows.begin(), rows.end(), [&](const EffectRow &other) {
               return other.effect == r.effect && other.param != r.param && on(other);
             });
    });
  };
  bool changed = false;
  for (const EffectRow &row : rows) {
    if (selection.wants(row.effect) || !on(row) || !works(row.effect) || alone(row)) continue;
    values[first[row.param]] = row.off;
    by_cell[row.param] = 0;
    changed = true;
  }
  return changed;
}

std::vector<LawEffect> law_effects(const dfm_type &type, const dfm_host &host,
                                   const std::vector<double> &values) {
  const dfm_friction &law = law_of(type);
  std::vector<LawEffect> out;
  for (const std::string &name : effects(type)) {
    LawEffect e;
    e.name = name;
    e.off = values;
    if (law.without &&
        call_plugin(host, type, "without",
                    [&] {
                      const dfm_status status = law.without(name.c_str(), e.off.data());
                      e.switchable = status == DFM_OK;
                      return status == DFM_E_UNSUPPORTED ? DFM_OK : status;
                    }) == DFM_OK &&
        e.switchable)
      e.works = e.off != values;
    out.push_back(std::move(e));
  }
  if (remembers(type, host, values)) out.push_back({kMemory, true, false, values});
  return out;
}

SelectedLaw select_law(const Registry &registry, const dfm_host &host, const Selection &selection,
                       const dfm_type &type, const std::vector<double> &values) {
  SelectedLaw out{&type, values};
  if (!selection.listed() || is_frictionless(law_of(type))) return out;
  if (!selection.wants(kFriction)) {
    const dfm_type &none = registry.find(DFM_KIND_FRICTION, kNoFriction);
    return {&none, pack_params(none, {})};
  }
  const auto unwanted = [&](const LawEffect &e) {
    return e.works && !selection.wants(e.name) && (e.name == kMemory || e.name == kStiction);
  };
  const std::vector<LawEffect> own = law_effects(type, host, values);
  if (const auto plain = plain_law(registry, type, values);
      plain && plain->type != &type && std::any_of(own.begin(), own.end(), unwanted)) {
    const std::vector<std::string> has = effects(*plain->type);
    if (std::none_of(own.begin(), own.end(), [&](const LawEffect &e) {
          return e.works && selection.wants(e.name) && std::find(has.begin(), has.end(), e.name) == has.end();
        }))
      out = *plain;
  }
  for (const std::string &name : effects(*out.type)) {
    if (selection.wants(name)) continue;
    for (const LawEffect &e : law_effects(*out.type, host, out.values))
      if (e.name == name && e.switchable && e.works) out.values = e.off;
  }
  return out;
}

}  // namespace dfm
