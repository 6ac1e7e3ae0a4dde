// Contacts and attachments name surface features of bodies by number. Here they are with the numbers that
// the features have after a cut, in the body or in the piece that has them now.
#pragma once
#include <vector>

#include "body/feature_map.h"
#include "state/body.h"
#include "state/world.h"

namespace dfm {

// A body that may have the features after the cut: the body itself first, then its pieces.
struct CutTarget {
  uint64_t id;
  const Body *body;
  FeatureMap map;
};

struct Lasting {
  std::vector<Attachment> attachments;
  Array<Crossing> crossings;
  Array<uint64_t> id_a, id_b;  // of the store, as the next two
  Array<uint32_t> feature_a, feature_b;
  std::vector<uint8_t> ended;  // [contacts of the store] 1: its feature is gone

  // For the body whose id the first target has. before: its shape before the cut.
  Lasting(const World &w, const BodyShape &before, const std::vector<CutTarget> &targets);
};

void reserve_ends(World &w, size_t pieces);
// Prepares the world with it, and ends contacts whose feature is gone and attachments without points; after a
// failure the world has what it had. The next search for overlaps covers what is not attached any more. Comes
// after reserve_ends().
void prepare_with(World &w, Lasting &lasting);

}  // namespace dfm
