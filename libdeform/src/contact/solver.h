// Normal contact and friction of one sub-step: sweeps of block Gauss-Seidel on the laws as they were
// linearized last (contact/sweeps.h has the passes over the laws), and residuals. The mathematics:
// doc/concepts/contact.md.
#pragma once
#include "contact/contact_state.h"
#include "contact/rows.h"

namespace dfm {

// All of them work on a part of the rows; parts of the same rows may be worked on by several threads at once.

// Sets the trial of every contact from the rows' present state: fn, vt, slip, ft_stop. response: change of
// slip per friction impulse by which ft_stop is found, the contact's own (rows.wt) or more.
void set_trial(const ContactRows &rows, const RowsPart &part, double h, const double *response,
               ContactState &state);
// Linearizes smooth laws: what sweeps and residuals need of dft_dvt; after each answer, and after new slopes.
void linearize(const ContactRows &rows, const RowsPart &part, double h, ContactState &state);

// One sweep in contact order. Every contact first gets its normal impulse, then its friction impulse with
// that new normal impulse. Bonds are swept behind it (bonds.h).
void sweep(ContactRows &rows, const RowsPart &part, const ContactState &law, double h);

// Impulses of a part, and the velocities with them, change by jumps [3 rows], one row after the other; a
// normal impulse never comes below zero.
void leap(ContactRows &rows, const RowsPart &part, const double *jumps);

// Limits of residuals: a contact is good where both stay within what they may be off by:
//   r_n <= normal[i]                      0.01 (d_c - d_g) / h: the gap is then off by less than a hundredth
//                                         of its margin; less where laws remember
//   r_t <= max(tangent[i], 1e-3 |slip|)   1e-6 m/s at rest, which bounds the creep of what sticks
// (doc/decisions/contact_solver.md).
struct Tolerance {
  double most_normal = 0;
  double bond = 0;                               // of |u + rate + soft l|, all bonds of the part
  double *normal = nullptr, *tangent = nullptr;  // by contact of the rows
};
struct ToleranceBounds { double tangent, normal, most_normal; };  // m/s: at rest, at rest, ever
// The residual of the laws as they were last evaluated; between evaluations, as they were linearized there.
Residual residual_of(const ContactRows &rows, const RowsPart &part, const ContactState &laws, double h,
                     const Tolerance &tolerance);
// The share of a part's impulses, at most 1, at which the function that a solve lowers is least along them,
// 1/2 l W l + l (u_free + rate). At a solution 1, unless bristles give back what they have stored.
double share_of_least_work(const ContactRows &rows, const RowsPart &part);
// of parts together
Residual larger(const Residual &a, const Residual &b);

// d of the bodies of a part: the largest r_t that the warm start leaves at any contact of the body, and the
// largest of all r_n and r_t; no less than start_residual has already. sides: [contacts,2] numbers of bodies,
// kNone: an obstacle; start_residual: [bodies,2].
void find_start_residual(const ContactRows &rows, const RowsPart &part, const ContactState &law, double h,
                         const uint32_t *sides, double *start_residual);
// tangent[i] = max(bounds.tangent, 1e-2 d), d the larger one of the two bodies. A contact at rest is warm
// started at its solution, so d vanishes and the bound at rest rules; while bodies shake, a hundredth of what
// the sub-step changes is enough, and what is left is part of the next sub-step's d. normal[i] =
// max(bounds.normal, 1e-2 d), with the second d, up to most_normal. bond = max(bounds.tangent, 1e-3 of the
// largest that the warm start leaves).
void set_tolerance(const ContactRows &rows, const RowsPart &part, std::span<const ContactPoint> contacts,
                   double h, const ToleranceBounds &bounds, const uint32_t *sides,
                   const double *start_residual, Tolerance &tolerance);

}  // namespace dfm
