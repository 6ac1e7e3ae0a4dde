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
std::string parameters_sane(const Subject &);
// rules_process.cpp: what it does to the process it runs in
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

}  // namespace cli::check
