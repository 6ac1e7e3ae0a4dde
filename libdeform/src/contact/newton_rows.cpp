// The problem of contact/newton.h: its unknowns, its rows, their impulses and derivatives, its matrix.
#include <algorithm>
#include <cmath>

#include "body/phyxels.h"
#include "contact/newton.h"
#include "contact/row_law.h"
#include "contact/solve_settings.h"
#include "core/lists.h"

namespace dfm {
namespace {

// Points of implicit bodies, from which conjugate gradients cost less than a factor of a few Newton steps.
constexpr uint32_t kIterated = 1000;

}  // namespace

ContactNewton::ContactNewton(const Memory &m, Tasks *tasks) : factor_(m), levels_(m, tasks), gmres_(m) {
  use_memory(m, node_of_dof_, dof_of_node_, row_, entry_, node_, jac_, speed_jac_, bias_, mass_, v_, base_,
             g_, before_, direction_, rhs_, inverse_, u_, l_, lh_, best_v_, best_g_, best_l_, rho_, response_,
             slope_, frozen_, pairs_, begin_, by_lower_, number_, higher_, ij_, place_, blocks_, matrix_,
             places_, analysed_, best_slides_, r_, base_r_, r_velocities_, row_of_, begin_entry_,
             entry_by_node_, stiff_jac_);
  use_memory(m, motions_.g, motions_.s, motions_.touched, motions_.columns, motions_.left,
             motions_.first_column, motions_.column_count, motions_.first_value);
}

void ContactNewton::begin(ContactRows &rows, const RowsPart &part, std::span<ImplicitSystem *const> systems,
                          ContactState &state, SolveLaws &host, double h) {
  rows_ = &rows;
  part_ = part;
  state_ = &state;
  host_ = &host;
  h_ = h;
  converged_ = factored_ = shaped_ = false;
  passes_ = steps_ = products_ = factors_ = reported_ = 0;
  number_nodes(systems);
  list_rows();
  set_bias();
  for (Array<double> *a : {&g_, &direction_, &rhs_}) a->resize(size_t{3} * nodes_);
  base_.resize(v_.size());
  r_.resize(size_t{3} * first_single_);
  const size_t n = row_.size();
  u_.resize(3 * n);
  l_.resize(3 * n);
  lh_.resize(3 * n);
  slope_.resize(9 * n);
  frozen_.resize(n);
  for (size_t k = 0; k < n; ++k) std::copy_n(&rows.impulse[size_t{3} * row_[k].row], 3, &lh_[3 * k]);
  l_.assign(lh_.begin(), lh_.end());
  put_rows();
}

// Points of implicit bodies, single points, motions of blocks. v_ is where the solve starts.
void ContactNewton::number_nodes(std::span<ImplicitSystem *const> systems) {
  const ContactRows &rows = *rows_;
  bodies_.clear();
  dof_of_node_.clear();
  mass_.clear();
  node_of_dof_.resize(rows.ndof);
  nodes_ = 0;
  const auto each_dof = [&](auto &&f) {
    each_row(part_, [&](uint32_t i) {
      for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j) f(rows.dof[j]);
    });
  };
  const auto system_of = [&](uint32_t d) -> ImplicitSystem * {
    return rows.block[d] == kNone ? systems[rows.source[d]] : nullptr;
  };
  each_dof([&](uint32_t d) {
    node_of_dof_[d] = kNone;
    ImplicitSystem *const system = system_of(d);
    if (!system || std::any_of(bodies_.begin(), bodies_.end(), [&](auto &b) { return b.system == system; }))
      return;
    bodies_.push_back({system, rows.source[d], 0, system->pattern().n, 0});
  });
  std::sort(bodies_.begin(), bodies_.end(), [](auto &a, auto &b) { return a.source < b.source; });
  v_.clear();
  inverse_.clear();
  for (Body &b : bodies_) {
    b.first = nodes_;
    nodes_ += b.count;
    const double *const start = b.system->start(), *const diagonal = b.system->diagonal_inverse();
    v_.insert(v_.end(), start, start + size_t{kStride} * b.count);
    for (uint32_t k = 0; k < b.count; ++k)
      inverse_.insert(inverse_.end(), diagonal + kStride * k, diagonal + kStride * k + 3);
  }
  first_single_ = nodes_;
  dof_of_node_.assign(nodes_, kNone);
  mass_.assign(size_t{kStride} * nodes_, 0.0);
  each_dof([&](uint32_t d) {
    if (rows.block[d] != kNone || node_of_dof_[d] != kNone) return;
    if (systems[rows.source[d]]) {
      const auto b = std::find_if(bodies_.begin(), bodies_.end(),
                                  [&](auto &body) { return body.source == rows.source[d]; });
      node_of_dof_[d] = b->first + rows.point[d];
      return;
    }
    node_of_dof_[d] = nodes_++;
    dof_of_node_.push_back(d);
    for (size_t c = 0; c < kStride; ++c) {
      const double inverse = c < 3 ? rows.inverse_mass[size_t{kStride} * d + c] : 0;
      v_.push_back(c < 3 ? rows.y[size_t{kStride} * d + c] : 0);
      mass_.push_back(inverse > 0 ? 1 / inverse : 0);
      if (c < 3) inverse_.push_back(inverse);
    }
  });
  first_motion_ = nodes_;
  // blocks: their motions, from where the impulses of the start have brought them
  motions_.rank = 0;
  motions_.touched.clear();
  if (!part_.blocks.empty()) rows.motions(part_.blocks, motions_);
  nodes_ += (motions_.rank + 2) / 3;
  v_.resize(size_t{kStride} * nodes_, 0.0);
  mass_.resize(size_t{kStride} * nodes_, 0.0);
  inverse_.resize(size_t{3} * nodes_, 1.0);
  dof_of_node_.resize(nodes_, kNone);
  if (first_single_ >= kIterated) solver_ = &levels_;
  else solver_ = &factor_;
  // single points and motions have no place: a patch turns them about a wrong one, which costs iterations
  places_.assign(size_t{3} * nodes_, 0.0);
  for (const Body &b : bodies_)
    for (uint32_t k = 0; k < b.count; ++k)
      std::copy_n(b.system->places() + size_t{kStride} * k, 3, &places_[3 * size_t{b.first + k}]);
}

