// Which sizes sub-steps have: few, from a short ladder, changed rarely. Why: doc/concepts/step.md,
// doc/decisions/0041-few-sizes-of-steps.md.
//
// Symplectic Euler keeps a nearby energy that depends on the size of the step. Each change of size moves a
// body from one such energy to another, and near the bound, where the nearby energy of the stiffest mode is
// nearly degenerate, by a large share of what that mode holds. Changes that follow the motion pump. So a
// step of length H is cut into n = 1, 2, 3 or (4, 5, 6, 7) 2^k sub-steps, steps that the library chooses
// have 4, 5, 6 or
// 7 times a power of two seconds, the size goes down at once where the bound asks for it, and up only after
//   patience that doubles each time.
#pragma once
#include <cstdint>
#include <string>

namespace dfm {

inline constexpr uint32_t kFirstPatience = 256, kMostPatience = 65536;  // sub-steps

// A step over which positions, numbers of 16 digits, round by more than a quarter of what contact may err
// (1e-6 m/s) is refused: 1 ns for each meter that a body is away from the origin, and for the first one.
inline constexpr double kShortestStep = 1e-9;  // s

struct Rung {
  double size = 0;    // s; 0: none yet
  uint32_t calm = 0;  // sub-steps since the bound has last forbidden a longer one
  // sub-steps that it must allow one longer by little, before that is taken
  uint32_t patience = kFirstPatience;
};

// Lasts: a restored world goes on with it.
struct StepSizes {
  Rung cut;    // of the sub-steps that the last step was cut into
  Rung offer;  // of the step that dfm_world_stable_step answers, whatever the host takes
  // s, that the errors of the last sub-step of implicit bodies allow; 0: none has been taken
  double accurate = 0;
};

// stable: s, the longest sub-step allowed now (infinite: any).
// s, a step that is not cut, and changes its size rarely if taken again and again
double offered_step(const StepSizes &s, double stable);
// The same for implicit bodies, whose step nothing bounds: by the error of the last one. It may change often.
double accurate_step(const StepSizes &s);
// number of sub-steps of the step dt, which may be too many for an integer
double choose_pieces(StepSizes &s, double dt, double stable);
// in mid-step, where the bound has fallen below size: into how many each one is cut
double cut_finer(StepSizes &s, double size, double stable);
// Is a change of the sub-steps' size one of the rare ones, which the bound has forced or patience has earned?
// Changes of the host's own are not.
bool earned(const StepSizes &before, const StepSizes &now, double stable);
void pass(StepSizes &s);         // a sub-step has been taken
bool sound(const StepSizes &s);  // could a world have come to it?

std::string short_step(double dt, double floor);  // the sentence that refuses it

}  // namespace dfm
