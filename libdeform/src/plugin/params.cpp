#include "plugin/params.h"

#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/names.h"
#include "plugin/boundary.h"
#include "plugin/registry.h"

namespace dfm {
namespace {

std::string range_of(const dfm_param &row) {
  if (row.flags & DFM_PARAM_ENUM) {
    std::vector<std::string> names;
    for (const char *const *n = row.names; n && *n; ++n) names.push_back(*n);
    return "one of " + join(names);
  }
  const char *const kind = row.flags & DFM_PARAM_INTEGER ? "a whole number" : "a number";
  const std::string range = format("%s in [%g, %g]", kind, row.min, row.max);
  return std::strcmp(row.unit, "1") == 0 ? range : range + " " + row.unit;
}

std::vector<std::string> keys_of(const dfm_type &type) {
  std::vector<std::string> keys;
  for (uint32_t i = 0; i < type.nparam; ++i) keys.push_back(type.params[i].key);
  return keys;
}

bool names_param(const dfm_type &type, const char *given, const char *row) {
  return std::strcmp(given, "mu") == 0 && !find_row(type, "mu") &&
         (std::strcmp(row, "mu_C") == 0 || std::strcmp(row, "mu_S") == 0);
}

void check_keys(const dfm_type &type, std::span<const dfm_param_value> given) {
  for (size_t i = 0; i < given.size(); ++i) {
    if (!given[i].key || !given[i].value)
      fail(DFM_E_ARG, "%s: parameter %zu has no %s", type.id, i, given[i].key ? "value" : "key");
    bool known = find_row(type, given[i].key) != nullptr;
    for (uint32_t k = 0; k < type.nparam; ++k) known |= names_param(type, given[i].key, type.params[k].key);
    if (!known) fail(DFM_E_ARG, "%s", no_parameter(type, "parameter", given[i].key, keys_of(type)).c_str());
    for (size_t k = 0; k < i; ++k)
      if (std::strcmp(given[i].key, given[k].key) == 0)
        fail(DFM_E_ARG, "%s: parameter \"%s\" is given twice", type.id, given[i].key);
  }
}

void check_value(const dfm_type &type, const dfm_param &row, const dfm_param_value &value) {
  const bool list = row.flags & DFM_PARAM_LIST;
  if (list ? value.width < 1 || value.width > row.width : value.width != row.width)
    fail(DFM_E_ARG, "%s: parameter \"%s\" has %u value%s, %s%u expected", type.id, value.key, value.width,
         value.width == 1 ? "" : "s", list ? "1 to " : "", row.width);
  for (uint32_t k = 0; k < value.width; ++k) {
    const double x = value.value[k];
    const bool whole = !(row.flags & (DFM_PARAM_INTEGER | DFM_PARAM_ENUM)) || x == std::floor(x);
    if (!(x >= row.min && x <= row.max) || !whole)
      fail(DFM_E_ARG, "%s: parameter \"%s\" is %g; expected %s", type.id, value.key, x,
           range_of(row).c_str());
  }
}

const dfm_param_value *choose(const dfm_type &type, const dfm_param &row,
                              std::span<const dfm_param_value> given, const ParamLookup &fallback) {
  for (const auto &value : given)
    if (std::strcmp(value.key, row.key) == 0) return &value;
  for (const auto &value : given)
    if (names_param(type, value.key, row.key)) return &value;
  return fallback ? fallback(row.key) : nullptr;
}

}  // namespace

std::string no_parameter(const dfm_type &type, const char *what, const std::string &key,
                         const std::vector<std::string> &known) {
  return format("%s has no %s \"%s\"%s; it has: %s", type.id, what, key.c_str(),
                did_you_mean(key, known).c_str(), known.empty() ? "none" : join(known).c_str());
}

const dfm_param *find_row(const dfm_type &type, const char *key) {
  for (uint32_t i = 0; i < type.nparam; ++i)
    if (std::strcmp(type.params[i].key, key) == 0) return &type.params[i];
  return nullptr;
}

uint32_t packed_width(const dfm_type &type) {
  uint32_t n = 0;
  for (uint32_t i = 0; i < type.nparam; ++i) n += type.params[i].width;
  return n;
}

std::vector<dfm_param_value> param_rows(const dfm_type &type, const std::vector<double> &packed) {
  std::vector<dfm_param_value> rows;
  size_t at = 0;
  for (uint32_t i = 0; i < type.nparam; ++i) {
    const dfm_param &row = type.params[i];
    rows.push_back({row.key, &packed[at], row.width});
    at += row.width;
  }
  return rows;
}

std::vector<double> pack_params(const dfm_type &type, std::span<const dfm_param_value> given,
                                const ParamLookup &fallback) {
  check_keys(type, given);
  std::vector<double> packed;
  packed.reserve(packed_width(type));
  for (uint32_t i = 0; i < type.nparam; ++i) {
    const dfm_param &row = type.params[i];
    if (const dfm_param_value *value = choose(type, row, given, fallback)) {
      check_value(type, row, *value);
      packed.insert(packed.end(), value->value, value->value + value->width);
      packed.insert(packed.end(), row.width - value->width, 0.0);
    } else {
      packed.insert(packed.end(), row.width, row.def);
    }
  }
  if (type.kind == DFM_KIND_FRICTION && law_of(type).check) {
    char why[256] = "";
    dfm_status status = DFM_E_FATAL;
    const Boundary boundary(type.id, "check");
    try {
      status = law_of(type).check(packed.data(), why, sizeof why);
    } catch (...) {
      std::strcpy(why, "its check threw an exception");
    }
    why[sizeof why - 1] = 0;
    if (status != DFM_OK)
      fail(DFM_E_ARG, "%s: %s", type.id, *why ? why : "its check refuses these parameters together");
  }
  return packed;
}

std::vector<double> changed_params(const dfm_type &type, std::span<const dfm_param_value> given,
                                   const std::vector<double> &present) {
  const std::vector<dfm_param_value> rows = param_rows(type, present);
  return pack_params(type, given, [&](const char *key) -> const dfm_param_value * {
    for (const dfm_param_value &row : rows)
      if (std::strcmp(row.key, key) == 0) return &row;
    return nullptr;
  });
}

}  // namespace dfm
