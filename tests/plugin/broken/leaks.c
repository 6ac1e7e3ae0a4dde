/* V09: a table that nobody frees. */
#include <stdlib.h>
#define OWN_ENTRY
#include "law.h"

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  static void *volatile table;
  (void)host_abi;
  (void)host_abi_min;
  if (!DFM_ABI_OK(host)) return NULL;
  table = malloc(100);
  return table ? &plugin : NULL;
}
