// Parameters given as fields by cell, and sets of values that are applied completely or not at all.
#pragma once
#include <algorithm>
#include <cstring>

#include "buffer.h"
#include "entry.h"

namespace model {

// Fields of the mesh for rows that may come by cell, [ncell, width] by row; an axis (three wide) is not zero.
// `fits(row, value)` beside the row's range. Throws Refused after the reason was logged.
template <class Fits>
void take_fields(const dfm_host *host, const char *who, const dfm_param *rows, uint32_t nrow,
                 const dfm_mesh &m, Buffer<double> *field, const Fits &fits) {
  for (uint32_t k = 0; m.field_keys && m.field_keys[k]; ++k)
    for (uint32_t r = 0; r < nrow; ++r) {
      const dfm_param &row = rows[r];
      if (!(row.flags & DFM_PARAM_PER_CELL) || std::strcmp(m.field_keys[k], row.key)) continue;
      const bool axis = row.width == 3;
      const auto refuse = [&](uint32_t cell, double value) {
        model::refuse(host, who, "field %s of cell %u is %g; %g .. %g %s is expected%s", row.key, cell, value,
                      row.min, row.max, row.unit, axis ? ", and an axis that is not zero" : "");
      };
      const double *values = m.fields[k];
      for (uint32_t c = 0; c < m.ncell; ++c) {
        double square = 0;
        for (uint32_t w = 0; w < row.width; ++w) {
          const double x = values[size_t(row.width) * c + w];
          if (!(x >= row.min && x <= row.max) || !fits(r, x)) refuse(c, x);
          square += x * x;
        }
        if (axis && !(square > 0)) refuse(c, 0);
      }
      field[r].create(host, size_t(row.width) * m.ncell);
      std::copy(values, values + size_t(row.width) * m.ncell, field[r].data());
    }
}

// For a parameter that may be given by cell.
inline double largest_of(const Buffer<double> &field, double value, uint32_t ncell) {
  return field.empty() ? value : *std::max_element(field.data(), field.data() + ncell);
}

// Whether cells have a plastic state. What a cut leaves of a body has that of the whole, so it does not
// follow from whether any of these cells yields.
inline bool may_yield(const Buffer<double> &field, double value) { return !field.empty() || value > 0; }

// Sets `params` to `values`, calls make() for the memory that they need, and restores them if it throws.
template <size_t kCount, class Make>
void try_params(double (&params)[kCount], const double *values, const Make &make) {
  double before[kCount];
  std::copy(params, params + kCount, before);
  std::copy(values, values + kCount, params);
  try {
    make();
  } catch (...) {
    std::copy(before, before + kCount, params);
    throw;
  }
}

}  // namespace model
