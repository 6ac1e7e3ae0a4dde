// A hash of what must be equal in the world that a snapshot is restored into: its bodies and obstacles and
// their materials. Models are not part of it: a snapshot contains them.
#pragma once
#include <cstdint>

namespace dfm {

struct World;

uint64_t snapshot_structure(const World &w);

}  // namespace dfm
