// Throws before it has said what it is.
#include <stdexcept>

#include "deform/plugin.h"

extern "C" DFM_EXPORT const dfm_plugin *dfm_plugin_entry(const dfm_host *, uint32_t, uint32_t) {
  throw std::runtime_error("boom");
}
