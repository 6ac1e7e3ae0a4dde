// Friction laws of a world, and the one place where they are asked: contacts are gathered into one batch per law, evaluated by the plugin,
// screened, and scattered back to the contacts' columns.
#pragma once
#include <string>
#include <vector>

#include "core/memory.h"
#include "deform/plugin.h"
#include "surfel/contact_state.h"

namespace dfm {

// One law with one set of parameter values.
struct LawInstance {
  const dfm_type *type = nullptr;
  const dfm_friction *ops = nullptr;
  std::vector<double> params;
  void *data = nullptr;           // what prepare() made
  const dfm_host *host = nullptr;
  uint32_t nstate = 0;

  LawInstance(const dfm_type &t, const dfm_host &h, std::vector<double> values);   // throws where check() or prepare() refuses
  LawInstance(const LawInstance &) = delete;
  LawInstance &operator=(const LawInstance &) = delete;
  ~LawInstance();
};

class LawBatches {
 public:
  explicit LawBatches(const Memory &memory);
  // Sorts the contacts into batches by state.law and sets state.set_valued. Call once per sub-step.
  void gather(const std::vector<LawInstance *> &laws, ContactState &state);
  // Asks every batch at the trial in state. nullptr, or the law that failed or answered with something not finite.
  const LawInstance *evaluate(double h, ContactState &state);

 private:
  struct Batch { const LawInstance *law; uint32_t begin, n; };
  std::vector<Batch> batches_;
  Array<uint32_t> order_;         // contacts by law, in contact order within each
  Array<double> in_, out_;        // columns of one batch
  Array<double> moved_, answer_;  // inputs and force beside the trial, for laws without derivatives
  Array<uint8_t> mode_;
  const LawInstance *evaluate(const Batch &batch, double h, ContactState &state);
  bool difference(const LawInstance &law, dfm_friction_in in, const double *ft, double *dv, double *dn);
};

}  // namespace dfm
