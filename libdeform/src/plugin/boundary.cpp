#include "plugin/boundary.h"

#include "deform/base.h"

namespace dfm {

constinit thread_local Running running;

}  // namespace dfm

const char *dfm_plugin_running(const char **what) {
  if (what) *what = dfm::running.what;
  return dfm::running.who;
}
