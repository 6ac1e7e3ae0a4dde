// Rows between rigid things by Newton's method, where sweeps are slow: a box that lies on four corners has
// twelve impulses for its six motions, and sweeps hand them from one to the other for hundreds of rounds.
//
//   proximal  (Rockafellar 1976) each row yields a little, by (p - p_last) / rho with p_last of the last
//             round: that has one solution, and rounds converge to one of the stiff rows, by a factor of
//             1 / (1 + rho w), w the response to the impulses that matter. What does not move anything stays
//             as it was
//   Newton    in a round impulses are functions of the velocities, so the unknowns are the motions of the
//             things alone: six for each thing that moves, one for each jaw
//   islands   of things that rows connect are solved apart
#include <algorithm>
#include <cmath>

#include "contact/friction_kernel.h"
#include "dynamics/rigid/rigid_set.h"
#include "math/dense_lu.h"
#include "math/turn.h"
#include "step/tool_touch.h"

namespace dfm {
namespace {

// rho, in units of 1 / response of the row: at first, from one round to the next where rounds are slow, most
constexpr double kYields = 100, kStiffer = 10, kMostYields = 1e6;
constexpr uint32_t kMostRounds = 12;
constexpr uint32_t kMostNewton = 32;  // steps in a round
constexpr double kFaster = 0.5;       // of what a round changes, by the next one: else rho grows, or they end
constexpr double kSlowly = 0.9;       // the same, where a larger rho has failed
constexpr size_t kMostMotions = 100;  // of an island: the system is stored dense
constexpr double kBeside = 1e-7;      // of an argument, for slopes of friction
constexpr double kBeyond = 0.1;       // of what drives a step, that may be left or drive it back at its end
constexpr uint32_t kMostCuts = 12;    // to find that end

}  // namespace

// What moves: the group of a side as one rigid thing, and its jaw. Numbers among motions_; kNone: none.
std::array<uint32_t, 2> ToolTouch::movers_of(const Side &side) {
  std::array<uint32_t, 2> out = {kNone, kNone};
  Moved &m = sides_[side.tool];
  const auto find = [&](uint32_t group, uint32_t jaw) {
    for (uint32_t i = 0; i < motions_.size(); ++i)
      if (motions_[i].tool == side.tool && motions_[i].group == group && motions_[i].jaw == jaw) return i;
    Motion fresh{};
    fresh.tool = side.tool;
    fresh.group = group;
    fresh.jaw = jaw;
    fresh.size = jaw == kNone ? 6 : 1;
    if (jaw == kNone && m.jointed[group]) {
      find_basis(m, group);
      fresh.jointed = true;
      fresh.size = m.rank[group];
      fresh.part = side.part;
    } else if (jaw == kNone) {
      uint32_t first = side.part;
      while (m.set->place[first] != 0 || m.set->group[first] != group) first = first > 0 ? first - 1 : 0;
      fresh.center = load3(m.set->state[first].position);
      fresh.part = first;
    }
    islands_.of.push_back(static_cast<uint32_t>(motions_.size()));
    motions_.push_back(fresh);
    return islands_.of.back();
  };
  const uint32_t g = m.set ? m.set->group[side.part] : DFM_RIGID_STILL;
  if (m.responds && g != DFM_RIGID_STILL && m.first[g] != kNone) out[0] = find(g, kNone);
  for (uint32_t j = 0; j < m.jaws.size(); ++j)
    if (m.jaws[j].part == side.part) out[1] = find(g, j);
  return out;
}

// How the places of the rows move with what moves them.
void ToolTouch::list_motions() {
  motions_.clear();
  islands_.start(0);
  levers_.clear();
  lever_values_.clear();
  first_lever_.clear();
  for (const Row &row : rows_) {
    first_lever_.push_back(static_cast<uint32_t>(levers_.size()));
    uint32_t joined = kNone;
    for (const Side *side : {&row.a, &row.b}) {
      const std::array<uint32_t, 2> movers = movers_of(*side);
      const double sign = side == &row.a ? 1 : -1;
      for (const uint32_t mover : movers) {
        if (mover == kNone) continue;
        const Motion &own = motions_[mover];
        levers_.push_back({mover, side == &row.a, lever_values_.size()});
        lever_values_.resize(lever_values_.size() + 6 * own.size, 0.0);
        const Vec3 axes[3] = {row.normal, row.tangent[0], row.tangent[1]};
        for (size_t k = 0; k < 3; ++k) {
          double *const to = &lever_values_[levers_.back().values + k * own.size];
          if (own.jointed) {
            const Moved &m = sides_[side->tool];
            const double *const basis = basis_of(m, side->part);
            const Vec3 turn = cross(side->arm, axes[k]);
            for (size_t d = 0; d < own.size; ++d)
              for (int e = 0; e < 3; ++e)
                to[d] += sign * (axes[k][e] * basis[size_t(e) * m.wide[own.group] + d] +
                                 turn[e] * basis[(3 + size_t(e)) * m.wide[own.group] + d]);
          } else if (own.jaw == kNone) {
            store3(to, sign * axes[k]);
            store3(to + 3, sign * cross(center(*side) + side->arm - own.center, axes[k]));
          } else {
            const Moved::Jaw &jaw = sides_[side->tool].jaws[own.jaw];
            to[0] = sign * (dot(jaw.lever, axes[k]) + dot(jaw.axis, cross(side->arm, axes[k])));
          }
        }
        if (joined == kNone) joined = mover;
        islands_.join(joined, mover);
      }
    }
  }
  first_lever_.push_back(static_cast<uint32_t>(levers_.size()));
}

// N s along the tangents for these slips and this normal impulse, where the place yields by 1 / rho.
std::array<double, 2> ToolTouch::rub_at(uint32_t i, double yields, const double last[3], double normal,
                                        double u1, double u2) const {
  if (!(normal > 0)) return {0, 0};
  const auto [a, b] = friction_impulse(state_.view(), i, h_, yields, last[1], last[2], normal, u1, u2);
  return {a, b};
}

// An order of elimination that leaves zeros where they are: the motion that shares rows with the fewest
// others comes first, and those around it then share rows with each other.
void ToolTouch::order_motions(uint32_t island) {
  std::vector<uint32_t> &order = newton_.order;
  order.clear();
  for (uint32_t i = 0; i < motions_.size(); ++i)
    if (islands_.root(i) == island) {
      motions_[i].at = order.size();
      order.push_back(i);
    }
  const size_t n = order.size();
  std::vector<uint8_t> &joined = newton_.joined;
  joined.assign(n * n, 0);
  for (size_t r = 0; r + 1 < first_lever_.size(); ++r)
    for (uint32_t i = first_lever_[r]; i < first_lever_[r + 1]; ++i)
      for (uint32_t j = first_lever_[r]; j < first_lever_[r + 1]; ++j) {
        const uint32_t a = levers_[i].motion, b = levers_[j].motion;
        if (islands_.root(a) == island) joined[motions_[a].at * n + motions_[b].at] = 1;
      }
  for (size_t done = 0; done < n; ++done) {
    size_t best = done, fewest = n + 1;
    for (size_t i = done; i < n; ++i) {
      const uint8_t *const of = &joined[motions_[order[i]].at * n];
      size_t degree = 0;
      for (size_t j = done; j < n; ++j) degree += of[motions_[order[j]].at];
      if (degree >= fewest) continue;
      best = i;
      fewest = degree;
    }
    std::swap(order[done], order[best]);
    const uint8_t *const of = &joined[motions_[order[done]].at * n];
    for (size_t i = done + 1; i < n; ++i)
      for (size_t j = done + 1; j < n; ++j) {
        const size_t p = motions_[order[i]].at, q = motions_[order[j]].at;
        if (of[p] && of[q]) joined[p * n + q] = 1;
      }
  }
}

// Places of the island's motions among its unknowns x [n]: m/s and rad/s, by which impulses change them.
// False: it has none, or too many.
bool ToolTouch::number_unknowns(uint32_t island) {
  order_motions(island);
  if (newton_.order.size() > kMostMotions) return false;
  size_t n = 0;
  newton_.first.clear();
  for (const uint32_t i : newton_.order) {
    motions_[i].at = n;
    n += motions_[i].size;
    while (motions_[i].jointed && newton_.first.size() < n) newton_.first.push_back(newton_.first.size());
    newton_.first.resize(n, motions_[i].at);
  }
  if (n == 0) return false;
  newton_.n = n;
  newton_.mass.assign(6 * n, 0.0);
  newton_.x.assign(n, 0.0);
  newton_.left.resize(n);
  newton_.slopes.resize(3 * n);
  return true;
}

// M: of a free thing the inverse of its response, of a jaw one over what it gives. False: not invertible.
bool ToolTouch::set_masses(uint32_t island) {
  for (const Motion &m : motions_) {
    if (islands_.root(static_cast<uint32_t>(&m - motions_.data())) != island) continue;
    const Moved &side = sides_[m.tool];
    if (m.jaw != kNone) {
      newton_.mass[6 * m.at] = 1 / side.jaws[m.jaw].give;
      continue;
    }
    if (m.jointed) {
      for (size_t d = 0; d < m.size; ++d) newton_.mass[6 * (m.at + d)] = 1;
      continue;
    }
    const size_t wide = side.wide[m.group], at = side.first[m.group];
    for (size_t c = 0; c < 6; ++c) {
      double response[6 * lu_row(6)] = {}, column[6] = {};
      for (size_t r = 0; r < 6; ++r)
        for (size_t k = 0; k < 6; ++k) response[lu_row(6) * r + k] = side.response[at + r * wide + k];
      column[c] = 1;
      if (!solve_lu(6, response, column, newton_.live)) return false;
      for (size_t r = 0; r < 6; ++r) newton_.mass[6 * (m.at + r) + c] = column[r];
    }
  }
  return true;
}

// The island's rows: velocities without impulses, the impulses so far, and rho. Of smooth laws the tangent is
// that for 1 / rho in place of the response until the island is solved.
void ToolTouch::start_rows(uint32_t island) {
  newton_.rows.clear();
  for (uint32_t i = 0; i < rows_.size(); ++i) {
    if (first_lever_[i + 1] == first_lever_[i] || islands_.root(levers_[first_lever_[i]].motion) != island)
      continue;
    const Row &row = rows_[i];
    NewtonRow l{};
    l.row = i;
    const Vec3 all = speed(row), own = all - change_of(row);
    const double bent[3] = {row.lift, dot(row.tangent[0], row.bend), dot(row.tangent[1], row.bend)};
    const Vec3 axes[3] = {row.normal, row.tangent[0], row.tangent[1]};
    const double given[3] = {row.impulse, row.along[0], row.along[1]};
    for (size_t c = 0; c < 3; ++c) {
      l.arcs[c] =
          row.frees && (c == 0 || (norm2(row.a.arm - row.a.bone) == 0 && norm2(row.b.arm - row.b.bone) == 0));
      l.start[c] = dot(axes[c], own) + (l.arcs[c] ? 0.0 : bent[c]);
      l.last[c] = l.now[c] = given[c];
    }
    l.law = state_.linear[i];
    newton_.rows.push_back(l);
  }
}

// rho, in units of 1 / response of the rows.
void ToolTouch::set_rho(double yields) {
  for (NewtonRow &l : newton_.rows) {
    const Row &row = rows_[l.row];
    l.rho[0] = yields * row.inverse;
    l.rho[1] = l.rho[2] = row.response > 0 ? yields / row.response : 0;
    if (row.response > 0 && state_.form[l.row] == kSmoothLaw)
      linearize(state_, l.row, h_, row.response / yields);
  }
}

// u += J x at a row, J its levers.
void ToolTouch::add_motion(uint32_t row, const std::vector<double> &x, double u[3]) const {
  for (uint32_t j = first_lever_[row]; j < first_lever_[row + 1]; ++j) {
    const Motion &m = motions_[levers_[j].motion];
    for (size_t c = 0; c < 3; ++c)
      for (size_t d = 0; d < m.size; ++d) u[c] += by(levers_[j], c)[d] * x[m.at + d];
  }
}

// The spins of x, and how they turn.
void ToolTouch::turn_motions() {
  for (const uint32_t i : newton_.order) {
    Motion &m = motions_[i];
    if (m.jaw != kNone || m.jointed) continue;
    m.spin = load3(&sides_[m.tool].base[6 * size_t{m.part} + 3]) + load3(&newton_.x[m.at + 3]);
    m.turn = turned(Quat{}, h_ * m.spin);
  }
}

// u += what turning adds beyond the first order, at the spin of x; and its slopes, for the levers.
void ToolTouch::add_arc(const NewtonRow &l, double u[3], bool slopes) {
  if (!l.arcs[0]) return;
  const Row &row = rows_[l.row];
  const Vec3 axes[3] = {row.normal, row.tangent[0], row.tangent[1]};
  const auto add_side = [&](const Side &side, Lever *lever) {
    const double sign = &side == &row.a ? 1 : -1;
    const Motion *const m = lever ? &motions_[lever->motion] : nullptr;
    const Vec3 w = m ? spin_of(*m, side) : load3(&sides_[side.tool].base[6 * size_t{side.part} + 3]);
    const Vec3 more = m && !m->jointed ? bend(w, m->turn, side.bone) : bend(w, side.bone);
    for (size_t c = 0; c < 3; ++c)
      if (l.arcs[c]) u[c] += sign * dot(axes[c], more);
    if (!lever || !slopes) return;
    if (m->jointed)
      for (size_t c = 0; c < 3; ++c) std::fill_n(bent(*lever, c), m->size, 0.0);
    for (size_t d = 0; d < 3; ++d) {
      Vec3 unit;
      unit[int(d)] = 1;
      const Vec3 slope = bend_slope(w, side.bone, unit);
      for (size_t c = 0; c < 3; ++c) {
        if (!l.arcs[c]) continue;
        const double along = sign * dot(axes[c], slope);
        if (!m->jointed) {
          bent(*lever, c)[3 + d] = along;
          continue;
        }
        const Moved &of = sides_[side.tool];
        const double *const basis = basis_of(of, side.part) + (3 + d) * of.wide[m->group];
        for (size_t e = 0; e < m->size; ++e) bent(*lever, c)[e] += along * basis[e];
      }
    }
  };
  Lever *of[2] = {};
  for (uint32_t j = first_lever_[l.row]; j < first_lever_[l.row + 1]; ++j)
    of[levers_[j].of_a ? 0 : 1] = &levers_[j];
  add_side(row.a, of[0]);
  add_side(row.b, of[1]);
}

// left = sum of J^T p over the rows.
void ToolTouch::gather_impulses() {
  std::fill(newton_.left.begin(), newton_.left.end(), 0.0);
  for (const NewtonRow &l : newton_.rows)
    for (uint32_t j = first_lever_[l.row]; j < first_lever_[l.row + 1]; ++j) {
      const Motion &m = motions_[levers_[j].motion];
      for (size_t c = 0; c < 3; ++c)
        for (size_t d = 0; d < m.size; ++d) newton_.left[m.at + d] += by(levers_[j], c)[d] * l.now[c];
    }
}

// The impulses p(u) of a row that yields, at velocity u:
//   p_n = max(0, (p_n_last / rho + rate - u_n) / (1 / rho + soft)),   p_t by the law at u_t and p_n
// and their slopes -dp/du, those of friction by differences.
void ToolTouch::impulse_at(NewtonRow &l, const double u[3]) const {
  const Row &row = rows_[l.row];
  const double stiff = 1 / (1 / l.rho[0] + row.soft), gives = l.last[0] / l.rho[0] - u[0];
  l.now[0] = std::max(0.0, stiff * (gives + row.rate));
  if (row.opens > 0)
    l.now[0] = std::max({0.0, (gives + row.rate) / (1 / l.rho[0] + row.opens), gives * l.rho[0]});
  l.now[1] = l.now[2] = 0;
  if (!(l.now[0] > 0 && row.response > 0)) return;
  const std::array<double, 2> t = rub_at(l.row, 1 / l.rho[1], l.last, l.now[0], u[1], u[2]);
  l.now[1] = t[0];
  l.now[2] = t[1];
}

void ToolTouch::answer_at(NewtonRow &l, const double u[3], double slope[3][3]) const {
  const Row &row = rows_[l.row];
  impulse_at(l, u);
  if (!(l.now[0] > 0)) return;
  const bool open = row.opens * l.now[0] < row.rate;
  const double stiff = slope[0][0] = 1 / (1 / l.rho[0] + row.soft + (open ? row.opens : 0));
  if (!(row.response > 0)) return;
  const double yields = 1 / l.rho[1], t[2] = {l.now[1], l.now[2]};
  const auto at = [&](double normal, double u1, double u2) {
    return rub_at(l.row, yields, l.last, normal, u1, u2);
  };
  const double by = kBeside * (std::fabs(u[1]) + std::fabs(u[2]) + yields * l.now[0]);
  const double more = kBeside * l.now[0];
  const std::array<double, 2> d1 = at(l.now[0], u[1] + by, u[2]), d2 = at(l.now[0], u[1], u[2] + by),
                              dn = at(l.now[0] + more, u[1], u[2]);
  for (size_t c = 0; c < 2; ++c) {
    slope[c + 1][1] = (t[c] - d1[c]) / by;
    slope[c + 1][2] = (t[c] - d2[c]) / by;
    slope[c + 1][0] = (dn[c] - t[c]) / more * stiff;
  }
}

// system += J^T slope J
void ToolTouch::add_slopes(uint32_t row, const double slope[3][3]) {
  const uint32_t begin = first_lever_[row], end = first_lever_[row + 1];
  for (uint32_t j = begin; j < end; ++j)
    for (uint32_t i = begin; i < end; ++i) {
      const Motion &mj = motions_[levers_[j].motion], &mi = motions_[levers_[i].motion];
      if (mj.jointed || mi.jointed) {  // many unknowns: slope J first
        for (size_t f = 0; f < mi.size; ++f)
          for (size_t c = 0; c < 3; ++c) {
            double sum = 0;
            for (size_t e = 0; e < 3; ++e)
              sum += slope[c][e] * (by(levers_[i], e)[f] + bent(levers_[i], e)[f]);
            newton_.slopes[3 * f + c] = sum;
          }
        for (size_t d = 0; d < mj.size; ++d) {
          double *const to = &newton_.system[(mj.at + d) * lu_row(newton_.n) + mi.at];
          const double k[3] = {by(levers_[j], 0)[d], by(levers_[j], 1)[d], by(levers_[j], 2)[d]};
          for (size_t f = 0; f < mi.size; ++f) {
            const double *const at = &newton_.slopes[3 * f];
            to[f] += k[0] * at[0] + k[1] * at[1] + k[2] * at[2];
          }
        }
        continue;
      }
      for (size_t c = 0; c < 3; ++c)
        for (size_t e = 0; e < 3; ++e) {
          if (slope[c][e] == 0) continue;
          for (size_t d = 0; d < mj.size; ++d)
            for (size_t f = 0; f < mi.size; ++f)
              newton_.system[(mj.at + d) * lu_row(newton_.n) + mi.at + f] +=
                  by(levers_[j], c)[d] * slope[c][e] * (by(levers_[i], e)[f] + bent(levers_[i], e)[f]);
        }
    }
}

void ToolTouch::put_masses() {
  const size_t n = newton_.n, row = lu_row(n);
  newton_.system.assign(n * row, 0.0);
  for (size_t r = 0; r < n; ++r)
    for (size_t c = 0; newton_.first[r] + c < n && c < 6; ++c)
      if (newton_.mass[6 * r + c] != 0)
        newton_.system[r * row + newton_.first[r] + c] = newton_.mass[6 * r + c];
}

// way . (sum of J^T p(start + J x) - M x)
double ToolTouch::force_along(const std::vector<double> &way) {
  const size_t n = newton_.n;
  double sum = 0;
  turn_motions();
  for (NewtonRow &l : newton_.rows) {
    double u[3], v[3] = {};
    std::copy(l.start, l.start + 3, u);
    add_motion(l.row, newton_.x, u);
    add_arc(l, u, false);
    impulse_at(l, u);
    add_motion(l.row, way, v);
    for (size_t c = 0; c < 3; ++c) sum += v[c] * l.now[c];
  }
  for (size_t r = 0; r < n; ++r)
    for (size_t c = 0; newton_.first[r] + c < n && c < 6; ++c)
      sum -= way[r] * newton_.mass[6 * r + c] * newton_.x[newton_.first[r] + c];
  return sum;
}

// Where a whole step goes beyond the place at which what drives it along its way has come to nothing: as far
// as that place (Illinois method).
void ToolTouch::shorten(double at_start) {
  std::vector<double> &x = newton_.x, &way = newton_.left;
  const auto at = [&](double t) {
    for (size_t r = 0; r < newton_.n; ++r) x[r] = newton_.from[r] + t * way[r];
    return force_along(way);
  };
  double low = 0, high = 1, f_low = at_start, f_high = at(1);
  if (!(at_start > 0) || f_high >= -kBeyond * at_start) return;
  for (uint32_t k = 0; k < kMostCuts; ++k) {
    const double t = (low * f_high - high * f_low) / (f_high - f_low), f = at(t);
    if (std::fabs(f) <= kBeyond * at_start) return;
    if (f > 0) {
      low = t;
      f_low = f;
      f_high *= 0.5;
    } else {
      high = t;
      f_high = f;
      f_low *= 0.5;
    }
  }
}

// One step toward M x = sum of J^T p(start + J x): (M + sum of J^T slope J) dx = sum of J^T p - M x. Returns
// the largest change of a row's velocity, m/s; negative or not finite: no step.
double ToolTouch::newton_step() {
  const size_t n = newton_.n;
  std::vector<double> &x = newton_.x, &left = newton_.left;
  put_masses();
  turn_motions();
  for (NewtonRow &l : newton_.rows) {
    double u[3], slope[3][3] = {};
    std::copy(l.start, l.start + 3, u);
    add_motion(l.row, x, u);
    add_arc(l, u, true);
    answer_at(l, u, slope);
    if (l.now[0] > 0) add_slopes(l.row, slope);
  }
  gather_impulses();
  for (size_t r = 0; r < n; ++r)
    for (size_t c = 0; newton_.first[r] + c < n && c < 6; ++c)
      left[r] -= newton_.mass[6 * r + c] * x[newton_.first[r] + c];
  newton_.force = left;
  if (!solve_lu(n, newton_.system.data(), left.data(), newton_.live)) return -1;
  double most = 0;
  for (const NewtonRow &l : newton_.rows) {
    double u[3] = {};
    add_motion(l.row, left, u);
    most = std::max({most, std::fabs(u[0]), std::fabs(u[1]), std::fabs(u[2])});
  }
  newton_.from = x;
  double drive = 0;
  for (size_t r = 0; r < n; ++r) drive += newton_.force[r] * left[r];
  shorten(drive);
  return most;
}

// Ends a round: p_last = p. Returns by how much rows have yielded in it, m/s.
double ToolTouch::end_round() {
  double moved = 0;
  for (NewtonRow &l : newton_.rows)
    for (size_t c = 0; c < 3; ++c) {
      if (l.rho[c] > 0) moved = std::max(moved, std::fabs(l.now[c] - l.last[c]) / l.rho[c]);
      l.last[c] = l.now[c];
    }
  return moved;
}

// Newton steps until none changes a velocity by more than `done`.
bool ToolTouch::solve_round(double done) {
  for (uint32_t step = 0; step < kMostNewton; ++step) {
    const double most = newton_step();
    if (!(most >= 0 && std::isfinite(most))) return false;
    if (most <= done) return true;
  }
  return false;
}

// Rounds with a rho that grows where they are slow, as for stacks, and falls where one does not converge.
// False: none did; else impulses are those of the last one that did.
bool ToolTouch::solve_rounds(double done) {
  double before = HUGE_VAL, yields = std::max(kYields, newton_.yields);
  bool any = false, limited = false;
  for (uint32_t round = 0; round < kMostRounds; ++round) {
    set_rho(yields);
    newton_.good = newton_.x;
    if (!solve_round(done)) {
      newton_.x = newton_.good;
      limited = true;
      yields /= kStiffer;
      if (yields < kYields) break;
      continue;
    }
    any = true;
    const double moved = end_round();
    if (moved <= done) break;
    if (!(moved < kFaster * before)) {
      if (limited ? !(moved < kSlowly * before) : yields == kMostYields) break;
      if (!limited) yields *= kStiffer;
    }
    before = moved;
  }
  newton_.yields = std::max(kYields, yields / kStiffer);
  return any;
}

// One island. False: it did not converge, and impulses are as they were.
bool ToolTouch::newton(uint32_t island, double done) {
  if (!number_unknowns(island) || !set_masses(island)) return false;
  start_rows(island);
  // starts from the velocities that the impulses so far make
  gather_impulses();
  put_masses();
  newton_.x = newton_.left;
  bool works = solve_lu(newton_.n, newton_.system.data(), newton_.x.data(), newton_.live);
  works = works && solve_rounds(done);
  for (const NewtonRow &l : newton_.rows) {
    Row &row = rows_[l.row];
    state_.linear[l.row] = l.law;
    row.impulse = l.last[0];
    row.along[0] = l.last[1];
    row.along[1] = l.last[2];
  }
  motions_[island].solved = works;
  return works;
}

// Finds all impulses again, by Newton's method.
void ToolTouch::leap(double done) {
  list_motions();
  bool any = false;
  for (uint32_t i = 0; i < motions_.size(); ++i)
    if (islands_.root(i) == i) any |= newton(i, done);
  if (!any) return;
  push_all();
  for (uint32_t i = 0; i < rows_.size(); ++i)
    if (first_lever_[i + 1] > first_lever_[i] &&
        motions_[islands_.root(levers_[first_lever_[i]].motion)].solved)
      follow_arc(rows_[i]);
}

}  // namespace dfm
