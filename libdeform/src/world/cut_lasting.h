// What the world keeps by numbers of a body's surface features, with those that they have after a cut or in
// the piece that they have gone to.
#pragma once
#include <vector>

#include "body/feature_map.h"
#include "state/body.h"
#include "state/world.h"

namespace dfm {

// Where features may be: the body itself first, then its pieces.
struct CutTarget {
  uint64_t id;
  uint32_t slot;
  FeatureMap map;
};

struct Lasting {
  std::vector<Attachment> attachments;
  Array<Crossing> crossings;
  Array<ContactPoint> contacts;  // of the report
  Array<uint64_t> id_a, id_b;    // of the store
  std::vector<uint8_t> ended;    // [contacts of the store] its feature has gone

  // Of the body whose id and slot the first target has.
  Lasting(const World &w, const std::vector<CutTarget> &targets);
};

void exchange(World &w, Lasting &other) noexcept;
// Contacts whose feature has gone, and attachments that hold nothing any more. Room for the events is there.
void end_what_went(World &w, const Lasting &lasting);

}  // namespace dfm
