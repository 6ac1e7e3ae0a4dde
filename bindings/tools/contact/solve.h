// One contact problem by the library's solver, ContactNewton: a captured one (problem.h) as the step
// would solve it, and one of others (read_problem.h) to Siconos' own tolerance.
#pragma once
#include <cmath>
#include <cstdint>

#include "deform/base.h"
#include "problem.h"
#include "read_problem.h"

namespace contact {

inline constexpr double kSolved = 1e-8;  // of Siconos' measure

// Sums over the runs of others' problems.
struct Result {
  bool solved = false, implicit = false;
  uint32_t contacts = 0, bonds = 0, rank = 0, runs = 1, passes = 0, steps = 0, products = 0, factors = 0;
  // Siconos' measure: the natural map |r - P(r - (u + mu |u_t| n))| over |q|, P the projection on the cone;
  // NAN where a law remembers or an attachment takes part. In m/s: what impulses are off by.
  double error = HUGE_VAL, speed = HUGE_VAL;
  double seconds = 0;  // of the processor
};

double siconos_error(const LocalProblem &p, const std::vector<double> &u, const double *r);
std::vector<double> velocities(const LocalProblem &p, const double *r);  // W r + q
uint32_t rank_of(Matrix W);

Result solve(const LocalProblem &problem);
// form: what the problem is in others' terms at its solution; without mu where it has no such form.
// Throws Error where a law is not loaded.
Result solve(dfm::ContactProblem &problem, dfm_context *context, LocalProblem &form);

}  // namespace contact
