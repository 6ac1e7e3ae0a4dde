// Ops of a model whose bodies step themselves, as calls of the Body.
#pragma once
#include <type_traits>

#include "entry.h"

namespace model {

// lacks_step(k) is true, and has said so, where a Body answers in the step of its last predict() alone.
template <class Body>
struct StepperOps : Ops<Body> {
  using Ops<Body>::with_state;
  template <class Use>
  static dfm_status in_step(void *self, const dfm_kin *k, const Use &use) {
    if constexpr (requires(Body &b) { b.lacks_step(*k); }) {
      Body &body = *static_cast<Body *>(self);
      return body.lacks_step(*k) ? DFM_E_STATE : answered([&] { use(body); });
    } else {
      return with_state(self, k, use);
    }
  }
  static dfm_status predict(void *self, const dfm_kin *k, const double *f, double *u) {
    dfm_status status = DFM_OK;
    const dfm_status given = with_state(self, k, [&](Body &b) {
      if constexpr (std::is_void_v<decltype(b.predict(*k, f, u))>) b.predict(*k, f, u);
      else status = b.predict(*k, f, u);
    });
    return given == DFM_OK ? status : given;
  }
  static dfm_status respond_many(void *self, const dfm_kin *k, uint32_t n, const uint32_t *surfel,
                                 uint32_t nrhs, const double *p, double *du) {
    return in_step(self, k, [&](Body &b) { b.respond(*k, n, surfel, nrhs, p, du); });
  }
  static dfm_status respond(void *self, const dfm_kin *k, uint32_t n, const uint32_t *surfel, const double *p,
                            double *du) {
    return respond_many(self, k, n, surfel, 1, p, du);
  }
  static dfm_status diagonal(void *self, const dfm_kin *k, uint32_t n, const uint32_t *surfel, double *w) {
    return in_step(self, k, [&](Body &b) { b.diagonal(*k, n, surfel, w); });
  }
  static dfm_status commit(void *self, const dfm_kin *k, const double *p, double *x, double *v) {
    return in_step(self, k, [&](Body &b) { b.commit(*k, p, x, v); });
  }
  static const dfm_fact *facts(const void *self, uint32_t *n) {
    *n = Body::kFactCount;
    return static_cast<const Body *>(self)->facts();
  }
  static constexpr dfm_stepper kStepper = {
      sizeof(dfm_stepper), 0, predict, respond, diagonal, commit, nullptr, respond_many};
  static constexpr dfm_facts kFacts = {sizeof(dfm_facts), sizeof(dfm_fact), facts};
};

}  // namespace model
