#include "friction/laws.h"

#include <algorithm>
#include <cmath>
#include <utility>

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

LawBatches::LawBatches(const Memory &m) { use_memory(m, order_, in_, out_, mode_, local_, selected_); }

void LawBatches::gather(const std::vector<LawInstance *> &laws, std::span<const RowRun> contacts,
                        ContactState &state) {
  batches_.clear();
  uint32_t n = 0, end = 0;
  for (const RowRun &r : contacts) n += r.n;
  order_.resize(n);
  has_smooth_ = remembers_ = false;
  for (uint32_t l = 0; l < laws.size() && end < n; ++l) {
    const uint32_t begin = end;
    const LawForm form = laws[l]->form();
    each_row(contacts, [&](uint32_t i) {
      if (state.law[i] != l) return;
      order_[end++] = i;
      state.form[i] = form;
    });
    if (end == begin) continue;
    has_smooth_ |= form == kSmoothLaw;
    remembers_ |= laws[l]->nstate > 0;
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

dfm_friction_in LawBatches::inputs(const LawInstance &law, std::span<const uint32_t> index, double h,
                                   const ContactState &state) {
  const uint32_t n = static_cast<uint32_t>(index.size()), needs = law.ops->needs, S = law.nstate;
  const size_t column = (n + 7) & ~7u;
  in_.assign(column * (8 + S), 0.0);  // the last one for call()
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

// Calls a law. Derivatives that it does not give are forward differences of its force: without them a steep
// law (h w_t c > 1) would make the passes diverge. A difference is a millionth of the value, and at least a
// tenth of the slip and of the force that the solve resolves.
dfm_status LawBatches::call(const LawInstance &law, const dfm_friction_in &in, dfm_friction_out out) {
  const auto eval = [&] {
    return call_plugin(*law.host, *law.type, "eval", [&] { return law.ops->eval(&in, &out); });
  };
  if (law.ops->flags & DFM_FRIC_JACOBIAN) return eval();
  const size_t s = in.stride;
  double *const ft = out.ft, *const dv = std::exchange(out.dft_dvt, nullptr),
                *const dn = std::exchange(out.dft_dfn, nullptr);
  dfm_status status = eval();
  out.state = out.limit = nullptr;
  out.mode = nullptr;
  double *const fn = in_.data(), *const vt = fn + s, *const kept = in_.data() + (7 + law.nstate) * s;
  // moved: the column of in; to: [2,n]
  const auto differ = [&](double *moved, double least, double *to) {
    if (status != DFM_OK) return;
    std::copy_n(moved, s, kept);
    for (size_t k = 0; k < in.n; ++k) moved[k] += std::max(least, 1e-6 * std::fabs(kept[k]));
    out.ft = to;
    status = eval();
    for (size_t r = 0; r < 2; ++r)
      for (size_t k = 0; k < in.n; ++k)
        to[r * s + k] = (to[r * s + k] - ft[r * s + k]) / (moved[k] - kept[k]);
    std::copy_n(kept, s, moved);
  };
  differ(vt, 1e-7, dv);
  differ(vt + s, 1e-7, dv + 2 * s);
  std::swap_ranges(dv + s, dv + 2 * s, dv + 2 * s);  // row-major
  differ(fn, 1e-9, dn);
  return status;
}

const LawInstance *LawBatches::evaluate(const LawInstance &law, std::span<const uint32_t> index, double h,
                                        ContactState &state) {
  const dfm_friction_in in = inputs(law, index, h, state);
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
  failed_ = kNone;
  if (call(law, in, out) != DFM_OK) return &law;

  // f(column of the result, columns, state's own): the results but for limit and mode
  const auto each_result = [&](const auto &f) {
    f(out.ft, size_t{2}, state.ft);
    f(out.state, S, state.bristle_out);
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
    // 0 times NaN or infinity is not zero; a limit of +inf is valid: no limit
    if (failed_ == kNone && !(nan_flag == 0 && out.limit[k] >= 0)) failed_ = i;
  }
  if (!state.scale.empty())
    for (const uint32_t i : index)
      for (const size_t at : {size_t{i}, stride + i}) state.dft_dfn[at] *= state.scale[i];
  return failed_ == kNone ? nullptr : &law;
}

}  // namespace dfm
