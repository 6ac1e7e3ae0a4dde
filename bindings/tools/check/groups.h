// The rules by the files that hold them.
#pragma once
#include "check/check.h"

namespace cli::check {

// rules_file.cpp: the file and what it says of itself
// as its author called it; empty where the file is stripped
std::string variable_at(const std::string &file, uint64_t address);
std::string exports_one_symbol(const Subject &);
std::string refuses_unknown_abi(const Subject &);
std::string metadata_complete(const Subject &);
// Why nothing can use the type, as the sentence of V03: a parameter row that cannot be read, or a function
// that every use of it calls and that is missing. Empty: none.
std::string unusable(const dfm_type &type);
std::string parameters_sane(const Subject &);
// rules_process.cpp: what it does to the process it runs in
std::string spelt(const std::string &name);  // a function as its author wrote it
bool sanitized();                            // this program
std::string eval_keeps_to_itself(const Subject &);
std::string stays_in_its_arrays(const Subject &);
std::string unloads_without_leak(const Subject &);
std::string sanitizer_finds_nothing(const Subject &);
std::string writes_no_static(const Subject &);
// rules_environment.cpp: what it leaves changed
std::string keeps_rounding(const Subject &);
std::string keeps_process(const Subject &);
// rules_lanes.cpp: a pure function of each lane
std::string same_bits(const Subject &);
std::string bad_lane_stays(const Subject &);
std::string split_equals_whole(const Subject &);
std::string endures(const Subject &);
// rules_force.cpp: what every friction force is
std::string rests_at_zero(const Subject &);
std::string turns_with_frame(const Subject &);
std::string dissipates(const Subject &);
std::string derivatives_agree(const Subject &);
std::string bounded_at_every_step(const Subject &);
std::string follows_normal_force(const Subject &);
// rules_course.cpp: how force and state go on
std::string state_stays_bounded(const Subject &);
std::string opposes_slip(const Subject &);
std::string converges_with_step(const Subject &);
// rules_promises.cpp: what the law's effects promise
std::string holds_below_threshold(const Subject &);
std::string falls_with_speed(const Subject &);
std::string rises_at_high_speed(const Subject &);
std::string presliding_is_displacement(const Subject &);
std::string loop_has_area(const Subject &);
std::string breaks_away(const Subject &);
std::string does_not_drift(const Subject &);
// rules_model_process.cpp: what a model does to the process it runs in
std::string model_parameters_sane(const Subject &);
std::string step_keeps_to_itself(const Subject &);
std::string model_stays_in_its_arrays(const Subject &);
std::string model_same_bits(const Subject &);
std::string bad_point_returns(const Subject &);
std::string instances_share_nothing(const Subject &);
std::string step_writes_no_static(const Subject &);
// all that a world requires of a model
void use_model(const Subject &);
// rules_model.cpp: its forces at one state
std::string rest_pose_is_free(const Subject &);
std::string rigid_motion_is_free(const Subject &);
std::string forces_sum_to_zero(const Subject &);
std::string forces_are_the_gradient(const Subject &);
std::string stiffness_is_the_derivative(const Subject &);
std::string constant_stiffness_is_constant(const Subject &);
std::string dampers_take_energy(const Subject &);
std::string numbering_does_not_matter(const Subject &);
std::string collapsed_cells_stay_finite(const Subject &);
std::string cell_energy_sums(const Subject &);
// rules_single.cpp
std::string single_is_close(const Subject &);
std::string parts_are_the_whole(const Subject &);
// rules_stepper.cpp: how it goes on, and bodies that step themselves
uint64_t digest_of_model(const Subject &);
std::string state_is_the_hosts(const Subject &);
std::string cost_grows_with_cells(const Subject &);
std::string bound_is_honest(const Subject &);
std::string commit_is_predict_and_respond(const Subject &);
std::string response_is_an_operator(const Subject &);
std::string diagonal_bounds_response(const Subject &);
std::string cut_does_not_matter(const Subject &);

}  // namespace cli::check
