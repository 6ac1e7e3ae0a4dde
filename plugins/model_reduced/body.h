// A body whose displacements in a moving frame are small, and sums of few modes:
//
//   x_i = c + R (X_i + u_i),   u_i = sum_k W_ik q_k
//
// A step:  where    c, R, q and their rates, from x and v alone
//          advance  the frame as a rigid body (or as what is held has it), each mode by itself
//          place    the points where that leads without contact; what an impulse changes is added to it
// A condensed body has a fourth part, the displacement at rest of what its modes leave out: it has no mass
// and follows forces and impulses at once. Equations, limits and cost: doc/models/modal.md, condensed.md.
#pragma once
#include <deform/plugin.h>

#include "modes.h"
#include "oscillator.h"

namespace reduced {

// Displacement gradient in the frame up to which small displacements are taken for the true ones.
constexpr double kLargestGradient = 0.1;
constexpr double kForgotten = 1;  // s in the range of small displacements
// What determines the body's position: the points; the points, for a host that sees them later; the state.
enum class Lead { points, points_for_now, state };
constexpr const char *kModalId = "org.deform.modal", *kCondensedId = "org.deform.condensed",
                     *kBoundaryId = "org.deform.boundary";

struct Frame {
  double c[3] = {};                           // m, of its origin
  double r[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // frame to world
};

class Body {
 public:
  Body(const char *id, bool condensed, bool by_surface = false)
      : id_(id), condensed_(condensed), by_surface_(by_surface) {}
  using Row = Param;
  const dfm_host *host = nullptr;
  const char *active_effects[3] = {};  // NULL-terminated

  void create(const dfm_host *h, const dfm_mesh &m);
  void apply_params(const double *values);
  const char *name() const { return id_; }
  static constexpr uint32_t kFactCount = 4;
  const dfm_fact *facts() const { return facts_; }
  const char *idle(Param row) const { return row == kModes && note_[0] ? note_ : nullptr; }
  bool lacks_state(const dfm_kin &k) const;

  dfm_status predict(const dfm_kin &k, const double *f, double *u_s);
  void respond(const dfm_kin &k, uint32_t n, const uint32_t *surfel, uint32_t nrhs, const double *p,
               double *du);
  void diagonal(const dfm_kin &k, uint32_t n, const uint32_t *surfel, double *w);
  void commit(const dfm_kin &k, const double *p_s, double *x, double *v);
  // Held bodies alone: dfm_late_points, and state of this instance.
  bool can_be_late() const { return !elastic_.floating; }
  void commit_near(const dfm_kin &k, const double *p_s, double *x, double *v);
  void points(const dfm_kin &k, double *x, double *v);
  static void look(double *state);
  bool sums(const dfm_kin &k, double *out) const;
  const dfm_slots *slots() const { return can_be_late() ? &slots_ : nullptr; }
  double energy(const dfm_kin &k);
  void cell_energy(const dfm_kin &k, double *density);
  void cell_stress(const dfm_kin &k, double *stress);

 private:
  const char *id_;
  const bool condensed_, by_surface_;
  double params_[kParamCount] = {};
  char note_[128] = {};
  dfm_fact facts_[kFactCount] = {};
  Elastic elastic_;
  Modes modes_;
  uint32_t nsurfel_ = 0;
  bool own_points_ = true;      // each surfel is a point of the body
  Buffer<uint32_t> row_, col_;  // coupling
  Buffer<double> weight_;
  Buffer<double> surface_;   // [nsurfel,3,modes]
  Buffer<double> pull_;      // [modes,3] sum m W: what a uniform acceleration does to a mode
  Buffer<double> swing_;     // [modes,9] sum m W X^T
  Buffer<double> twist_;     // [3,modes,modes] sum m W_k x W_l; floating
  Buffer<double> gradient_;  // [modes] the largest displacement gradient of a cell, per unit
  // Condensed: C_rest is the response at rest of what the modes leave out.
  Buffer<double> columns_;  // [3 nsurfel, 3 nlead_] of it to unit forces at surfels, as they are touched
  Buffer<uint8_t> known_;   // [3 nsurfel]
  Buffer<double> eight_;    // [3 npoint,8]
  Buffer<double> between_;  // [9,n] blocks of C_rest from one surfel to n; [3,n] what it answers
  Buffer<double> weight_at_rest_;  // [3, 3 npoint] of it to unit accelerations; held

