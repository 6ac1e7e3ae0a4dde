// Parameters by key: the same code for C, scenes and the command; checked against the table of the plugin.
#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "deform/base.h"

namespace dfm {

using ParamLookup = std::function<const dfm_param_value *(const char *key)>;

// The values of all rows end to end: the given value, else that of `fallback` (a body's material), else the
// default. "mu" sets mu_C and mu_S if the type has no row "mu"; an explicit mu_C or mu_S takes precedence.
// Throws DFM_E_ARG: unknown key (with the nearest valid one), given twice, width, range, integer,
// enumeration, or what a law's check says.
std::vector<double> pack_params(const dfm_type &type, std::span<const dfm_param_value> given,
                                const ParamLookup &fallback = {});
// The same, but values that are not given keep their `present` values.
std::vector<double> changed_params(const dfm_type &type, std::span<const dfm_param_value> given,
                                   const std::vector<double> &present);
// Packed values by key, in the form that pack_params takes; they point into `packed`.
std::vector<dfm_param_value> param_rows(const dfm_type &type, const std::vector<double> &packed);
const dfm_param *find_row(const dfm_type &type, const char *key);  // of its table; null: none
// "ID has no parameter "KEY"", with the nearest of those that it has, and all of them. what: "parameter".
std::string no_parameter(const dfm_type &type, const char *what, const std::string &key,
                         const std::vector<std::string> &known);
uint32_t packed_width(const dfm_type &type);  // doubles of all rows

}  // namespace dfm
