/* V02: built for another ABI, and hands itself to every host. */
#define OWN_ENTRY
#include "law.h"

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  static dfm_plugin other;
  (void)host;
  (void)host_abi;
  (void)host_abi_min;
  other = plugin;
  other.abi_draft = DFM_ABI_DRAFT + 7;
  return &other;
}
