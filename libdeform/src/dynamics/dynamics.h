// How one body moves in a sub-step. Stages, contact, guard and energy watch use this interface only; the
// integrators are known in this folder only.
//
//   bound         between sub-steps: the largest stable one at the present state
//   choose_scheme of a sub-step: whether contacts are expected, and again where they are known
//   add_forces    forces that follow from the state
//   free_motion   the mean velocity over the sub-step without contact
//   unknowns      that velocity, and what an impulse changes of it where points do not answer each other's
//                 impulses; or the equations of motion of its points, which the solve of contact solves
//                 together with it; else
//   response      between the touched surfels
//   end_state     where it ends with the impulses of the solve; called again after a further solve
//   commit        the end becomes the present
//
// Why contact sees no more of a body: doc/decisions/structure.md.
#pragma once
#include <atomic>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <string>

#include "body/phyxels.h"
#include "dynamics/model.h"
#include "geometry/surface.h"
#include "math/turn.h"

namespace dfm {

// Work of an implicit sub-step relative to an explicit one of the same body; the second value is for a
// constant matrix. Source: doc/decisions/implicit_time.md.
inline constexpr unsigned kImplicitWork = 50, kConstantWork = 20;

class ImplicitSystem;
struct RestRows;
class Tasks;

struct SubStep {
  double time = 0, h = 0;     // s: its start, its length
  Vec3 gravity;               // m/s2
  double fastest = HUGE_VAL;  // m/s: limit on the components of velocities
  Vec3 gravity_before;        // m/s2, at the start of the sub-step; `gravity` is that at its end
};

struct StepBound {
  double step = std::numeric_limits<double>::infinity();  // s; infinite: no bound
  uint32_t point = 0;                                     // that determines the bound
  // s, bounds by stiffness alone and by damping alone at that point; lagged: without that of the dampers
  double by_stiffness = step, by_damping = step;
  bool lagged = false;  // dampers with a lag count as stiffness in `step`
};
// How long explicit sub-steps may be, measured as a model is made.
struct ExplicitTime {
  double share = 1;  // what the largest eigenvalue at rest has of its bound by row sums; 1: all, or not known
  double lag = 0;    // s, with which the dampers best see the velocity; 0: none
};
// Adds row sums of stiffness (N/m) and damping (N s/m) of loads outside the model.
using AddRowSums = std::function<void(double *stiffness, double *damping)>;

// [n,4] m/s: velocities of the points at the end of the sub-step, and their means over it.
struct EndState { const double *v, *mean; };

// Options of implicit points.
struct ImplicitOptions {
  std::string solver = "auto";     // auto ldlt pcg, or the name of a plugin's solver
  double tolerance = 1e-10;        // of an iterative solver, relative residual
  uint32_t solver_iterations = 0;  // limit of its iterations; 0: the number of unknowns
  uint32_t newton = 20;       // limit of iterations; 1: one linear solve per sub-step, without line search
  double rest = 1e-8;         // m/s, error that Newton's method may leave in a body at rest
  bool rest_factor = true;    // may be used instead of the matrix
  Tasks *tasks = nullptr;     // for the rows of a large matrix
  bool second_order = false;  // TR-BDF2 without contact; else backward Euler always
};

// What contact solves for of a body. Velocities without contact are valid after free_motion().
struct Unknowns {
  const double *velocity = nullptr;  // m/s: [npoint,4], or [nsurfel,4], those of the surfels, surface.v
  // [npoint,4] 1/kg, change of velocity per impulse at the same point; null: the unknowns are the touched
  // surfels, which respond to each other's impulses, or points with a `system`
  const double *diagonal = nullptr;
  ImplicitSystem *system = nullptr;  // the equations of motion, of points that move implicitly
  const double *of_points() const { return diagonal || system ? velocity : nullptr; }
};

// Sums over all points of a body, computed without visiting each point.
struct BodySums {
  double kinetic = 0, elastic = 0;  // J
  Vec3 first;                       // kg m: masses times places
  double reach = 0;                 // m, largest coordinate of the points that steps move
};

// What a body's dynamics supports.
struct Abilities {
  bool forces = false;    // add_forces() does something
  bool springs = false;   // loads may depend on the state: bound() takes their row sums
  bool placed = false;    // single points may be moved
  bool accurate = false;  // accurate_step() is known
  bool energy = false;    // the energy that its scheme conserves is known (step/watch/energy_watch.h)
  bool damps = false;     // its scheme conserves no energy: it dissipates
  bool parts = false;     // its free motion depends on whether there are contacts: choose_scheme()
  bool late = false;      // steps leave out points: see_points()
  // DFM_CAP_* that the model must keep with any parameters, because these dynamics need them.
  uint32_t claims = 0;
  uint32_t work = 1;  // of a sub-step relative to an explicit one: a rough number for the budget of a step
};

class Dynamics {
 public:
  Dynamics(Phyxels &points, Surface &surface, ModelInstance &model);
  Dynamics(const Dynamics &) = delete;
  virtual ~Dynamics() = default;

