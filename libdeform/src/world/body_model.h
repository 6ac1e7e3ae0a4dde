// What moves a body, as a whole: the model's instance, the body's dynamics, and what the two were made with.
// It is made beside what the body has and then exchanged with it, so that a body changes its model as a whole
// or not at all.
#pragma once
#include "state/body.h"

namespace dfm {

struct BodyModel {
  ModelInstance instance;
  std::unique_ptr<Dynamics> dynamics;  // works once it is the body's
  std::vector<CellField> fields;
  std::vector<Unused> unused;
  ModelOrigin origin;
  Withheld withheld;
  Integrator integrator;
};

// Parameters that the type takes, to keep. Throws Error for others.
ModelParams keep_params(const dfm_type &type, const dfm_params &given);
// Makes one for the body, whose points, cells, surface and makeup stand. Parameters that the origin does not
// name follow from the makeup. integrator: DFM_INTEGRATOR_*; AUTO: the world's, or prepare() chooses it.
// Throws Error.
std::unique_ptr<BodyModel> make_body_model(World &w, Body &b, const dfm_type &type, ModelOrigin origin,
                                           int32_t integrator);
// Where an integrator is named for a body whose model steps itself.
void warn_of_own_steps(const World &w, const std::string &body, const ModelInstance &model,
                       int32_t integrator);
// Of type and origin, for two bodies that differ in nothing else.
uint64_t model_hash(const Body &b);
// What its origin and makeup ask for, as its type's table orders them.
std::vector<double> values_asked(const World &w, const Body &b);
// Throws what make_body_model() throws about parameters.
void check_params(const World &w, const Body &b, const dfm_type &type, const ModelParams &params);
void exchange(Body &b, BodyModel &other) noexcept;

}  // namespace dfm
