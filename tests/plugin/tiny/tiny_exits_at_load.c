/* Ends the process of whoever loads it. */
#include <stdlib.h>

#include "deform/plugin.h"

__attribute__((constructor)) static void leave(void) { exit(0); }

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  (void)host;
  (void)host_abi;
  (void)host_abi_min;
  return NULL;
}
