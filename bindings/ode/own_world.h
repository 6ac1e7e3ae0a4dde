// The host "ode" for a set that brings nothing but its defs (scenes): a dWorldID of its own with these
// bodies and joints.
#pragma once
#include "host.h"

namespace dfm_ode_detail {

dfm_status create_own_world(const dfm_rigid_set_def &set, void **self, uint32_t *group, uint32_t *nextra);

}  // namespace dfm_ode_detail
