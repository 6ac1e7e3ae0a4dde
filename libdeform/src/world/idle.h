// Parameters of a body without effect: material entries that its model does not have, and parameters that the
// model reports as having no effect now.
#pragma once
#include <string>
#include <vector>

#include "state/body.h"
#include "state/material.h"

namespace dfm {

struct IdleParam {
  std::string key, why;
  bool chosen;           // not the default: the user set it and expects an effect
  bool unknown = false;  // the model has no such parameter
};

// Material entries that are no parameter of the model and differ from their default. Friction is used by
// pairs.
std::vector<Unused> find_unused(const dfm_type &type, const CellMaterials &cells);

// b.unused, then the report of the model's extension "dfm.idle/1" on the present parameters, in the order of
// its table; parameters at their default only if a material has them.
std::vector<IdleParam> idle_params(const Body &b);

// Logs one warning for each chosen parameter.
void warn_of_idle(const Body &b);

}  // namespace dfm
