// A body of cells with more nodes than a tetrahedron's corners (cells.h). The stiffness K of a cell is that
// at rest, in a frame R that turns with the cell, or stands still: with d_a = R^T x_a and X_a the rest
// positions
//   u_a = d_a - X_a,   E = u.K u / 2,   h = K u,   f = -dE/dx = -R P^T h,   P = du/d(R^T dx).
// R is the polar factor of the mean gradient F = sum x_a (x) G_a, S = R^T F. A change e of d turns it by
//   w = A^-1 sum G_a x e_a,  A = tr S I - S;   (P e)_a = e_a - w x d_a,   (P^T h)_a = h_a - (A^-1 tau) x G_a,
// tau = sum d_a x h_a = sum u_a x h_a, since K resists no rotation of X. So the forces are the gradient of an
// energy that no rotation changes, and have no moment, except where kMinStretch acts: there A^-1 is not the
// inverse of A. The tangent is R P^T K P R^T, positive semidefinite; what the turning of P adds is left out.
// The damper is damping_stiffness R P^T K P R^T v. With yield, E is the potential of the step (cell_points.h)
// and h its derivative, which resists no rotation of X either; E as a function of u is convex, and its second
// derivative is at most K.
//
// The step bound. With N_ab >= |K_ab| and any weights w > 0, D_a = sum_b N_ab w_b / w_a dominates K (corot's
// corot_bound.cpp). Let q = sum |G_a| |u_a| of a change u, alpha >= |A^-1|, hence |w| <= alpha q and
// q^2 <= g sum (|G_a| / w_a) u_a^2, g = sum |G_a| w_a. K P u = K (u - w x U), U the displacement: with
// e^2 = alpha^2 (sum D_a U_a^2) g max(|G_a| / (w_a D_a)) the square in K of the bracket is at most
// (1 + e)^2 sum D_a u_a^2. What the turning of P adds is
//   -2 h.(w x u) + h.(w x (w x d)) - tau.dw,   |A dw| <= |dA| |w| + q |w|.
// With M = sum h_a (x) d_a, |tau| <= sqrt 2 |M|, |dA| <= sqrt 2 (1 + sqrt 2 alpha |S|) q the last two are at
// most (alpha^2 |M| + sqrt 2 |M| alpha^2 (1 + sqrt 2 + 2 alpha |S|)) q^2. The first is at most 2 alpha q p,
// p = sum |h_a| |u_a|, p^2 <= H sum (|h_a| / w_a) u_a^2, H = sum |h_a| w_a, so at most
// alpha (q^2 H/g + p^2 g/H).
#pragma once
#include <algorithm>
#include <cmath>
#include <cstring>

#include "buffer.h"
#include "cell_blocks.h"
#include "cell_points.h"
#include "cells.h"
#include "edges.h"
#include "entry.h"
#include "even_rows.h"
#include "fibers.h"
#include "lists.h"
#include "params.h"
#include "pieces.h"
#include "rotation.h"
#include "small.h"
#include "small_range.h"

namespace model {

// True, once logged, where the host gives no state that a plastic body needs.
template <class Body>
bool lacks_state(const Body &b, const char *who, const dfm_kin &k) {
  if (!b.plastic() || k.state) return false;
  complain(b.host, who,
           "the host gives no state, which yield needs: it must ask the instance for the "
           "extension " DFM_EXT_SLOTS);
  return true;
}

class CellBody {
 public:
  // The four rows that each model with these cells begins its parameters with; four of plastic flow and four
  // of fibers, which a model may have. All are one wide but the last.
  enum Param : uint32_t {
    kYoung,
    kPoisson,
    kDampingStiffness,
    kDampingMass,
    kYield,
    kHardening,
    kCreep,
    kPlasticLimit,
    kYoungAlong,
    kPoissonAlong,
    kShearAlong,
    kAxis,
    kParamCount,
    kValueCount = kAxis + 3
  };
  struct Of {
    const char *id;
    const dfm_param *rows;
    uint32_t nrow;
    bool turns;      // the frames of the cells
    int32_t row[3];  // with which each four begin, -1: the model has none; a value begins at its row's number
    bool has(uint32_t r) const {
      return std::any_of(row, row + 3, [&](int32_t at) { return at >= 0 && r - uint32_t(at) < 4; });
    }
  };

