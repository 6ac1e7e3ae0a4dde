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
#include "state/world.h"
#include "step/tool_touch.h"

namespace dfm {
namespace {

constexpr double kYields = 100;  // rho, in units of 1 / response of the row
constexpr uint32_t kMostRounds = 12;
constexpr uint32_t kMostNewton = 16;  // steps in a round
constexpr double kFaster = 0.5;       // of what a round changes, by the next one: else they end
constexpr size_t kMostMotions = 120;  // of an island: the system is dense
constexpr double kBeside = 1e-7;      // of an argument, for slopes of friction

// x = A^-1 x by elimination with pivots; A [n,n] is overwritten. False: singular.
bool solve_dense(size_t n, double *a, double *x) {
  for (size_t k = 0; k < n; ++k) {
    size_t best = k;
    for (size_t i = k + 1; i < n; ++i)
      if (std::fabs(a[i * n + k]) > std::fabs(a[best * n + k])) best = i;
    if (!(std::fabs(a[best * n + k]) > 0)) return false;
    if (best != k) {
      std::swap_ranges(a + k * n, a + (k + 1) * n, a + best * n);
      std::swap(x[k], x[best]);
    }
    for (size_t i = k + 1; i < n; ++i) {
      const double f = a[i * n + k] / a[k * n + k];
      if (f == 0) continue;
      for (size_t j = k + 1; j < n; ++j) a[i * n + j] -= f * a[k * n + j];
      x[i] -= f * x[k];
    }
  }
  for (size_t k = n; k-- > 0;) {
    for (size_t j = k + 1; j < n; ++j) x[k] -= a[k * n + j] * x[j];
    x[k] /= a[k * n + k];
  }
  return true;
}

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
    fresh.island = static_cast<uint32_t>(motions_.size());
    fresh.size = jaw == kNone ? 6 : 1;
    if (jaw == kNone) {
      uint32_t first = side.part;
      while (m.set->place[first] != 0 || m.set->group[first] != group) first = first > 0 ? first - 1 : 0;
      fresh.center = load3(m.set->state[first].position);
      fresh.part = first;
    }
    motions_.push_back(fresh);
    return fresh.island;
  };
  const uint32_t g = m.set ? m.set->group[side.part] : DFM_RIGID_STILL;
  if (m.responds && g != DFM_RIGID_STILL && m.first[g] != kNone) out[0] = find(g, kNone);
  for (uint32_t j = 0; j < m.jaws.size(); ++j)
    if (m.jaws[j].part == side.part) out[1] = find(g, j);
  return out;
}

uint32_t ToolTouch::island_of(uint32_t motion) {
  while (motions_[motion].island != motion) motion = motions_[motion].island;
  return motion;
}

