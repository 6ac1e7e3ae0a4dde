// The plain kernel on four lanes, for the files that bring v4.
#pragma once
#include "corot_bound.h"
#include "model_corotational_fem/corot_kernel_cells.h"

namespace corot {
namespace {

static void plain(const corot_bound::Cells &cells) {
  constexpr uint32_t kSide = 8;
  model::Polar<Wide> o[kSide];
  const uint32_t fours = cells.groups * (kGroup / 4);
  for (uint32_t begin = 0; begin < fours; begin += kSide) {
    const uint32_t count = fours - begin < kSide ? fours - begin : kSide;
    const auto load = [&](uint32_t n, v4 *f) __attribute__((always_inline)) {
      for (int k = 0; k < 9; ++k) f[k] = load4(cells.gradient + 36 * size_t(begin + n) + 4 * k);
    };
    v4 f[9], r[9], e[6], s[6], all[9], p[9];
    for (uint32_t n = 0; n < count; ++n) {
      load(n, f);
      model::polar_invariants(f, o[n]);
    }
    for (uint32_t n = 0; n < count; ++n) model::polar_trace(o[n]);
    for (uint32_t n = 0; n < count; ++n) {
      const Four q = {cells.group + (begin + n) / 2, (begin + n) % 2 * 4};
      load(n, f);
      model::polar_rotation(f, o[n], r);
      strain_of(r, f, e);
      stress_of(q, e, s);
      full(s, all);
      turn(r, all, p);
      double *const out = cells.force + 36 * size_t(begin + n);
      for (int c = 0; c < 3; ++c)
        for (int i = 0; i < 3; ++i)
          store4(out + 4 * (3 * c + i), (p[3 * i] * rest4(q, 3 * c) + p[3 * i + 1] * rest4(q, 3 * c + 1)) +
                                            p[3 * i + 2] * rest4(q, 3 * c + 2));
    }
  }
}

}  // namespace
}  // namespace corot
