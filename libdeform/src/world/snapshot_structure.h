// What must be the same in the world that a snapshot is restored into: who is there and what it is made of,
// as a hash. Models are not part of it: a snapshot has its own.
#pragma once
#include <cstdint>

namespace dfm {

struct World;

uint64_t snapshot_structure(const World &w);

}  // namespace dfm
