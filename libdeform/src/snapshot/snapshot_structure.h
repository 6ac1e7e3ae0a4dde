// What must be equal in the world that a snapshot is restored into, as hashes. Models are not part of it: a
// snapshot contains them.
#pragma once
#include <cstdint>

namespace dfm {

struct Body;
struct Obstacle;
struct World;

// The structure of one of them, without its id and name.
uint64_t make_of(const Body &b);
uint64_t make_of(const Obstacle &o);
// The structure of the rest: sets of rigid bodies, tools and self contact.
uint64_t rest_of_structure(const World &w);
// The structure of all, with ids and names: for a world that was written as a scene and read again.
uint64_t snapshot_structure(const World &w);

}  // namespace dfm
