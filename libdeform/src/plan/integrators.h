// Chooses which bodies move implicitly, if the host leaves it to the library. Only a body that alone would be
// implicit may be: it damps what explicit bodies keep, so no other body makes it so. All bodies of a world
// take the same sub-steps: explicit bodies bound the sub-step, and implicit bodies pay for each of these.
// Where that costs more than moving explicitly, they do (doc/decisions/implicit_time.md).
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace dfm {

// How one body may move.
struct IntegratorOption {
  double substeps = 1;       // explicit sub-steps per step
  double work = 1;           // of one of them
  double implicit_work = 0;  // of an implicit one, relative to `work`; 0: it cannot move implicitly
  bool open = false;         // to be chosen; otherwise `implicit` is given
  bool implicit = false;
};

// Sets `implicit` of the open ones.
void choose_integrators(std::vector<IntegratorOption> &bodies);

}  // namespace dfm