// How the places of the rows move with what moves them.
void ToolTouch::list_motions() {
  motions_.clear();
  levers_.clear();
  first_lever_.clear();
  for (const Row &row : rows_) {
    first_lever_.push_back(static_cast<uint32_t>(levers_.size()));
    uint32_t joined = kNone;
    for (const Side *side : {&row.a, &row.b}) {
      const std::array<uint32_t, 2> movers = movers_of(*side);
      const double sign = side == &row.a ? 1 : -1;
      for (const uint32_t mover : movers) {
        if (mover == kNone) continue;
        Lever lever{mover, {}};
        const Motion &own = motions_[mover];
        const Vec3 axes[3] = {row.normal, row.tangent[0], row.tangent[1]};
        for (size_t k = 0; k < 3; ++k) {
          if (own.jaw == kNone) {
            store3(lever.by[k], sign * axes[k]);
            store3(lever.by[k] + 3, sign * cross(center(*side) + side->arm - own.center, axes[k]));
          } else {
            const Moved::Jaw &jaw = sides_[side->tool].jaws[own.jaw];
            lever.by[k][0] = sign * (dot(jaw.lever, axes[k]) + dot(jaw.axis, cross(side->arm, axes[k])));
          }
        }
        levers_.push_back(lever);
        const uint32_t root = island_of(mover);
        if (joined == kNone) joined = root;
        motions_[std::max(joined, root)].island = std::min(joined, root);
        joined = std::min(joined, root);
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

// Places of the island's motions among its unknowns x [n]: m/s and rad/s, by which impulses change them.
// False: it has none, or too many.
bool ToolTouch::number_unknowns(uint32_t island) {
  size_t n = 0;
  for (uint32_t i = 0; i < motions_.size(); ++i)
    if (island_of(i) == island) {
      motions_[i].at = n;
      n += motions_[i].size;
    }
  if (n == 0 || n > kMostMotions) return false;
  newton_.n = n;
  newton_.mass.assign(n * n, 0.0);
  newton_.system.resize(n * n);
  newton_.x.assign(n, 0.0);
  newton_.left.resize(n);
  return true;
}

// M: of a free thing the inverse of its response, of a jaw one over what it gives. False: not invertible.
bool ToolTouch::set_masses(uint32_t island) {
  const size_t n = newton_.n;
  for (const Motion &m : motions_) {
    if (island_of(static_cast<uint32_t>(&m - motions_.data())) != island) continue;
    const Moved &side = sides_[m.tool];
    if (m.jaw != kNone) {
      newton_.mass[m.at * n + m.at] = 1 / side.jaws[m.jaw].give;
      continue;
    }
    const size_t wide = side.wide[m.group], at = side.first[m.group];
    for (size_t c = 0; c < 6; ++c) {
      double response[36], column[6] = {};
      for (size_t r = 0; r < 6; ++r)
        for (size_t k = 0; k < 6; ++k) response[6 * r + k] = side.response[at + r * wide + k];
      column[c] = 1;
      if (!solve_dense(6, response, column)) return false;
      for (size_t r = 0; r < 6; ++r) newton_.mass[(m.at + r) * n + m.at + c] = column[r];
    }
  }
  return true;
}

// The island's rows: velocities without impulses, the impulses so far, and rho. Of smooth laws the tangent is
// that for 1 / rho in place of the response until the island is solved.
void ToolTouch::start_rows(uint32_t island) {
  newton_.rows.clear();
  for (uint32_t i = 0; i < rows_.size(); ++i) {
    if (first_lever_[i + 1] == first_lever_[i] || island_of(levers_[first_lever_[i]].motion) != island)
      continue;
    const Row &row = rows_[i];
    NewtonRow l{};
    l.row = i;
    const Vec3 all = speed(row), own = all - change_of(row);
    const double bent[3] = {row.lift, dot(row.tangent[0], row.bend), dot(row.tangent[1], row.bend)};
    const Vec3 axes[3] = {row.normal, row.tangent[0], row.tangent[1]};
    const double given[3] = {row.impulse, row.along[0], row.along[1]};
    for (size_t c = 0; c < 3; ++c) {
      l.start[c] = dot(axes[c], own) + bent[c];
      l.last[c] = l.now[c] = given[c];
    }
    l.rho[0] = kYields * row.inverse;
    l.rho[1] = l.rho[2] = row.response > 0 ? kYields / row.response : 0;
    l.law = state_.linear[i];
    if (row.response > 0 && state_.form[i] == kSmoothLaw) linearize(state_, i, h_, row.response / kYields);
    newton_.rows.push_back(l);
  }
}

// u += J x at a row, J its levers.
void ToolTouch::add_motion(uint32_t row, const std::vector<double> &x, double u[3]) const {
  for (uint32_t j = first_lever_[row]; j < first_lever_[row + 1]; ++j) {
    const Motion &m = motions_[levers_[j].motion];
    for (size_t c = 0; c < 3; ++c)
      for (size_t d = 0; d < m.size; ++d) u[c] += levers_[j].by[c][d] * x[m.at + d];
  }
}

// left = sum of J^T p over the rows.
void ToolTouch::gather_impulses() {
  std::fill(newton_.left.begin(), newton_.left.end(), 0.0);
  for (const NewtonRow &l : newton_.rows)
    for (uint32_t j = first_lever_[l.row]; j < first_lever_[l.row + 1]; ++j) {
      const Motion &m = motions_[levers_[j].motion];
      for (size_t c = 0; c < 3; ++c)
        for (size_t d = 0; d < m.size; ++d) newton_.left[m.at + d] += levers_[j].by[c][d] * l.now[c];
    }
}

// The impulses p(u) of a row that yields, at velocity u:
//   p_n = max(0, (p_n_last / rho + rate - u_n) / (1 / rho + soft)),   p_t by the law at u_t and p_n
// and their slopes -dp/du, those of friction by differences.
void ToolTouch::answer_at(NewtonRow &l, const double u[3], double slope[3][3]) const {
  const Row &row = rows_[l.row];
  const double stiff = 1 / (1 / l.rho[0] + row.soft);
  l.now[0] = std::max(0.0, stiff * (l.last[0] / l.rho[0] + row.rate - u[0]));
  if (l.now[0] > 0) slope[0][0] = stiff;
  l.now[1] = l.now[2] = 0;
  if (!(l.now[0] > 0 && row.response > 0)) return;
  const double yields = 1 / l.rho[1];
  const auto at = [&](double normal, double u1, double u2) {
    return rub_at(l.row, yields, l.last, normal, u1, u2);
  };
  const std::array<double, 2> t = at(l.now[0], u[1], u[2]);
  l.now[1] = t[0];
  l.now[2] = t[1];
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
      for (size_t c = 0; c < 3; ++c)
        for (size_t e = 0; e < 3; ++e) {
          if (slope[c][e] == 0) continue;
          for (size_t d = 0; d < mj.size; ++d)
            for (size_t f = 0; f < mi.size; ++f)
              newton_.system[(mj.at + d) * newton_.n + mi.at + f] +=
                  levers_[j].by[c][d] * slope[c][e] * levers_[i].by[e][f];
        }
    }
}

// One step toward M x = sum of J^T p(start + J x): (M + sum of J^T slope J) dx = sum of J^T p - M x. Returns
// the largest change of a row's velocity, m/s; negative or not finite: no step.
double ToolTouch::newton_step() {
  const size_t n = newton_.n;
  std::vector<double> &x = newton_.x, &left = newton_.left;
  newton_.system = newton_.mass;
  for (NewtonRow &l : newton_.rows) {
    double u[3], slope[3][3] = {};
    std::copy(l.start, l.start + 3, u);
    add_motion(l.row, x, u);
    answer_at(l, u, slope);
    add_slopes(l.row, slope);
  }
  gather_impulses();
  for (size_t r = 0; r < n; ++r)
    for (size_t c = 0; c < n; ++c) left[r] -= newton_.mass[r * n + c] * x[c];
  if (!solve_dense(n, newton_.system.data(), left.data())) return -1;
  double most = 0;
  for (const NewtonRow &l : newton_.rows) {
    double u[3] = {};
    add_motion(l.row, left, u);
    most = std::max({most, std::fabs(u[0]), std::fabs(u[1]), std::fabs(u[2])});
  }
  for (size_t r = 0; r < n; ++r) x[r] += left[r];
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

// One island. False: it did not converge, and impulses are as they were.
bool ToolTouch::newton(uint32_t island, double done) {
  if (!number_unknowns(island) || !set_masses(island)) return false;
  start_rows(island);
  // starts from the velocities that the impulses so far make
  gather_impulses();
  newton_.system = newton_.mass;
  newton_.x = newton_.left;
  bool works = solve_dense(newton_.n, newton_.system.data(), newton_.x.data());
  double before = HUGE_VAL;
  for (uint32_t round = 0; works && round < kMostRounds; ++round) {
    works = solve_round(done);
    const double moved = end_round();
    if (moved <= done || !(moved < kFaster * before)) break;
    before = moved;
  }
  for (const NewtonRow &l : newton_.rows) {
    Row &row = rows_[l.row];
    state_.linear[l.row] = l.law;
    if (!works) continue;
    row.impulse = l.now[0];
    row.along[0] = l.now[1];
    row.along[1] = l.now[2];
  }
  return works;
}

// All impulses anew, by Newton's method.
void ToolTouch::leap(double done) {
  list_motions();
  bool any = false;
  for (uint32_t i = 0; i < motions_.size(); ++i)
    if (island_of(i) == i) any |= newton(i, done);
  if (any) push_all();
}

}  // namespace dfm
