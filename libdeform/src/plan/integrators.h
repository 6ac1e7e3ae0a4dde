// Which bodies move implicitly, where that is left to the library. All bodies of a world take the same
// sub-steps, so the choice is one for all of them: explicit bodies bound the sub-step, and whoever moves
// implicitly beside them pays for each of theirs (doc/decisions/0170-integrators-by-cost.md).
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace dfm {

// How one body may move.
struct IntegratorOption {
  double substeps = 1;       // that it would take explicitly in a step
  double work = 1;           // of one of them
  double implicit_work = 0;  // over `work`, of an implicit one; 0: it cannot move implicitly
  bool open = false;         // to be chosen; else it moves as `implicit` says
  bool implicit = false;
};

// Sets `implicit` of the open ones.
void choose_integrators(std::vector<IntegratorOption> &bodies);

}  // namespace dfm