  // Whether all rows that these cells lack have their defaults; else the reason has been logged.
  static bool takes(const dfm_host *h, const Of &of, const double *values) {
    for (uint32_t r = 0; r < of.nrow; values += of.rows[r++].width)
      for (uint32_t w = 0; !of.has(r) && w < of.rows[r].width; ++w)
        if (values[w] != of.rows[r].def) return refuse(h, of, of.rows[r].key);
    return true;
  }

  void create(const dfm_host *h, const dfm_mesh &m, const Of &of) {
    host = h;
    of_ = of;
    kind_ = m.cell;
    nodes_ = nodes_of(kind_);
    npoint_ = m.npoint;
    ncell_ = m.ncell;
    if (!takes(h, of, m.params)) throw Refused{};
    for (uint32_t k = 0; m.field_keys && m.field_keys[k]; ++k)
      for (uint32_t r = 0; r < of.nrow; ++r)
        if (!of.has(r) && !std::strcmp(m.field_keys[k], of.rows[r].key) && !refuse(h, of, of.rows[r].key))
          throw Refused{};
    for (int part = 0; part < 3; ++part)
      if (of.row[part] >= 0)
        take_fields(h, of.id, of.rows + of.row[part], 4, m, field_ + 4 * part,
                    [](uint32_t, double) { return true; });
    rest_.create_copy(h, m.rest, 3 * size_t(npoint_));
    mass_.create_copy(h, m.mass, npoint_);
    cells_.create_copy(h, m.cells, size_t(nodes_) * ncell_);
    const bool part = m.size >= offsetof(dfm_mesh, inside) + sizeof m.inside && m.inside;
    if (part) inside_.create_copy(h, m.inside, size_t{cells::kInside} * ncell_);
    cell_.create(h, ncell_);
    node_.create(h, size_t(nodes_) * ncell_);
    block_.create(h, kind_, ncell_);
    force_.create(h, 3 * size_t(nodes_) * ncell_);
    drag_.create(h, npoint_);
    weight_.create(h, npoint_);
    next_.create(h, npoint_);
    norm_.create(h, block_.each() * ncell_);
    find_places();
    if (of.row[1] >= 0 && may_yield(field_[kYield], m.params[of.row[1]])) points_.create(h, kind_, ncell_);
    apply_params(m.params);
  }

  // Throws before anything changes.
  void apply_params(const double *values) {
    if (!takes(host, of_, values)) throw Refused{};
    double own[kValueCount];
    std::copy(params_, params_ + kValueCount, own);
    for (int part = 0; part < 3; ++part)
      if (of_.row[part] >= 0) std::copy_n(values + of_.row[part], part < 2 ? 4 : 6, own + 4 * part);
    bool fibers = false;
    try_params(params_, own, [&] { fibers = check_params(); });
    fibers_ = fibers;
    std::fill(drag_.data(), drag_.data() + npoint_, 0.0);
    std::fill(weight_.data(), weight_.data() + npoint_, 0.0);
    for (uint32_t c = 0; c < ncell_; ++c) make_cell(c);
    bool damped = false;
    for (uint32_t c = 0; c < ncell_; ++c) damped |= at(kDampingStiffness, c) > 0 || at(kDampingMass, c) > 0;
    const char **effect = active_effects;
    if (of_.turns) *effect++ = "volume";
    if (damped) *effect++ = "damping";
    if (of_.turns) *effect++ = "large_rotation";
    if (fibers_) *effect++ = "anisotropy";
    if (largest_of(kYield) > 0) *effect++ = "deform.plasticity";
    *effect = nullptr;
    for (uint32_t i = 0; i < npoint_; ++i) drag_[i] = weight_[i] > 0 ? mass_[i] * (drag_[i] / weight_[i]) : 0;
    find_rows();
  }

  // Whether the points of the cells have a plastic strain, which cannot change: it is state.
  bool plastic() const { return !points_.empty(); }
  uint32_t points() const { return uint32_t(cells::points_of(kind_)); }
  size_t state_size() const { return plastic() ? points_.state() * ncell_ : 0; }
  bool lacks_state(const dfm_kin &k) const { return model::lacks_state(*this, of_.id, k); }
  const char *idle(uint32_t row) const {
    if (of_.row[1] >= 0 && row - uint32_t(of_.row[1]) - 1 < 3 && !(largest_of(kYield) > 0))
      return plastic::kIdle;
    return of_.row[2] >= 0 && row == uint32_t(of_.row[2]) + 3 && !fibers_ ? kNoAxis : nullptr;
  }

