// The contacts of one implicit body with obstacles, all at once, where sweeps stall.
//
// A sweep hands a load on from contact to contact. Where hundreds of contacts bear on one body, W = J A^-1
// J^T is the inverse of a stiffness: smooth loads take thousands of sweeps. With fixed friction limits
// (contact/fixed_limits.h) the problem is convex, and the method of multipliers (Hestenes 1969; Rockafellar
// 1976) solves it in long strides:
//
//     l <- P(l - rho (u + b)),    u the minimum of (u - u0).W^-1 (u - u0) / 2 + psi(l - rho (u + b)) / rho
//
// P projects on l_n >= 0, |l_t| <= limit, and is the derivative of psi. The function is convex with a
// continuous derivative, so Newton's method with a line search finds its minimum, and it needs no dense
// matrix: its Hessian is A + J^T K J with K = -dP/du of each contact, which is as sparse as A. Each stride
// renews the limits from the last normal impulses, so that in the end they are those of the law (Haslinger,
// Hlavacek and Necas 1996, section 4.4). What results is measured by the residual of the sweeps.
// doc/decisions/contact_solver.md
#pragma once
#include <span>

#include "body/backing.h"
#include "contact/contact_state.h"
#include "contact/rows.h"
#include "contact/solver.h"

namespace dfm {

class Tresca {
 public:
  explicit Tresca(const Memory &memory);
  // Whether the part is one that this can solve: contacts of one block with obstacles, without bonds, with
  // laws that project.
  static bool serves(const ContactRows &rows, const RowsPart &part, const ContactState &law);
  // Finds impulses whose residual (Residual::due) is at most `most`, or at most `enough` if it cannot be
  // lowered further, from the present ones. Returns false if there are none; the impulses are then as they
  // were, or better.
  bool solve(ContactRows &rows, const RowsPart &part, const ContactState &law, double h,
             const Tolerance &tolerance, double most, double enough, BackedResponse &body);
  // of the last solve: products with the response
  uint32_t products() const { return products_; }

 private:
  struct Contact {
    double rn, rt, wn, wt;
    uint32_t row;
    bool slides, holds;
  };
  uint32_t products_ = 0;
  Array<Contact> contacts_;
  Array<double> limit_;              // [n] N s
  Array<double> kept_;               // [3n] N s, impulses at the start
  Array<double> base_;               // [3n] N s, what P starts from
  Array<double> l_, u_;              // [3n] impulses and the velocities with them, bias included
  Array<double> answer_;             // [3n] P
  Array<double> r_, dl_, du_;        // [3n]
  Array<double> curve_, stiffness_;  // [n,9] K, in the contacts' and the world's axes
  Array<double> given_, change_;     // [n,3] in the world's axes
  Array<uint32_t> begin_, surfel_;
  Array<double> weight_;
  Backing backing() const;
  void put(ContactRows &rows, const RowsPart &part, const double *l);
  void velocities(const ContactRows &rows, double *u) const;
  void renew_limits(const ContactState &law, double h);
  void project(double ahead);
  void curve();
  bool newton(const ContactRows &rows, BackedResponse &body);
};

}  // namespace dfm
