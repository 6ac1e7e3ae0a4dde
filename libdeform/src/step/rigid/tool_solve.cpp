// The rows between rigid things as a contact problem: blocks of it are tools with their jaws and groups of
// bodies, known by their responses. It is solved as that of soft bodies, each island by itself: sweeps, then
// Newton's method (contact/solver.h, contact/newton.h).
#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/rigid/rigid_set.h"
#include "state/world.h"
#include "step/budget.h"
#include "step/context.h"
#include "step/rigid/tool_touch.h"
#include "step/solve/tolerance.h"

namespace dfm {
namespace {

constexpr double kRest = 0.01;       // of what contacts may be off by at rest: sweeps need not leave less
constexpr double kDisturbed = 1e-3;  // of what impulses so far leave: tolerance of a solve
constexpr NewtonSettings kNewton{.steps = 30};  // what these do not find, more do not

// What a solve asks of the laws of its rows.
class RigidLaws final : public SolveLaws {
 public:
  RigidLaws(World &w, StepContext &step, const ContactRows &rows, const RowsPart &part, ContactState &state,
            LawBatches &batches, const Tolerance &tolerance)
      : w_(w),
        step_(step),
        rows_(rows),
        part_(part),
        state_(state),
        batches_(batches),
        tolerance_(tolerance) {}
  bool answer(const double *response) override {
    // a law is asked where slip is known to a tenth of what may be left of it
    return !(bad = batches_.answer(step_.h, response, 0.1 * tolerance_.bond, 1e-3, state_));
  }
  bool slopes() override {
    if ((bad = batches_.slopes(step_.h, state_))) return false;
    if (batches_.differences()) linearize(rows_, part_, step_.h, state_);
    return true;
  }
  bool judge(Residual &residual) override {
    set_trial(rows_, part_, step_.h, rows_.wt.data(), state_);
    if (!answer(rows_.wt.data())) return false;
    if (batches_.smooth()) linearize(rows_, part_, step_.h, state_);
    residual = true_residual(rows_, part_, state_, step_.h, tolerance_);
    return true;
  }
  void spend(uint64_t) override { charge(w_, step_, 0); }
  bool goes_on() override { return !is_used_up(step_); }

  const LawInstance *bad = nullptr;