  void add_forces(const dfm_kin &k, double *f) {
    const double flow = flow_at(k);
    const bool parallel = ncell_ >= kParallelCells;
    in_pieces(host, parallel, ncell_, kGrain, [&](uint32_t begin, uint32_t end) {
      for (uint32_t c = begin; c < end; ++c) force_of(k, flow, c);
    });
    in_pieces(host, parallel, npoint_, kGrain, [&](uint32_t begin, uint32_t end) {
      for (uint32_t i = begin; i < end; ++i) sum_point(k, i, f);
    });
  }

  void bound(const dfm_kin &k, double *ksum, double *csum) const {
    const double flow = flow_at(k);
    for (uint32_t c = 0; c < ncell_; ++c) {
      const Node *const node = nodes_at(c);
      double more[kMaxNodes] = {}, grown = 1;
      if (of_.turns) growth(k, flow, c, grown, more);
      for (uint32_t a = 0; a < nodes_; ++a) {
        const uint32_t i = corner(c, a);
        ksum[i] += grown * node[a].row + more[a];
        csum[i] += at(kDampingStiffness, c) * grown * node[a].row;
      }
    }
    for (uint32_t i = 0; i < npoint_; ++i) csum[i] += drag_[i];
  }

  double energy(const dfm_kin &k) {
    const double flow = flow_at(k);
    double sum = 0;
    for (uint32_t c = 0; c < ncell_; ++c) {
      Moved m;
      sum += energy_of(k, flow, c, m);
      if (of_.turns) continue;
      double h[3][3];
      for (int i = 0; i < 9; ++i) h[i / 3][i % 3] = m.s[i] - (i % 4 == 0);
      range_.look(c, h);
    }
    range_.warn(host, of_.id);
    return sum;
  }
  void cell_energy(const dfm_kin &k, double *density) const {
    const double flow = flow_at(k);
    for (uint32_t c = 0; c < ncell_; ++c) {
      Moved m;
      density[c] = energy_of(k, flow, c, m) / cell_[c].volume;
    }
  }

  // The stress of the mean strain in the frame, turned into the axes of the world; where frames turn, (s -
  // [q]x) S / det S with the q that makes it symmetric.
  void cell_stress(const dfm_kin &k, double *stress) const {
    constexpr int kRow[6] = {0, 1, 2, 0, 1, 2}, kCol[6] = {0, 1, 2, 1, 2, 0};
    const double flow = flow_at(k);
    for (uint32_t c = 0; c < ncell_; ++c) {
      Moved m;
      move(k, c, m);
      const Along along(*this, c, fibers_);
      const Lame l = along.material.lame;
      const double trace = ((m.s[0] + m.s[4]) + m.s[8]) - 3;
      double twice[6], own[6], less[6] = {}, local[9], half[9];
      for (int n = 0; n < 6; ++n) {
        twice[n] = m.s[3 * kRow[n] + kCol[n]] + m.s[3 * kCol[n] + kRow[n]];
        own[n] = l.mu * twice[n] + (n < 3 ? l.lambda * trace - 2 * l.mu : 0);
      }
      if (along.material.fiber) {
        double d[6][6];
        elasticity_matrix(along.fiber, along.axis, d);
        for (int n = 0; n < 6; ++n) {
          own[n] = 0;
          for (int o = 0; o < 6; ++o) own[n] += d[n][o] * (o < 3 ? 0.5 * twice[o] - 1 : twice[o]);
        }
      }
      if (plastic()) points_.mean_stress(c, law_of(flow, c), state_of(k, c), m.u, less);
      for (int n = 0; n < 6; ++n)
        local[3 * kRow[n] + kCol[n]] = local[3 * kCol[n] + kRow[n]] = own[n] - less[n];
      if (of_.turns) {
        double both[9], axial[3], q[3], area[3], less_of[3];
        matrix_product(local, m.s, both);
        for (size_t n = 0; n < 3; ++n) {
          const size_t i = (n + 1) % 3, j = (n + 2) % 3;
          axial[n] = both[3 * j + i] - both[3 * i + j];
        }
        product(m.inverse, axial, q);
        for (size_t j = 0; j < 3; ++j) {
          cross(q, m.s + 3 * j, less_of);
          for (size_t i = 0; i < 3; ++i) both[3 * i + j] -= less_of[i];
        }
        cross(m.s + 3, m.s + 6, area);
        const double over = 1 / std::max(std::fabs(dot(m.s, area)), kMinVolume);
        for (int n = 0; n < 9; ++n) local[n] = 0.5 * over * (both[n] + both[3 * (n % 3) + n / 3]);
      }
      matrix_product(m.r, local, half);
      for (int n = 0; n < 6; ++n) {
        double sum = 0;
        for (int o = 0; o < 3; ++o) sum += half[3 * kRow[n] + o] * m.r[3 * kCol[n] + o];
        stress[6 * size_t(c) + size_t(n)] = sum;
      }
    }
  }

