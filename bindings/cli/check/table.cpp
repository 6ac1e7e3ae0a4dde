// The rules, in the order in which they are run and printed. What the letters and numbers mean to an author:
// doc/reference/plugin_check.md.
#include <cstring>

#include "check/groups.h"

namespace cli::check {

const std::vector<Rule> &rules() {
  static const std::vector<Rule> table = {
      // id, title, of each type, law, model
      {"V01", "one exported symbol", false, exports_one_symbol, nullptr},
      {"V02", "loads, and refuses an unknown ABI", false, refuses_unknown_abi, nullptr},
      {"V03", "metadata complete, operations sound", true, metadata_complete, metadata_complete},
      {"V04", "parameter table sane, defaults accepted, out of range refused", true, parameters_sane,
       parameters_sane},
      {"V05", "no allocation, file, environment, clock or chance in eval", true, eval_keeps_to_itself,
       nullptr},
      {"V06", "writes and reads nothing outside its arrays", true, stays_in_its_arrays, nullptr},
      {"V07", "same input, same bits, twice and in two processes", true, same_bits, nullptr},
      {"V08", "a NaN or infinite lane neither crashes nor hangs nor leaves its lane", true, bad_lane_stays,
       nullptr},
      {"V09", "100 load-unload cycles without a leak", false, unloads_without_leak, unloads_without_leak},
      {"V10", "nothing found by the sanitizer, from several threads", true, sanitizer_finds_nothing, nullptr},
      {"V11", "the floating-point environment stays as it was", true, keeps_rounding, keeps_rounding},
      {"V12", "the process stays as it was: folder, environment, locale, streams, signals, threads", false,
       keeps_process, keeps_process},
      {"V13", "same bits after a million contacts, and in a batch of 70,000", true, endures, nullptr},
      {"V14", "eval writes no static variable", true, writes_no_static, nullptr},
      {"F01", "zero slip and zero state give zero force", true, rests_at_zero, nullptr},
      {"F02", "the force turns with the tangent frame", true, turns_with_frame, nullptr},
      {"F03", "closed loops dissipate, and no more comes out than was stored", true, dissipates, nullptr},
      {"F04", "a split batch equals the whole batch", true, split_equals_whole, nullptr},
      {"F05", "derivatives agree with differences", true, derivatives_agree, nullptr},
      {"F06", "stiction: what is held below the threshold stays", true, holds_below_threshold, nullptr},
      {"F07", "stribeck: the force falls with speed somewhere", true, falls_with_speed, nullptr},
      {"F08", "viscous: the force rises at high speed", true, rises_at_high_speed, nullptr},
      {"F09", "presliding: force is a function of displacement at low rates", true,
       presliding_is_displacement, nullptr},
      {"F10", "hysteresis: a presliding loop has an area", true, loop_has_area, nullptr},
      {"F11", "breakaway: a peak above the kinetic level, falling with the ramp rate", true, breaks_away,
       nullptr},
      {"F12", "bounded at every step from 1e-6 to 1/30 s", true, bounded_at_every_step, nullptr},
      {"F13", "stiction: no drift under a biased oscillating load", true, does_not_drift, nullptr},
      {"F14", "normal force to zero and back, and a jump by 1e6, leave no spike", true, follows_normal_force,
       nullptr},
      {"F15", "no state grows without bound", true, state_stays_bounded, nullptr},
      {"F16", "the force opposes the slip, and a mirrored history gives the mirrored force", true,
       opposes_slip, nullptr},
      {"F17", "the force converges as the step shrinks", true, converges_with_step, nullptr},
  };
  return table;
}

const Rule *find_rule(const std::string &id) {
  for (const Rule &rule : rules())
    if (id == rule.id) return &rule;
  return nullptr;
}

}  // namespace cli::check