  // Late points. State: touched in the last step, Lead, q, q'; of a condensed body what follows at rest: of
  // accelerations [3] m/s2, its displacements at the near points [nnear,3] m, of impulses [nsurfel,3] N.
  Buffer<dfm_slot> slot_;
  dfm_slots slots_{};
  size_t nstate_ = 0;
  static constexpr size_t kTouched = 0, kLead = 1, kCoordinates = 2;
  size_t at_pull() const { return kCoordinates + 2 * size_t(modes_.count); }
  size_t at_near() const { return at_pull() + 3; }
  size_t at_impulse() const { return at_near() + 3 * size_t(nnear_); }
  uint32_t nnear_ = 0;  // points that a surfel depends on, or that are held
  uint32_t nfree_ = 0;  // of these, that are not held in all components
  uint32_t nlead_ = 0;  // near, or not following others
  // [npoint] of points in columns_, the free near ones first, then the other near ones; and back
  Buffer<uint32_t> place_, point_;
  Buffer<double> near_response_;     // condensed: C_rest between the free near points, [3 nfree,3 nfree]
  Buffer<double> near_force_;        // [3 nfree]
  double weight_of_weight_[9] = {};  // [b,c] kg m: sum m (weight_at_rest_ of c)_b
  double rest_moment_[3] = {};       // kg m: sum m X
  Basis near_shape_;                 // of the near points
  Buffer<double> near_x_, near_v_;   // [padded 3 nnear] m, m/s at the end without contact, in the frame
  Buffer<double> near_change_;       // what impulses change
  Buffer<double> near_rest_;         // of it, what the modes leave out
  Buffer<double> near_given_;        // condensed: what impulses add to that
  Buffer<double> end_x_, end_v_;     // [3 nnear] m, m/s in the world, at the end without contact
  Buffer<double> now_x_, now_v_;     // [npoint,now_stride_], of a step that needs all points
  uint32_t now_stride_ = 0;
  Buffer<double> holders_;  // [holders,3] m, where they were as nothing was led
  Frame holders_frame_;
  bool holders_known_ = false;
  bool near_only_ = false;      // this step
  bool rest_is_known_ = false;  // the state holds what the modes leave out
  Buffer<uint32_t> near_edge_;  // [.,2] places: edges of the mesh between near points
  size_t near_edges_ = 0, next_edge_ = 0;
  double near_most_ = 0, sweep_most_ = 0;  // the largest stretch of one: of the last sweep, of this one
  double looked_ = 0;                      // near_most_ at the last look at all cells
  double near_time_ = 0;                   // s, at the last step's end

  // State of the step at hand, from predict on. Points are in the frame of its start where not said
  // otherwise, [padded 3 npoint]; modes [modes].
  double h_ = 0;
  bool soft_ = false;    // backward Euler: the body was touched
  bool moving_ = false;  // held points move
  bool led_ = false;     // and displace the body
  bool has_rest_ = false;
  bool beside_ = false;     // the modes do not hold all of the displacements
  bool even_ = false;       // the forces are the masses times pull_of_
  double pull_of_[3] = {};  // m/s2 in the frame
  Frame at_, to_;
  Buffer<double> u_, w_, f_;           // displacement, velocity beside the frame's, force
  Buffer<double> mu_, mw_;             // times the masses
  Buffer<double> follow_, follow_to_;  // what held points displace, at start and end; held
  Buffer<double> given_[2];            // [3 npoint] the held displacements of which the last two were found
  Buffer<double> rest_;                // what the modes do not hold of u
  Buffer<double> u_to_, w_to_;         // at the end, in its frame
  Buffer<double> x_to_, v_to_;         // the same in the world
  Buffer<double> q_, qd_, load_, q_to_, qd_to_, modal_;
  Buffer<double> coupling_;                  // [3,modes] sum m r x W; floating
  Buffer<double> under_, under_of_;          // condensed: displacement at rest by which uneven forces
  Buffer<double> rows_, lanes_, responses_;  // of respond
  Buffer<Transition> step_;
  double step_h_ = -1;
  bool step_soft_ = false;
  Buffer<double> softened_;                                       // [modes] what an impulse leaves
  double left_ = 0;                                               // of rest_ after the step
  double rigid_ = 1;                                              // the same of the rigid motion
  Transition drift_{};                                            // of what no stiffness acts on
  double velocity_[3] = {}, spin_[3] = {}, velocity_to_[3] = {};  // floating; the spin in the frame
  double inertia_[9] = {}, moment_[3] = {}, moment_to_[3] = {};   // in the frame; in the world
  double turning_[9] = {};                                        // inverse inertia in the world
  double force_sum_[3] = {}, torque_[3] = {};
  bool named_ = false, checked_ = false;
  double reported_ = 0;  // the displacement gradient that was reported; 0: none, or long ago
  double outside_ = 0;   // s, when it was last out of its range
  uint32_t since_look_ = 0;