  uint32_t pairs() const {
    ready_pairs();
    return npoint_ + npair_;
  }
  void pattern(uint32_t *ij) const {
    for (uint32_t i = 0; i < npoint_; ++i) ij[2 * size_t(i)] = ij[2 * size_t(i) + 1] = i;
    ready_pairs();
    std::copy(pair_.data(), pair_.data() + 2 * size_t(npair_), ij + 2 * size_t(npoint_));
  }
  void add_stiffness(const dfm_kin &k, double a, double b, double *blk) const {
    ready_pairs();
    const double flow = flow_at(k);
    for (uint32_t c = 0; c < ncell_; ++c)
      if (const double by = a + b * at(kDampingStiffness, c); by != 0)
        add_tangent(k, flow, c, by, a / by, blk);
    for (uint32_t i = 0; i < npoint_; ++i)
      for (size_t n = 0; n < 9; n += 4) blk[9 * size_t(i) + n] -= b * drag_[i];
  }

  const dfm_host *host = nullptr;
  const char *active_effects[6] = {};  // of the present parameters, NULL-terminated

 private:
  static constexpr uint32_t kParallelCells = 500, kGrain = 64;
  // The volume, over that at rest, that a flatter cell counts as having in its Cauchy stress.
  static constexpr double kMinVolume = 1e-3;
  // Least sum of two stretches that turns a frame: nearer to a reflection the forces are no gradient.
  static constexpr double kMinStretch = 0.1;

  struct Cell {
    double volume;
    double g, excess;  // sum |G_a| w_a, g max(|G_a| / (w_a D_a))
  };
  struct Node {      // of a cell
    double rest[3];  // m, from the mean of the nodes
    double mean[3];  // 1/m, G
    double row;      // N/m, D_a of this cell
    double share;    // |G_a| g / w_a
  };
  // One at the positions of a call.
  struct Moved {
    double r[9], s[9], inverse[9];  // R, S, A^-1
    double d[kMaxNodes][3], u[kMaxNodes][3];
  };
  // The material of a cell; refuses constants along the axis without a positive energy.
  struct Along {
    CellMaterial material;
    Fiber fiber;
    double axis[3];
    Along(const CellBody &b, uint32_t c, bool fibers)
        : material{lame_of(b.at(kYoung, c), b.at(kPoisson, c))} {
      if (!fibers) return;
      fiber = fiber_of_cell(b.host, b.of_.id, c, b.at(kYoung, c), b.at(kPoisson, c), b.at(kYoungAlong, c),
                            b.at(kPoissonAlong, c), b.at(kShearAlong, c));
      const double *const a = b.field_[kAxis].empty() ? b.params_ + kAxis : &b.field_[kAxis][3 * size_t(c)];
      const double length = std::sqrt((a[0] * a[0] + a[1] * a[1]) + a[2] * a[2]);
      for (int n = 0; n < 3; ++n) axis[n] = a[n] / length;
      material = {{fiber.lambda, fiber.mu}, &fiber, axis};
    }
    Along(const Along &) = delete;
  };

