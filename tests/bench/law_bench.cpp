// Friction laws: a batch of 1,000 contacts, every output asked for; items are contacts. Laws with memory are
// first brought to a steady state.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "deform/deform.h"

namespace {

constexpr uint32_t kContacts = 1000;

// 64-byte columns, as the library hands them to a law.
struct Columns {
  double *data;
  explicit Columns(size_t n)
      : data(static_cast<double *>(std::aligned_alloc(64, n * kContacts * sizeof(double)))) {}
  ~Columns() { std::free(data); }
  Columns(const Columns &) = delete;
  Columns &operator=(const Columns &) = delete;
};

// set-valued laws are told by ft_stop; laws with memory slide around v_s, creep, or do either by contact
enum Motion { kSlides, kSticks, kMixed };

void law(benchmark::State &state, const char *name, std::vector<double> params, Motion motion) {
  dfm_context_def def = dfm_context_def_default();
  def.plugin_dir = DEFORM_PLUGIN_DIR;
  def.log = [](void *, int32_t, const char *) {};
  dfm_context *context = nullptr;
  dfm_law handle = 0;
  const dfm_type *type = nullptr;
  if (dfm_context_create(&def, &context) < 0 || dfm_law_open(context, name, &handle) < 0 ||
      dfm_law_type(handle, &type) < 0)
    return state.SkipWithError(dfm_last_error());
  const dfm_friction &ops = *static_cast<const dfm_friction *>(type->ops);
  uint32_t nstate = 0;
  for (uint32_t s = 0; s < ops.nslot; ++s) nstate += ops.slots[s].width;
  Columns fn(1), vt(2), stop(2), area(1), old(nstate + 1), ft(2), next(nstate + 1), dv(4), dn(2), limit(1),
      stored(1);
  std::vector<uint8_t> mode(kContacts);
  std::fill(old.data, old.data + nstate * kContacts, 0.0);
  for (uint32_t i = 0; i < kContacts; ++i) {
    const bool stick = motion == kSticks || (motion == kMixed && i % 7 < 3);
    // around v_s: the Stribeck curve is felt
    const double speed = (stick && nstate ? 1e-9 : 1e-3) * (1 + i % 97);
    fn.data[i] = 1 + 0.001 * i;
    area.data[i] = 1e-4;
    vt.data[i] = 0.6 * speed;
    vt.data[kContacts + i] = 0.8 * speed;
    const double pull = stick ? 1e-3 : 1e3;
    stop.data[i] = -pull * 0.6;
    stop.data[kContacts + i] = -pull * 0.8;
  }
  dfm_friction_in in{};
  in.size = sizeof in;
  in.n = in.stride = kContacts;
  in.dt = 1e-3;
  in.params = params.data();
  in.fn = fn.data;
  in.vt = vt.data;
  in.ft_stop = stop.data;
  in.area = area.data;
  in.state = old.data;
  dfm_friction_out out{};
  out.size = sizeof out;
  out.ft = ft.data;
  out.state = next.data;
  out.dft_dvt = dv.data;
  out.dft_dfn = dn.data;
  out.limit = limit.data;
  out.mode = mode.data();
  out.stored = stored.data;
  for (int step = 0; nstate && step < 300; ++step) {
    ops.eval(&in, &out);
    std::copy(next.data, next.data + nstate * kContacts, old.data);
  }
  for (auto _ : state) {
    if (ops.eval(&in, &out) != DFM_OK) return state.SkipWithError("the law refused the batch");
    benchmark::ClobberMemory();
  }
  if ((motion != kSlides && mode[0] != 1) || mode[96] != (motion == kSticks ? 1 : 2))
    return state.SkipWithError("contacts do not do what is measured");
  state.SetItemsProcessed(int64_t(state.iterations()) * kContacts);
  dfm_context_destroy(context);
}

}  // namespace

// mu_C mu_S v_s delta sigma2, and dv for karnopp
BENCHMARK_CAPTURE(law, coulomb_one_level, "coulomb", {0.5, 0.5, 0.01, 2, 0}, kSlides);
BENCHMARK_CAPTURE(law, coulomb_stribeck_delta_2, "coulomb", {0.4, 0.6, 0.01, 2, 0}, kSlides);
BENCHMARK_CAPTURE(law, coulomb_stribeck_delta_1_5, "coulomb", {0.4, 0.6, 0.01, 1.5, 0}, kSlides);
BENCHMARK_CAPTURE(law, coulomb_sticks, "coulomb", {0.5, 0.5, 0.01, 2, 0}, kSticks);
BENCHMARK_CAPTURE(law, karnopp_stribeck_delta_2, "karnopp", {0.4, 0.6, 0.01, 2, 0, 1e-6}, kSlides);
// mu_C sigma0 alpha
BENCHMARK_CAPTURE(law, dahl_slides, "dahl", {0.5, 1e8, 1}, kSlides);
BENCHMARK_CAPTURE(law, dahl_sticks, "dahl", {0.5, 1e8, 1}, kSticks);
BENCHMARK_CAPTURE(law, dahl_alpha_2, "dahl", {0.5, 1e8, 2}, kSlides);
// mu_C mu_S v_s delta sigma0 sigma1 sigma1_form v_d sigma2
BENCHMARK_CAPTURE(law, lugre_passive, "lugre", {0.4, 0.6, 0.01, 2, 1e8, 1e5, 0, 0.01, 0}, kSlides);
BENCHMARK_CAPTURE(law, lugre_passive_mixed, "lugre", {0.4, 0.6, 0.01, 2, 1e8, 1e5, 0, 0.01, 0}, kMixed);
BENCHMARK_CAPTURE(law, lugre_passive_delta_1_5, "lugre", {0.4, 0.6, 0.01, 1.5, 1e8, 1e5, 0, 0.01, 0},
                  kSlides);
BENCHMARK_CAPTURE(law, lugre_constant, "lugre", {0.4, 0.6, 0.01, 2, 1e8, 1e5, 1, 0.01, 0}, kSlides);
BENCHMARK_CAPTURE(law, lugre_falling, "lugre", {0.4, 0.6, 0.01, 2, 1e8, 1e5, 2, 0.01, 0}, kSlides);
// and kappa i multiplier
BENCHMARK_CAPTURE(law, elastoplastic_slides, "elastoplastic",
                  {0.4, 0.6, 0.01, 2, 1e8, 1e5, 0, 0.01, 0, 0.7, 1, 0}, kSlides);
BENCHMARK_CAPTURE(law, elastoplastic_sticks, "elastoplastic",
                  {0.4, 0.6, 0.01, 2, 1e8, 1e5, 0, 0.01, 0, 0.7, 1, 0}, kSticks);
BENCHMARK_CAPTURE(law, elastoplastic_mixed, "elastoplastic",
                  {0.4, 0.6, 0.01, 2, 1e8, 1e5, 0, 0.01, 0, 0.7, 1, 0}, kMixed);
// mu_C mu_S v_s delta sigma2 C k nu
BENCHMARK_CAPTURE(law, gms_slides, "gms", {0.4, 0.6, 0.01, 2, 0, 1e5, 4e7, 3e7, 2e7, 1e7, 0.2, 0.3, 0.3, 0.2},
                  kSlides);
BENCHMARK_MAIN();
