// Parameters by key: one path for C, scenes and the command, checked against the plugin's own table.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "deform/base.h"

namespace dfm {

using ParamLookup = std::function<const dfm_param_value *(const char *key)>;

// The values of all rows end to end: what is given, else what `fallback` knows under the row's key (a body's
// material), else the default. "mu" stands for mu_C and mu_S where the type has no row of that name; a key
// given by its own name wins over it.
// Throws DFM_E_ARG: unknown key (with the nearest valid one), given twice, width, range, integer,
// enumeration, or what a law's check says.
std::vector<double> pack_params(const dfm_type &type, std::span<const dfm_param_value> given,
                                const ParamLookup &fallback = {});
// The same, where what is not given keeps its `present` value.
std::vector<double> changed_params(const dfm_type &type, std::span<const dfm_param_value> given,
                                   const std::vector<double> &present);
// Packed values by key, as pack_params takes them; they point into `packed`.
std::vector<dfm_param_value> param_rows(const dfm_type &type, const std::vector<double> &packed);
uint32_t packed_width(const dfm_type &type);  // doubles of all rows

}  // namespace dfm
