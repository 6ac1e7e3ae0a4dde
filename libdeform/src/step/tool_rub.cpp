// Friction of tools: the laws of their pairs, and what lasts from one sub-step to the next.
//
//   start    impulses of the same keys, times h / h_old, and the state of the law; turned with the normal
//   pass     laws are evaluated at the present slip and normal force; sweeps solve their tangents, as for
//            bodies
//   end      the state that a law has given at the solution lasts, with the impulses
//
// A place where two rigid things meet has no area. Laws that use the area get one square centimeter.
#include <algorithm>
#include <cmath>

#include "contact/friction_kernel.h"
#include "core/hash.h"
#include "state/world.h"
#include "step/context.h"
#include "step/tool_touch.h"

namespace dfm {
namespace {

constexpr double kArea = 1e-4;         // m2
constexpr double kLeastChange = 1e-6;  // m/s: a law is evaluated at no smaller normal force than makes it
constexpr double kAnswered = 1e-6;     // of the slip: how far beside it a smooth law may be evaluated

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
  response_.resize(n);
  tangents_.resize(3 * size_t{n});
  match_.resize(n);
  for (uint32_t i = 0; i < n; ++i) {
    points_[i].key = rows_[i].key;
    store3(points_[i].normal, rows_[i].normal);
    state_.law[i] = rows_[i].law;
    state_.area[i] = kArea;
    response_[i] = rows_[i].response;
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
  const RowRun all{0, n};
  batches_.gather(laws_, {&all, 1}, state_);
}

Vec3 ToolTouch::slip(const Row &row) const { return speed(row) + row.bend; }

// Evaluates the laws at the present state. Returns m/s, by how much their values differ from it.
double ToolTouch::ask_laws(double least) {
  const uint32_t n = state_.n;
  const size_t stride = state_.stride;
  for (uint32_t i = 0; i < n; ++i) {
    const Row &row = rows_[i];
    const Vec3 v = slip(row);
    const double shut = row.impulse > 0 ? row.impulse : row.inverse * (row.rate - dot(row.normal, v));
    state_.fn[i] = std::max(shut, kLeastChange * row.inverse) / h_;
    for (size_t k = 0; k < 2; ++k) {
      const double u = dot(row.tangent[k], v);
      state_.vt[k * stride + i] = state_.slip[k * stride + i] = u;
      state_.ft_stop[k * stride + i] = row.response > 0 ? (row.along[k] - u / row.response) / h_ : 0;
    }
  }
  const LawInstance *bad = batches_.answer(h_, response_.data(), least, kAnswered, state_);
  if (!bad) bad = batches_.slopes(h_, state_);
  if (bad) {
    const uint32_t i = batches_.failed();
    if (i == kNone) throw LawFailed{bad, NAN, NAN};
    const double a = state_.vt[i], b = state_.vt[stride + i];
    throw LawFailed{bad, state_.fn[i], std::sqrt(a * a + b * b)};
  }
  double most = 0;
  for (uint32_t i = 0; i < n; ++i) {
    const Row &row = rows_[i];
    if (state_.form[i] == kSmoothLaw) linearize(state_, i, h_, row.response);
    if (!(row.impulse > 0 && row.response > 0)) continue;
    const std::array<double, 2> t = rub(i);
    const double a = t[0] - row.along[0], b = t[1] - row.along[1];
    most = std::max(most, row.response * std::sqrt(a * a + b * b));
  }
  return most;
}

// N s along the tangents, by the tangent of the law, for the present normal impulse.
std::array<double, 2> ToolTouch::rub(uint32_t i) const {
  const Row &row = rows_[i];
  const Vec3 v = slip(row);
  const auto [a, b] = friction_impulse(state_.view(), i, h_, row.response, row.along[0], row.along[1],
                                       row.impulse, dot(row.tangent[0], v), dot(row.tangent[1], v));
  return {a, b};
}

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
