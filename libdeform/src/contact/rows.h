// The contact operator of one sub-step.
//
// Contact i sees the mean velocity over the sub-step u_i = sum_k w_ik y_k - v_obstacle of a few unknowns
// ("dofs") y_k: phyxels of bodies whose points do not answer each other, surfels of the others. An impulse p
// at the contact changes them by
//     y_k += w_ik D_k p                        (phyxel that answers its own impulses only; D its diagonal,
//                                              zero where held)
//     y_j += R_jk w_ik p for all j of the body (other bodies; R is the symmetric response, dense over the
//     touched surfels)
// A contact with a rigid body also sees the change (dv, dw) of that body's mean velocity, at the arm r from
// its center to the contact:
//     u_i -= dv + dw x r,   (dv, dw)_j -= R_jk (p, r x p)  for all bodies j of its group (joints tie them)
// which is W = J B J^T of doc/concepts/contact.md without ever forming it.
#pragma once
#include <span>

#include "contact/bond.h"
#include "contact/contact_set.h"
#include "contact/rows_part.h"
#include "geometry/surface.h"
#include "math/dense_kernel.h"
#include "math/vec3.h"

namespace dfm {

// Where a body's dofs come from.
struct DofSource {
  uint32_t first_node = 0, nnode = 0;    // world-wide surfel numbers of the body
  uint32_t first_point = 0, npoint = 0;  // world-wide phyxel numbers
  const Surface *surface = nullptr;
  // [npoint,4] 1/kg, Dynamics::diagonal(), or ImplicitSystem::diagonal_inverse(); null: surfels are the
  // unknowns
  const double *diagonal = nullptr;
  const double *velocity = nullptr;  // without contact: [npoint,4] or, of surfels, surface->v
  // [npoint,4] m, positions of phyxels, of a surface whose surfels are set back from them; else null
  const double *place = nullptr;
  // 1/kg, estimate of what an implicit body answers as a whole, beside `diagonal`
  double whole = 0;
};

// The rigid body that an obstacle is: its number in a group of bodies that answer each other's impulses.
struct RigidPlace {
  uint32_t group = kNone, place = 0;  // world-wide; kNone: an obstacle that feels nothing
  Vec3 center;                        // of mass, at the start of the sub-step
};
struct RigidPlaces {
  std::span<const RigidPlace> of_obstacle;  // by obstacle slot; empty: no rigid bodies
  std::span<const uint32_t> group_size;     // bodies per group
};
// A contact between two rigid things at this place; normal: from b to a.
struct RigidSides {
  RigidPlace a, b;
  Vec3 at, normal, tangent;
};

struct ContactRows {
  // Dofs [first, first+count) of a self-stepping body, or of a rigid group: per body its linear velocity,
  // then its spin.
  struct Block {
    uint32_t source, first, count;
    size_t response;  // its first value
    uint32_t group;
  };

  uint32_t n = 0, ndof = 0;
  uint32_t nrigid = 0;  // of the n contacts, the last ones: between rigid things alone
  uint32_t soft() const { return n - nrigid; }
  uint32_t nbond = 0;  // rows behind the contacts: three to a bond
  uint32_t all() const { return n + nbond; }
  Array<uint32_t> begin;  // [all+1] into dof, weight
  Array<uint32_t> dof;
  Array<double> weight;
  // [ndof,4]; 1/kg, the diagonal response of a dof, zero for those of blocks
  Array<double> y, inverse_mass;
  Array<double> y_free;  // [ndof,4] without impulses
  // [ndof] index of the DofSource (rigid: kNone), phyxel (or surfel of a block)
  Array<uint32_t> source, point;
  Array<uint32_t> block;  // [ndof] kNone or index into blocks
  // [all] dof of the rigid body's velocity, its spin is the next one; kNone. Empty: no contact has any
  Array<uint32_t> rigid;
  Array<double> arm;  // [all,3] m, where there are any
  // the same of the body on the other side of contacts between rigid things alone; empty: there are none
  Array<uint32_t> rigid_a;
  Array<double> arm_a;
  // [all,3,3] m, of both: what a change of spin adds to the velocity in the frame beside spin x arm, since
  // the arm turns in the sub-step. Empty: nothing.
  Array<double> arc, arc_a;
  Array<Block> blocks;

