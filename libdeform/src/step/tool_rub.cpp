// Friction of tools: the laws of their pairs, and what lasts from one sub-step to the next.
//
//   start    impulses of the same keys, times h / h_old, and the state of the law; turned with the normal
//   solve    by the method for soft bodies (tool_solve.cpp)
//   end      the state that a law has given at the solution lasts, with the impulses
//
// A place where two rigid things meet has no area. Laws that use the area get one square centimeter.
#include <algorithm>
#include <cmath>

#include "core/hash.h"
#include "state/world.h"
#include "step/context.h"
#include "step/tool_touch.h"

namespace dfm {
namespace {

constexpr double kArea = 1e-4;  // m2

}  // namespace

uint64_t ToolTouch::key_of(const uint64_t pair[2], Name name) {
  Hash h;
  h.add(pair[0]);
  h.add(pair[1]);
  for (const uint32_t x : {uint32_t{name.kind}, name.first, name.second}) h.add(x);
  return h.value;
}

// Sets the frames of the rows and their initial impulses, and adds these to the velocities.
void ToolTouch::take_last(const World &w) {
  const uint32_t n = static_cast<uint32_t>(rows_.size());
  laws_.resize(w.laws.size());
  std::transform(w.laws.begin(), w.laws.end(), laws_.begin(), [](auto &law) { return law.get(); });
  uint32_t nstate = 0;
  for (const Row &row : rows_) nstate = std::max(nstate, laws_[row.law]->nstate);
  state_.resize(n, nstate);
  points_.assign(n, {});
  tangents_.resize(3 * size_t{n});
  match_.resize(n);
  for (uint32_t i = 0; i < n; ++i) {
    points_[i].key = rows_[i].key;
    store3(points_[i].normal, rows_[i].normal);
    state_.law[i] = rows_[i].law;
    state_.area[i] = kArea;
  }
  warm_start(w.tool_store, points_, h_, start_, state_, tangents_.data(), match_.data());
  for (uint32_t i = 0; i < n; ++i) {
    Row &row = rows_[i];
    row.tangent[0] = load3(&tangents_[3 * size_t{i}]);
    row.tangent[1] = cross(row.normal, row.tangent[0]);
    row.impulse = start_[3 * size_t{i}];
    std::copy_n(&start_[3 * size_t{i} + 1], 2, row.along);
    push(row, row.given());
    for (const Side *side : {&row.a, &row.b}) {
      Moved &m = sides_[side->tool];
      m.touched = true;
      m.reach[side->part] = std::max(m.reach[side->part], norm(side->arm));
    }
  }
  drop_bad_start();
}

// Impulses of rows that contradict each other may be large while what they do cancels. Where the rows have
// changed it does not: then none are the better start.
void ToolTouch::drop_bad_start() {
  double with = 0, without = 0;
  for (const Row &row : rows_) {
    with = std::max(with, norm(speed(row)));
    without = std::max(without, norm(base_speed(row)) + std::fabs(row.rate));
  }
  if (with <= without) return;
  for (Row &row : rows_) row.impulse = row.along[0] = row.along[1] = 0;
  std::fill(start_.begin(), start_.end(), 0.0);
  push_all();
}

Vec3 ToolTouch::slip(const Row &row) const { return speed(row) + row.bend; }

// Memory for it is needed before the sub-step is final.
void ToolTouch::keep_next() {
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
    to.id_a[n] = row.pair[0];
    to.id_b[n] = row.pair[1];
    store3(&to.normal[3 * size_t{n}], row.normal);
    store3(&to.tangent[3 * size_t{n}], row.tangent[0]);
    store3(&to.impulse[3 * size_t{n}], {row.impulse, row.along[0], row.along[1]});
    for (uint32_t s = 0; s < to.nstate; ++s)
      to.bristle[size_t{to.nstate} * n + s] = state_.bristle_out[size_t{s} * state_.stride + i];
    to.law[n] = row.law;
    to.dwell[n] = state_.dwell[i] + h_;
    to.area[n] = kArea;
    to.touching[n] = 1;
    ++n;
  }
  to.order();
}

void ToolTouch::keep(World &w) noexcept {
  if (w.tool_store.n > 0 || next_.n > 0) std::swap(w.tool_store, next_);
  report(w);
}

}  // namespace dfm
