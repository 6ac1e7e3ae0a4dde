// How one body moves in a sub-step. Stages, contact, guard and watch know a body's motion by this interface
// alone; what moves it is known in this folder only.
//
//   bound         between sub-steps: the largest stable one at the present state
//   begin         of a sub-step: whether contacts are expected
//   add_forces    forces that follow from the state
//   free_motion   the mean velocity over the sub-step without contact
//   take_contact  contacts are known: is the free motion one that goes with them?
//   diagonal      what an impulse changes of that velocity, where points do not answer each other's impulses;
//   response      else, between the touched surfels
//   revise        the impulses of a solve are known: where both of these are not what they were taken for
//                 there, they are found anew, and the solve goes on
//   end_state     where it ends with the impulses that the solve has found; asked again after a further solve
//   commit        the end becomes the present
//
// Why contact sees no more of a body: doc/decisions/0085-body-dynamics.md.
#pragma once
#include <functional>
#include <limits>
#include <memory>
#include <string>

#include "body/phyxels.h"
#include "core/tasks.h"
#include "dynamics/model.h"
#include "geometry/surface.h"

namespace dfm {

struct SubStep {
  double time = 0, h = 0;     // s: its start, its length
  Vec3 gravity;               // m/s2
  double fastest = HUGE_VAL;  // m/s: no component of a velocity may be above it
  Vec3 gravity_before;        // m/s2: at its start; `gravity` is that of its end
};

struct StepBound {
  double step = std::numeric_limits<double>::infinity();  // s; infinite: nothing bounds it
  uint32_t point = 0;                                     // that bounds it
  double by_stiffness = step, by_damping = step;          // s, that each would allow alone at that point
};
// Adds row sums of stiffness N/m and damping N s/m that act on the points from outside of the model.
using AddRowSums = std::function<void(double *stiffness, double *damping)>;

// [n,4] m/s: of the points at the end of the sub-step, and their mean on the way there.
struct EndState { const double *v, *mean; };

// What revise() has found anew.
enum class Revision {
  none,
  velocity,
  response,  // and velocity
  diverged,  // there is no state to be found from here: the sub-step is too long
  failed     // the model cannot
};

// How implicit points solve.
struct ImplicitOptions {
  std::string solver = "auto";     // auto ldlt pcg, or that of a plugin
  double tolerance = 1e-10;        // of an iterative solver, relative residual
  uint32_t solver_iterations = 0;  // of it at most; 0: as many as unknowns
  uint32_t newton = 20;            // at most; 1: one linear solve per sub-step, without a line search
  double rest = 1e-8;              // m/s that Newton's method may leave of what does not move
  bool rest_factor = true;         // may stand for the matrix
  Tasks *tasks = nullptr;          // for the rows of a large body's matrix
  bool second_order = false;       // TR-BDF2 without contact; else backward Euler always
};

// Of all points of a body, without a look at each.
struct BodySums {
  double kinetic = 0, elastic = 0;  // J
  Vec3 first;                       // kg m: masses times places
  double reach = 0;                 // m, the largest coordinate of the points that steps move
};

// What may be done to a body beside moving it.
struct Abilities {
  bool forces = false;    // add_forces() does something
  bool springs = false;   // loads may depend on the state: bound() takes their row sums
  bool placed = false;    // its points may be put elsewhere, one by one
  bool revises = false;   // revise() does something
  bool accurate = false;  // accurate_step() is known
  bool energy = false;    // the energy that its scheme keeps is known (step/energy_watch.h)
  bool damps = false;     // its scheme keeps none: it lowers the energy itself
  bool parts = false;     // its free motion is another one where contacts are: begin(), take_contact()
};

class Dynamics {
 public:
  Dynamics(Phyxels &points, Surface &surface, ModelInstance &model);
  Dynamics(const Dynamics &) = delete;
  Dynamics &operator=(const Dynamics &) = delete;
  virtual ~Dynamics() = default;

  virtual Abilities abilities() const = 0;
  // DFM_CAP_* that its model must keep, whatever parameters it is given: what this was made for.
  virtual uint32_t claims() const { return 0; }
  // of a sub-step, over that of an explicit one: a rough number for the budget of a step
  virtual uint32_t relative_work() const { return 1; }

  // Multiplications so far, roughly: differences are counts of what sub-steps have done. They depend on the
  // states that it came through, not on what it still knows of earlier ones. 0: nobody counts.
  virtual double effort() const { return 0; }

