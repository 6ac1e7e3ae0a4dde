// The effects that a world selects by its list: an effect that is not in the list is not simulated
// (doc/concepts/effects.md).
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "deform/plugin.h"

struct dfm_context;

namespace dfm {

class Registry;

// Effects of the host; the others come from plugins.
inline constexpr char kFriction[] = "friction", kMemory[] = "memory", kGuard[] = "guard";
inline constexpr char kSelfContact[] = "self_contact";
// Effects that require self contact: the sides of a cut, and a folded surface, touch each other.
inline constexpr const char *kNeedSelf[] = {"cutting", "folding"};

// An effect that the list leaves out although parameters call for it: its owner, and these parameters.
struct LeftOut { std::string effect, of, by; };

class Selection {
 public:
  Selection() = default;  // no list: all effects that parameters call for
  // NULL-terminated, or NULL. Effects of a law imply friction; cutting and folding imply self contact.
  Selection(const char *const *list, const Registry &registry);
  bool listed() const { return listed_; }
  bool lists(const std::string &effect) const;  // by name
  bool wants(const std::string &effect) const {
    return !listed_ || lists(effect) || (friction_on_ && effect == kFriction) ||
           (folds_ && effect == kSelfContact);
  }
  const std::vector<std::string> &names() const { return names_; }

 private:
  bool listed_ = false, friction_on_ = false, folds_ = false;
  std::vector<std::string> names_;
};

void warn_of(const dfm_context &context, const LeftOut &left_out);

// ---- models: the rows of "dfm.effect_rows/1" --------------------------------------------------------------
struct EffectRow {
  std::string effect;
  uint32_t param;  // row of the type's table
  double off;
};
// Reads a table of a plugin, or null; rows that name no parameter of the type are ignored.
std::vector<EffectRow> copy_effect_rows(const dfm_type &type, const void *table);
// Switches off the active effects of the type that are not selected: their rows of `values` (all rows end to
// end) get the value "off", and by_cell[row] (whether the row differs by cell) becomes 0. A row on which a
// selected effect depends is kept. Returns false if nothing has changed.
bool omit_effects(const dfm_type &type, const std::vector<EffectRow> &rows, const Selection &selection,
                  const std::function<bool(const std::string &)> &works, std::vector<double> &values,
                  std::vector<uint8_t> &by_cell);

// ---- laws: dfm_friction.without ---------------------------------------------------------------------------
struct LawEffect {
  std::string name;
  bool works = true;        // with these parameters
  bool switchable = false;  // by parameters
  std::vector<double> off;  // if switchable: the parameters without it
};
// In the order of the type's table; then "memory" for a law with state. Does not include the host's
// "friction".
std::vector<LawEffect> law_effects(const dfm_type &type, const dfm_host &host,
                                   const std::vector<double> &values);
inline bool is_frictionless(const dfm_friction &law) { return law.flags & DFM_FRIC_NONE; }

struct SelectedLaw {
  const dfm_type *type;
  std::vector<double> values;
};
// The replacement of a law under the selection: `none` without friction; without memory or stiction the
// cheapest law that slides and has the other selected effects, `coulomb`; without its effects that are not
// selected. Throws Error if a required law is not loaded.
SelectedLaw select_law(const Registry &registry, const dfm_host &host, const Selection &selection,
                       const dfm_type &type, const std::vector<double> &values);

}  // namespace dfm
