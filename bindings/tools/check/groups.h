// The rules by the files that hold them.
#pragma once
#include <functional>

#include "check/check.h"

namespace cli::check {

// rules_file.cpp: the file and what it says of itself
Check exports_one_symbol, refuses_unknown_abi, metadata_complete;
// Why nothing can use the type, as the sentence of V03: a parameter row that cannot be read, or a function
// that every use of it calls and that is missing. Empty: none.
std::string unusable(const dfm_type &type);
Check parameters_sane;
// rules_process.cpp: what it does to the process it runs in
std::string spelt(const std::string &name);  // a function as its author wrote it
void needs_sanitizer();                      // of this program; else Skipped
// While a call runs the plugin's own writable memory is read only; inside: any address in the plugin.
void keeps_statics(const Subject &, const char *name, const void *inside, const char *remedy,
                   const std::function<void()> &call);
Check eval_keeps_to_itself, stays_in_its_arrays, unloads_without_leak, sanitizer_finds_nothing,
    writes_no_static;
// rules_environment.cpp: what it leaves changed
Check keeps_rounding, keeps_process;
// rules_lanes.cpp: a pure function of each lane
Check same_bits, bad_lane_stays, split_equals_whole, endures;
// rules_force.cpp: what every friction force is
Check rests_at_zero, turns_with_frame, dissipates, derivatives_agree, bounded_at_every_step,
    follows_normal_force;
// rules_course.cpp: how force and state go on
Check state_stays_bounded, opposes_slip, converges_with_step;
// rules_promises.cpp: what the law's effects promise
Check holds_below_threshold, falls_with_speed, rises_at_high_speed, presliding_is_displacement, loop_has_area,
    breaks_away, does_not_drift;
// rules_model_process.cpp: what a model does to the process it runs in
Check model_parameters_sane, step_keeps_to_itself, model_stays_in_its_arrays, model_same_bits,
    bad_point_returns, instances_share_nothing, step_writes_no_static;
// all that a world requires of a model
void use_model(const Subject &);
// rules_model.cpp: its forces at one state
Check rest_pose_is_free, rigid_motion_is_free, forces_sum_to_zero, forces_are_the_gradient,
    stiffness_is_the_derivative, constant_stiffness_is_constant, dampers_take_energy,
    numbering_does_not_matter, collapsed_cells_stay_finite, cell_energy_sums;
// rules_single.cpp
Check single_is_close, parts_are_the_whole;
// rules_stepper.cpp: how it goes on, and bodies that step themselves
uint64_t digest_of_model(const Subject &);
Check state_is_the_hosts, cost_grows_with_cells, bound_is_honest, commit_is_predict_and_respond,
    response_is_an_operator, diagonal_bounds_response, cut_does_not_matter;

}  // namespace cli::check
