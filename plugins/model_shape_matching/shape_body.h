// A body of shape matching: clusters of points, each with the goals that its fitted rest shape gives them,
// and the step of points towards their goals. Derivation: doc/models/shape_matching.md.
#pragma once
#include <deform/plugin.h>

#include <algorithm>

#include "../model_common/buffer.h"
#include "../model_common/stepper.h"

namespace shape {

using model::Buffer;

// Rows of the parameter table, each one wide.
enum Param : uint32_t {
  kMode,
  kStiffness,
  kReferenceStep,
  kDamping,
  kLinearity,
  kClusters,
  kOverlap,
  kCreep,
  kYield,
  kPlasticMax,
  kDampingMass,
  kParamCount
};
extern const dfm_param kParams[kParamCount];
constexpr const char *kId = "org.deform.shape_matching";
enum Mode : uint32_t { kRigid, kLinear, kQuadratic };

// Functions of the rest position that goals are made of: the position q, from its cluster's center, and for
// quadratic goals the products of its components over the cluster's size, less their mean.
constexpr int kBasis = 9, kPlastic = 9;

// A cluster at rest; with plastic flow the same of the shape that it has flowed to.
struct Cluster {
  double mass;                            // kg, of the shares of its points
  double size;                            // m, root mean square of |q| at rest
  double mean[6];                         // m, of the products
  double linear_inverse[9];               // of sum m q q^T, 1/(kg m2); zero along what the points do not span
  double root_inverse[9];                 // its root; linear goals only
  double content;                         // the root of the determinant of sum m q q^T; 0: flat
  double basis_inverse[kBasis * kBasis];  // of sum m b b^T; quadratic goals only
};

// Where a cluster is at the start of the step.
struct Frame {
  double center[3];           // m
  double remainder[3];        // m, what its rounding has left out, so that nothing moves momentum
  double inverse_inertia[9];  // 1/(kg m2), zero about axes that turn nothing
  double goal[3 * kBasis];    // row-major: goal = center + goal b
  double stretch[9];          // R^T A, of the linear fit A
  double volume;              // det A
  double plastic[kPlastic];   // at the start of the step
  bool flowed;                // plastic is not the identity
  Cluster now;                // of the shape that it has
};

// Mean velocity of a point over a step of length h: with v and the acceleration f/m its deviation is
//   kept v + given h f/m + pulled (goal - x),
// and where clusters move against each other they share in (pulled + led) (goal - x). See
// doc/models/shape_matching.md.
struct Rates { double kept, given, pulled, led, drag; };

struct Body {
  using Row = Param;
  const dfm_host *host = nullptr;
  uint32_t npoint = 0, nsurfel = 0, ncluster = 0;
  double params[kParamCount] = {};
  const char *active_effects[4] = {};  // NULL-terminated
  dfm_slots slots{};

  void create(const dfm_host *h, const dfm_mesh &m);
  void apply_params(const double *values);  // cannot fail
  const char *idle(Param row) const;
  void init_state(double *state) const;

  bool lacks_state(const dfm_kin &k) const {
    if (!k.state) model::complain(host, kId, "the host gives no state; every cluster has one");
    return !k.state;
  }
  // Frames are those of the last predict(), which has to be of the same step.
  bool lacks_step(const dfm_kin &k) const {
    const bool lacks = frames_of != k.t || step_of != k.dt;
    if (lacks) model::complain(host, kId, "asked for answers in a step that was not predicted");
    return lacks;
  }
  void predict(const dfm_kin &k, const double *f, double *u_s);
  void respond(const dfm_kin &, uint32_t n, const uint32_t *surfel, uint32_t nrhs, const double *p,
               double *du);
  void diagonal(const dfm_kin &, uint32_t n, const uint32_t *surfel, double *w) const;
  void commit(const dfm_kin &k, const double *p_s, double *x, double *v);

 private:
  Buffer<double> rest;        // [npoint,3] m
  Buffer<double> weight;      // [npoint] kg: mass, and kHeavy times as much of points that are held
  Buffer<double> inverse;     // [npoint,3] 1/kg; 0 for held components
  Buffer<uint32_t> row, col;  // coupling, as in dfm_mesh
  Buffer<double> coupling;    // its weights
  // Points of the clusters, ascending, each with its share of the mass and q [.,3]; clusters of the points,
  // ascending, with the point's place in the cluster's list.
  Buffer<uint32_t> cluster_begin, cluster_point, point_begin, point_cluster, point_place;
  Buffer<double> part, q;
  Buffer<Cluster> cluster;  // at rest
  Buffer<dfm_slot> slot;
  bool warned_softened = false;

  // of the present step
  double frames_of = 0, step_of = -1;  // its time and length
  Rates rates{};
  Buffer<Frame> frame;
  Buffer<double> position;  // [npoint,3] m
  Buffer<double> velocity;  // [npoint,3] m/s, mean without contact
  // of one answer; zero in between
  Buffer<double> change, matched;  // [npoint,3] m/s, of the points' velocities: before, after the clusters
  Buffer<double> momentum;         // [ncluster,6] of the change; then the clusters' rigid velocities
  Buffer<uint32_t> touched, met;   // points and clusters, in the order in which they are met
  Buffer<uint8_t> is_touched, is_met;
  uint32_t ntouched = 0, nmet = 0;
  Buffer<uint32_t> pushed;  // [nsurfel] surfels with an impulse at the end of the step
  Buffer<double> push_by;   // [nsurfel,3] N s

  void take_mesh(const dfm_mesh &m);
  void make_clusters();
  void list_members(const uint32_t *center, const double *near, double reach);
  void check_cohesion() const;
  void make_cluster(uint32_t c);
  Mode mode() const { return Mode(uint32_t(params[kMode])); }

  Rates rates_of(double h) const;
  void warn_softened(double h);
  void fit(uint32_t c, const dfm_kin &k);
  void find_goal(const double *turn, const double *moments, const double *full, Frame &f) const;
  void to_goal(uint32_t point, double *d) const;
  // The mean over a point's clusters of their rigid velocities.
  void add_momentum(uint32_t point, const double *w);
  void make_rigid(uint32_t c);
  void rigid_velocity(uint32_t point, double *out) const;
  void touch(uint32_t n, const uint32_t *surfel);
  void forget();
  void push(uint32_t n, const uint32_t *surfel, const double *p);
  void changed(uint32_t point, double *out) const;
  void flow(const dfm_kin &k) const;
};

}  // namespace shape
