// A body's model changes between two steps (doc/concepts/changing_models.md).
#pragma once
#include "state/body.h"

namespace dfm {

// The choice as a caller words it; `type` short or full. Beside the model's own parameters `params` may have
// "max_jump". Throws Error where the model is not there or does not take the parameters.
ModelChoice choose_model(const Body &b, const char *type, const dfm_params &params, int32_t integrator);
// Positions and velocities stay as they are. Throws Error and leaves the world as it was: DFM_DISCARD where
// the elastic energy would jump by more than max_jump. swap: out, what is known of it in that case too.
void change_model(Body &b, const ModelChoice &to, Swap &swap);
// Has the body the model of this choice, made with the same?
bool is_made_so(const Body &b, const ModelChoice &c);
// Makes the models of changes that are to come, to know now what no state of the body would mend: the contact
// method, the integrator, springs, cells that a model does not take, effects (where the world has its plan).
// What was made of the mesh is kept as the body's spares. at_rest: equilibria will be looked for.
// What is known of each then is kept with it. Throws Error.
void rehearse(Body &b, std::vector<Switch> &switches, std::vector<SwitchRule> &rule, bool at_rest);
// Asks a model that steps itself for a sub-step of a nanosecond, of which nothing is kept: what it would
// refuse in the first step. Throws Error with its reason.
void check_first_step(World &w, Body &b);
// Changes the model and keeps the row. False: refused for what would jump, and the row says so where `tell`.
bool try_change(World &w, Body &b, const ModelChoice &to, bool tell);
// What is due in the step of dt seconds that begins now: by time, then by rules (model_rule.cpp).
void make_switches(World &w, double dt);
void follow_rules(World &w);
void keep_swap(World &w, const Swap &swap);

}  // namespace dfm