  // [all,9] normal, tangent, normal x tangent; of a bond the world's axes.
  Array<double> frame;
  Array<double> drive;        // [all,3] obstacle velocity in the frame
  Array<double> rate;         // [n] m/s: gap / h; a depth 0.2 gap / h, at least -0.1 d_c / h
  Array<double> borne;        // [soft()] N s, normal impulses at the start of the sub-step
  Array<double> start_depth;  // [soft()] m, that counts as distance (ContactStore); empty: none
  // [n,3] Of a contact that is compliant under its load l (ContactPoint::indentation, soften_openings()): the
  // softness c, 1/kg, its largest effect m, m/s, and the load p, N s, from which on it yields: min(c max(l -
  // p, 0), m) is added to u_n + rate. 0, 0, 0 for all others.
  Array<double> compliance;
  Array<double> wn, wt;  // [all] 1/kg: W_nn; largest eigenvalue of W_tt, of a bond the larger of W_yy, W_zz
  // [n,2] 1/kg: W_tn, the slip that a unit normal impulse makes at its own contact
  Array<double> cross;
  Array<double> impulse;  // [all,3] N s: normal, two tangents; of a bond in the world's axes
  // What a bond has beside the impulse: the part of its impulse that does not depend on the bodies, and the
  // inverse of its own W + soft, kg, zero in the components in which nothing moves.
  struct BondRow {
    Vec3 rate;
    double soft;
    Vec3 inverse[3];
    Vec3 along;  // of a drag (contact/bond.h), else zero
    double most, max_work;
    double w;  // 1/kg, of a drag along it; zero: nothing moves
    bool drags() const { return along.x != 0 || along.y != 0 || along.z != 0; }
  };
  Array<BondRow> bond;  // [nbond]

  Array<double> whole_of;  // [sources] DofSource::whole

  // m/s, at most, at which a depth is opened; 0: a tenth of the rest distance per sub-step
  double recovery = 0;

  explicit ContactRows(const Memory &memory);
  // Expands contacts to dofs. Blocks get their dofs and counts; the caller gives their responses, then calls
  // finish(). Of contacts between rigid things it also gives drive, rate, compliance and impulse.
  void build(std::span<const ContactPoint> contacts, std::span<const DofSource> sources,
             const RigidPlaces &rigids = {}, std::span<const Bond> bonds = {},
             std::span<const RigidSides> between_rigids = {});
  // fill(matrix) writes the block's response, [3 count, 3 count] 1/kg: by rows, or by columns, which are what
  // unit impulses change one after another.
  template <class Fill>
  void set_response(const Block &b, bool by_columns, const Fill &fill) {
    const size_t wide = size_t(3) * b.count;
    unit_response_.resize(wide * wide);
    fill(unit_response_.data());
    take_response(b, by_columns ? 1 : wide, by_columns ? wide : 1);
  }
  // Frames from normals and tangents [n,3], W diagonals, rates. planned: s, time in which a depth closes;
  // longer than h where the guard has cut it, or depths would turn into speed. tasks: null: on this thread
  // alone.
  void finish(std::span<const ContactPoint> contacts, const double *tangents, double h, double planned,
              double offset, std::span<const Bond> bonds = {}, Tasks *tasks = nullptr);
  // Depths open against the loads that they bore and what opening needs of the contact alone, and against no
  // larger load: where normals oppose each other, n and -n + e would open at -rate / |e|. So u = 0 is always
  // allowed. firm: [n] where above zero, the row stays as it is; empty: none does.
  void soften_openings(std::span<const double> firm);
  // N s, the normal impulse less what a depth that does not open has added to its load: the next sub-step
  // would push against it with as much again, and loads of depths that exclude each other would grow for
  // ever.
  double load_without_opening(uint32_t i) const;
  RowsPart whole();  // all of them; valid until the next call

