// A law that leaves the floating-point environment changed: its constructor rounds upward and sets a locale,
// its entry flushes denormals, and eval does what its parameter says. eval logs, so that a test can look at
// the thread meanwhile.
#include <fenv.h>

#include <clocale>
#include <stdexcept>

#include "../../support/flush_denormals.h"
#include "deform/plugin.hpp"

namespace {
namespace dp = dfm::plugin;
const struct Loaded {
  Loaded() {
    std::fesetround(FE_UPWARD);
    std::setlocale(LC_NUMERIC, "C.UTF-8");
  }
} loaded;
const dfm_host *host = nullptr;

dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  host->log(host->ctx, 1, 0, "eval at work");
  for (uint32_t i = 0; out->ft && i < 2 * in->stride; ++i) out->ft[i] = 0;
  const int way = static_cast<int>(in->params[0]);
  if (way == 1 || way == 4) std::fesetround(FE_UPWARD);
  if (way == 2) flush_denormals();
  if (way == 3) feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
  if (way == 4) throw std::runtime_error("boom");
  return DFM_OK;
}

constexpr dfm_param rows[] = {dp::param("way", "what eval leaves changed", "1", 0, 4, 0)};
const dfm_friction law = dp::friction(DFM_NEED_VT, 0, eval);
const dfm_type type =
    dp::type(DFM_KIND_FRICTION, "org.tiny.rounds", "rounds", "1.0", "MIT", "test", rows, nullptr, &law);
const dfm_type *const types[] = {&type};
const dfm_plugin plugin = {sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 1, types, nullptr};
}  // namespace

extern "C" DFM_EXPORT const dfm_plugin *dfm_plugin_entry(const dfm_host *given, uint32_t, uint32_t) {
  if (!DFM_ABI_OK(given)) return nullptr;
  host = given;
  flush_denormals();
  return &plugin;
}
