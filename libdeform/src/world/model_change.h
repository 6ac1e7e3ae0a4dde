// Changes a body's model between two steps (doc/concepts/changing_models.md).
#pragma once
#include "state/body.h"

namespace dfm {

// Makes a choice from the caller's arguments; `type` is a short or full name. `params` may contain "max_jump"
// in addition to the parameters of the model. Throws Error if the model does not exist or does not have the
// parameters.
ModelChoice choose_model(const Body &b, const char *type, const dfm_params &params, int32_t integrator);
// Positions and velocities do not change. Throws Error; then the world is unchanged. DFM_DISCARD: the elastic
// energy would jump by more than max_jump. swap: output, also in that case.
void change_model(Body &b, const ModelChoice &to, Swap &swap);
// Whether the body has the model of this choice with the same inputs.
bool is_made_so(const Body &b, const ModelChoice &c);
// Makes the models of future changes to detect errors now that do not depend on the state:
// integrator, springs, cells that a model rejects, effects (if the world has its plan). The instances are
// cached in the body. at_rest: equilibria will be computed. Results are kept with each change. Throws Error.
void rehearse(Body &b, std::vector<Switch> &switches, std::vector<SwitchRule> &rule, bool at_rest);
// Tests a model that steps itself with a sub-step of a nanosecond, whose result is discarded: finds what it
// would refuse in the first step. Throws Error with its reason.
void check_first_step(World &w, Body &b);
// Changes the model and keeps the row. Returns false if it was refused because of the energy jump; the row
// reports that if `report`.
bool try_change(World &w, Body &b, const ModelChoice &to, bool report);
// Makes the changes that are due in the step of dt seconds that begins now: by time, then by rules.
void make_switches(World &w, double dt);
// Whether a rule with these inputs that begins now, before any contact, asks for the level that the body has.
bool begins_alike(const Body &b, const SwitchRule &r);
void keep_swap(World &w, const Swap &swap);

}  // namespace dfm
