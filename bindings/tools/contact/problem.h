// A contact problem by itself: what the solve of one island is given, without its world. It can be kept in a
// file, and solved again from there. An implicit body is linear in it: its equations of motion at the
// velocities from which the solve starts. Laws are known by id and parameters.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "body/implicit_system.h"
#include "contact/contact_state.h"
#include "contact/rows.h"
#include "contact/solver.h"

namespace dfm {

// r(v) = at_start + A (v - start)
class LinearMotion final : public ImplicitSystem {
 public:
  bool linearize(ImplicitSystem &of);  // false: its model cannot tell its forces
  BlockPattern pattern() const override {
    return {n, static_cast<uint32_t>(pairs_.size() / 2), pairs_.data()};
  }
  double mass() const override { return mass_; }
  const double *start() const override { return start_.data(); }
  const double *places() const override { return places_.data(); }
  const double *diagonal_inverse() const override { return inverse_.data(); }
  bool residual(const double *v, double *r) override;
  bool matrix(const uint32_t *at, double *blk) override;
  void take(const double *) override {}
  const double *blocks() const { return blocks_.data(); }  // [nb,9] A
  template <class Transfer>
  void transfer(Transfer &t);
  bool is_valid() const;  // do sizes and numbers fit each other?

  uint32_t n = 0;  // points; 0: this is no implicit body

 private:
  double mass_ = 0;
  Array<uint32_t> pairs_;                      // [nb,2]
  Array<double> start_, places_, inverse_;     // [n,4]
  Array<double> at_start_, blocks_, changes_;  // [n,3], [nb,9]; scratch
};

struct ContactProblem {
  struct Law {
    std::string id;
    std::vector<double> params;
  };
  double h = 0;                         // s
  double rest = 0;                      // m/s, what a slip may be off by at rest
  double bond = 0, most_normal = 0;     // of Tolerance
  std::vector<double> normal, tangent;  // [contacts] of Tolerance
  std::vector<Law> laws;
  ContactRows rows{Memory::standard()};
  ContactState state;                 // what the laws start from, and the law of each contact
  std::vector<LinearMotion> motions;  // by source of the rows' dofs

  // Fills an empty problem with the rows of this part, their bodies and the start of the laws, which the
  // caller names. False: a model cannot tell its forces.
  bool take(const ContactRows &from, const RowsPart &part, const ContactState &of,
            std::span<ImplicitSystem *const> systems);
  std::string bytes();
  // Throws Error(DFM_E_FORMAT) with the reason where these are none.
  void read(std::string_view bytes);

 private:
  template <class Transfer>
  void transfer(Transfer &t);
  void take_blocks(const ContactRows &from, const std::vector<uint32_t> &number);
  void check() const;
};

}  // namespace dfm
