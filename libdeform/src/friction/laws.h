// Friction laws of a world, and the only place where they are evaluated: contacts are gathered into one batch
// per law, evaluated by the plugin, checked, and scattered back to the columns of the contacts.
#pragma once
#include <span>
#include <vector>

#include "contact/contact_state.h"
#include "contact/rows_part.h"
#include "core/memory.h"
#include "deform/base.h"
#include "geometry/surface.h"
#include "plugin/selection.h"

namespace dfm {

inline constexpr double kNoRestitution = -1;  // none is given

// One law with one set of parameter values.
struct LawInstance {
  const dfm_type *type = nullptr;
  const dfm_friction *ops = nullptr;
  std::vector<double> params;
  std::vector<dfm_param_value> by_key;  // params, for dfm_world_law_info
  void *data = nullptr;                 // result of prepare()
  const dfm_host *host = nullptr;
  uint32_t nstate = 0;
  std::vector<uint8_t> tangent;         // [nstate] 1: a component of a vector in the tangent plane
  bool turns = false;                   // any
  bool by_default = false;              // used for pairs without a rule
  double restitution = kNoRestitution;  // 0 to 1, of the pairs that have this law
  // The parameters as the rule gives them; the list of effects may have removed some of them.
  const dfm_type *requested_type = nullptr;
  std::vector<double> requested;

  // throws if check() or prepare() refuses
  LawInstance(const dfm_type &t, const dfm_host &h, std::vector<double> values);
  LawForm form() const {
    return is_frictionless(*ops)              ? kNoFriction
           : ops->flags & DFM_FRIC_SET_VALUED ? kSetValuedLaw
                                              : kSmoothLaw;
  }
  LawInstance(const LawInstance &) = delete;
  LawInstance &operator=(const LawInstance &) = delete;
  ~LawInstance();
};

// What the list of effects has left out of the law.
std::vector<LeftOut> left_out_of(const LawInstance &law);

class LawBatches {
 public:
  explicit LawBatches(const Memory &memory);
  // Sorts these contacts into batches by state.law and sets state.form. Call once per sub-step. Several
  // threads may evaluate batches of disjoint contacts at once.
  void gather(const std::vector<LawInstance *> &laws, std::span<const RowRun> contacts, ContactState &state);
  // Evaluates every batch at the trial in state: force, limit, mode, trial state, and the slopes dft_dvt and
  // dft_dfn. Returns nullptr, or the law that failed or returned a value that is not finite.
  const LawInstance *evaluate(double h, ContactState &state);
  // The same, but a smooth law is evaluated where the contact would come to rest alone
  // (friction/local_solve.cpp): state.vt moves there.
  //   wt     [n] 1/kg, how much slip an impulse makes at its own contact; with it ft_stop gives the slip
  //          that others leave
  //   least, relative   m/s, 1: a contact's slip need not be known closer than least + relative of it
  //   all   false: of smooth laws alone
  const LawInstance *evaluate_local(double h, const double *wt, double least, double relative,
                                    ContactState &state, bool all = true);
  bool has_smooth() const { return has_smooth_; }
  bool remembers() const { return remembers_; }  // whether any law has a state
  // After a law has failed: the contact whose result is invalid; kNone: the law refused the whole batch.
  uint32_t failed() const { return failed_; }

 private:
  struct Batch {
    const LawInstance *law;
    uint32_t begin, n;
  };
  // A contact whose local solution is not found yet: the best slip so far, its residual, and the step tried
  // from there.
  struct Local {
    uint32_t contact;
    bool from_zero, last;
    double v[2], left, step[2], fraction;
  };
  std::vector<Batch> batches_;
  Array<uint32_t> order_;   // contacts by law, in contact order within each
  Array<double> in_, out_;  // columns of one batch
  Array<uint8_t> mode_;
  Array<Local> local_;
  Array<uint32_t> selected_;  // contacts of local_ that are evaluated together
  bool has_smooth_ = false, remembers_ = false;
  uint32_t failed_ = kNone;
  dfm_friction_in inputs(const LawInstance &law, std::span<const uint32_t> contacts, double h,
                         const ContactState &state);
  // in: of inputs()
  dfm_status call(const LawInstance &law, const dfm_friction_in &in, dfm_friction_out out);
  const LawInstance *evaluate(const LawInstance &law, std::span<const uint32_t> contacts, double h,
                              ContactState &state);
  const LawInstance *solve_local(const Batch &batch, double h, const double *wt, double least,
                                 double relative, ContactState &state);
  // The result for contacts without friction, whose law is not evaluated.
  static void set_frictionless(std::span<const uint32_t> contacts, ContactState &state);
};

}  // namespace dfm