  static bool refuse(const dfm_host *h, const Of &of, const char *key) {
    say(h, 3, of.id,
        "parameter %s is for first-order tetrahedra alone; leave it out, or give a mesh of those", key);
    return false;
  }
  double at(Param which, uint32_t c) const {
    return field_[which].empty() ? params_[which] : field_[which][c];
  }
  double largest_of(Param which) const { return model::largest_of(field_[which], params_[which], ncell_); }
  // Returns whether there are fibers.
  bool check_params() const {
    const bool fibers = largest_of(kYoungAlong) != kAuto || largest_of(kPoissonAlong) != kAuto ||
                        largest_of(kShearAlong) != kAuto;
    const char *const wrong = plastic() && fibers                    ? plastic::kNoFibers
                              : !plastic() && largest_of(kYield) > 0 ? plastic::kMadeWithout
                                                                     : nullptr;
    if (wrong) model::refuse(host, of_.id, "%s", wrong);
    for (uint32_t c = 0; fibers && c < ncell_; ++c) (void)Along(*this, c, true);
    return fibers;
  }
  double flow_at(const dfm_kin &k) const { return plastic() ? plastic::flow_in(params_[kCreep], k.dt) : 0; }
  CellPoints::Law law_of(double flow, uint32_t c) const {
    return {lame_of(at(kYoung, c), at(kPoisson, c)).mu, at(kYield, c), at(kHardening, c),
            at(kPlasticLimit, c), flow};
  }
  const double *state_of(const dfm_kin &k, uint32_t c) const { return k.state + points_.state() * c; }
  const Node *nodes_at(uint32_t c) const { return &node_[size_t(nodes_) * c]; }
  uint32_t corner(uint32_t c, uint32_t a) const { return cells_[size_t(nodes_) * c + a]; }

  // Places of each point in the list of nodes of all cells, ascending.
  void find_places() {
    const auto each = [&](const auto &use) {
      for (size_t k = 0; k < size_t(nodes_) * ncell_; ++k) use(cells_[k], uint32_t(k));
    };
    make_lists(host, npoint_, each, begin_, place_);
  }

  void make_cell(uint32_t c) {
    double x[3 * kMaxNodes], middle[3] = {};
    for (uint32_t a = 0; a < nodes_; ++a)
      for (uint32_t n = 0; n < 3; ++n) {
        x[3 * a + n] = rest_[3 * size_t(corner(c, a)) + n];
        middle[n] += x[3 * a + n] / nodes_;
      }
    RestCell made;
    const double *const inside = inside_.empty() ? nullptr : &inside_[size_t{cells::kInside} * c];
    if (!make_rest_cell(kind_, x, inside, Along(*this, c, fibers_).material, made, points_.of(c),
                        points_.inner_of(c)))
      throw kFlatCell;
    cell_[c].volume = made.volume;
    for (uint32_t a = 0; a < nodes_; ++a)
      for (uint32_t n = 0; n < 3; ++n) {
        node_[size_t(nodes_) * c + a].rest[n] = x[3 * a + n] - middle[n];
        node_[size_t(nodes_) * c + a].mean[n] = made.mean[a][n];
      }
    block_.set(c, made);
    for (size_t n = 0; n < block_.each(); ++n) norm_[block_.each() * c + n] = norm_of(block_.of(c) + 9 * n);
    for (uint32_t a = 0; a < nodes_; ++a) {
      drag_[corner(c, a)] += made.volume * at(kDampingMass, c);
      weight_[corner(c, a)] += made.volume;
    }
  }

  double row_of(uint32_t c, uint32_t a) const {
    const double *const norm = norm_.data() + block_.each() * c;
    double sum = 0;
    for (uint32_t b = 0; b < nodes_; ++b)
      sum += norm[block_.place(std::min(a, b), std::max(a, b))] * weight_[corner(c, b)];
    return sum;
  }

  void find_rows() {
    even_rows(npoint_, mass_.data(), weight_.data(), next_.data(), [&](double *out) {
      for (uint32_t c = 0; c < ncell_; ++c)
        for (uint32_t a = 0; a < nodes_; ++a) out[corner(c, a)] += row_of(c, a);
    });
    for (uint32_t c = 0; c < ncell_; ++c) {
      Cell &cell = cell_[c];
      Node *const node = &node_[size_t(nodes_) * c];
      double length[kMaxNodes], sum = 0;
      for (uint32_t a = 0; a < nodes_; ++a) {
        const double *g = node[a].mean;
        length[a] = std::sqrt((g[0] * g[0] + g[1] * g[1]) + g[2] * g[2]);
        sum += length[a] * weight_[corner(c, a)];
      }
      cell.g = sum;
      cell.excess = 0;
      for (uint32_t a = 0; a < nodes_; ++a) {
        const double w = weight_[corner(c, a)];
        node[a].row = row_of(c, a) / w;
        node[a].share = length[a] * sum / w;
        cell.excess = std::max(cell.excess, node[a].share / node[a].row);
      }
    }
  }

