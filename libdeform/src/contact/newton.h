// The contact problem of an island with the motion of its bodies, by an augmented Lagrangian on the impulses
// and Newton's method on the velocities. Find v and impulses l with
//
//     g(v) = r(v) - sum_i J_i' l_i = 0,     l_i the law of contact i at its velocity u_i = J_i v + bias_i
//
// r: the equations of motion of the bodies; v: [nodes,4] velocities over the sub-step. A node is a point that
// moves by itself, a point of an implicit body, or three motions of a body that is known by its response.
//
//   outer pass    with multipliers lh and penalties rho (kg): v with g = 0, l_i(v) = P_i(lh_i - rho_i u_i),
//                 then lh <- l(v). The normal part of P is the positive part, the friction part a smooth law
//                 at the normal impulse of this pass and the slip u + (l - lh)/rho, or the disc that a
//                 set-valued law has at the start of the pass.
//   Newton step   (A + J'GJ) d = -g, G = -dl/du, by GMRES with the last factor of A + J' sym(G) J,
//                 or, of many points, with conjugate gradients on that matrix. It is taken where it makes g
//                 smaller. Where it does not, limits of friction are frozen: g is then the gradient of a
//                 convex function (but for arcs), and steps with a line search lower that.
//
// Impulses of redundant contacts are not unique, velocities are: passes end by velocities. A contact that
// sticks keeps lh, so that it acts as a spring of stiffness rho/h^2 with memory and does not creep, whatever
// is left of the residual. Sources: Alart and Curnier 1991 (Newton for mixed formulations of frictional
// contact), Rockafellar 1976 (augmented Lagrangians and the proximal point algorithm).
#pragma once
#include <algorithm>
#include <span>

#include "body/implicit_system.h"
#include "contact/contact_state.h"
#include "contact/row_law.h"
#include "contact/rows.h"
#include "contact/solver.h"
#include "math/gmres.h"
#include "math/ldlt_solver.h"
#include "math/pcg_solver.h"

namespace dfm {

// What a solve asks of the laws, and of the one who knows tolerances and budget.
class SolveLaws {
 public:
  virtual ~SolveLaws() = default;
  // Evaluates smooth laws at the state's fn where slip and force lie on the line of ft_stop with these
  // responses [rows], 1/kg (friction/local_solve.cpp); their slopes there. slip: m/s, that slips may be off
  // by. False: a law has failed.
  virtual bool evaluate_local(const double *response, double slip) = 0;
  // The residual of rows.impulse at rows.y; the state then has the laws there. False: a law has failed.
  virtual bool judge(Residual &residual) = 0;
  virtual void spend(uint64_t rows) = 0;  // that were swept, or multiplied
  virtual bool goes_on() = 0;             // whether the budget holds more
};

class ContactNewton {
 public:
  explicit ContactNewton(const Memory &memory, Tasks *tasks = nullptr);

  // systems: by source; null: not an implicit body. mass: of one. Rows and host stay valid until the solve
  // has ended. rows.impulse is the start of lh.
  void begin(ContactRows &rows, const RowsPart &part, std::span<ImplicitSystem *const> systems,
             ContactState &state, SolveLaws &host, double h);
  // From the present impulses, so that it goes on where rates or limits of the rows have changed. tolerance:
  // m/s, of what the motion of the bodies may be off by; normal: of velocities along normals. steps:
  // the limit on Newton steps, and on passes. False: a law or a model has failed; neither rows nor
  // bodies have a result.
  bool solve(double tolerance, double normal, uint32_t steps = 600);
  // The bodies' velocities become those of the solution.
  void take();

  const Residual &residual() const { return residual_; }
  uint32_t passes() const { return passes_; }
  uint32_t steps() const { return steps_; }
  uint32_t products() const { return products_; }
  uint32_t factors() const { return factors_; }

 private:
  struct Body {
    ImplicitSystem *system;
    uint32_t source, first, count;  // nodes
    size_t pattern;                 // first block in body_blocks_
  };
  enum class Kind : uint8_t { contact, bond, drag };
  struct Row {
    uint32_t row;
    Kind kind;
  };
  ContactRows *rows_ = nullptr;
  RowsPart part_;
  ContactState *state_ = nullptr;
  SolveLaws *host_ = nullptr;
  double h_ = 0;

