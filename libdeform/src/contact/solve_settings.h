// The tuned numbers of the contact solve. Nominal values hold for all scenes that were tried; the comment
// says what a change trades. Figures: doc/decisions/contact_solver.md.
#pragma once
#include <cstdint>

namespace dfm {

struct SolveSettings {
  // Share of what an iteration is judged by that the one inside of it may leave: of a tolerance by a pass, of
  // a pass by its steps or sweeps, of a step by its system and line search. Smaller, fewer of the outer ones.
  // What sticks takes back at most this share of its tolerance.
  static constexpr double accuracy = 0.3;

  // rho w: larger, fewer passes with more Newton steps each. Also the factor by which rho grows where passes
  // are slow, and falls where steps go round.
  static constexpr double penalty = 10;
  // What normals may be off by where velocities no longer change, over their tolerance.
  static constexpr double contradiction = 20;
  // In a row: slow passes, after which rho grows; phases of frozen steps, after which steps go round; passes
  // at rest, after which rows contradict each other. Also sweeps, at most, from one residual to the next,
  // since a residual costs as much as a sweep.
  static constexpr uint32_t rounds = 3;
  // Limit of an inner iteration: products of a system, and of all that a factor is kept for; trials of a line
  // search, since bodies near inversion take steps of a thousandth; Newton steps where all is rigid (what
  // these do not find, more do not); sweeps that go below what is required, for the next sub-step.
  static constexpr uint32_t inner = 24;

  // Tolerances. gap: of normals, as a share of half of d_c over h. at_rest: of tangents, m/s. of_slip: of
  // tangents, as a share of the slip; of bonds, of what the start leaves. of_start: of normals and tangents,
  // as a share of what the start leaves; also the relative residual of the system of a Newton step, at most,
  // the relative error of r by A up to which A is kept, and the share of a pass's goal over rho w to which
  // slips of laws are known.
  static constexpr double gap = 0.01;
  static constexpr double at_rest = 1e-6;
  static constexpr double of_slip = 1e-3;
  static constexpr double of_start = 1e-2;

  // Laws with memory accumulate errors of the normal force instead of averaging them out. Whenever the force
  // falls, the friction cone cuts off a part of the bristle, which does not come back when the force rises.
  // A point that oscillates under a bristle of share s stretches it by (1 - s) of each way forth and slackens
  // it by (1 + s) of each way back. Both make a held contact creep. Islands with such laws therefore use this
  // share of the normal tolerance while bodies move (doc/decisions/friction_memory.md).
  static constexpr double remembered = 0.05;
  // Where errors add up, rows are solved to this share of the tolerance at rest: normals, if laws remember,
  // and all rows where all is rigid. Nothing is elastic there, so no later sub-step makes good what a solve
  // leaves, and loads that share a place wander where gaps differ by it; sweeps there go on to its square.
  static constexpr double exact = 1e-3;

  // Share of the slip error of a sticking contact that is taken back over a planned sub-step (all at once
  // would be a velocity as large as the error, which the next solve stops again).
  static constexpr double take_back = 0.4;
};

}  // namespace dfm
