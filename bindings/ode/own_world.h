// The host "ode" (rigid_host/host.h): its table, and sets that consist of definitions only (from scenes).
// Each such set is a dWorldID of its own.
#pragma once
#include <ode/ode.h>

#include "rigid_host/host.h"

namespace dfm_ode_detail {

using namespace dfm_rigid_detail;

dfm_status create_own_world(const dfm_rigid_set_def &set, void **self, uint32_t *group, uint32_t *nextra);
const EngineKind &ode_kind();
dfm_status check_ode();  // precision and version at run time, with its sentence

}  // namespace dfm_ode_detail
