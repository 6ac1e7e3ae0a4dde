// SIGINT and SIGTERM while a scene runs: the first one ends it in order, a second one the process as usual.
#pragma once
#include <atomic>

#include "deform/deform.h"

namespace cli {

void catch_signals();
bool interrupted();
// The world whose step a signal stops; 0: none.
inline std::atomic<dfm_world> stepping{0};
static_assert(std::atomic<dfm_world>::is_always_lock_free);

}  // namespace cli
