// Parameters of a body that do nothing: those of its materials that its model lacks, and those that the model
// says have no effect now.
#pragma once
#include <string>
#include <vector>

#include "state/body.h"
#include "state/material.h"

namespace dfm {

struct IdleParam {
  std::string key, why;
  bool chosen;  // not the default: somebody set it and expects something of it
};

// Entries of the materials that the model has no parameter for and that are not at their default. Friction is
// the pairs' to use.
std::vector<Unused> find_unused(const dfm_type &type, const CellMaterials &cells);

// b.unused, then what the model's extension "dfm.idle/1" says about the present parameters, in the order of
// its table; those at their default only where a material has them.
std::vector<IdleParam> idle_params(const Body &b);

// One warning for each that was chosen.
void warn_of_idle(const Body &b);

}  // namespace dfm
