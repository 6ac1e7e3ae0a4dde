// What a world asks for by its list of effects. A list selects: what is not in it is not simulated
// (doc/concepts/effects.md).
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "deform/plugin.h"

struct dfm_context;

namespace dfm {

class Registry;

// Words of the host's own; the others are plugins'.
inline constexpr char kFriction[] = "friction", kMemory[] = "memory", kGuard[] = "guard";
inline constexpr char kSelfContact[] = "self_contact";
// Effects that cannot keep their promise without self contact: what is cut lies on itself, what folds comes
// to lie on itself.
inline constexpr const char *kNeedSelf[] = {"cutting", "folding"};

// What a list leaves out although parameters call for it: whose it is, and by which parameters.
struct LeftOut { std::string effect, of, by; };

class Selection {
 public:
  Selection() = default;  // no list: whatever parameters call for
  // NULL-terminated, or NULL. What a law does asks for friction, without which it cannot be; cutting and
  // folding for self contact.
  Selection(const char *const *list, const Registry &registry);
  bool listed() const { return listed_; }
  bool lists(const std::string &effect) const;  // by name
  bool wants(const std::string &effect) const {
    return !listed_ || lists(effect) || (rubs_ && effect == kFriction) || (folds_ && effect == kSelfContact);
  }
  const std::vector<std::string> &names() const { return names_; }

 private:
  bool listed_ = false, rubs_ = false, folds_ = false;
  std::vector<std::string> names_;
};

void warn_of(const dfm_context &context, const LeftOut &left_out);

// ---- models: the rows of "dfm.effect_rows/1" --------------------------------------------------------------
struct EffectRow {
  std::string effect;
  uint32_t param;  // row of the type's table
  double off;
};
// Of a table that a plugin answered, or null; rows that name no parameter of the type are passed over.
std::vector<EffectRow> copy_effect_rows(const dfm_type &type, const void *table);
// Switches those of the type's effects off that are at work and that the selection does not want: their rows
// of `values` (all rows end to end) get the value that is off, and by_cell[row], which says whether the row
// differs by cell, becomes 0. A row that alone keeps another, wanted effect at work stays. False: nothing has
// changed.
bool leave_out(const dfm_type &type, const std::vector<EffectRow> &rows, const Selection &selection,
               const std::function<bool(const std::string &)> &works, std::vector<double> &values,
               std::vector<uint8_t> &by_cell);

// ---- laws: dfm_friction.without ---------------------------------------------------------------------------
struct LawEffect {
  std::string name;
  bool works = true;        // with these parameters
  bool switchable = false;  // by parameters
  std::vector<double> off;  // where switchable: the parameters without it
};
// In the order of the type's table; then "memory" of a law that has a state. The host's "friction" is not
// among them.
std::vector<LawEffect> law_effects(const dfm_type &type, const dfm_host &host,
                                   const std::vector<double> &values);
inline bool is_frictionless(const dfm_friction &law) { return law.flags & DFM_FRIC_NONE; }

struct SelectedLaw {
  const dfm_type *type;
  std::vector<double> values;
};
// What stands for a law under the selection: `none` without friction; without memory, or without stiction,
// the cheapest law that slides and has all else that is wanted of this one, `coulomb`; and of that law what
// is wanted. Throws Error where one that is called for is not loaded.
SelectedLaw select_law(const Registry &registry, const dfm_host &host, const Selection &selection,
                       const dfm_type &type, const std::vector<double> &values);

}  // namespace dfm
