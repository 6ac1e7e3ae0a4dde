// The plan as JSON text, for `deform explain` and for hosts.
#pragma once
#include <string>

#include "world/world.h"

namespace dfm {

std::string explain(const World &w);

}  // namespace dfm
