// A recorded hand, from a file (reference/scenes.md, "tools").
#pragma once
#include <string>

#include "scene/defs.h"

namespace dfm::scene {

void read_hand(const std::string &path, Tool &tool);  // its keys; those of the opening where it has jaws

}  // namespace dfm::scene
