#include <dlfcn.h>

#include "deform/bullet_host.h"
#include "own_world.h"

namespace dfm_bullet_detail {

const EngineKind &bullet_kind() {
  static const EngineKind kind{"bullet", "stepSimulation", create_own_world};
  return kind;
}

// Names that take a btScalar differ between the builds, all others are the same: with both in one process the
// calls of one reach the other.
dfm_status check_bullet() {
  if (!dlsym(RTLD_DEFAULT, "_ZN11btRigidBody12applyDampingEf") ||
      !dlsym(RTLD_DEFAULT, "_ZN11btRigidBody12applyDampingEd"))
    return DFM_OK;
  return failed(DFM_E_UNSUPPORTED,
                "Bullet of single and of double precision are both loaded in this process, and take each "
                "other's calls; link all of it against one of them (libdeform_bullet, libdeform_bullet64)");
}

}  // namespace dfm_bullet_detail

using namespace dfm_bullet_detail;

dfm_status dfm_bullet_register(void) {
  if (const dfm_status s = check_bullet(); s != DFM_OK) return s;
  return register_host(bullet_kind());
}

const dfm_rigid_host *dfm_bullet_table(void) {
  static const dfm_rigid_host table = table_of(bullet_kind());
  return check_bullet() == DFM_OK ? &table : nullptr;
}
