// The extension "dfm.spring_mask/1" of a Body whose springs() are a Material and which has mask_changed().
#pragma once
#include "entry.h"
#include "mass_spring.h"

namespace msm {

template <class Body>
struct SpringMask {
  static dfm_status set(void *self, uint32_t n, const uint32_t *edges, uint8_t on) {
    Body &body = *static_cast<Body *>(self);
    Material &of = body.springs();
    for (uint32_t k = 0; k < n; ++k)
      if (edges[k] >= of.nedge) {
        model::complain(body.host, Body::kName, "the spring to switch does not exist; nothing was changed");
        return DFM_E_ARG;
      }
    return model::answered([&] {
      Buffer<uint8_t> off;
      off.create(body.host, of.nedge);
      for (uint32_t e = 0; e < of.nedge; ++e) off[e] = !of.edge_off.empty() && of.edge_off[e];
      for (uint32_t k = 0; k < n; ++k) off[edges[k]] = !on;
      off.swap(of.edge_off);
      try {
        body.mask_changed();
      } catch (...) {
        off.swap(of.edge_off);
        body.mask_changed();
        throw;
      }
    });
  }
  static dfm_status get(const void *self, uint8_t *on) {
    const Material &of = static_cast<const Body *>(self)->springs();
    for (uint32_t e = 0; e < of.nedge; ++e) on[e] = of.edge_off.empty() || !of.edge_off[e];
    return DFM_OK;
  }
  static constexpr dfm_spring_mask kTable = {sizeof(dfm_spring_mask), 0, set, get};
};

}  // namespace msm