  // Frame and displacements of a cell.
  void move(const dfm_kin &k, uint32_t c, Moved &m) const {
    const Node *const node = nodes_at(c);
    double middle[3] = {}, from[kMaxNodes][3], f[9] = {};
    for (uint32_t a = 0; a < nodes_; ++a)
      for (uint32_t n = 0; n < 3; ++n) {
        from[a][n] = k.x[size_t(k.stride) * corner(c, a) + n];
        middle[n] += from[a][n];
      }
    for (double &x : middle) x /= nodes_;
    for (uint32_t a = 0; a < nodes_; ++a)
      for (uint32_t i = 0; i < 3; ++i) {
        from[a][i] -= middle[i];
        for (uint32_t j = 0; j < 3; ++j) f[3 * i + j] += from[a][i] * node[a].mean[j];
      }
    if (of_.turns) rotation::polar_of(f, m.r);
    else rotation::identity(m.r);
    for (uint32_t a = 0; a < nodes_; ++a)
      for (uint32_t i = 0; i < 3; ++i) {
        m.d[a][i] = (m.r[i] * from[a][0] + m.r[3 + i] * from[a][1]) + m.r[6 + i] * from[a][2];
        m.u[a][i] = m.d[a][i] - node[a].rest[i];
      }
    transposed_matrix_product(m.r, f, m.s);
    if (of_.turns) invert_turn(m);
  }

  // A^-1, no eigenvalue of A less than kMinStretch.
  static void invert_turn(Moved &m) {
    double a[3][3], far = 0;
    const double trace = (m.s[0] + m.s[4]) + m.s[8];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        a[i][j] = (i == j ? trace : 0) - 0.5 * (m.s[3 * i + j] + m.s[3 * j + i]);
        const double off = a[i][j] - (i == j ? 2 : 0);
        far += off * off;
      }
    if (far < 1) {  // no eigenvalue is less than 1
      invert(&a[0][0], m.inverse);
      return;
    }
    spectral_inverse(a, m.inverse, [](double x, double) { return std::max(x, kMinStretch); });
  }

  double energy_of(const dfm_kin &k, double flow, uint32_t c, Moved &m) const {
    double h[kMaxNodes][3];
    move(k, c, m);
    const double elastic = block_.energy(c, m.u, h);
    return plastic() ? elastic + points_.energy(c, law_of(flow, c), state_of(k, c), m.u) : elastic;
  }

  // The rate of u: R^T v less the turning of the frame.
  void rate(const dfm_kin &k, uint32_t c, const Moved &m, double (*out)[3]) const {
    double middle[3] = {}, axial[3] = {}, w[3], part[3];
    for (uint32_t a = 0; a < nodes_; ++a)
      for (uint32_t n = 0; n < 3; ++n) middle[n] += k.v[size_t(k.stride) * corner(c, a) + n] / nodes_;
    for (uint32_t a = 0; a < nodes_; ++a) {
      const double *const v = k.v + size_t(k.stride) * corner(c, a);
      const double from[3] = {v[0] - middle[0], v[1] - middle[1], v[2] - middle[2]};
      for (uint32_t i = 0; i < 3; ++i)
        out[a][i] = (m.r[i] * from[0] + m.r[3 + i] * from[1]) + m.r[6 + i] * from[2];
      cross(nodes_at(c)[a].mean, out[a], part);
      for (int n = 0; n < 3; ++n) axial[n] += part[n];
    }
    if (!of_.turns) return;
    product(m.inverse, axial, w);
    for (uint32_t a = 0; a < nodes_; ++a) {
      cross(w, m.d[a], part);
      for (int n = 0; n < 3; ++n) out[a][n] -= part[n];
    }
  }

  void force_of(const dfm_kin &k, double flow, uint32_t c) {
    Moved m;
    double h[kMaxNodes][3], tau[3] = {}, turn[3] = {}, part[3];
    move(k, c, m);
    double pull[kMaxNodes][3];
    std::copy_n(&m.u[0][0], 3 * nodes_, &pull[0][0]);
    if (const double damp = at(kDampingStiffness, c); damp > 0) {
      rate(k, c, m, h);
      for (uint32_t a = 0; a < nodes_; ++a)
        for (int n = 0; n < 3; ++n) pull[a][n] += damp * h[a][n];
    }
    block_.apply(block_.of(c), pull, h);
    if (plastic()) {
      double *const next = k.state_out ? k.state_out + points_.state() * c : nullptr;
      points_.relieve(c, law_of(flow, c), state_of(k, c), next, m.u, h);
    }
    for (uint32_t a = 0; of_.turns && a < nodes_; ++a) {
      cross(m.u[a], h[a], part);
      for (int n = 0; n < 3; ++n) tau[n] += part[n];
    }
    if (of_.turns) product(m.inverse, tau, turn);
    double *out = force_.data() + 3 * size_t(nodes_) * c;
    for (uint32_t a = 0; a < nodes_; ++a, out += 3) {
      cross(turn, nodes_at(c)[a].mean, part);
      for (int n = 0; n < 3; ++n) part[n] -= h[a][n];
      product(m.r, part, out);
    }
  }

