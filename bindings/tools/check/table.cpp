// The rules, in the order in which they are run and printed. What the letters and numbers mean to an author:
// doc/reference/plugin_check.md.
#include <cstring>

#include "check/groups.h"
#include "check/plugin.h"

namespace cli::check {

const std::vector<Rule> &rules() {
  constexpr auto none = nullptr;
  static const std::vector<Rule> table = {
      // id, title, of each type, law, model, solver
      {"V01", "one exported symbol", false, exports_one_symbol},
      {"V02", "loads, and refuses an unknown ABI", false, refuses_unknown_abi},
      {"V03", "metadata complete, operations sound", true, metadata_complete, metadata_complete,
       metadata_complete},
      {"V04", "parameter table sane, defaults accepted, out of range refused", true, parameters_sane,
       model_parameters_sane, parameters_sane},
      {"V05", "no allocation, file, environment, clock or random number in eval or a step", true,
       eval_keeps_to_itself, step_keeps_to_itself},
      {"V06", "writes and reads nothing outside its arrays", true, stays_in_its_arrays,
       model_stays_in_its_arrays},
      {"V07", "same input, same bits, twice and in two processes", true, same_bits, model_same_bits},
      {"V08", "a NaN or infinite lane does not crash, hang or change other lanes", true, bad_lane_stays,
       bad_point_returns},
      {"V09", "100 load-unload cycles without a leak", false, unloads_without_leak},
      {"V10", "nothing found by the sanitizer, from several threads", true, sanitizer_finds_nothing,
       instances_share_nothing},
      {"V11", "the floating-point environment stays as it was", true, keeps_rounding, keeps_rounding,
       keeps_rounding},
      {"V12", "the process stays as it was: folder, environment, locale, streams, signals, threads", false,
       keeps_process},
      {"V13", "same bits after a million contacts, and in a batch of 70,000", true, endures},
      {"V14", "eval or a step writes no static variable", true, writes_no_static, step_writes_no_static},
      {"F01", "zero slip and zero state give zero force", true, rests_at_zero},
      {"F02", "the force turns with the tangent frame", true, turns_with_frame},
      {"F03", "closed loops dissipate, and no more comes out than was stored", true, dissipates},
      {"F04", "a split batch equals the whole batch", true, split_equals_whole},
      {"F05", "derivatives agree with differences", true, derivatives_agree},
      {"F06", "stiction: what is held below the threshold stays", true, holds_below_threshold},
      {"F07", "stribeck: the force falls with speed somewhere", true, falls_with_speed},
      {"F08", "viscous: the force rises at high speed", true, rises_at_high_speed},
      {"F09", "presliding: force is a function of displacement at low rates", true,
       presliding_is_displacement},
      {"F10", "hysteresis: a presliding loop has an area", true, loop_has_area},
      {"F11", "breakaway: a peak above the kinetic level, falling with the ramp rate", true, breaks_away},
      {"F12", "bounded at every step from 1e-6 to 1/30 s", true, bounded_at_every_step},
      {"F13", "stiction: no drift under a biased oscillating load", true, does_not_drift},
      {"F14", "normal force to zero and back, and a jump by 1e6, leave no spike", true, follows_normal_force},
      {"F15", "no state grows without bound", true, state_stays_bounded},
      {"F16", "the force opposes the slip, and a mirrored history gives the mirrored force", true,
       opposes_slip},
      {"F17", "the force converges as the step shrinks", true, converges_with_step},
      {"M01", "the rest pose is free of forces", true, none, rest_pose_is_free},
      {"M02", "forces turn with the body, and its energy does not change", true, none, rigid_motion_is_free},
      {"M03", "forces sum to zero, and so do their moments", true, none, forces_sum_to_zero},
      {"M04", "forces are the negative gradient of the energy", true, none, forces_are_the_gradient},
      {"M05", "stiffness is the derivative of the forces, symmetric and negative semidefinite", true, none,
       stiffness_is_the_derivative},
      {"M09", "a mesh numbered otherwise moves the same", true, none, numbering_does_not_matter},
      {"M10", "saved, restored and taken back: same bits", true, none, state_is_the_hosts},
      {"M11", "inverted, flat and coincident cells stay finite", true, none, collapsed_cells_stay_finite},
      {"M12", "the cost of a cell does not grow with the body", true, none, cost_grows_with_cells},
      {"M13", "the bound of explicit steps is safe, and at least a quarter of the limit", true, none,
       bound_is_honest},
      {"M14", "commit equals predict plus respond", true, none, commit_is_predict_and_respond},
      {"M16", "the energies of the cells sum to the energy", true, none, cell_energy_sums},
      {"M17", "same bits for any cut of parallel_for", true, none, cut_does_not_matter},
      {"M18", "respond is linear, symmetric and positive semidefinite", true, none, response_is_an_operator},
      {"M19", "diagonal is that of respond, or above", true, none, diagonal_bounds_response},
      {"M20", "constant stiffness is constant", true, none, constant_stiffness_is_constant},
      {"M21", "dampers take energy, and are claimed", true, none, dampers_take_energy},
      {"M22", "forces in single precision are those in double, nearly", true, none, single_is_close},
      {"M23", "forces given part by part are those of all points at once", true, none, parts_are_the_whole},
  };
  return table;
}

const Rule *find_rule(const std::string &id) {
  for (const Rule &rule : rules())
    if (id == rule.id) return &rule;
  return nullptr;
}

Check *check_for(const Rule &rule, uint32_t kind) {
  return kind == DFM_KIND_FRICTION ? rule.law : kind == DFM_KIND_MODEL ? rule.model : rule.solver;
}

}  // namespace cli::check