void ContactNewton::list_rows() {
  const ContactRows &rows = *rows_;
  row_.clear();
  entry_.assign(1, 0);
  node_.clear();
  jac_.clear();
  speed_jac_.clear();
  const bool turns = motions_.rank > 0 && !motions_.s.empty();
  const auto add = [&](uint32_t i, Kind kind) {
    row_.push_back({i, kind});
    const double *const f = &rows.frame[size_t{9} * i];
    for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j) {
      const uint32_t node = node_of_dof_[rows.dof[j]];
      if (node == kNone) continue;
      node_.push_back(node);
      for (size_t r = 0; r < 3; ++r)
        for (size_t c = 0; c < 3; ++c)
          jac_.push_back(inverse_[3 * size_t{node} + c] > 0 ? rows.weight[j] * f[3 * r + c] : 0);
      if (turns) speed_jac_.insert(speed_jac_.end(), jac_.end() - 9, jac_.end());
    }
    if (motions_.rank > 0) rows.motion_row(i, motions_);
    for (const uint32_t q : motions_.touched) {
      const double *const of = &motions_.g[size_t{9} * q];
      if (std::all_of(of, of + 9, [](double x) { return x == 0; })) continue;
      node_.push_back(first_motion_ + q);
      jac_.insert(jac_.end(), of, of + 9);
      if (turns)
        speed_jac_.insert(speed_jac_.end(), &motions_.s[size_t{9} * q], &motions_.s[size_t{9} * q] + 9);
    }
    entry_.push_back(static_cast<uint32_t>(node_.size()));
  };
  each_row(part_.contacts, [&](uint32_t i) { add(i, Kind::contact); });
  each_row(part_.bonds, [&](uint32_t i) { add(i, rows.bond[i - rows.n].drags() ? Kind::drag : Kind::bond); });
}

