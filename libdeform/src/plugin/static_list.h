// Plugins linked into the library (option DEFORM_PLUGINS_STATIC); empty otherwise.
#pragma once
#include <span>

#include "deform/plugin.h"

namespace dfm {

struct StaticPlugin {
  const char *name;
  dfm_plugin_fn entry;
};
std::span<const StaticPlugin> static_plugins();

}  // namespace dfm