  void sum_point(const dfm_kin &k, uint32_t i, double *f) const {
    const double *const v = k.v + size_t(k.stride) * i;
    double sum[3] = {-drag_[i] * v[0], -drag_[i] * v[1], -drag_[i] * v[2]};
    for (uint32_t n = begin_[i]; n < begin_[i + 1]; ++n)
      for (uint32_t j = 0; j < 3; ++j) sum[j] += force_[3 * size_t(place_[n]) + j];
    for (uint32_t j = 0; j < 3; ++j) f[size_t(k.stride) * i + j] += sum[j];
  }

  // grown: factor of the rows at rest; more: what comes on top by node.
  void growth(const dfm_kin &k, double flow, uint32_t c, double &grown, double (&more)[kMaxNodes]) const {
    Moved m;
    double h[kMaxNodes][3], pull[kMaxNodes], moment[9] = {}, rows = 0, all = 0, second = 0;
    move(k, c, m);
    block_.apply(block_.of(c), m.u, h);
    if (plastic()) points_.relieve(c, law_of(flow, c), state_of(k, c), nullptr, m.u, h);
    const Cell &cell = cell_[c];
    const Node *const node = nodes_at(c);
    const auto square = [](const double *x) { return (x[0] * x[0] + x[1] * x[1]) + x[2] * x[2]; };
    for (uint32_t a = 0; a < nodes_; ++a) {
      rows += node[a].row * square(m.u[a]);
      pull[a] = std::sqrt(square(h[a]));
      all += pull[a] * weight_[corner(c, a)];
      for (uint32_t n = 0; n < 9; ++n) moment[n] += h[a][n / 3] * m.d[a][n % 3];
    }
    for (const double x : moment) second += x * x;
    second = std::sqrt(second);
    const double alpha = norm_of(m.inverse), stretch = norm_of(m.s), root = std::sqrt(2.0);
    const double e = alpha * std::sqrt(rows * cell.excess);
    grown = (1 + e) * (1 + e);
    const double twist =
        alpha * all / cell.g + alpha * alpha * second * (1 + root * (1 + root + 2 * alpha * stretch));
    for (uint32_t a = 0; a < nodes_; ++a)
      more[a] = twist * node[a].share + alpha * cell.g * pull[a] / weight_[corner(c, a)];
  }

