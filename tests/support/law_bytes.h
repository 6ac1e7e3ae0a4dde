// Any bytes as a friction law at work: which law, its parameters within their ranges, and eight contacts that
// are moved, pressed and let go for a few steps with the state handed on. What must hold is said by the first
// thing that does not.
#pragma once
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "deform/deform.h"

namespace law_bytes {

inline constexpr const char *kLaws[] = {"coulomb",       "karnopp", "dahl", "lugre",
                                        "elastoplastic", "gms",     "none"};

class Bytes {
 public:
  Bytes(const uint8_t *data, size_t size) : at_(data), end_(data + size) {}
  bool left() const { return at_ != end_; }
  uint32_t next() { return left() ? *at_++ : 0; }
  double share() { return (next() * 256 + next()) / 65535.0; }
  // From 0 or a to b, even in decades.
  double decades(double a, double b) {
    const double s = share();
    return s < 0.02 ? 0 : a * std::pow(b / a, s);
  }

 private:
  const uint8_t *at_, *end_;
};

// Empty: all held, or the law refused the parameters.
inline std::string complaint(dfm_context *context, const uint8_t *data, size_t size) {
  constexpr uint32_t n = 8;
  Bytes bytes(data, size);
  const std::string name = kLaws[bytes.next() % std::size(kLaws)];
  dfm_law law = 0;
  const dfm_type *type = nullptr;
  if (dfm_law_open(context, name.c_str(), &law) != DFM_OK || dfm_law_type(law, &type) != DFM_OK)
    return dfm_last_error();
  const dfm_friction &ops = *static_cast<const dfm_friction *>(type->ops);
  std::vector<double> params;
  bool passive = ops.flags & DFM_FRIC_PASSIVE;
  std::string text = name;
  for (uint32_t r = 0; r < type->nparam; ++r) {
    const dfm_param &p = type->params[r];
    for (uint32_t k = 0; k < p.width; ++k) {
      const uint32_t kind = bytes.next() % 6;
      const double s = bytes.share(), low = p.min > 0 ? p.min : p.max * 1e-18;
      double value = kind < 2    ? p.def
                     : kind == 2 ? p.min + s * (p.max - p.min)
                     : kind == 3 ? low * std::pow(p.max / low, s)
                     : kind == 4 ? p.def * 2 * s
                                 : p.min;
      value = value < p.min ? p.min : value > p.max ? p.max : value;
      if (p.flags & (DFM_PARAM_INTEGER | DFM_PARAM_ENUM)) value = std::floor(value);
      if (!std::strcmp(p.key, "sigma1_form")) passive = passive && value == 0;
      params.push_back(value);
      char word[64];
      std::snprintf(word, sizeof word, " %s %.17g", p.key, value);
      text += word;
    }
  }
  char why[400] = "";
  if (ops.check && ops.check(params.data(), why, sizeof why) != DFM_OK) {
    dfm_law_close(law);
    return why[0] ? "" : text + ": refused without a reason";
  }
  uint32_t nstate = 0;
  for (uint32_t s = 0; s < ops.nslot; ++s) nstate += ops.slots[s].width;
  std::vector<double> fn(n), vt(2 * n), stop(2 * n), area(n), dwell(n), state(n * nstate + 1),
      next(n * nstate + 1), ft(2 * n), dv(4 * n), dn(2 * n), limit(n), stored(n), before(n);
  std::vector<uint8_t> mode(n);
  for (double &a : area) a = bytes.decades(1e-9, 1);
  dfm_friction_in in{};
  in.size = sizeof in;
  in.n = in.stride = n;
  in.params = params.data();
  in.fn = fn.data();
  in.vt = vt.data();
  in.ft_stop = stop.data();
  in.area = area.data();
  in.dwell = dwell.data();
  in.state = state.data();
  dfm_friction_out out{};
  out.size = sizeof out;
  out.ft = ft.data();
  out.state = next.data();
  out.dft_dvt = dv.data();
  out.dft_dfn = dn.data();
  out.limit = limit.data();
  out.mode = mode.data();
  out.stored = stored.data();
  std::string wrong;
  for (int step = 0; step < 12 && wrong.empty() && (bytes.left() || step == 0); ++step) {
    in.dt = bytes.decades(1e-7, 1.0 / 30);
    for (uint32_t i = 0; i < n; ++i) {
      fn[i] = bytes.decades(1e-6, 1e5) * (bytes.next() < 250 ? 1 : -1);
      const double w = bytes.decades(1e-9, 100);
      const double pull = bytes.decades(1e-6, 1e5);
      const double turn = 6.283185307179586 * bytes.share();
      vt[i] = w * std::cos(turn);
      vt[n + i] = w * std::sin(turn);
      stop[i] = -pull * std::cos(2 * turn);
      stop[n + i] = -pull * std::sin(turn);
    }
    const dfm_status status = dfm_law_eval(law, &in, &out);
    for (uint32_t i = 0; i < n && wrong.empty(); ++i) {
      const double f = std::hypot(ft[i], ft[n + i]), work = -(ft[i] * vt[i] + ft[n + i] * vt[n + i]) * in.dt;
      const double turned = std::fabs(f * std::hypot(vt[i], vt[n + i]) * in.dt) + before[i];
      if (status != DFM_OK) wrong = "refused or not finite";
      else if (mode[i] > 2 || (fn[i] <= 0 && (mode[i] != 0 || f != 0))) wrong = "an open contact is not open";
      else if (!(f <= limit[i] * (1 + 1e-9))) wrong = "the force is above its limit";
      else if (passive && nstate && !(work + before[i] - stored[i] >= -1e-9 * turned))
        wrong = "work from nowhere";
      if (wrong.empty()) continue;
      char where[400];
      std::snprintf(where, sizeof where,
                    " (status %d, step %d, lane %u: h %.17g, fn %.17g, v %.17g %.17g, area %.17g, f %.17g, "
                    "limit %.17g, work %.17g, energy %.17g -> %.17g)",
                    status, step, i, in.dt, fn[i], vt[i], vt[n + i], area[i], f, limit[i], work, before[i],
                    stored[i]);
      wrong += where;
    }
    state.swap(next);
    before = stored;
    in.state = state.data();
    out.state = next.data();
  }
  dfm_law_close(law);
  return wrong.empty() ? "" : wrong + "; " + text;
}

}  // namespace law_bytes
