// The rows between rigid things as part of the contact problem of a sub-step: blocks of it are tools with
// their jaws and groups of bodies, known by their responses.
#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/rigid/rigid_set.h"
#include "state/world.h"
#include "step/context.h"
#include "step/rigid/rigid.h"
#include "step/rigid/tool_touch.h"

namespace dfm {
namespace {

constexpr double kFace = 1e5;    // N/m, of a place on the face of a jaw
constexpr double kOpenUpTo = 1;  // m/s: what a load could change that keeps a place from opening

}  // namespace

const ToolTouch::Moved *ToolTouch::known(const RigidSet &set) const {
  const auto at = std::find_if(sides_.begin(), sides_.end(), [&](const Moved &m) { return m.set == &set; });
  return at == sides_.end() ? nullptr : &*at;
}

RigidPlace ToolTouch::place_of(const Side &side) const {
  const Moved &m = sides_[side.tool];
  const uint32_t g = m.set && m.yields() ? m.set->group[side.part] : DFM_RIGID_STILL;
  if (g == DFM_RIGID_STILL || m.first[g] == kNone) return {kNone, 0, center(side)};
  return {m.set->first_group + g, m.set->place[side.part], center(side)};
}

void ToolTouch::begin_passes() {
  passes_ = 0;
  changed_ = HUGE_VAL;
}

std::span<const RigidSides> ToolTouch::sides() {
  begin_passes();
  places_.clear();
  for (const Row &row : rows_)
    places_.push_back(
        {place_of(row.a), place_of(row.b), center(row.a) + row.a.arm, row.normal, row.tangent[0]});
  return places_;
}

// What a jaw gives, at the first of its body's entries.
void ToolTouch::add_jaw(const Moved::Jaw &jaw, double *matrix, size_t wide) {
  double way[6];
  store3(way, jaw.lever);
  store3(way + 3, jaw.axis);
  for (size_t r = 0; r < 6; ++r)
    for (size_t c = 0; c < 6; ++c) matrix[r * wide + c] += jaw.softness * way[r] * way[c];
}

bool ToolTouch::fill_response(uint32_t group, double *matrix) const {
  for (const Moved &m : sides_) {
    if (!m.set) continue;
    const uint32_t g = group - m.set->first_group;
    if (group < m.set->first_group || g >= m.set->ngroup) continue;
    if (m.first[g] == kNone) return false;
    const size_t wide = m.wide[g];
    std::copy_n(&m.response[m.first[g]], wide * wide, matrix);
    for (const Moved::Jaw &jaw : m.jaws)
      add_jaw(jaw, matrix + 6 * size_t{m.set->place[jaw.part]} * (wide + 1), wide);
    return true;
  }
  return false;
}

std::span<const RigidMember> ToolTouch::members(const Views &views, uint32_t group) const {
  return {views.rigid_members.data() + views.rigid_first[group], views.rigid_groups[group]};
}

bool ToolTouch::free_velocity(const RigidSet &set, uint32_t body, double *out) const {
  const Moved *const m = known(set);
  if (!m || !m->yields()) return false;
  for (size_t k = 0; k < 6; ++k) out[k] = m->free[6 * size_t{body} + k] + m->turn[6 * size_t{body} + k];
  return true;
}

// [6] of the side's body where the unknowns of the problem are zero: what detection has used.
const double *ToolTouch::first_of(const Side &side) const {
  const Moved &m = sides_[side.tool];
  const size_t at = 6 * size_t{side.part};
  return m.set ? &m.set->first[at] : &m.free[at];
}

// What turning adds follows the spins of the solution, to first order about the present ones, where these are
// no larger than contact allows (follows_arcs). On rounded corners the place of contact stays behind the
// turn, so slips do not follow it.
void ToolTouch::set_arcs(const Row &row, ContactRows &to, uint32_t r) const {
  if (h_ * std::max(norm(spin(row.a)), norm(spin(row.b))) > kArc) return;
  const Vec3 axes[3] = {row.normal, row.tangent[0], row.tangent[1]};
  const bool round = norm2(row.a.arm - row.a.bone) > 0 || norm2(row.b.arm - row.b.bone) > 0;
  double *const drive = &to.drive[3 * size_t{r}];
  const auto set = [&](const Side &side, double sign, Array<double> &arcs) {
    double *const arc = &arcs[9 * size_t{r}];
    const Vec3 now = spin(side) - load3(first_of(side) + 3);  // of the unknowns
    const Vec3 unit[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const double change[3] = {now.x, now.y, now.z};
    for (size_t d = 0; d < 3; ++d) {
      const Vec3 slope = bend_slope(spin(side), side.bone, unit[d]);
      for (size_t c = 0; c < (round ? 1 : 3); ++c) {
        arc[3 * c + d] = dot(axes[c], slope);
        drive[c] += sign * arc[3 * c + d] * change[d];
      }
    }
  };
  set(row.a, 1, to.arc_a);
  set(row.b, -1, to.arc);
}

// How the two sides yield. Where nothing can move along the normal, wn is zero and the row has no impulse;
// where nothing can move across it, wt is.
void ToolTouch::set_responses(Row &row, ContactRows &to, uint32_t r) const {
  to.set_diagonal(r);
  double &wn = to.wn[r], &wt = to.wt[r];
  const bool held = !(wn > rounding_of(row, row.normal));
  row.soft = row.pair->jaw ? 1 / (h_ * h_ * kFace) : held ? softness_of_motor(row) : 0;
  wn = held ? row.soft : wn + row.soft;
  if (held || !(wt > rounding_of(row, row.tangent[0]))) wt = 0;
  const bool opens = row.pair->frees && !held && row.rate > 0;
  // of the rate of a place that opens, the load takes back a share
  store3(&to.compliance[3 * size_t{r}], {opens ? kOpens * offset_ * wn / (planned_ * kOpenUpTo) : row.soft,
                                         opens ? row.rate : std::numeric_limits<double>::max(), 0});
  if (!(wn > 0)) row.impulse = 0;
  if (!(wt > 0 && row.impulse > 0)) row.along[0] = row.along[1] = 0;
}

void ToolTouch::fill_row(Row &row, ContactRows &to, uint32_t r) const {
  const auto at = [&](const Side &side) { return velocity_at(first_of(side), side.arm); };
  const Vec3 without = at(row.a) - at(row.b);
  store3(&to.drive[3 * size_t{r}],
         {-(dot(row.normal, without) + row.lift), -dot(row.tangent[0], without + row.bend),
          -dot(row.tangent[1], without + row.bend)});
  if (row.pair->frees) set_arcs(row, to, r);
  set_responses(row, to, r);
  store3(&to.impulse[3 * size_t{r}], {row.impulse, row.along[0], row.along[1]});
  to.rate[r] = -row.rate;
}

void ToolTouch::put(ContactRows &to, ContactState &state) {
  if (rows_.empty()) return;
  if (std::any_of(rows_.begin(), rows_.end(), [](const Row &row) { return row.pair->frees; }))
    for (Array<double> *arc : {&to.arc, &to.arc_a}) arc->assign(9 * size_t{to.all()}, 0.0);
  for (uint32_t i = 0; i < rows_.size(); ++i) {
    const uint32_t r = to.soft() + i;
    fill_row(rows_[i], to, r);
    state.law[r] = state_.law[i];
    state.area[r] = state_.area[i];
    state.dwell[r] = state_.dwell[i];
    for (size_t s = 0; s < state.nstate; ++s)
      state.bristle[s * state.stride + r] = s < state_.nstate ? state_.bristle[s * state_.stride + i] : 0;
  }
}

void ToolTouch::take(const StepContext &step, double left) {
  left_ = left;
  for (uint32_t i = 0; i < rows_.size(); ++i) {
    const double *const l = &step.rows.impulse[3 * size_t{step.rows.soft() + i}];
    rows_[i].impulse = l[0];
    std::copy_n(l + 1, 2, rows_[i].along);
  }
  for (Moved &m : sides_)
    for (size_t i = 0; i < m.now.size(); ++i) m.now[i] = m.free[i] + m.turn[i];
  for (const ContactRows::Block &b : step.rows.blocks) {
    if (b.group == kNone) continue;
    uint32_t place = 0;
    for (const auto &[set, body] : members(step, b.group)) {
      Moved *const m = known(*set);
      const double *const y = &step.rows.y[4 * size_t{b.first + 2 * place++}];
      for (size_t k = 0; m && k < 6; ++k)
        m->now[6 * size_t{body} + k] = set->first[6 * size_t{body} + k] + y[k < 3 ? k : k + 1];
    }
  }
}

}  // namespace dfm
