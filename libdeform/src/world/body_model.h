// Model instance and dynamics of a body, with the inputs of both. It is made separately and then exchanged
// with that of the body, so that a change of model is complete or has no effect.
#pragma once
#include "state/body.h"

namespace dfm {

// Its dynamics are usable after the exchange.
struct MadeModel : BodyModel { Dampers dampers; };

// Throw Error for another integrator than DFM_INTEGRATOR_*, and for parameters without values.
void check_integrator(const Body &b, int32_t integrator);
void check_given(const Body &b, const dfm_params &params);
// The model of a body that names none, by its kind of cells, DFM_CELL_*.
const dfm_type &default_model(const Registry &types, uint32_t cell);
// Copies the parameters of the type. Throws Error for others.
ModelParams keep_params(const dfm_type &type, const dfm_params &given);
// One by one; they point into the values of `params`.
struct GivenParam {
  std::string key;
  const double *values;
  uint32_t width;
};
std::vector<GivenParam> rows_of(const ModelParams &params);
// Makes one for the body, whose points, cells, surface and composition are complete. Parameters the origin
// does not name follow from the composition. integrator: DFM_INTEGRATOR_*; AUTO: of the world, or chosen by
// prepare(). Throws Error.
std::unique_ptr<MadeModel> make_body_model(World &w, Body &b, const dfm_type &type, ModelOrigin origin,
                                           int32_t integrator);
// The same in two parts, for a model whose points the library moves: the instance, which any thread may make
// while other bodies step; and the dynamics of a body that has it, by the integrator that it uses. bound_at:
// s, and the longest explicit sub-step at its present state then; null: not that.
std::unique_ptr<MadeModel> make_body_instance(World &w, Body &b, const dfm_type &type, ModelOrigin origin);
void set_dynamics(World &w, Body &b, const double *bound_at);
// How long its explicit sub-steps may be, with its present parameters.
void measure_explicit(const World &w, Body &b);
// What bounds its explicit sub-steps at rest, with this share of the row sums of stiffness; 1: for certain.
// False: nothing, or its points do not move explicitly.
bool rest_rows(const Body &b, double share, RestRows &out);
// Moves this share of its mass at most to points that bound its explicit sub-steps; its model is to be made
// again. Throws Error.
void set_scaled_mass(Body &b, double share);
// Logs a message if an integrator is named for a body whose model steps itself.
void warn_of_own_steps(const Body &b, const ModelInstance &model, int32_t integrator);
// Hash of type and origin, to compare bodies that are equal otherwise.
uint64_t model_hash(const Body &b);
// The values that these parameters, or the origin's, and the composition specify, in the order of the type's
// table. Throws the errors of make_body_model() about parameters.
std::vector<double> requested_values(const World &w, const Body &b, const dfm_type &type,
                                     const ModelParams &params);
std::vector<double> requested_values(const World &w, const Body &b);
void exchange(Body &b, MadeModel &other) noexcept;

}  // namespace dfm