  // 1/kg: the estimate of what implicit bodies answer as a whole, in wn and wt of this row; 0 without any
  double whole_response(uint32_t i) const;
  Vec3 rigid_diagonal(uint32_t i, Vec3 a) const;  // of W a of a contact: the rigid bodies' part
  void set_diagonal(uint32_t i);  // wn, wt, cross of a contact, from its frame and the responses
  // relative velocity of contact i in its frame (normal, t1, t2); of unknowns like y
  Vec3 velocity(uint32_t i) const { return velocity(i, y.data()); }
  Vec3 velocity(uint32_t i, const double *of) const {
    Vec3 u;
    for (uint32_t j = begin[i]; j < begin[i + 1]; ++j) u += weight[j] * load3(of + size_t(dof[j]) * 4);
    if (!rigid.empty()) return velocity_with_rigids(i, of, u);
    return in_frame(&frame[size_t(i) * 9], u) - load3(&drive[size_t(i) * 3]);
  }
  // changes y by an impulse given in the frame
  void apply(uint32_t i, Vec3 impulse_frame) {
    const Vec3 p = from_frame(&frame[size_t(i) * 9], impulse_frame);
    if (!blocks.empty()) return apply_to_blocks(i, p);
    for (uint32_t j = begin[i]; j < begin[i + 1]; ++j)
      add3(&y[size_t(dof[j]) * 4], weight[j] * response_alone(dof[j], p));
  }
  Vec3 world_impulse(uint32_t i) const {  // the row's own
    return from_frame(&frame[size_t(9) * i], load3(&impulse[size_t(3) * i]));
  }
  // Begins a solve: y_free is y as it is, and y has the impulses of the last one. Those without a normal part
  // go as a whole, for there is no friction without it: they come from hits that have turned a contact, and
  // from fixed limits.
  void apply_last();
  // y of a part from the impulses alone: sweeps have left it not finite, or with their rounding
  void restore(const RowsPart &part);
  // What blocks can do: velocities change by G G^T impulse through them, with arcs by S G^T impulse, q = G^T
  // impulse in triples.
  struct Motions {
    // [triples,3,3] rows of G, and with arcs of S, of one contact; triples that are not touched are 0
    Array<double> g, s;
    Array<uint32_t> touched;  // ascending
    uint32_t rank = 0;
    // columns of the blocks, what is left of a diagonal; [blocks] first column, columns, and place of their
    // first value
    Array<double> columns, left;
    Array<size_t> first_column, column_count, first_value;
  };
  void motions(std::span<const uint32_t> of_blocks, Motions &out) const;
  void motion_row(uint32_t i, Motions &out) const;  // sets g, s, touched
  // Rigid bodies begin again: y has their velocities without impulses, or their responses have changed.
  void restart_rigids();

 private:
  friend struct ContactProblem;  // bindings/tools/contact keeps them in a file
  // this sub-step's dof of a phyxel, of a surfel of a self-stepping body; kNone
  Array<uint32_t> dof_of_point_, dof_of_node_;
  bool points_free_ = false;  // all of dof_of_point_ are kNone
  // the place of a dof in the row being made
  Array<uint32_t> place_;
  Array<uint32_t> dof_of_group_;  // first dof of a rigid group
  const DenseKernels &kernels_;
  // per block [3 count columns, 4 count], 1/kg: what an impulse at one dof changes of all, as y has them
  Array<double> response_;
  Array<double> unit_response_;  // scratch
  // of whole()
  RowRun every_row_[2] = {};
  Array<uint32_t> every_block_;
  void clear();
  void add_block(uint32_t from, uint32_t first, uint32_t group);
  void add_rigid_block(uint32_t group, uint32_t bodies);
  // f(dof of its velocity, arm, sign, arc or null): the rigid bodies of row i
  template <class F>
  void each_rigid(uint32_t i, const F &f) const {
    const auto turns = [&](const Array<double> &of) { return of.empty() ? nullptr : &of[size_t(9) * i]; };
    if (!rigid.empty() && rigid[i] != kNone) f(rigid[i], load3(&arm[size_t(3) * i]), -1.0, turns(arc));
    if (!rigid_a.empty() && rigid_a[i] != kNone)
      f(rigid_a[i], load3(&arm_a[size_t(3) * i]), 1.0, turns(arc_a));
  }
  void take_response(const Block &b, size_t along, size_t across);
  // The response of block b at dof k's component `row` to a unit impulse of that column.
  double response(const Block &b, size_t column, size_t k, size_t row) const {
    return response_[b.response + (column * b.count + k) * 4 + row];
  }
  void build_rigid(std::span<const ContactPoint> contacts, const RigidPlaces &rigids,
                   std::span<const Bond> bonds, std::span<const RigidSides> between_rigids);
  void set_rigid_sides(std::span<const RigidSides> between_rigids);
  void set_arms(std::span<const ContactPoint> contacts, std::span<const DofSource> sources,
                const RigidPlaces &rigids, std::span<const Bond> bonds);
  Vec3 response_alone(uint32_t d, Vec3 p) const {  // of a dof that is in no block
    const double *const w = &inverse_mass[size_t(d) * 4];
    return {w[0] * p.x, w[1] * p.y, w[2] * p.z};
  }
  void response_apply(const Block &b, uint32_t k, Vec3 p);
  void apply_to_rigids(uint32_t i, Vec3 p);
  void apply_to_blocks(uint32_t i, Vec3 p);
  Vec3 velocity_with_rigids(uint32_t i, const double *of, Vec3 u) const;
  Vec3 diagonal(uint32_t i, Vec3 direction) const;
  void finish_bonds(std::span<const Bond> bonds);
};

// Impulses of a part of the rows, [rows,3] one after the other; set, with the velocities that go with them.
void take_impulses(const ContactRows &rows, const RowsPart &part, double *to);
void put_impulses(ContactRows &rows, const RowsPart &part, const double *from);

}  // namespace dfm