// Velocity of each row without what the nodes contribute: rows.y has those of blocks without impulses.
void ContactNewton::set_bias() {
  ContactRows &rows = *rows_;
  bias_.resize(3 * row_.size());
  each_row(part_, [&](uint32_t i) {
    for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j)
      if (rows.block[rows.dof[j]] == kNone) std::fill_n(&rows.y[size_t{kStride} * rows.dof[j]], 3, 0.0);
  });
  for (const uint32_t number : part_.blocks) {
    const size_t first = size_t{kStride} * rows.blocks[number].first;
    std::copy_n(&rows.y_free[first], size_t{kStride} * rows.blocks[number].count, &rows.y[first]);
  }
  for (size_t k = 0; k < row_.size(); ++k) {
    const uint32_t i = row_[k].row;
    Vec3 u = rows.velocity(i);
    const double *const f = &rows.frame[size_t{9} * i];
    for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j) {
      const uint32_t node = node_of_dof_[rows.dof[j]];
      if (node == kNone) continue;
      for (int c = 0; c < 3; ++c)  // a component that is held moves as prescribed
        if (inverse_[3 * size_t{node} + size_t(c)] == 0)
          u += (rows.weight[j] * v_[size_t{kStride} * node + size_t(c)]) * Vec3{f[c], f[3 + c], f[6 + c]};
    }
    store3(&bias_[3 * k], u);
    // motions of blocks as the start impulses have made them
    for (uint32_t e = entry_[k]; e < entry_[k + 1]; ++e) {
      if (node_[e] < first_motion_) continue;
      const Vec3 l = load3(&rows.impulse[size_t{3} * i]);
      add3(&v_[size_t{kStride} * node_[e]], from_frame(&jac_[size_t{9} * e], l));
    }
  }
}

void ContactNewton::set_penalties(double factor) {
  const ContactRows &rows = *rows_;
  stiff_ = factor;
  rho_.resize(2 * row_.size());
  response_.resize(rows.all());
  for (size_t k = 0; k < row_.size(); ++k) {
    // over what the nodes answer by themselves, which is stiffer than the bodies are
    const uint32_t i = row_[k].row;
    const double whole = rows.whole_response(i), wn = rows.wn[i] - whole, wt = rows.wt[i] - whole;
    rho_[2 * k] = wn > 0 ? factor / wn : 0;
    rho_[2 * k + 1] = wt > 0 ? factor / wt : 0;
    if (row_[k].kind == Kind::bond) {
      const double soft = rows.bond[i - rows.n].soft;
      const double most = std::max(wn, wt);
      rho_[2 * k] = (most > 0 ? factor / most : 0) + (soft > 0 ? factor / soft : 0);
      rho_[2 * k + 1] = rho_[2 * k];
    }
    if (row_[k].kind == Kind::drag) {
      const double w_along = rows.bond[i - rows.n].w;
      rho_[2 * k] = w_along > 0 ? factor / w_along : 0;
    }
    response_[i] = rho_[2 * k + 1] > 0 ? 1 / rho_[2 * k + 1] : 0;
  }
}

Vec3 ContactNewton::entry_times(uint32_t e, const double *x) const {
  return in_frame(&(speed_jac_.empty() ? jac_ : speed_jac_)[size_t{9} * e], load3(x));
}

Vec3 ContactNewton::times(uint32_t k, const double *x, size_t stride) const {
  Vec3 u;
  for (uint32_t e = entry_[k]; e < entry_[k + 1]; ++e) u += entry_times(e, x + stride * node_[e]);
  return u;
}

void ContactNewton::add_transposed(uint32_t k, Vec3 z, double *to) const {
  for (uint32_t e = entry_[k]; e < entry_[k + 1]; ++e)
    add3(to + size_t{3} * node_[e], from_frame(&jac_[size_t{9} * e], z));
}

void ContactNewton::evaluate_bond(uint32_t k) {
  const ContactRows::BondRow &b = rows_->bond[row_[k].row - rows_->n];
  const double rho = rho_[2 * size_t{k}];
  const Vec3 u = load3(&u_[3 * size_t{k}]), lh = load3(&lh_[3 * size_t{k}]);
  Vec3 l = lh;
  if (row_[k].kind == Kind::drag) {
    l = std::clamp(dot(b.along, lh) - rho * dot(b.along, u), 0.0, b.most) * b.along;
  } else if (rho > 0) {
    for (int c = 0; c < 3; ++c)
      if (b.inverse[c][c] != 0) l[c] = (lh[c] - rho * (u[c] + b.rate[c])) / (1 + rho * b.soft);
  }
  store3(&l_[3 * size_t{k}], l);
}

