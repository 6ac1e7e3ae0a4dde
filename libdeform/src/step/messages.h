// Words that messages of a step have in common.
#pragma once
#include <cstdint>
#include <string>

#include "core/error.h"

namespace dfm {

struct Body;
struct Entities;
struct WorldState;

std::string at_step(const WorldState &w);                    // "step 12"
std::string at_step(const WorldState &w, const Body &b);     // "step 12, body 'a'"
const std::string &name_of(const Entities &w, uint64_t id);  // of a body or an obstacle; "?": it is gone
std::string names_of(const Entities &w, uint64_t a,
                     uint64_t b);  // "body 'a' on obstacle 'b'", of what touches
// Half a sentence for a body that an attachment without compliance holds at an obstacle; else "". If the
// points are in or on another one, no motion satisfies attachment and contact.
const char *hint_of_attachment(const WorldState &w, uint64_t body);

// Fails a stage, with the bit of its trouble: the sentence, as of printf, is the last error. Returns false.
bool fail_step(uint32_t *trouble, uint32_t bit, const char *format, ...) DEFORM_PRINTF(3, 4);

}  // namespace dfm
