// Which pairs may touch, and by which law; step/pair_table.h fills them from the rules.
#pragma once
#include <cstdint>
#include <vector>

#include "broad/pair_filter.h"

namespace dfm {

struct LawInstance;

struct PairTables {
  std::vector<uint32_t> law;  // [body][body or obstacle] -> index into World::laws
  // as law -> first in zone_law [zone a][zone b], kNone: the pair has one law; empty: all have
  std::vector<uint32_t> zone_table, zone_law;
  std::vector<uint32_t> tool_law;  // of tools with each other and with rigid bodies
  PairFilter filter;
  std::vector<LawInstance *> laws;
};

}  // namespace dfm
