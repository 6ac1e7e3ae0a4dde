// Words that messages of a step have in common.
#pragma once
#include <cstdint>
#include <string>

namespace dfm {

struct Body;
struct World;

std::string at_step(const World &w);                           // "step 12"
std::string at_step(const World &w, const Body &b);            // "step 12, body 'a'"
const std::string &name_of(const World &w, uint64_t id);       // of a body or an obstacle; "?": it is gone
std::string names_of(const World &w, uint64_t a, uint64_t b);  // "body 'a' on obstacle 'b'", of what touches

}  // namespace dfm
