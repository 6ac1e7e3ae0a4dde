// Snapshot, restore and hash of a world.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace dfm {

struct World;

uint64_t world_hash(const World &w);  // of what the results of later steps depend on
void world_snapshot(const World &w, std::vector<unsigned char> &out);
void world_restore(World &w, const void *data, size_t bytes);  // throws Error; then the world is unchanged

}  // namespace dfm
