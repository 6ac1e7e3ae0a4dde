// The host "bullet" (rigid_host/host.h): its table, and sets that consist of definitions only (from scenes).
// Each such set is a btDiscreteDynamicsWorld of its own.
#pragma once
#include "rigid_host/host.h"

namespace dfm_bullet_detail {

using namespace dfm_rigid_detail;

dfm_status create_own_world(const dfm_rigid_set_def &set, void **self, uint32_t *group, uint32_t *nextra);
const EngineKind &bullet_kind();
dfm_status check_bullet();  // one build of Bullet in this process, with its sentence

}  // namespace dfm_bullet_detail
