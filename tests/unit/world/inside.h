// The library's own world behind a handle.
#pragma once
#include "core/handle.h"
#include "state/world.h"

namespace test {

inline dfm::World &inside(dfm_world w) {
  return *static_cast<dfm::World *>(dfm::handle_find(dfm::Kind::world, w));
}

}  // namespace test