  const Abilities &abilities() const { return abilities_; }

  // spectrum: share is wanted, too. The lag is points().dampers.lag from the next bound() on.
  // placed: of the rest positions that the model was made with.
  virtual ExplicitTime measure(const Pose & /*placed*/, bool /*spectrum*/) { return {}; }
  // What bounds sub-steps at rest, with the dampers as they are. False: nothing does, or it is not known.
  virtual bool rest_rows(const Pose & /*placed*/, double /*share*/, RestRows &) { return false; }
  // share: that of the model as it was made. False: the model gives none.
  virtual bool bound(double time, double share, const AddRowSums &outside, StepBound &out) = 0;
  // s, the longest sub-step with contacts, at the last bound; infinite: any.
  virtual double contact_step() { return std::numeric_limits<double>::infinity(); }
  // Called once for a sub-step and its repetitions (touched: the last one ended with contacts), and once
  // there are contacts. Returns false if the scheme is another one than before: free_motion() must run again.
  virtual bool choose_scheme(bool /*touched*/) { return true; }
  // Return false if the model fails, or (free_motion) a velocity is not finite or above `fastest`. kinetic:
  // J, of the free motion; unchanged if it is not known.
  // keep: points().f holds the forces until commit(); else they may be used up as they come.
  virtual bool add_forces(const SubStep &, bool /*keep*/) { return true; }
  virtual bool free_motion(const SubStep &now, double &kinetic) = 0;

  Unknowns unknowns() const;
  // Where the unknowns are surfels: the response of n distinct ones to impulses at them, [3n,3n] 1/kg: one
  // column per unit impulse; symmetric up to rounding. Returns false if the model fails.
  virtual bool response(const SubStep &, uint32_t, const uint32_t *, double *) { return false; }

  // Takes the impulses in points().impulse, or at the surfels [nsurfel,3] if points respond to each other.
  // touched: there are impulses; else the unknowns have the velocity without contact again, which a further
  // solve needs. Returns false if the model fails, or the end is not finite.
  virtual bool end_state(const SubStep &now, const double *surfel_impulse, bool touched) = 0;
  EndState end() const { return end_; }
  // s, the sub-step that would have the wanted error, estimated from the error of this one; infinite: not
  // known. After end_state().
  virtual double accurate_step(const SubStep &) const { return std::numeric_limits<double>::infinity(); }
  // For a body whose scheme damps: writes the forces at the end into points().f, including loads of the
  // sub-step. Returns false if the model fails. After end_state().
  virtual bool end_forces(const SubStep &) { return false; }
  // Before commit(): the guard takes only this share of the displacement. Velocities are those of the end,
  // but unless `in_full`, forces on points that move explicitly act for the share only: in full they would
  // drive what cannot move again and again. surfel_impulse: what contact then does, as points().impulse;
  // null: none.
  virtual void take_part(double share, bool in_full, const double *surfel_impulse);
  // J, stored in dampers that see the velocity with a lag
  virtual double damper_energy(double /*time*/) { return 0; }
  virtual void commit(const SubStep &now) = 0;
  // After commit(), of points with a `diagonal`: takes c M^-1 K v from the velocities, c in s2, K the
  // stiffness of the model, taken as constant over `ahead` (s) of the motion. Both momenta stay.
  void damp(double time, double c, double ahead);

  // Computes the points that steps may leave out because no surfel depends on them. Call before reading
  // points. Between steps, any thread.
  void see_points();
  // Call after points have been written; all of them must have been computed before.
  void points_changed();
  // Returns false if the sums are not known without see_points(). Also valid between free_motion() and
  // end_state().
  virtual bool sums(BodySums &) const { return false; }

  // trial: with memory for the next state of the model
  dfm_kin kin(double time, double h, bool trial = false) const;
  void push(uint32_t point, double weight, const double *impulse);  // N s, between sub-steps

 protected:
  Phyxels &p_;
  Surface &surface_;
  ModelInstance &model_;
  Abilities abilities_;
  EndState end_{};
  ImplicitSystem *system_ = nullptr;  // of points that move implicitly
  double least_h_ = 0;                // s, that kin() gives to the model
  std::atomic<bool> unseen_ = false;  // points have been left out since see_points()

 private:
  std::mutex seeing_;
};

// Makes the dynamics of a body with this model. edges: [nedge,2] of its mesh. implicit: null if the library
// moves the points explicitly.
std::unique_ptr<Dynamics> make_dynamics(const Memory &memory, Phyxels &points, Surface &surface,
                                        ModelInstance &model, const Array<uint32_t> &edges,
                                        const ImplicitOptions *implicit);

}  // namespace dfm
