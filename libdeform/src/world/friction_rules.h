// Friction rules of a world, which can be added, changed and removed between steps.
#pragma once
#include <span>
#include <string>

#include "deform/base.h"

namespace dfm {

struct World;

// Adds a rule for two sides and removes an older one for the same sides; if that one has the same kind of
// law, its law gets the new parameters.
void add_friction_rule(World &w, std::string a, std::string b, const char *law,
                       std::span<const dfm_param_value> given, double restitution);
// Parameters of the rule for two sides; others keep their values. Throws Error(ARG) if there is no such rule.
void set_friction_rule(World &w, const char *a, const char *b, std::span<const dfm_param_value> given);
void remove_friction_rule(World &w, const char *a, const char *b);

}  // namespace dfm