  size_t size() const { return 3 * size_t(elastic_.npoint); }
  void take_surface(const dfm_mesh &m);
  void take_integrals();
  void check_size(uint32_t nsurfel, uint32_t npoint) const;
  void reserve();
  void describe();
  void set_steps();
  void name_aliases();

  Frame frame_of(const double *x, size_t stride, const double *v, double h) const;
  bool is_rotated(const dfm_kin &k) const;
  void displacement(const dfm_kin &k, const Frame &f, double *u) const;
  bool held_displacement(const dfm_kin &k, const Frame &f, double h, double *u) const;
  void follow(const dfm_kin &k, const Frame &f, double h, int which, double *out);
  void where_floating(const dfm_kin &k, const double *f);
  void where_held(const dfm_kin &k);
  bool uniform(const dfm_kin &k, const double *f, double *a) const;
  void project(const dfm_kin &k, const double *f);
  void couple_rest();
  void find_spin();
  void keep_rest();
  void advance_frame();
  void advance_coordinates();
  void advance_modes();
  void place_floating();
  void place_held(const dfm_kin &k);
  void arm(const dfm_kin &k, uint32_t s, double *r) const;
  void take_impulses(const dfm_kin &k, const double *p, double *sum, double *moment);
  size_t row_width() const { return modes_.count + (elastic_.floating ? 6 : 0); }
  void gather(const dfm_kin &k, uint32_t n, const uint32_t *surfel);
  void weigh(uint32_t n, uint32_t nrhs, const double *p);
  void find_columns(uint32_t n, const uint32_t *surfel);
  void make_columns(size_t many, const size_t *wanted);
  void add_response_at_rest(uint32_t n, const uint32_t *surfel, uint32_t nrhs, const double *p, double *du);
  void add_coupled_response_at_rest(uint32_t n, const uint32_t *surfel, uint32_t nrhs, const double *p,
                                    double *du) const;
  void add_displacement_at_rest(const double *p, double *out);
  double between(uint32_t surfel, size_t component, uint32_t point, size_t other) const;
  void find_near_response();
  void add_near_response(const double *p_s);
  bool commit_all(const dfm_kin &k, const double *p_s, double *x, double *v);
  void find_weight_at_rest();
  void rest_under(const double *f, const double *load, double *out);
  const double *rest_of_forces();
  void match_moment(const double *wanted, const double *c, const double *velocity, const double *x, double *v,
                    size_t stride) const;
  void look_at_gradient(double time, const double *x, size_t stride);
  void warn_gradient(double time, double most, const char *where, uint32_t which);
  void take_near(const dfm_mesh &m);
  bool stays_near(const dfm_kin &k, const double *f);
  void all_points(const dfm_kin &k, dfm_kin &all);
  dfm_status predict_near(const dfm_kin &k, double *u_s);
  dfm_status predict_all(const dfm_kin &k, const double *f, double *u_s);
  void displacement_of(const double *state, double *u, double *w);
  void add_rest_of(const double *state, double *u);
  bool holds_rest(const double *state);
  void end_state(const dfm_kin &k, const double *p_s, bool touched, Lead lead);
  void watch_near(const dfm_kin &k, bool touched);
  void look_at_cells();
  void whole_displacement(const dfm_kin &k, Frame &f);
};

struct Modal : Body {
  static constexpr uint32_t kCells = model::kAllCells;
  Modal() : Body(kModalId, false) {}
};
struct Condensed : Body {
  static constexpr uint32_t kCells = Modal::kCells;
  Condensed() : Body(kCondensedId, true) {}
};
// Condensed, with the stiffness of boundary elements (boundary.h).
struct Surface : Body {
  Surface() : Body(kBoundaryId, true, true) {}
};

}  // namespace reduced