// r of the bodies at v: multipliers and limits change without v, and the forces of models are expensive.
bool ContactNewton::find_residual() {
  const auto end = v_.begin() + std::ptrdiff_t(kStride * size_t{first_single_});
  if (r_known_ && std::equal(v_.begin(), end, r_velocities_.begin())) return true;
  r_known_ = false;
  for (const Body &b : bodies_)
    if (!b.system->residual(&v_[size_t{kStride} * b.first], &r_[size_t{3} * b.first])) return false;
  r_velocities_.assign(v_.begin(), end);
  return r_known_ = true;
}

// N s, the friction impulse that would end the slip of a contact at the present velocities.
Pair ContactNewton::stop_of(uint32_t k) const {
  const size_t at = 3 * size_t{k};
  const double rho = rho_[2 * size_t{k} + 1];
  return {lh_[at + 1] - rho * u_[at + 1], lh_[at + 2] - rho * u_[at + 2]};
}

// The disc that a set-valued law had at the start of the pass, at the present normal impulse. A limit that
// falls with the slip is renewed by passes, as multipliers are: evaluated here, contacts would stick and slip
// in turns.
Disc ContactNewton::disc_at(uint32_t k) const {
  const Pair stop = stop_of(k);
  const double ln = l_[3 * size_t{k}];
  if (!(ln > 0)) return {};
  return disc_of(*state_, row_[k].row, h_, 1 / rho_[2 * size_t{k} + 1],
                 std::sqrt(stop.a * stop.a + stop.b * stop.b), ln);
}

void ContactNewton::find_slides() {
  for (uint32_t k = 0; k < row_.size(); ++k) {
    const uint32_t i = row_[k].row;
    if (row_[k].kind != Kind::contact || state_->form[i] != kSetValuedLaw) continue;
    const Pair stop = stop_of(k);
    const double radius = rho_[2 * size_t{k} + 1] > 0 ? disc_at(k).radius : 0;
    state_->slides[i] = radius > 0 && stop.a * stop.a + stop.b * stop.b > radius * radius;
  }
}

// g, u, l at v. frozen: with the limits of friction of freeze(). False: a model or a law cannot tell.
bool ContactNewton::evaluate(bool frozen) {
  ContactState &s = *state_;
  const size_t stride = s.stride;
  if (!find_residual()) return false;
  std::copy(r_.begin(), r_.end(), g_.begin());
  for (uint32_t k = first_single_; k < first_motion_; ++k)
    for (size_t c = 0; c < 3; ++c)
      g_[3 * size_t{k} + c] =
          mass_[size_t{kStride} * k + c] *
          (v_[size_t{kStride} * k + c] - rows_->y_free[size_t{kStride} * dof_of_node_[k] + c]);
  for (uint32_t k = first_motion_; k < nodes_; ++k)
    for (size_t c = 0; c < 3; ++c) g_[3 * size_t{k} + c] = v_[size_t{kStride} * k + c];
  bool laws = false;
  double finite = 0;  // NaN if a velocity is not: no law is asked there
  for (uint32_t k = 0; k < row_.size(); ++k) {
    const Vec3 u = times(k, v_.data(), kStride) + load3(&bias_[3 * size_t{k}]);
    store3(&u_[3 * size_t{k}], u);
    finite += 0.0 * (u.x + u.y + u.z);
    if (row_[k].kind != Kind::contact) {
      evaluate_bond(k);
      continue;
    }
    const uint32_t i = row_[k].row;
    const double rho = rho_[2 * size_t{k}], rho_t = rho_[2 * size_t{k} + 1];
    const double *const lh = &lh_[3 * size_t{k}];
    double *const l = &l_[3 * size_t{k}];
    std::copy_n(lh, 3, l);
    if (!(rho > 0)) continue;
    l[0] = normal_impulse(lh[0], u.x + rows_->rate[i], 1 / rho, &rows_->compliance[3 * size_t{i}]);
    l[1] = l[2] = 0;
    const Pair stop = stop_of(k);
    if (s.form[i] == kSetValuedLaw && rho_t > 0) {
      const Pair t = on_disc(stop.a, stop.b, frozen ? frozen_[k] : disc_at(k).radius);
      l[1] = t.a;
      l[2] = t.b;
    } else if (s.form[i] == kSmoothLaw) {
      s.fn[i] = (frozen ? frozen_[k] : l[0]) / h_;
      s.vt[i] = s.slip[i] = u.y;
      s.vt[stride + i] = s.slip[stride + i] = u.z;
      s.ft_stop[i] = stop.a / h_;
      s.ft_stop[stride + i] = stop.b / h_;
      laws = laws || s.fn[i] > 0;
    }
  }
  // a slip that is off by e is an impulse that is off by rho e
  const double slip = SolveSettings::of_start * goal_ / stiff_;
  if (finite != 0 || (laws && !host_->evaluate_local(response_.data(), slip))) return false;
  for (uint32_t k = 0; k < row_.size(); ++k) {
    double *const l = &l_[3 * size_t{k}];
    if (row_[k].kind == Kind::contact) {
      const uint32_t i = row_[k].row;
      const double rho_t = rho_[2 * size_t{k} + 1];
      if (rho_t > 0 && s.fn[i] > 0 && s.form[i] == kSmoothLaw) {
        l[1] = h_ * s.ft[i];
        l[2] = h_ * s.ft[stride + i];
      }
    }
    if (l[0] != 0 || l[1] != 0 || l[2] != 0) add_transposed(k, -load3(l), g_.data());
  }
  double sum = 0;  // NaN if any value is not finite
  for (const double value : g_) sum += 0.0 * value;
  return sum == 0;
}

