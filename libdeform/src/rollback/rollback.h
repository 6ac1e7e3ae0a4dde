// The contact method `rollback`, for comparison: the collision solution of Zerbato (2010), sections 4.2 and
// 5.4. Colliding vertices go back to the time of their impact. doc/concepts/rollback.md,
// doc/decisions/scenes_and_hosts.md.
#pragma once
#include "step/method.h"

namespace dfm::rollback {

const ContactMethod &method();

}  // namespace dfm::rollback
