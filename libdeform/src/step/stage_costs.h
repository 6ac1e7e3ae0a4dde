// The counts of the present scene with which the cost of a stage grows (not seconds). For `deform explain`.
#pragma once
#include <string>

namespace dfm {

struct World;

namespace cost {
std::string prescribed(const World &w);
std::string cells(const World &w);
std::string points(const World &w);
std::string rigid_states(const World &w);
std::string weights(const World &w);
std::string surfels_and_triangles(const World &w);
std::string candidates(const World &w);
std::string candidates_near(const World &w);
std::string self_surfels(const World &w);
std::string contacts_and_sweeps(const World &w);
std::string contacts_and_surfels(const World &w);
std::string awake(const World &w);
}  // namespace cost

}  // namespace dfm
