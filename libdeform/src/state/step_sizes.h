// The sizes of sub-steps: few different ones, from a short ladder, changed rarely. Why: doc/concepts/step.md,
// doc/decisions/explicit_time.md.
//
// Symplectic Euler keeps a nearby energy that depends on the size of the step. Each change of size moves a
// body from one such energy to another, and near the bound, where the nearby energy of the stiffest mode is
// nearly degenerate, by a large share of the energy of that mode. If changes of size follow the motion,
// they pump energy into it. Therefore
//   - a step of length H is cut into n = 1, 2, 3 or (4, 5, 6, 7) 2^k sub-steps;
//   - steps that the library chooses have 4, 5, 6 or 7 times a power of two seconds;
//   - the size goes down at once where the bound requires it, and up only after a waiting time (patience)
//     that doubles each time;
//   - a host that changes the length of its steps pays with damping: doc/decisions/energy_watch.md.
#pragma once
#include <cmath>
#include <cstdint>
#include <string>

namespace dfm {

inline constexpr uint32_t kFirstPatience = 256, kMaxPatience = 65536;  // sub-steps

// A step is refused if the rounding of positions (16 digits) over that step exceeds a quarter of the
// tolerance of contact (1e-6 m/s): 1 ns for each meter of distance from the origin, and at least 1 ns.
inline constexpr double kShortestStep = 1e-9;  // s

// s: how long the size must stay the same before sub-steps may be as long as the bound allows again
inline constexpr double kSteady = 1;

struct StepLevel {
  double size = 0;           // s; 0: none yet
  uint32_t quiet_steps = 0;  // sub-steps since the bound last prevented a longer one
  // number of sub-steps for which the bound must allow a slightly longer one before it is used
  uint32_t patience = kFirstPatience;
};

// Lasting state: a restored world continues with it.
struct StepSizes {
  StepLevel cut;    // of the sub-steps of the last step
  StepLevel offer;  // of the step that dfm_world_stable_step returns, whatever step the host takes
  // s, the step that the errors of the last sub-step of implicit bodies allow; 0: there was none
  double accurate = 0;
  double steady = kSteady;  // s since the host last changed the size of the sub-steps
  double damping = 0;       // s2, impulse of stiffness damping that these changes still call for
};

// stable: s, the longest sub-step allowed now (infinite: any).
// s, a step that needs no sub-steps and whose size changes rarely if it is used repeatedly
double offered_step(const StepSizes &s, double stable);
// The same for implicit bodies, whose step has no stability bound: by the error of the last one. It may
// change often.
double accurate_step(const StepSizes &s);
// Number of sub-steps of the step dt, which may be too many for an integer. longest: s, of a sub-step where
// nothing bounds it.
double choose_substeps(StepSizes &s, double dt, double stable, double longest = HUGE_VAL);
// The impulse of stiffness damping c (s2: v -= c M^-1 K v) to be done after a sub-step of h; it counts as
// done.
double next_damping(StepSizes &s, double h, double stable);
// within a step, when the bound has fallen below size: into how many parts each sub-step is divided
double cut_finer(StepSizes &s, double size, double stable);
bool differ(double size, double other);  // by more than rounding
void pass(StepSizes &s, double h);       // a sub-step of h has been taken
bool is_valid(const StepSizes &s);       // whether a world could have reached it

std::string short_step(double dt, double floor);  // the sentence that refuses it

}  // namespace dfm
