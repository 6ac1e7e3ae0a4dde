#include "state/body.h"

#include <algorithm>
#include <cstring>

#include "body/feature_map.h"
#include "body/self_rest.h"
#include "state/search_tree.h"
#include "state/world.h"

namespace dfm {

Body::Body() = default;
Body::~Body() = default;

bool Body::loads_vary() const {
  return !springs.empty() || std::any_of(loads.begin(), loads.end(), [](const Load &l) {
    return !l.keys.empty() || l.sine.amplitude[0] != 0;
  });
}

void Body::relax_dampers() {
  for (Array<double> *a : {&p.dampers.v, &p.dampers.slow})
    if (p.dampers.lag > 0) a->assign(p.v.begin(), p.v.end());
    else a->clear();
  const std::span<double> seen = model.seen_velocity();
  for (size_t at = 0; at < seen.size(); ++at) seen[at] = p.v[kStride * (at / 3) + at % 3];
}

double Body::young() const {
  for (const CellField &f : fields)
    if (f.key == "young") return *std::max_element(f.values.begin(), f.values.end());
  size_t at = 0;
  for (uint32_t i = 0; i < model.type->nparam; at += model.type->params[i++].width)
    if (!std::strcmp(model.type->params[i].key, "young")) return model.params[at];
  return 0;
}

double Body::impulse_time() const {
  if (!world->plan.touches()) return 0;
  return sleep_state.h > 0 ? sleep_state.h : world->store.h;
}

}  // namespace dfm
