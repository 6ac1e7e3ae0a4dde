#include "plugin/static_list.h"

// DEFORM_STATIC_PLUGIN_LIST is X(name) X(name) ..., written by the build.
#ifdef DEFORM_STATIC_PLUGIN_LIST
#define X(name) extern "C" const dfm_plugin *dfm_plugin_entry_##name(const dfm_host *, uint32_t, uint32_t);
DEFORM_STATIC_PLUGIN_LIST
#undef X
#endif

namespace dfm {

std::span<const StaticPlugin> static_plugins() {
#ifdef DEFORM_STATIC_PLUGIN_LIST
#define X(name) {#name, dfm_plugin_entry_##name},
  static const StaticPlugin list[] = {DEFORM_STATIC_PLUGIN_LIST};
#undef X
  return list;
#else
  return {};
#endif
}

}  // namespace dfm
