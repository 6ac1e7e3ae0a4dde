// Uses what the host lends: memory and the log in prepare and release, scratch and parallel_for in eval.
#include <atomic>
#include <cstring>

#include "deform/plugin.hpp"

namespace {
namespace dp = dfm::plugin;
struct Tables {
  const dfm_host *host;
  double factor;
};
const dfm_param rows[] = {dp::param("factor", "what prepare() doubles", "1", 0, 100, 3)};

dfm_status prepare(const dfm_host *host, const double *params, void **data) {
  auto *tables = static_cast<Tables *>(host->alloc(host->ctx, sizeof(Tables), alignof(Tables)));
  if (!tables) return DFM_E_NOMEM;
  *tables = {host, 2 * params[0]};
  host->log(host->ctx, 1, 0, "prepared");
  *data = tables;
  return DFM_OK;
}

void release(const dfm_host *host, void *data) {
  host->log(host->ctx, 1, 0, "released");
  host->release(host->ctx, data, sizeof(Tables), alignof(Tables));
}

struct Job {
  const dfm_friction_in *in;
  double *twice;
  const dfm_host *host;
  std::atomic<bool> refused;
};

void work(void *user, uint32_t begin, uint32_t end) {
  Job &job = *static_cast<Job *>(user);
  double *own = static_cast<double *>(job.host->scratch(job.host->ctx, (end - begin) * sizeof(double)));
  if (!own) {
    job.refused = true;
    return;
  }
  for (uint32_t i = begin; i < end; ++i) own[i - begin] = job.in->fn[i];
  for (uint32_t i = begin; i < end; ++i) job.twice[i] = 2 * own[i - begin];
}

// ft_x = twice the normal force through two pieces of scratch that live together, ft_y = the
// factor of prepare().
dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  const auto &tables = *static_cast<const Tables *>(in->data);
  const dfm_host *host = tables.host;
  double *twice = static_cast<double *>(host->scratch(host->ctx, in->n * sizeof(double)));
  double *large = static_cast<double *>(host->scratch(host->ctx, 3000000));
  if (!twice || !large || reinterpret_cast<uintptr_t>(twice) % 64 || reinterpret_cast<uintptr_t>(large) % 64)
    return DFM_E_FATAL;
  std::memset(large, 0xff, 3000000);
  Job job{in, twice, host, false};
  host->parallel_for(host->ctx, in->n, 16, work, &job);
  if (job.refused) return DFM_E_NOMEM;
  for (uint32_t i = 0; i < in->n; ++i) {
    out->ft[i] = twice[i];
    out->ft[in->stride + i] = tables.factor;
  }
  return host->extension(host->ctx, "dfm.unheard-of/1") ? DFM_E_FATAL : DFM_OK;
}

const dfm_friction law = {sizeof(dfm_friction),
                          DFM_NEED_FN,
                          0,
                          0,
                          nullptr,
                          dp::guarded<eval>,
                          nullptr,
                          prepare,
                          release,
                          nullptr,
                          0,
                          0,
                          nullptr};
const dfm_type type =
    dp::type(DFM_KIND_FRICTION, "org.tiny.host", "host services", "1.0", "MIT", "test", rows, nullptr, &law);
}  // namespace
DFM_PLUGIN(&type)