  // blk -= by R P^T K P R^T. With Z_a = sum K_ab [u_b]x, Y = sum [u_a]x^T Z_a, C_a = A^-1 [G_a]x:
  // P^T K P = K + Z C + (Z C)^T + C^T Y C. The flow softens K in the share `soft` of it.
  void add_tangent(const dfm_kin &k, double flow, uint32_t c, double by, double soft, double *blk) const {
    Moved m;
    move(k, c, m);
    const double *own = block_.of(c);
    double softened[9 * kMaxNodes * (kMaxNodes + 1) / 2];
    if (plastic() && soft > 0) {
      std::copy_n(own, 9 * block_.each(), softened);
      points_.soften(c, law_of(flow, c), state_of(k, c), m.u, soft, softened);
      own = softened;
    }
    double z[kMaxNodes][9], turn[kMaxNodes][9], y[9] = {};
    for (uint32_t n = 0; of_.turns && n < 3; ++n) {
      // columns: of [u]x it is u x e_n, of A^-1 [G]x it is A^-1 (G x e_n)
      double unit[3] = {}, column[kMaxNodes][3], result[kMaxNodes][3], part[3];
      unit[n] = 1;
      for (uint32_t a = 0; a < nodes_; ++a) cross(m.u[a], unit, column[a]);
      block_.apply(own, column, result);
      for (uint32_t a = 0; a < nodes_; ++a) {
        for (uint32_t i = 0; i < 3; ++i) z[a][3 * i + n] = result[a][i];
        cross(result[a], m.u[a], part);  // [u]x^T p = p x u
        for (uint32_t i = 0; i < 3; ++i) y[3 * i + n] += part[i];
        double g[3], t[3];
        cross(nodes_at(c)[a].mean, unit, g);
        product(m.inverse, g, t);
        for (uint32_t i = 0; i < 3; ++i) turn[a][3 * i + n] = t[i];
      }
    }
    for (uint32_t a = 0; a < nodes_; ++a)
      for (uint32_t b = a; b < nodes_; ++b, own += 9) {
        double sum[9], half[9] = {}, full[9] = {};
        std::copy(own, own + 9, sum);
        for (uint32_t i = 0; of_.turns && i < 3; ++i)
          for (uint32_t j = 0; j < 3; ++j)
            for (uint32_t n = 0; n < 3; ++n) {
              double yc = 0;
              for (uint32_t o = 0; o < 3; ++o) yc += y[3 * n + o] * turn[b][3 * o + j];
              sum[3 * i + j] +=
                  z[a][3 * i + n] * turn[b][3 * n + j] + turn[a][3 * n + i] * (z[b][3 * j + n] + yc);
            }
        for (uint32_t i = 0; i < 3; ++i)
          for (uint32_t j = 0; j < 3; ++j)
            for (uint32_t n = 0; n < 3; ++n) half[3 * i + j] += m.r[3 * i + n] * sum[3 * n + j];
        for (uint32_t i = 0; i < 3; ++i)
          for (uint32_t j = 0; j < 3; ++j)
            for (uint32_t n = 0; n < 3; ++n) full[3 * i + j] += half[3 * i + n] * m.r[3 * j + n];
        const uint32_t i = corner(c, a), j = corner(c, b);
        const size_t slot =
            a == b ? i : npoint_ + slot_[(block_.each() - nodes_) * c + block_.place(a, b) - (a + 1)];
        for (uint32_t n = 0; n < 9; ++n) blk[9 * slot + n] -= by * full[i > j ? 3 * (n % 3) + n / 3 : n];
      }
  }

  // Pairs i < j of points of a cell, ascending; made when an implicit step first asks.
  void ready_pairs() const {
    if (!pair_.empty()) return;
    Buffer<uint32_t> pair;
    npair_ = list_pairs(host, cells_.data(), ncell_, nodes_, pair);
    slot_.create(host, (block_.each() - nodes_) * ncell_);
    size_t at = 0;
    for (uint32_t c = 0; c < ncell_; ++c)
      for (uint32_t a = 0; a < nodes_; ++a)
        for (uint32_t b = a + 1; b < nodes_; ++b)
          slot_[at++] = find_edge(pair.data(), npair_, corner(c, a), corner(c, b));
    pair_.swap(pair);  // made
  }

  Of of_{};
  uint32_t kind_ = 0, nodes_ = 0, npoint_ = 0, ncell_ = 0;
  // What a model has no row for stays as it is here.
  double params_[kValueCount] = {0, 0, 0, 0, 0, 0, plastic::kAtOnce, 0, kAuto, kAuto, kAuto, 1, 1, 1};
  Buffer<double> field_[kParamCount];  // [ncell] values by cell in place of a parameter's; empty without
  Buffer<double> rest_, mass_;         // [npoint,3] m, [npoint] kg
  Buffer<double> inside_;              // [ncell,27] of a lattice, as dfm_mesh has it; else empty
  Buffer<uint32_t> cells_;             // [ncell,nodes]
  Buffer<Cell> cell_;                  // [ncell]
  Buffer<Node> node_;                  // [ncell,nodes]
  CellBlocks block_;
  bool fibers_ = false;
  CellPoints points_;               // empty without yield
  Buffer<double> norm_;             // [ncell] of each of its blocks, N/m
  Buffer<double> force_;            // [ncell,nodes,3] N
  Buffer<uint32_t> begin_, place_;  // [npoint + 1], [ncell * nodes]
  Buffer<double> drag_;             // [npoint] kg/s
  Buffer<double> weight_, next_;    // [npoint]
  SmallRange range_;
  mutable Buffer<uint32_t> pair_, slot_;  // [npair,2], [ncell, pairs of its nodes]
  mutable uint32_t npair_ = 0;
};

}  // namespace model
