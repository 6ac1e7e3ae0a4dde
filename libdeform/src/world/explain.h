// The plan as JSON text, for `deform explain` and for hosts.
#pragma once
#include <string>

namespace dfm {

struct World;

std::string explain(const World &w);

}  // namespace dfm
