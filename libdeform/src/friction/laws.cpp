#include "friction/laws.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "plugin/call.h"
#include "plugin/params.h"
#include "plugin/registry.h"

namespace dfm {

LawInstance::LawInstance(const dfm_type &t, const dfm_host &h, std::vector<double> values)
    : type(&t),
      ops(static_cast<const dfm_friction *>(t.ops)),
      params(std::move(values)),
      by_key(param_rows(t, params)),
      host(&h) {
  requested_type = &t;
  requested = params;
  for (const dfm_slot &slot : law_slots(t, h, params.data())) {
    nstate += slot.width;
    tangent.resize(nstate, slot.kind == DFM_SLOT_TANGENT);
    turns |= slot.kind == DFM_SLOT_TANGENT;
  }
  // pack_params has called check()
  if (ops->prepare &&
      call_plugin(h, t, "prepare", [&] { return ops->prepare(host, params.data(), &data); }) != DFM_OK)
    fail(DFM_E_FATAL, "law '%s' could not prepare its tables; see the log", t.id);
}

std::vector<LeftOut> left_out_of(const LawInstance &law) {
  std::vector<LeftOut> out;
  const dfm_type &requested = *law.requested_type;
  const bool other = law.type != &requested;
  if (!other && law.params == law.requested) return out;
  const std::string of = std::string("friction law ") + requested.id,
                    instead = other ? format("%s is used instead", law.type->id) : std::string();
  if (other && is_frictionless(*law.ops)) return {{kFriction, of, instead}};
  const std::vector<LawEffect> left = law_effects(*law.type, *law.host, law.params);
  for (const LawEffect &e : law_effects(requested, *law.host, law.requested)) {
    if (!e.works || std::any_of(left.begin(), left.end(),
                                [&](const LawEffect &l) { return l.works && l.name == e.name; }))
      continue;
    std::vector<std::string> by;
    for (const dfm_param_value &row : param_rows(requested, law.requested))
      if (const size_t at = size_t(row.value - law.requested.data()); e.off[at] != law.requested[at])
        by.push_back(format("%s %g", row.key, *row.value));
    if (other) by.push_back(instead);
    out.push_back({e.name, of, join(by)});
  }
  return out;
}

LawInstance::~LawInstance() {
  if (ops->prepare && ops->release) call_plugin(*host, *type, "release", [&] { ops->release(host, data); });
}

LawBatches::LawBatches(const Memory &m) {
  use_memory(m, order_, in_, out_, moved_, forces_, mode_, local_, selected_);
}

void LawBatches::gather(const std::vector<LawInstance *> &laws, std::span<const RowRun> contacts,
                        ContactState &state) {
  batches_.clear();
  uint32_t n = 0, end = 0;
  for (const RowRun &r : contacts) n += r.n;
  order_.resize(n);
  has_smooth_ = remembers_ = differences_ = false;
  for (uint32_t l = 0; l < laws.size() && end < n; ++l) {
    const uint32_t begin = end;
    const LawForm form = laws[l]->form();
    each_row(contacts, [&](uint32_t i) {
      if (state.law[i] != l) return;
      order_[end++] = i;
      state.form[i] = form;
      state.origin[i].made = state.origin[i].hold = kNoSlope;
    });
    if (end == begin) continue;
    has_smooth_ |= form == kSmoothLaw;
    remembers_ |= laws[l]->nstate > 0;
    differences_ |= !(laws[l]->ops->flags & DFM_FRIC_JACOBIAN);
    batches_.push_back({laws[l], begin, end - begin});
  }
}

void LawBatches::set_frictionless(std::span<const uint32_t> index, ContactState &state) {
  for (const uint32_t i : index) {
    state.ft[i] = state.ft[state.stride + i] = state.limit[i] = 0;
    state.dft_dfn[i] = state.dft_dfn[state.stride + i] = 0;
    for (uint32_t j = 0; j < 4; ++j) state.dft_dvt[size_t(j) * state.stride + i] = 0;
    state.mode[i] = state.fn[i] > 0 ? 2 : 0;
  }
}

const LawInstance *LawBatches::evaluate(double h, ContactState &state) {
  for (const Batch &batch : batches_)
    if (batch.law->form() == kNoFriction) set_frictionless({&order_[batch.begin], batch.n}, state);
    else if (const LawInstance *bad = evaluate(*batch.law, {&order_[batch.begin], batch.n}, h, state))
      return bad;
  return nullptr;
}

const LawInstance *LawBatches::slopes(double h, ContactState &state) {
  for (const Batch &batch : batches_) {
    if ((batch.law->ops->flags & DFM_FRIC_JACOBIAN) || batch.law->form() == kNoFriction) continue;
    for (const Slopes which : {kByVt, kByFn}) {
      selected_.clear();
      for (uint32_t k = 0; k < batch.n; ++k) {
        const uint32_t i = order_[batch.begin + k];
        if (state.origin[i].hold & which) continue;
        // The force of a sticking contact depends on its bristle and not on the normal force; the passes
        // correct small deviations.
        if (which == kByFn && state.mode[i] == 1) {
          state.dft_dfn[i] = state.dft_dfn[state.stride + i] = 0;
          state.origin[i].made |= which;
          state.origin[i].hold |= which;
        } else {
          selected_.push_back(i);
        }
      }
      if (selected_.empty()) continue;
      if (const LawInstance *bad = difference(*batch.law, selected_, h, which, state)) return bad;
    }
  }
  return nullptr;
}

// If slopes predict the change of force since they were computed to a tenth, each pass reduces the error to a
// tenth; new slopes are not worth three evaluations.
void LawBatches::reuse_slopes(uint32_t i, ContactState &s) {
  constexpr double kGood = 0.1;
  ContactState::Origin &o = s.origin[i];
  if (!o.made) return;
  const uint32_t n = s.stride;
  const double v1 = s.vt[i] - o.v[0], v2 = s.vt[n + i] - o.v[1], fn = s.fn[i] - o.fn;
  const double p1 = s.dft_dvt[i] * v1 + s.dft_dvt[n + i] * v2 + s.dft_dfn[i] * fn;
  const double p2 =
      s.dft_dvt[2 * size_t(n) + i] * v1 + s.dft_dvt[3 * size_t(n) + i] * v2 + s.dft_dfn[n + i] * fn;
  const double e1 = s.ft[i] - o.f[0] - p1, e2 = s.ft[n + i] - o.f[1] - p2;
  o.hold = e1 * e1 + e2 * e2 <= kGood * kGood * (p1 * p1 + p2 * p2) ? o.made : uint8_t(kNoSlope);
}

dfm_friction_in LawBatches::inputs(const LawInstance &law, std::span<const uint32_t> index, double h,
                                   const ContactState &state) {
  const uint32_t n = static_cast<uint32_t>(index.size()), needs = law.ops->needs, S = law.nstate;
  const size_t column = (n + 7) & ~7u;
  in_.assign(column * (7 + S), 0.0);
  double *const fn = in_.data();
  double *const vt = fn + column;
  double *const stop = vt + 2 * column;
  double *const area = stop + 2 * column;
  double *const dwell = area + column;
  double *const bristle = dwell + column;
  for (uint32_t k = 0; k < n; ++k) {
    const uint32_t i = index[k];
    fn[k] = state.scale.empty() ? state.fn[i] : state.fn[i] * state.scale[i];
    area[k] = state.area[i];
    dwell[k] = state.dwell[i];
    vt[k] = state.vt[i];
    vt[column + k] = state.vt[state.stride + i];
    stop[k] = state.ft_stop[i];
    stop[column + k] = state.ft_stop[state.stride + i];
    for (uint32_t s = 0; s < S; ++s) bristle[s * column + k] = state.bristle[size_t(s) * state.stride + i];
  }
  dfm_friction_in in{};
  in.size = sizeof in;
  in.n = n;
  in.stride = static_cast<uint32_t>(column);
  in.dt = h;
  in.params = law.params.data();
  in.data = law.data;
  in.fn = fn;
  in.vt = vt;
  in.ft_stop = stop;
  in.area = needs & DFM_NEED_AREA ? area : nullptr;
  in.dwell = needs & DFM_NEED_DWELL ? dwell : nullptr;
  in.state = bristle;
  return in;
}

const LawInstance *LawBatches::evaluate(const LawInstance &law, std::span<const uint32_t> index, double h,
                                        ContactState &state) {
  const dfm_friction_in in = inputs(law, index, h, state);
  const bool given = law.ops->flags & DFM_FRIC_JACOBIAN;
  const size_t column = in.stride, stride = state.stride, S = law.nstate;
  out_.resize(column * (11 + S));
  mode_.resize(column);
  dfm_friction_out out{};
  out.size = sizeof out;
  out.ft = out_.data();
  out.dft_dvt = out.ft + 2 * column;
  out.dft_dfn = out.dft_dvt + 4 * column;
  out.limit = out.dft_dfn + 2 * column;
  out.state = out.limit + 3 * column;
  out.mode = mode_.data();
  if (!given) out.dft_dvt = out.dft_dfn = nullptr;
  failed_ = kNone;
  if (call_plugin(*law.host, *law.type, "eval", [&] { return law.ops->eval(&in, &out); }) != DFM_OK)
    return &law;

  // f(column of the result, columns, state's own): the results that this law gives, but for limit and mode
  const auto each_result = [&](const auto &f) {
    f(out.ft, size_t{2}, state.ft);
    f(out.state, S, state.bristle_out);
    if (!given) return;
    f(out.dft_dvt, size_t{4}, state.dft_dvt);
    f(out.dft_dfn, size_t{2}, state.dft_dfn);
  };
  for (size_t k = 0; k < in.n; ++k) {
    const uint32_t i = index[k];
    double nan_flag = 0;
    each_result([&](const double *from, size_t width, Array<double> &to) {
      for (size_t c = 0; c < width; ++c) {
        nan_flag += 0.0 * from[c * column + k];
        to[c * stride + i] = from[c * column + k];
      }
    });
    state.limit[i] = out.limit[k];
    state.mode[i] = out.mode[k];
    if (!given) reuse_slopes(i, state);
    // the poison of NaN and infinity is not zero; a limit of +inf is valid: no limit
    if (failed_ == kNone && !(nan_flag == 0 && out.limit[k] >= 0)) failed_ = i;
  }
  if (given && !state.scale.empty())
    for (const uint32_t i : index)
      for (const size_t at : {size_t{i}, stride + i}) state.dft_dfn[at] *= state.scale[i];
  return failed_ == kNone ? nullptr : &law;
}

// Derivatives of a law that does not give them, by forward differences: without them a steep law (h w_t c >
// 1) would make the passes diverge. The difference is a millionth of the value, and at least a tenth of the
// slip and of the force that the solve resolves.
const LawInstance *LawBatches::difference(const LawInstance &law, std::span<const uint32_t> index, double h,
                                          Slopes which, ContactState &state) {
  dfm_friction_in in = inputs(law, index, h, state);
  const size_t column = in.stride, n = state.stride;
  const double *const fn = in.fn, *const vt = in.vt;
  forces_.resize(2 * column);
  dfm_friction_out out{};
  out.size = sizeof out;
  out.ft = forces_.data();
  failed_ = kNone;
  // to: the column of the 2x2 or 2x1 slope, of `width` columns
  const auto differs = [&](const double *at, size_t columns, size_t c, const double *&input, double least,
                           Array<double> &to, size_t width) {
    moved_.assign(at, at + columns * column);
    for (size_t k = 0; k < in.n; ++k)
      moved_[c * column + k] += std::max(least, 1e-6 * std::fabs(at[c * column + k]));
    input = moved_.data();
    const bool evaluated =
        call_plugin(*law.host, *law.type, "eval", [&] { return law.ops->eval(&in, &out); }) == DFM_OK;
    input = at;
    for (size_t r = 0; r < 2; ++r)
      for (size_t k = 0; k < in.n; ++k) {
        const double slope = (forces_[r * column + k] - state.ft[r * n + index[k]]) /
                             (moved_[c * column + k] - at[c * column + k]);
        to[(r * width + c) * n + index[k]] = slope;
        if (failed_ == kNone && !std::isfinite(slope)) failed_ = index[k];
      }
    return evaluated;
  };
  bool evaluated = true;
  if (which & kByVt)
    evaluated =
        differs(vt, 2, 0, in.vt, 1e-7, state.dft_dvt, 2) && differs(vt, 2, 1, in.vt, 1e-7, state.dft_dvt, 2);
  if (evaluated && (which & kByFn)) evaluated = differs(fn, 1, 0, in.fn, 1e-9, state.dft_dfn, 1);
  if ((which & kByFn) && !state.scale.empty())
    for (const uint32_t i : index)
      for (size_t r = 0; r < 2; ++r) state.dft_dfn[r * n + i] *= state.scale[i];
  for (const uint32_t i : index) {
    ContactState::Origin &o = state.origin[i];
    // slopes computed at another trial belong to another force
    if (!(o.hold & ~which)) o.made = kNoSlope;
    const uint8_t made = o.made | which, hold = o.hold | which;
    o = {{state.vt[i], state.vt[n + i]}, state.fn[i], {state.ft[i], state.ft[n + i]}, made, hold};
  }
  return evaluated && failed_ == kNone ? nullptr : &law;
}

}  // namespace dfm
