// Makes the surface of a new body: the boundary of its cells, or its own surface, coupled to its points.
#pragma once
#include "state/body.h"

namespace dfm {

// b.p (rest, x, v) and b.tets are complete. Throws Error; logs a warning if its own surface is outside the
// cells. smooth: degrees, of make_bulges().
void make_body_surface(Body &b, const dfm_surface_def *def, double smooth);

// The coupling in the form that models get; valid as long as the surface of the body and this object.
class MeshCoupling {
 public:
  MeshCoupling(const Memory &memory, const Surface &surface);
  void fill_mesh(dfm_mesh &mesh) const;

 private:
  const Surface &surface_;
  Array<uint32_t> row_, col_;  // of an identity, which stores no rows otherwise
  Array<double> weight_;
};

}  // namespace dfm
