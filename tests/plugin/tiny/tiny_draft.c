/* Built against the last draft of the header, and it does not ask for whom. */
#include "deform/plugin.h"

static const dfm_plugin plugin = {sizeof(dfm_plugin),          0, 1, 1, (const dfm_type *const *)(uintptr_t)8,
                                  (void (*)(void))(uintptr_t)8};

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  (void)host;
  (void)host_abi;
  (void)host_abi_min;
  return &plugin;
}