  std::vector<Body> bodies_;
  // Nodes: points of implicit bodies, then single points, then motions of blocks.
  uint32_t nodes_ = 0, first_single_ = 0, first_motion_ = 0;
  Array<uint32_t> node_of_dof_;  // kNone: a block
  Array<uint32_t> dof_of_node_;  // of single points; kNone
  ContactRows::Motions motions_;
  Array<Row> row_;
  Array<uint32_t> entry_;    // [row_+1] into node_, jac_
  Array<uint32_t> node_;     // [entries]
  Array<double> jac_;        // [entries,9] rows: the contact's axes
  Array<double> speed_jac_;  // the same for velocities, where that differs (ContactRows::arc); else empty
  Array<double> bias_;       // [row_,3] m/s
  Array<double> mass_;       // [nodes,4] kg of single points; zero where held
  // the iterate
  Array<double> v_, base_;    // [nodes,4] m/s: now, and where the step began
  Array<double> g_;           // [nodes,3] N s
  Array<double> direction_;   // [nodes,3] m/s, of the step
  Array<double> rhs_;         // [nodes,3] N s, -g_ where not held; scratch
  Array<double> inverse_;     // [nodes,3] 1/kg of A's diagonal; zero where held
  Array<double> u_, l_, lh_;  // [row_,3] m/s, N s
  Array<double> before_;      // [nodes,4] m/s, v_ at the start of the pass
  Array<double> rho_;         // [row_,2] kg, normal and tangential
  Array<double> response_;    // [rows] 1/rho_t, by row
  Array<double> slope_;       // [row_,9] G, row-major
  Array<double> frozen_;      // [row_] limit of friction, N s, or the normal impulse of a smooth law
  // r of bodies at r_velocities_, if r_known_; at base_
  Array<double> r_, r_velocities_, base_r_;
  bool r_known_ = false;
  // of the pass that leaves the least residual
  Array<double> best_v_, best_g_, best_l_;
  Array<uint8_t> best_slides_;  // [row_]
  // the matrix
  BlockPattern pattern_;
  Array<uint32_t> pairs_, begin_, by_lower_, number_, higher_;  // of shape()
  Array<uint32_t> ij_;                                          // [nb,2] the blocks of the matrix
  Array<uint32_t> analysed_;                                    // ij_ that factor_ has the order of
  Array<uint32_t> place_;                                       // the block of each pair: first
  std::span<const uint32_t> body_blocks_;                       // those of the bodies' patterns, then
  std::span<const uint32_t> diagonal_;                          // [nodes] the diagonal
  Array<uint32_t> row_of_, begin_entry_, entry_by_node_;        // [entries], [nodes+1], [entries]
  Array<double> stiff_jac_;                                     // [entries,9] S J, S = sym(G)
  Array<double> places_;                                        // [nodes,3] m
  Array<double> blocks_, matrix_;                               // [nb,9] A + J' sym(G) J; A
  LdltSolver factor_;
  PcgSolver levels_;
  LinearSolver *solver_ = nullptr;  // the one of these that serves the nodes
  bool factored_ = false, shaped_ = false;
  bool current_ = false;  // A is that at v, to the accuracy of a step's system
  Gmres gmres_;

  bool converged_ = false;
  Residual residual_;
  uint32_t passes_ = 0, steps_ = 0, products_ = 0, factors_ = 0;
  double goal_ = 0;               // m/s, of g in the present pass
  double stiff_ = 0;              // rho w
  uint32_t limit_ = 0;            // on steps_
  uint32_t factor_products_ = 0;  // since factor_ was made
  uint32_t reported_ = 0;         // of products_, to the host

  void number_nodes(std::span<ImplicitSystem *const> systems);
  void list_rows();
  void set_bias();
  void set_penalties(double factor);
  void shape();
  Vec3 entry_times(uint32_t e, const double *x) const;
  Vec3 times(uint32_t k, const double *x, size_t stride) const;  // J_k x
  void add_transposed(uint32_t k, Vec3 z, double *to) const;
  bool is_open(uint32_t k) const {  // G of this row is zero
    return std::all_of(&slope_[9 * size_t{k}], &slope_[9 * size_t{k}] + 9, [](double g) { return g == 0; });
  }
  // f(entry of the node, entry of the same row) for all such pairs, by row, of rows that are `wanted`
  template <class Wanted, class F>
  void each_neighbor(uint32_t node, const Wanted &wanted, const F &f) const {
    for (uint32_t p = begin_entry_[node]; p < begin_entry_[node + 1]; ++p) {
      const uint32_t own = entry_by_node_[p], k = row_of_[own];
      if (!wanted(k)) continue;
      for (uint32_t e = entry_[k]; e < entry_[k + 1]; ++e) f(own, e);
    }
  }
  bool find_residual();
  bool evaluate(bool frozen);
  void evaluate_bond(uint32_t k);
  Pair stop_of(uint32_t k) const;
  Disc disc_at(uint32_t k) const;
  void find_slides();
  void find_slopes(bool frozen);
  void freeze();
  bool set_matrix();
  bool refactor();
  static void symmetric_part(const double *G, double *out);
  bool find_direction(bool symmetric, double tolerance);
  void begin_step();
  bool is_linear();
  void multiply_bodies(const double *in, double *out) const;
  void multiply(const double *in, double *out, bool symmetric) const;
  void move(double share);
  double error() const;        // m/s, largest of inverse g
  double scaled_norm() const;  // of g, in the metric of the inverse diagonal
  bool newton(double tolerance, double &left, bool &cycles);
  void scale_penalties(double by);
  bool coupled_step(double tolerance, double left, bool &failed);
  bool frozen_steps();
  bool adds_energy(double normal) const;
  bool penalties_alone(double tolerance, uint32_t steps);
  void put_rows();
  void report();  // the products, to the host
};

}  // namespace dfm
