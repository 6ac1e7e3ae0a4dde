// The lowest modes of a body: K w = l M w, W^T M W = 1, M the masses of the points. They do not
// include the rigid motions of a floating body.
#pragma once
#include "basis.h"
#include "elastic.h"

namespace reduced {

// Default number of modes of a body, and the most that it may have.
constexpr uint32_t kDefaultModes = 40, kMaxModes = 1024;

struct Modes {
  uint32_t count = 0;
  Buffer<double> lambda;  // [count] 1/s2, rising
  Basis shape;
  double share = 0;  // of the static response to loads on the surface that they hold
  uint32_t available = 0;

  // By the parameters modes, frequency, share. Throws a sentence where there are none, or model::Refused.
  void create(const dfm_host *host, const char *id, const dfm_mesh &m, const Elastic &body,
              const double *params);
};

}  // namespace reduced
