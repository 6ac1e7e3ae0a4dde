#pragma once
#include <cstdint>

namespace dfm {

struct World;

// Half a sentence for a body that an attachment without compliance holds at an obstacle; else "". If the
// points are in or on another one, no motion satisfies attachment and contact.
const char *hint_of_attachment(const World &w, uint64_t body);

}  // namespace dfm