  // False: the model gives none.
  virtual bool bound(double time, const AddRowSums &outside, StepBound &out) = 0;
  // 1/s, of the edge that stretches fastest; 0 where no bound follows the shape
  virtual double strain_rate() const { return 0; }
  // touched: the last sub-step ended with contacts. Asked once for a sub-step and its repetitions.
  virtual void begin(bool) {}
  // The present loads are those of the start of the sub-step; those of its end come next. Not asked where
  // loads do not vary.
  virtual void loads_before() {}
  // There are contacts. False: the sub-step has to be taken anew, now with what goes with them.
  virtual bool take_contact() { return true; }
  // False: the model cannot, or (free_motion) a velocity is not finite or above `fastest`. kinetic: J, of the
  // free motion; left as it is where it is not known.
  virtual bool add_forces(const SubStep &) { return true; }
  virtual bool free_motion(const SubStep &now, double &kinetic) = 0;

  // [npoint,4] 1/kg, what an impulse changes of its own point; null: the unknowns of contact are the touched
  // surfels, which answer each other.
  virtual const double *diagonal() const { return nullptr; }
  // Where diagonal() is null: what impulses at n distinct surfels change of their velocities, [3n,3n] 1/kg:
  // the answers to unit impulses one after another; symmetric but for rounding. False: the model cannot.
  virtual bool response(const SubStep &, uint32_t, const uint32_t *, double *) { return false; }
  // By the impulses at the surfels [nsurfel,3]; point_velocity() and response() then give what has changed.
  virtual Revision revise(const SubStep &, const double *, bool /*last*/) { return Revision::none; }
  // [npoint,4] m/s without contact; null: free_motion() has written the surfels' own, surface.v.
  virtual const double *point_velocity() const { return nullptr; }
  virtual const double *contact_velocity() const;  // of the unknowns: [npoint,4], or [nsurfel,4]

  // By the impulses in points().impulse, or at the surfels [nsurfel,3] where points answer each other.
  // touched: there are any. False: the model cannot, or its end is not finite.
  virtual bool end_state(const SubStep &now, const double *surfel_impulse, bool touched) = 0;
  virtual EndState end() const = 0;
  // point_velocity() is that without contact again, before a further solve: end_state() may have put the end
  // in its place.
  virtual void free_again(const SubStep &) {}
  // After somebody has changed point_velocity().
  virtual void free_changed() {}
  // Bounds of the surfels' mean velocities and of what contact has changed of them, m/s, as the linear
  // response gives them: replaced by the true ones where the end need not agree with it. After end_state().
  virtual void bound_ends(double &, double &) const {}
  // s, the sub-step whose error would be what is wanted, by that of this one; infinite: not known. After
  // end_state().
  virtual double accurate_step(const SubStep &) const { return std::numeric_limits<double>::infinity(); }
  // Of a body whose scheme damps: forces at the end into points().f, loads of the sub-step included. False:
  // the model cannot. After end_state().
  virtual bool end_forces(const SubStep &) { return false; }
  // fraction: of the way to the end that is taken; velocities are the end's.
  virtual void commit(const SubStep &now, double fraction) = 0;

  // Steps may leave out points that no surfel hangs on: before anybody reads them. Between steps, any thread.
  virtual void see_points() {}
  // The same of the ends that end_state() has found, where only a part of the way to them is taken.
  virtual void see_ends() {}
  // After somebody has written points, all of which had been seen.
  virtual void points_changed() {}
  // Whether steps leave out points.
  virtual bool late() const { return false; }
  // False: not known without see_points(). Also between free_motion() and end_state().
  virtual bool sums(BodySums &) const { return false; }

  // trial: with room for the model's next state
  dfm_kin kin(double time, double h, bool trial = false) const;
  void push(uint32_t point, double weight, const double *impulse);  // N s, between sub-steps

 protected:
  Phyxels &p_;
  Surface &surface_;
  ModelInstance &model_;

  void bound_surfel_ends(const double *mean, double &speed, double &change) const;
};

// What moves a body of this model. edges: [nedge,2] of its mesh.
// implicit: null where the library's points move explicitly.
std::unique_ptr<Dynamics> make_dynamics(const Memory &memory, Phyxels &points, Surface &surface,
                                        ModelInstance &model, const Array<uint32_t> &edges,
                                        const ImplicitOptions *implicit);

}  // namespace dfm
