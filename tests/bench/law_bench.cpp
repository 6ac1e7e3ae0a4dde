// Friction laws: a batch of 1,000 contacts that slide, or that all stick; items are contacts.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <vector>

#include "deform/deform.h"

namespace {

constexpr uint32_t kContacts = 1000;

// 64-byte columns, as the library hands them to a law.
struct Columns {
  double *data;
  explicit Columns(size_t n) : data(static_cast<double *>(std::aligned_alloc(64, n * kContacts * sizeof(double)))) {}
  ~Columns() { std::free(data); }
  Columns(const Columns &) = delete;
  Columns &operator=(const Columns &) = delete;
};

// params: mu_C mu_S v_s delta sigma2, and dv for karnopp.
void law(benchmark::State &state, const char *name, std::vector<double> params, bool stick) {
  dfm_context_def def = dfm_context_def_default();
  def.plugin_dir = DEFORM_PLUGIN_DIR;
  dfm_context *context = nullptr;
  dfm_law handle = 0;
  const dfm_type *type = nullptr;
  if (dfm_context_create(&def, &context) < 0 || dfm_law_open(context, name, &handle) < 0 || dfm_law_type(handle, &type) < 0)
    return state.SkipWithError(dfm_last_error());
  Columns fn(1), vt(2), stop(2), area(1), ft(2), dv(4), dn(2), limit(1);
  std::vector<uint8_t> mode(kContacts);
  for (uint32_t i = 0; i < kContacts; ++i) {
    const double speed = 1e-3 * (1 + i % 97);   // around v_s: the Stribeck curve is felt
    fn.data[i] = 1 + 0.001 * i, area.data[i] = 1e-4;
    vt.data[i] = 0.6 * speed, vt.data[kContacts + i] = 0.8 * speed;
    const double pull = stick ? 1e-3 : 1e3;
    stop.data[i] = -pull * 0.6, stop.data[kContacts + i] = -pull * 0.8;
  }
  dfm_friction_in in{};
  in.size = sizeof in, in.n = in.stride = kContacts, in.dt = 1e-3, in.params = params.data();
  in.fn = fn.data, in.vt = vt.data, in.ft_stop = stop.data, in.area = area.data;
  dfm_friction_out out{};
  out.size = sizeof out, out.ft = ft.data, out.dft_dvt = dv.data, out.dft_dfn = dn.data, out.limit = limit.data, out.mode = mode.data();
  const dfm_friction &ops = *static_cast<const dfm_friction *>(type->ops);
  for (auto _ : state) {
    if (ops.eval(&in, &out) != DFM_OK) return state.SkipWithError("the law refused the batch");
    benchmark::ClobberMemory();
  }
  if (mode[0] != (stick ? 1 : 2)) return state.SkipWithError("contacts do not do what is measured");
  state.SetItemsProcessed(int64_t(state.iterations()) * kContacts);
  dfm_context_destroy(context);
}

}  // namespace

BENCHMARK_CAPTURE(law, coulomb_one_level, "coulomb", {0.5, 0.5, 0.01, 2, 0}, false);
BENCHMARK_CAPTURE(law, coulomb_stribeck_delta_2, "coulomb", {0.4, 0.6, 0.01, 2, 0}, false);
BENCHMARK_CAPTURE(law, coulomb_stribeck_delta_1_5, "coulomb", {0.4, 0.6, 0.01, 1.5, 0}, false);
BENCHMARK_CAPTURE(law, coulomb_sticks, "coulomb", {0.5, 0.5, 0.01, 2, 0}, true);
BENCHMARK_CAPTURE(law, karnopp_stribeck_delta_2, "karnopp", {0.4, 0.6, 0.01, 2, 0, 1e-6}, false);
BENCHMARK_MAIN();
