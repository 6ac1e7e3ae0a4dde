// The tuned numbers of the contact solve. Nominal values hold for all scenes that were tried; the comment
// says what a change trades. Figures: doc/decisions/contact_solver.md.
#pragma once
#include <cstdint>

namespace dfm {

struct SolveSettings {
  // Newton's method
  static constexpr double penalty = 10;    // rho w: larger, fewer passes with more Newton steps each
  static constexpr double growth = 10;     // of rho where passes are slow; of 1/rho where steps go round
  static constexpr double accuracy = 0.3;  // of what an iteration is judged by, left by the one inside of it
  static constexpr double linear = 1e-2;   // relative residual of the system of a Newton step, at most
  // of the tolerance, by which normals may miss what velocities no longer follow
  static constexpr double contradiction = 20;
  // in a row, after which passes are slow, steps go round, rows contradict
  static constexpr uint32_t rounds = 3;
  static constexpr uint32_t products = 24;  // of a system, at most, and of all that a factor is kept for
  // of a line search: bodies near inversion take steps of a thousandth
  static constexpr uint32_t trials = 24;

  // Sweeps. A pass is solved to this fraction of what its laws are then judged by: smaller, fewer passes. The
  // next sub-step continues from what they leave: at most so many are spent on more than is required. The
  // residual costs as much as a sweep: so many in a row go without one.
  static constexpr double pass_fraction = 0.5;
  static constexpr uint32_t polish = 20;
  static constexpr int unseen = 4;

  // Tolerances. Of normals, as a share of half of d_c over h; of tangents, m/s at rest; both also as shares
  // of the slip, and of what the start leaves along the surface and along the normal.
  static constexpr double gap = 0.01;
  static constexpr double at_rest = 1e-6;
  static constexpr double of_slip = 1e-3;
  static constexpr double of_start = 1e-2, of_start_normal = 2e-2;

  // Laws with memory accumulate errors of the normal force instead of averaging them out. Whenever the force
  // falls, the friction cone cuts off a part of the bristle, which does not come back when the force rises.
  // A point that oscillates under a bristle of share s stretches it by (1 - s) of each way forth and slackens
  // it by (1 + s) of each way back. Both make a held contact creep. Islands with such laws therefore use this
  // share of the normal tolerance while bodies move, and this share of the tangential one at rest
  // (doc/decisions/friction_memory.md).
  static constexpr double remembered = 0.05, remembered_at_rest = 1e-3;

  // Where all is rigid, nothing is elastic: no later sub-step makes good what a solve leaves, and loads that
  // share a place wander where gaps differ by it. Sweeps go on to the rounding of what contact changes. What
  // they leave below a share of the tolerance at rest is good enough; above it Newton's method gets this many
  // steps (what these do not find, more do not), and the better result counts.
  static constexpr double rigid_rounding = 1e-11, rigid_at_rest = 1e-2;
  static constexpr uint32_t rigid_steps = 30;

  // Of the slip that a stuck contact owes, the share that is taken back over a planned sub-step (all at once
  // would be a velocity as large as the error, which the next solve stops again), and the most, as a share of
  // the tolerance.
  static constexpr double take_back = 0.4, most_back = 0.5;
};

}  // namespace dfm
