#include "state/body.h"

#include <algorithm>

#include "body/feature_map.h"
#include "body/self_rest.h"
#include "state/cuts_ahead.h"
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

double Body::impulse_time() const { return slumber.asleep ? slumber.h : world->report.h; }

}  // namespace dfm