// Limits of friction as they are at the present impulses.
void ContactNewton::freeze() {
  const ContactState &s = *state_;
  for (uint32_t k = 0; k < row_.size(); ++k) {
    const uint32_t i = row_[k].row;
    if (row_[k].kind != Kind::contact) continue;
    const double l = l_[3 * size_t{k}];
    frozen_[k] = s.form[i] == kSetValuedLaw && rho_[2 * size_t{k} + 1] > 0 ? disc_at(k).radius : l;
  }
}

// G = -dl/du of all rows at the last evaluate().
void ContactNewton::find_slopes(bool frozen) {
  ContactState &s = *state_;
  const size_t n = s.stride;
  std::fill(slope_.begin(), slope_.end(), 0.0);
  for (uint32_t k = 0; k < row_.size(); ++k) {
    const uint32_t i = row_[k].row;
    double *const G = &slope_[9 * size_t{k}];
    const double rho = rho_[2 * size_t{k}], rho_t = rho_[2 * size_t{k} + 1];
    const double *const l = &l_[3 * size_t{k}];
    if (!(rho > 0)) continue;
    if (row_[k].kind != Kind::contact) {
      const ContactRows::BondRow &b = rows_->bond[i - rows_->n];
      if (row_[k].kind == Kind::bond) {
        for (int c = 0; c < 3; ++c)
          if (b.inverse[c][c] != 0) G[4 * c] = rho / (1 + rho * b.soft);
      } else {
        const double free =
            dot(b.along, load3(&lh_[3 * size_t{k}])) - rho * dot(b.along, load3(&u_[3 * size_t{k}]));
        if (!(free > 0 && free < b.most)) continue;
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3; ++c) G[3 * r + c] = rho * b.along[r] * b.along[c];
      }
      continue;
    }
    double normal = 0;
    if (l[0] > 0) {
      const double *const compliance = &rows_->compliance[3 * size_t{i}];
      const double gives = compliance[0] * (l[0] - compliance[2]);
      normal = gives > 0 && gives < compliance[1] ? 1 / (1 / rho + compliance[0]) : rho;
      G[0] = normal;
    }
    if (!(rho_t > 0)) continue;
    if (s.form[i] == kSmoothLaw && s.fn[i] > 0) {
      const auto [d, m11, m12, m21, m22, det] = linear_law(s, i, h_ / rho_t);
      // X = (I - D/rho)^-1; G_tt = -X D, G_tn = X (dft/dfn) G_nn
      const double x11 = m22 / det, x12 = -m12 / det, x21 = -m21 / det, x22 = m11 / det;
      G[4] = -h_ * (x11 * d.a + x12 * d.c);
      G[5] = -h_ * (x11 * d.b + x12 * d.d);
      G[7] = -h_ * (x21 * d.a + x22 * d.c);
      G[8] = -h_ * (x21 * d.b + x22 * d.d);
      if (!frozen) {
        G[3] = normal * (x11 * s.dft_dfn[i] + x12 * s.dft_dfn[n + i]);
        G[6] = normal * (x21 * s.dft_dfn[i] + x22 * s.dft_dfn[n + i]);
      }
    } else if (s.form[i] == kSetValuedLaw) {
      const Disc disc = frozen ? Disc{frozen_[k], 0, 0} : disc_at(k);
      if (!(disc.radius > 0)) continue;
      const auto [a, b] = stop_of(k);
      const double all = std::sqrt(a * a + b * b);
      if (all <= disc.radius) {
        G[4] = G[8] = rho_t;
        continue;
      }
      const double t1 = a / all, t2 = b / all, across = rho_t * disc.radius / all;
      G[4] = across * t2 * t2 + disc.along * t1 * t1;
      G[5] = G[7] = (disc.along - across) * t1 * t2;
      G[8] = across * t1 * t1 + disc.along * t2 * t2;
      G[3] = disc.grows * normal * t1;
      G[6] = disc.grows * normal * t2;
    }
  }
}

