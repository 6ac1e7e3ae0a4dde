/* V02: right for this host, but it does not look whether the host is one it knows. */
#define OWN_ENTRY
#include "law.h"

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  (void)host;
  (void)host_abi;
  (void)host_abi_min;
  return &plugin;
}
