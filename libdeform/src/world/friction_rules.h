// Rules of friction of a world, which may come, change and go between steps.
#pragma once
#include <span>
#include <string>

#include "deform/base.h"

namespace dfm {

struct FrictionRule;
struct World;

// A rule for two sides. One for the same two sides goes: its law takes the new parameters where it is of
// the same kind.
void add_friction_rule(World &w, std::string a, std::string b, const char *law,
                       std::span<const dfm_param_value> given);
// Parameters of the rule for two sides; what is not given keeps its value. Throws Error(ARG) where there
// is no such rule.
void set_friction_rule(World &w, const char *a, const char *b, std::span<const dfm_param_value> given);
void remove_friction_rule(World &w, const char *a, const char *b);

}  // namespace dfm