// The part of G that is symmetric and has no negative eigenvalue.
void ContactNewton::symmetric_part(const double *G, double *out) {
  std::fill_n(out, 9, 0.0);
  out[0] = G[0];
  if (G[1] != 0 || G[2] != 0) {  // of a bond
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) out[3 * r + c] = 0.5 * (G[3 * r + c] + G[3 * c + r]);
    return;
  }
  const double a = G[4], c = G[8], b = 0.5 * (G[5] + G[7]);
  const double mean = 0.5 * (a + c), dev = 0.5 * (a - c), spread = std::sqrt(dev * dev + b * b);
  const double top = mean + spread, bottom = mean - spread;
  if (bottom >= 0) {
    out[4] = a;
    out[5] = out[7] = b;
    out[8] = c;
  } else if (top > 0) {  // top p p', p p' = (S - bottom I)/(top - bottom)
    const double scale = top / (top - bottom);
    out[4] = scale * (a - bottom);
    out[5] = out[7] = scale * b;
    out[8] = scale * (c - bottom);
  }
}

// The pattern of A + J' G J, which holds until begin(): blocks of the bodies, the diagonal, pairs of nodes of
// each row. Pairs of nodes are ordered by the lower one, then the higher ones of each.
void ContactNewton::shape() {
  pairs_.clear();
  const auto add = [&](uint32_t i, uint32_t j) {
    pairs_.insert(pairs_.end(), {std::min(i, j), std::max(i, j)});
  };
  for (Body &b : bodies_) {
    const BlockPattern p = b.system->pattern();
    b.pattern = pairs_.size() / 2;
    for (uint32_t k = 0; k < p.nb; ++k) add(b.first + p.ij[2 * size_t{k}], b.first + p.ij[2 * size_t{k} + 1]);
  }
  const size_t n = pairs_.size() / 2;
  list_by(nodes_, n, [&](size_t p) { return pairs_[2 * p]; }, begin_, by_lower_);
  row_of_.resize(node_.size());
  for (uint32_t k = 0; k < row_.size(); ++k)
    std::fill(row_of_.begin() + entry_[k], row_of_.begin() + entry_[k + 1], k);
  list_by(nodes_, node_.size(), [&](size_t e) { return node_[e]; }, begin_entry_, entry_by_node_);
  ij_.clear();
  place_.resize(n + nodes_);
  number_.assign(nodes_, kNone);
  for (uint32_t i = 0; i < nodes_; ++i) {
    higher_.assign(1, i);
    number_[i] = i;
    const auto meet = [&](uint32_t j) {
      if (j < i || number_[j] == i) return;
      number_[j] = i;
      higher_.push_back(j);
    };
    for (uint32_t p = begin_[i]; p < begin_[i + 1]; ++p) meet(pairs_[2 * size_t{by_lower_[p]} + 1]);
    each_neighbor(i, [](uint32_t) { return true; }, [&](uint32_t, uint32_t e) { meet(node_[e]); });
    std::sort(higher_.begin(), higher_.end());
    for (const uint32_t j : higher_) {
      number_[j] = uint32_t(ij_.size() / 2);
      ij_.insert(ij_.end(), {i, j});
    }
    for (uint32_t p = begin_[i]; p < begin_[i + 1]; ++p)
      place_[by_lower_[p]] = number_[pairs_[2 * size_t{by_lower_[p]} + 1]];
    place_[n + i] = number_[i];
    for (const uint32_t j : higher_) number_[j] = kNone;
  }
  pattern_ = {nodes_, static_cast<uint32_t>(ij_.size() / 2), ij_.data()};
  body_blocks_ = {place_.data(), n};
  diagonal_ = {place_.data() + n, nodes_};
  blocks_.resize(size_t{9} * pattern_.nb);
  matrix_.assign(size_t{9} * pattern_.nb, 0.0);
  shaped_ = true;
}

