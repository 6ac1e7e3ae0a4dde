#include "friction/limit.h"

#include <cmath>

#include "plugin/call.h"

namespace dfm {
namespace {

constexpr size_t kColumn = 8;     // doubles, the least stride
constexpr double kArea = 1e-4;    // m2, of a law that asks for the area
constexpr double kStep = 1e-3;    // s
constexpr size_t kColumnsIn = 7;  // before those of the state

}  // namespace

double limit_of(const LawInstance &law, double fn) {
  if (law.form() == kNoFriction) return 0;
  Array<double> values{HookAllocator<double>(Memory::standard())};
  values.assign(kColumn * (kColumnsIn + 2 * size_t{law.nstate} + 3), 0.0);
  Array<uint8_t> mode{HookAllocator<uint8_t>(Memory::standard())};
  mode.assign(64, 0);
  double *const at = values.data();
  at[0] = fn;
  at[5 * kColumn] = kArea;
  const uint32_t needs = law.ops->needs;
  dfm_friction_in in{};
  in.size = sizeof in;
  in.n = 1;
  in.stride = kColumn;
  in.dt = kStep;
  in.params = law.params.data();
  in.data = law.data;
  in.fn = at;
  in.vt = at + kColumn;
  in.ft_stop = at + 3 * kColumn;
  in.area = needs & DFM_NEED_AREA ? at + 5 * kColumn : nullptr;
  in.dwell = needs & DFM_NEED_DWELL ? at + 6 * kColumn : nullptr;
  in.state = at + kColumnsIn * kColumn;
  double *const to = at + (kColumnsIn + law.nstate) * kColumn;
  dfm_friction_out out{};
  out.size = sizeof out;
  out.ft = to;
  out.limit = to + 2 * kColumn;
  out.state = to + 3 * kColumn;
  out.mode = mode.data();
  if (call_plugin(*law.host, *law.type, "eval", [&] { return law.ops->eval(&in, &out); }) != DFM_OK) return 0;
  return std::isfinite(out.limit[0]) && out.limit[0] > 0 ? out.limit[0] : 0;
}

}  // namespace dfm