 private:
  World &w_;
  StepContext &step_;
  const ContactRows &rows_;
  const RowsPart &part_;
  ContactState &state_;
  LawBatches &batches_;
  const Tolerance &tolerance_;
};

}  // namespace

// A jaw of a tool that does not answer impulses moves alone.
RigidPlace ToolTouch::place_of(const Side &side) {
  const Moved &m = sides_[side.tool];
  if (!m.set) return {};
  const uint32_t g = m.set->group[side.part];
  const bool answers = m.responds && g != DFM_RIGID_STILL && m.first[g] != kNone;
  if (!answers && std::none_of(m.jaws.begin(), m.jaws.end(),
                               [&](const Moved::Jaw &jaw) { return jaw.part == side.part; }))
    return {kNone, 0, center(side)};
  const Group own{side.tool, answers ? g : kNone, answers ? kNone : side.part};
  const auto at = std::find(groups_.begin(), groups_.end(), own);
  const auto number = static_cast<uint32_t>(at - groups_.begin());
  if (at == groups_.end()) {
    groups_.push_back(own);
    group_size_.push_back(answers ? static_cast<uint32_t>(m.wide[g] / 6) : 1);
  }
  return {number, answers ? m.set->place[side.part] : 0, center(side)};
}

void ToolTouch::fill_response(const Group &of, double *matrix) const {
  const Moved &m = sides_[of.tool];
  const bool alone = of.group == kNone;
  const size_t wide = alone ? 6 : m.wide[of.group];
  if (alone) std::fill_n(matrix, wide * wide, 0.0);
  else std::copy_n(&m.response[m.first[of.group]], wide * wide, matrix);
  for (const Moved::Jaw &jaw : m.jaws) {
    if (alone ? jaw.part != of.jaw : m.set->group[jaw.part] != of.group) continue;
    const size_t at = alone ? 0 : 6 * size_t{m.set->place[jaw.part]};
    double way[6];
    store3(way, jaw.lever);
    store3(way + 3, jaw.axis);
    for (size_t r = 0; r < 6; ++r)
      for (size_t c = 0; c < 6; ++c) matrix[(at + r) * wide + at + c] += jaw.give * way[r] * way[c];
  }
}

// [6] of the side's body where the unknowns of the problem are zero: in one with soft bodies, what detection
// has used.
const double *ToolTouch::start_velocity(const Side &side, bool shared) const {
  const Moved &m = sides_[side.tool];
  const size_t at = 6 * size_t{side.part};
  return !shared ? &m.base[at] : m.set ? &m.set->first[at] : &m.free[at];
}

// What turning adds follows the spins of the solution, to first order about the present ones, where these are
// no larger than contact allows (follows_arcs). On rounded corners the place of contact stays behind the
// turn, so slips do not follow it.
void ToolTouch::set_arcs(const Row &row, ContactRows &to, uint32_t r, bool shared) const {
  if (h_ * std::max(norm(spin(row.a)), norm(spin(row.b))) > kArc) return;
  const Vec3 axes[3] = {row.normal, row.tangent[0], row.tangent[1]};
  const bool round = norm2(row.a.arm - row.a.bone) > 0 || norm2(row.b.arm - row.b.bone) > 0;
  double *const drive = &to.drive[3 * size_t{r}];
  const auto set = [&](const Side &side, double sign, Array<double> &arcs) {
    double *const arc = &arcs[9 * size_t{r}];
    const Vec3 now = spin(side) - load3(start_velocity(side, shared) + 3);  // of the unknowns
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

void ToolTouch::fill_row(const Row &row, ContactRows &to, uint32_t r, bool shared) const {
  const auto at = [&](const Side &side) {
    const double *const v = start_velocity(side, shared);
    return load3(v) + cross(load3(v + 3), side.arm);
  };
  const Vec3 without = at(row.a) - at(row.b);
  store3(&to.drive[3 * size_t{r}],
         {-(dot(row.normal, without) + row.lift), -dot(row.tangent[0], without + row.bend),
          -dot(row.tangent[1], without + row.bend)});
  if (row.frees) set_arcs(row, to, r, shared);
  store3(&to.impulse[3 * size_t{r}], {row.impulse, row.along[0], row.along[1]});
  to.rate[r] = -row.rate;
  to.wn[r] = 1 / row.inverse;
  to.wt[r] = row.response;
  for (size_t k = 0; k < 2; ++k) to.cross[2 * size_t{r} + k] = dot(row.tangent[k], row.pressed);
  const bool opens = row.opens > 0;
  store3(&to.yields[3 * size_t{r}],
         {opens ? row.opens : row.soft, opens ? row.rate : std::numeric_limits<double>::max(), 0});
}

void ToolTouch::build_rows() {
  places_.clear();
  groups_.clear();
  group_size_.clear();
  for (const Row &row : rows_)
    places_.push_back(
        {place_of(row.a), place_of(row.b), center(row.a) + row.a.arm, row.normal, row.tangent[0]});
  solved_.build({}, {}, {{}, group_size_}, {}, places_);
  solved_.y_free.assign(solved_.y.begin(), solved_.y.end());
  for (const ContactRows::Block &b : solved_.blocks)
    solved_.set_response(b, [&](double *matrix) { fill_response(groups_[b.group], matrix); });
  if (std::any_of(rows_.begin(), rows_.end(), [](const Row &row) { return row.frees; }))
    for (Array<double> *arc : {&solved_.arc, &solved_.arc_a}) arc->assign(9 * rows_.size(), 0.0);
  for (uint32_t i = 0; i < rows_.size(); ++i) fill_row(rows_[i], solved_, i, false);
}

// Groups that rows connect, and the rows of each.
void ToolTouch::find_islands() {
  islands_.start(static_cast<uint32_t>(groups_.size()));
  const auto group_of = [](const RigidSides &c) { return c.a.group != kNone ? c.a.group : c.b.group; };
  for (const RigidSides &c : places_)
    if (c.a.group != kNone && c.b.group != kNone) islands_.join(c.a.group, c.b.group);
  const uint32_t count = islands_.number();
  runs_.resize(count);
  blocks_.resize(count);
  for (uint32_t k = 0; k < count; ++k) {
    runs_[k].clear();
    blocks_[k].clear();
  }
  for (uint32_t b = 0; b < solved_.blocks.size(); ++b)
    blocks_[islands_.of[solved_.blocks[b].group]].push_back(b);
  for (uint32_t i = 0; i < places_.size(); ++i) {
    const uint32_t group = group_of(places_[i]);
    if (group == kNone) continue;  // a host that has failed to answer
    std::vector<RowRun> &runs = runs_[islands_.of[group]];
    if (!runs.empty() && runs.back().first + runs.back().n == i) ++runs.back().n;
    else runs.push_back({i, 1});
  }
}

// Sweeps first; where they leave too much, Newton's method goes on from there. The better result counts.
void ToolTouch::solve_island(World &w, StepContext &step, size_t island, double least) {
  RowsPart part{runs_[island], {}, blocks_[island]};
  for (const RowRun &run : runs_[island]) part.n += run.n;
  const double rest = kRest * tangent_at_rest(w, h_);
  const double at_rest = normal_at_rest(w, h_);
  Tolerance tolerance{at_rest, least, normal_tolerance_.data(), tolerance_.data()};
  batches_.gather(laws_, runs_[island], state_);
  RigidLaws laws(w, step, solved_, part, state_, batches_, tolerance);
  solved_.restore(part);
  Residual left;
  // slopes of an earlier sub-step are of no use for the residual of the start
  if (laws.judge(left) && laws.slopes() && (!batches_.differences() || laws.judge(left))) {
    tolerance.bond = std::max(least, kDisturbed * left.speed);
    tolerance.most_normal = std::min(tolerance.bond, kOff * offset_ / h_);
    each_row(part.contacts, [&](uint32_t i) {
      tolerance_[i] = tolerance.bond;
      normal_tolerance_[i] = tolerance.most_normal;
    });
    const SweepLimits limits{w.def.max_sweeps, w.def.max_passes, left.speed};
    bool found = sweeps_.solve(solved_, part, state_, laws, tolerance, limits, h_, left);
    swept_.assign(solved_.impulse.begin(), solved_.impulse.end());
    if (!found && !laws.bad && left.speed > rest && !is_used_up(step)) {
      if (island >= newtons_.size()) newtons_.resize(island + 1);
      auto &newton = newtons_[island];
      if (!newton) newton = std::make_unique<ContactNewton>(step.contact_memory, kNewton);
      newton->begin(solved_, part, {}, state_, laws, h_);
      found = newton->solve(tolerance.bond, at_rest) && newton->residual().speed < left.speed;
    }
    if (!found) {  // a law that fails on the way need not fail there
      solved_.impulse.assign(swept_.begin(), swept_.end());
      solved_.restore(part);
      laws.judge(left);
    }
    if (!found) left_ = std::max(left_, left.normal);
    each_row(part.contacts, [&](uint32_t i) {
      rows_[i].impulse = solved_.impulse[3 * size_t{i}];
      std::copy_n(&solved_.impulse[3 * size_t{i} + 1], 2, rows_[i].along);
    });
  }
  if (!laws.bad) return;
  const uint32_t i = batches_.failed();
  if (i == kNone) throw LawFailed{laws.bad, NAN, NAN};
  const double a = state_.vt[i], b = state_.vt[state_.stride + i];
  throw LawFailed{laws.bad, state_.fn[i], std::sqrt(a * a + b * b)};
}

// Finds all impulses, from the present ones. tolerance: m/s.
void ToolTouch::solve_rows(World &w, StepContext &step, double tolerance) {
  build_rows();
  find_islands();
  tolerance_.assign(rows_.size(), tolerance);
  normal_tolerance_.assign(rows_.size(), tolerance);
  for (size_t k = 0; k < runs_.size(); ++k) solve_island(w, step, k, tolerance);
  push_all();
}

}  // namespace dfm
