// The collision solution of Zerbato (2010), sections 4.2 and 5.4, for comparison: colliding vertices go back
// to the time of their impact. doc/concepts/rollback.md, doc/decisions/scenes_and_hosts.md.
#pragma once
#include <cstdint>
#include <memory>

#include "deform/world.h"

namespace dfm::rollback {

struct Buffers;

// Steps one world by the library's stages and detection, with the scheme in place of contact and friction.
class Scheme {
 public:
  Scheme();
  ~Scheme();
  // In place of dfm_world_step(); DFM_E_UNSUPPORTED: the world has what the scheme lacks.
  dfm_status step(dfm_world world, double dt, uint32_t *trouble);

 private:
  std::unique_ptr<Buffers> buffers_;
};

}  // namespace dfm::rollback
