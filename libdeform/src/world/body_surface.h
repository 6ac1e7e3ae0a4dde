// The skin of a new body: the boundary of its cells, or a surface of its own that hangs on its points.
#pragma once
#include "state/body.h"

namespace dfm {

// b.p (rest, x, v) and b.tets stand. Throws Error; tells the log where a surface of its own lies
// outside the cells.
void make_body_surface(Body &b, const dfm_surface_def *def);

// The coupling as models are told about it; lives as long as the body's surface and this object.
class MeshCoupling {
 public:
  MeshCoupling(const Memory &memory, const Surface &surface);
  void tell(dfm_mesh &mesh) const;

 private:
  const Surface &surface_;
  Array<uint32_t> row_, col_;  // of an identity, which needs none otherwise
  Array<double> weight_;
};

}  // namespace dfm
