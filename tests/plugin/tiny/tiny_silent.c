/* Returns nothing and says nothing. */
#include "deform/plugin.h"

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  (void)host;
  (void)host_abi;
  (void)host_abi_min;
  return NULL;
}