// A at the present state, and the inverse of its diagonal.
bool ContactNewton::set_matrix() {
  if (!shaped_) shape();
  for (const uint32_t b : body_blocks_) std::fill_n(&matrix_[9 * size_t{b}], 9, 0.0);
  for (const Body &b : bodies_)
    if (!b.system->matrix(&body_blocks_[b.pattern], matrix_.data())) return false;
  for (uint32_t k = first_single_; k < nodes_; ++k)
    for (size_t c = 0; c < 3; ++c) {
      const double mass = mass_[size_t{kStride} * k + c];
      matrix_[9 * size_t{diagonal_[k]} + 4 * c] = k < first_motion_ && mass > 0 ? mass : 1;
    }
  for (uint32_t k = 0; k < first_single_; ++k)
    for (size_t c = 0; c < 3; ++c) {
      double &inverse = inverse_[3 * size_t{k} + c];
      if (inverse > 0) inverse = 1 / matrix_[9 * size_t{diagonal_[k]} + 4 * c];
    }
  return true;
}

bool ContactNewton::refactor() {
  std::copy(matrix_.begin(), matrix_.end(), blocks_.begin());
  stiff_jac_.resize(jac_.size());  // S J; zero where the row is open
  for (size_t k = 0; k < row_.size(); ++k) {
    double s[9];
    symmetric_part(&slope_[9 * k], s);
    for (size_t a = size_t{9} * entry_[k]; a < size_t{9} * entry_[k + 1]; a += 9)
      for (size_t r = 0; r < 9; r += 3)
        for (size_t c = 0; c < 3; ++c)
          stiff_jac_[a + r + c] =
              s[r] * jac_[a + c] + s[r + 1] * jac_[a + 3 + c] + s[r + 2] * jac_[a + 6 + c];
  }
  for (uint32_t i = 0, block = 0; i < nodes_; ++i) {
    for (; block < pattern_.nb && ij_[2 * size_t{block}] == i; ++block)
      number_[ij_[2 * size_t{block} + 1]] = block;
    const auto closed = [&](uint32_t k) { return !is_open(k); };  // few are
    each_neighbor(i, closed, [&](uint32_t own, uint32_t e) {
      if (node_[e] < i) return;
      // J_own' S J_e, by the product S J of the earlier of the two in their row
      const uint32_t a = std::min(own, e), b = std::max(own, e);
      const double *const sa = &stiff_jac_[size_t{9} * a], *const jb = &jac_[size_t{9} * b];
      double *const to = &blocks_[9 * size_t{number_[node_[e]]}];
      for (size_t r = 0; r < 3; ++r)
        for (size_t c = 0; c < 3; ++c)
          to[own > e ? 3 * r + c : 3 * c + r] +=
              jb[r] * sa[c] + jb[3 + r] * sa[3 + c] + jb[6 + r] * sa[6 + c];
    });
  }
  if (!factored_ && solver_ == &levels_) {
    levels_.analyse(pattern_);
  } else if (!factored_ && analysed_ != ij_) {
    analysed_.clear();
    factor_.analyse(pattern_);
    analysed_.assign(ij_.begin(), ij_.end());
  }
  solver_->place(places_.data(), 3);
  ++factors_;
  return factored_ = solver_->factor(blocks_.data());
}

}  // namespace dfm
