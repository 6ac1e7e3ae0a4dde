#include "surface_stress.h"

#include <algorithm>
#include <cmath>

#include "cell_volume.h"
#include "messages.h"

namespace cli {
namespace {

double von_mises(const double *s) {
  const double xy = s[0] - s[1], yz = s[1] - s[2], zx = s[2] - s[0];
  return std::sqrt(0.5 * (xy * xy + yz * yz + zx * zx) + 3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

}  // namespace

SurfaceStress::SurfaceStress(const BodyView &body, const std::vector<double> &surfels)
    : body_(body.handle),
      cells_(4 * size_t(body.ntet)),
      around_(body.npoint),
      stress_(6 * size_t(body.ntet)),
      mean_(body.npoint) {
  std::vector<double> x(3 * size_t(body.npoint));
  need(dfm_body_get_rest(body_, body.npoint, x.data(), body.ntet, cells_.data()));
  for (size_t c = 0; c < cells_.size(); c += 4) {
    volume_.push_back(std::fabs(cell_volume(x.data(), &cells_[c])));
    for (size_t k = 0; k < 4; ++k) around_[cells_[c + k]] += volume_.back();
  }
  uint32_t n = 0;
  need(dfm_body_get_state(body_, body.npoint, x.data(), nullptr, &n));
  for (size_t s = 0; s < surfels.size(); s += 3) {
    uint32_t nearest = 0;
    double least = HUGE_VAL;
    for (uint32_t p = 0; p < body.npoint && least > 0; ++p) {
      double d = 0;
      for (size_t k = 0; k < 3; ++k)
        d += (x[3 * size_t(p) + k] - surfels[s + k]) * (x[3 * size_t(p) + k] - surfels[s + k]);
      if (d < least) {
        least = d;
        nearest = p;
      }
    }
    nearest_.push_back(nearest);
  }
}

bool SurfaceStress::read(std::vector<float> &out) {
  const dfm_status status = dfm_body_stress(body_, uint32_t(volume_.size()), stress_.data());
  if (status == DFM_E_UNSUPPORTED) return false;
  need(status);
  std::ranges::fill(mean_, 0.0);
  for (size_t c = 0; c < volume_.size(); ++c) {
    const double share = volume_[c] * von_mises(&stress_[6 * c]);
    for (size_t k = 0; k < 4; ++k) mean_[cells_[4 * c + k]] += share;
  }
  for (size_t s = 0; s < nearest_.size(); ++s) out[s] = float(mean_[nearest_[s]] / around_[nearest_[s]]);
  return true;
}

}  // namespace cli
