// The planner: which model, integrator and step reach an accuracy for the least processor time, or the best
// accuracy for a given time. It predicts before the first step, from a few numbers of each body and from
// measured costs and errors of models (`deform calibrate`). It may be wrong, so it states its assumptions.
// Rules and their sources: doc/concepts/planner.md.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace dfm {

// ---- measured costs and errors
// -----------------------------------------------------------------------------------

// Time integration schemes. A model that steps itself has only the first.
enum class Scheme { explicit_euler, implicit_euler, tr_bdf2 };
inline constexpr size_t kSchemes = 3;
const char *scheme_name(Scheme scheme);  // as a scene names it

// s, the steps at which costs are measured: implicit time and models that step themselves at both, because a
// shorter step takes fewer iterations.
inline constexpr double kCostStep = 1.0 / 60, kShortCostStep = kCostStep / 16;
inline constexpr double kFrame = kCostStep;  // s, where the scene names no step
struct CostAt {
  double points = 0, ns = 0;  // of a body; processor time of one sub-step per point
  double short_ns = 0;        // the same at the short step; 0: not measured
};

// What a body touches, which determines the cost of a sub-step: nothing; the ground; a probe that presses it
// while it is held; another deformable body.
enum class Meets { nothing, ground, probe, body };
inline constexpr size_t kMeets = 4;
const char *meets_name(Meets meets);  // as a file of costs names it

// What was measured of cells of one kind.
struct MeasuredCells {
  // The largest explicit step that is proven, over the time in which a pressure wave goes by `cell_size`.
  double wave_steps = 0;
  // by scheme and by what is met; empty: the model has no such scheme
  std::array<std::array<std::vector<CostAt>, kMeets>, kSchemes> costs;
  bool any() const {
    for (const auto &scheme : costs)
      if (!scheme[0].empty()) return true;
    return false;
  }
};

struct MeasuredModel : MeasuredCells {  // of tetrahedra
  MeasuredCells hexahedra;              // of lattices
  std::string id;                       // short name
  std::string machine;                  // on which it was measured; empty: that of all
  bool steps_itself = false;
  // Relative errors of positions against corotational_fem on the same mesh: a bar that bends by 0.02 and by
  // 0.8 of its length, a bar that turns, a block that lies on a plane, a held block that a small sphere
  // dents.
  double bends_little = 0, bends_far = 0, turns = 0, lies = 0, dents = 0;
  double dent_force = 0;  // relative error of the sphere's force at the same depths
};

struct Measured {
  std::string machine;  // machine, compiler and version of the library
  std::vector<MeasuredModel> models;
};

// ---- input of the planner -------------------------------------------------------------------------------

// Measured on the lowest modes of held bars, 1 to 5 edges across: 1.08 to 1.8 at 0.3, 1.6 to 2.5 at 0.45.
inline double bending_of_tetrahedra(double poisson) { return 1.08 * std::pow(1 - 2 * poisson, -0.29); }
// doc/models/corotational_fem.md, cells that bend; a clamped bar of five cells (doc/concepts/filling.md)
inline constexpr double kBendingOfSecondOrder = 0.01, kBendingOfHexahedra = 0.022;

struct BodyRegime {
  std::string name;
  uint32_t points = 0;
  double length = 0, thickness = 0;  // m, longest and shortest side of the box around the body at rest
  double edge = 0;                   // m, median edge of the cells
  // Relative increase of the bending stiffness by cells as large as the thickness; goes with the square of
  // the edge.
  double stiffens = bending_of_tetrahedra(0.3);
  bool hexahedra = false;
  double cell_size = 0;                            // m, dfm_mesh_info.wave_path
  double young = 0, poisson = 0, density = 0;      // Pa, 1, kg/m3
  double damping_mass = 0, damping_stiffness = 0;  // 1/s, s
  double load = 0;                                 // m/s2: of gravity and of forces
  double speed = 0;   // m/s, at the start and by falling until it meets something
  double travel = 0;  // m, that it moves as a whole
  double after = 0;   // share of the time after it first meets something by falling or flying
  bool held = false, touches = false, turns = false;
  bool meets_body = false;    // another deformable one
  double contact = HUGE_VAL;  // m, across the narrowest contact that it may have
  std::string met;            // whose contact that is
  // m/s, of what comes to it, and m, how deep that goes in, or where that is not known, how far it moves
  double approach = 0, depth = 0;
  double presses = HUGE_VAL;        // how often something comes to it at most; infinite: that is not known
  double below = HUGE_VAL;          // m, from it down to what it would fall on
  std::string model;                // that the scene names; empty: to be chosen
  int scheme = -1;                  // that the scene names; -1: to be chosen
  std::vector<std::string> models;  // that may be chosen
};

struct Wish {
  double target = 0;       // relative error, 0: none
  double ms_per_step = 0;  // milliseconds of processor time, 0: none
  double weight = 1;       // how many times the error of positions the error of the quantity is
  bool force = false;      // a force of contact counts, with its own error
  double duration = 0;     // s
  double step = 0;         // s, that the scene names; 0: to be chosen
  bool any() const { return target > 0 || ms_per_step > 0; }
};

// ---- results --------------------------------------------------------------------------------------

// Numbers that determine the behavior of one body.
struct Estimate {
  double frequency = 0;  // rad/s of the lowest mode
  double strain = 0, rotation = 0;
  double sag = 0;    // m, of the shape
  double lasts = 0;  // s, until damping has ended the motion
  double duration = 0;
};
Estimate estimate(const BodyRegime &body, double duration);
// Relative increase of the bending stiffness by the cells of its mesh.
double stiffening(const BodyRegime &body);
// Whether it is touched over less than its own thickness, which dents it where it is touched.
bool dented(const BodyRegime &body);
Meets what_it_meets(const BodyRegime &body);

struct BodyWay {
  std::string model;
  Scheme scheme = Scheme::explicit_euler;
  double model_error = 0, time_error = 0, mesh_error = 0;  // of the quantity
  double cpu_s_per_s = 0;
};
struct Way {
  double step = 0;   // s, of the scene; for an explicit scheme 0: "auto"
  double frame = 0;  // s, for which a budget counts: the step that the scene names, else 1/60 s
  double substep = 0;
  std::vector<BodyWay> bodies;
  double error = 0;  // largest sum of the three over the bodies
  double cpu_s_per_s = 0;
};

struct PlannedWay {
  bool found = false;  // false: no model can be chosen, because no measurement applies
  bool meets = false;  // target, by the errors of model, time and mesh, or budget
  Way way;
  std::vector<Way> considered;       // the Pareto front: by cost, each with less error than all cheaper ones
  std::vector<std::string> assumed;  // sentences
  std::string missed;                // if it does not meet: what is predicted and what would meet
};
PlannedWay plan_accuracy(const std::vector<BodyRegime> &bodies, const Measured &measured, const Wish &wish);
// Whether the first is taken rather than the second: plans of the same scene with other cells.
bool wins(const PlannedWay &a, const PlannedWay &b, const Wish &wish);
// Whether the error of its cells is predicted, so that others may be compared with them.
bool mesh_error_known(const BodyRegime &body);

// s of processor time per second, on a card by the clock, of a body that a model moves in the scheme that the
// body names, else explicitly, in steps of a scene; infinite where it was not measured.
double predicted_cost(const Measured &measured, const std::string &model, const BodyRegime &body,
                      double step);

// Milliseconds of a frame.
double ms_per_step(const Way &way);

}  // namespace dfm
