// Friction of tools: the laws of their pairs, and what lasts from one sub-step to the next.
//
//   start    impulses of the same keys, times h / h_old, or none, and the state of the law; turned with the
//            normal
//   solve    with the contacts of soft bodies (tool_rows.cpp)
//   end      the state that a law has given at the solution lasts, with the impulses
//
// A place where two rigid things meet has no area. Laws that use the area get one square centimeter.
#include <algorithm>
#include <cmath>

#include "core/hash.h"
#include "dynamics/rigid/rigid_set.h"
#include "state/world.h"
#include "step/context.h"
#include "step/rigid/tool_touch.h"

namespace dfm {
namespace {

constexpr double kArea = 1e-4;  // m2

}  // namespace

uint64_t ToolTouch::key_of(const std::array<uint64_t, 2> &pair, Name name) {
  Hash h;
  for (const uint64_t id : pair) h.add(id);
  for (const uint32_t x : {uint32_t{name.kind}, name.first, name.second}) h.add(x);
  return h.value;
}

// Sets the frames of the rows and their initial impulses, and adds these to the velocities.
void ToolTouch::take_last(const WorldState &state, const Derived &derived, const Views &views) {
  const uint32_t n = static_cast<uint32_t>(rows_.size());
  uint32_t nstate = 0;
  for (const Row &row : rows_) nstate = std::max(nstate, derived.pairs.laws[row.pair->law]->nstate);
  state_.resize(n, nstate);
  points_.assign(n, {});
  tangents_.resize(3 * size_t{n});
  match_.resize(n);
  for (uint32_t i = 0; i < n; ++i) {
    points_[i].key = rows_[i].key;
    store3(points_[i].normal, rows_[i].normal);
    state_.law[i] = rows_[i].pair->law;
    state_.area[i] = kArea;
  }
  warm_start(state.tool_store, points_, h_, start_, state_, tangents_.data(), match_.data());
  for (uint32_t i = 0; i < n; ++i) {
    Row &row = rows_[i];
    row.tangent[0] = load3(&tangents_[3 * size_t{i}]);
    row.tangent[1] = cross(row.normal, row.tangent[0]);
    row.impulse = start_[3 * size_t{i}];
    std::copy_n(&start_[3 * size_t{i} + 1], 2, row.along);
    for (const Side *side : {&row.a, &row.b}) {
      Moved &m = sides_[side->tool];
      m.touched = true;
      m.reach[side->part] = std::max(m.reach[side->part], norm(side->arm));
    }
  }
  add_rows_to_velocities(views);
  drop_bad_starts(views);
  for (Row &row : rows_) follow_arc(row);
}

// `now` is that without soft bodies.
void ToolTouch::add_rows_to_velocities(const Views &views) {
  for (Moved &m : sides_) {
    for (size_t k = 0; k < m.now.size(); ++k) m.now[k] = m.free[k] + m.turn[k];
    if (m.set) std::fill(m.set->impulse.begin(), m.set->impulse.end(), 0.0);
  }
  add_impulses();
  for (Moved &m : sides_) {
    for (const Moved::Jaw &jaw : m.jaws) {
      const double rate = rate_of(m, jaw);
      add3(&m.now[6 * size_t{jaw.part}], rate * jaw.lever);
      add3(&m.now[6 * size_t{jaw.part} + 3], rate * jaw.axis);
    }
    for (uint32_t g = 0; m.responds && g < m.set->ngroup; ++g) {
      if (m.first[g] == kNone) continue;
      const auto bodies = members(views, m.set->first_group + g);
      for (size_t r = 0; r < m.wide[g]; ++r)
        for (size_t c = 0; c < m.wide[g]; ++c)
          m.now[6 * size_t{bodies[r / 6].body} + r % 6] +=
              m.response[m.first[g] + r * m.wide[g] + c] *
              m.set->impulse[6 * size_t{bodies[c / 6].body} + c % 6];
    }
  }
}

// The number among the groups of all sides; kNone: nothing moves it.
uint32_t ToolTouch::group_of(const Side &side) const {
  const Moved &m = sides_[side.tool];
  const uint32_t g = m.set ? m.set->group[side.part] : DFM_RIGID_STILL;
  return g == DFM_RIGID_STILL ? kNone : first_group_[side.tool] + g;
}

uint32_t ToolTouch::island_of(const Row &row) const {
  const uint32_t a = group_of(row.a), g = a != kNone ? a : group_of(row.b);
  return g != kNone ? islands_.of[g] : kNone;
}

// Impulses of rows that contradict each other may be large while what they do cancels, and an impact repeats
// itself in no later sub-step. Where impulses make the places of connected groups faster than none would,
// none are the start.
void ToolTouch::drop_bad_starts(const Views &views) {
  std::vector<uint32_t> &first = first_group_;
  first.assign(1, 0);
  for (const Moved &m : sides_) first.push_back(first.back() + (m.set ? m.set->ngroup : 0));
  islands_.start(first.back());
  for (const Row &row : rows_)
    if (const uint32_t a = group_of(row.a), b = group_of(row.b); a != kNone && b != kNone)
      islands_.join(a, b);
  start_speeds_.assign(islands_.number(), {});
  const auto speeds_of = [&](const Row &row) {
    const uint32_t island = island_of(row);
    return island != kNone ? &start_speeds_[island] : nullptr;
  };
  for (const Row &row : rows_)
    if (StartSpeeds *const s = speeds_of(row)) {
      const Vec3 belts = belt(row.a) - belt(row.b);
      s->with = std::max(s->with, norm(speed(row) + belts));
      s->without = std::max(s->without, norm(speed(row, &Moved::free) + belts) + std::fabs(row.rate));
    }
  bool any = false;
  for (Row &row : rows_)
    if (const StartSpeeds *const s = speeds_of(row); s && s->with > s->without) {
      row.impulse = row.along[0] = row.along[1] = 0;
      any = true;
    }
  if (any) add_rows_to_velocities(views);
}

Vec3 ToolTouch::slip(const Row &row) const { return speed(row) + row.bend; }

// Memory for it is needed before the sub-step is final.
void ToolTouch::keep_next(const Solution &solution) {
  const ContactState &state = solution.state;
  ContactStore &to = next_;
  uint32_t n = 0;
  for (const Row &row : rows_) n += row.impulse > 0;
  to.n = n;
  to.nstate = n > 0 ? state_.nstate : 0;
  to.h = n > 0 ? h_ : 0;
  each_column(
      [&](const auto &column, auto &values) {
        values.assign(column.width == kOwnLength ? 0 : column.entries(n, to.nstate), {});
      },
      to);
  n = 0;
  for (uint32_t i = 0; i < rows_.size(); ++i) {
    const Row &row = rows_[i];
    if (!(row.impulse > 0)) continue;
    to.key[n] = row.key;
    to.id_a[n] = row.pair->id[0];
    to.id_b[n] = row.pair->id[1];
    store3(&to.normal[3 * size_t{n}], row.normal);
    store3(&to.tangent[3 * size_t{n}], row.tangent[0]);
    store3(&to.impulse[3 * size_t{n}], {row.impulse, row.along[0], row.along[1]});
    to.lasting[n] = row.impulse;
    store3(&to.turned[3 * size_t{n}], row.tangent[0]);
    store3(&to.point[3 * size_t{n}], row.at);
    to.gap[n] = row.gap - offset_;
    const uint32_t r = solution.rows.soft() + i;
    for (size_t k = 0; k < 2; ++k) to.slip[2 * size_t{n} + k] = dot(row.tangent[k], slip(row));
    for (uint32_t s = 0; s < to.nstate; ++s)
      to.bristle[size_t{to.nstate} * n + s] = state.bristle_out[size_t{s} * state.stride + r];
    to.law[n] = row.pair->law;
    to.dwell[n] = state_.dwell[i] + h_;
    to.area[n] = kArea;
    to.touching[n] = 1;
    to.sticks[n] = solution.rows.wt[r] > 0 && state.mode[r] == 1;
    to.began[n] = match_[i] == kNone;
    ++n;
  }
  to.order();
}

}  // namespace dfm
