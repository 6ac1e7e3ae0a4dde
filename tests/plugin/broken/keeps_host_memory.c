/* V09: takes a piece of the host's memory at entry and does not give it back. */
#define OWN_ENTRY
#include "law.h"

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  (void)host_abi;
  (void)host_abi_min;
  if (!DFM_ABI_OK(host)) return NULL;
  return host->alloc(host->ctx, 64, 8) ? &plugin : NULL;
}
