// Contacts between cut faces that hold the same points in more ways than these can move.
#include "contact/redundant.h"

#include <gtest/gtest.h>

namespace {

using namespace dfm;

struct Held { std::vector<std::pair<uint32_t, double>> points; };

// Points 0 to 9, of 1 kg each; all contacts are loaded and between cut faces.
bool found(const std::vector<Held> &contacts, bool cut = true) {
  ContactRows rows{Memory::standard()};
  rows.n = static_cast<uint32_t>(contacts.size());
  rows.ndof = 10;
  rows.begin = {0};
  for (const Held &c : contacts) {
    for (const auto &[point, weight] : c.points) {
      rows.dof.push_back(point);
      rows.weight.push_back(weight);
    }
    rows.begin.push_back(static_cast<uint32_t>(rows.dof.size()));
    rows.wn.push_back(2);
    rows.impulse.insert(rows.impulse.end(), {1, 0, 0});
  }
  const std::vector<uint8_t> of_cuts(rows.n, 1);
  Redundant redundant(Memory::standard());
  return redundant.found(rows, rows.whole(), cut ? of_cuts.data() : nullptr);
}

const Held kCopies{{{0, 1}, {1, -1}}};
// Edges that cross next to the same two points.
const Held kEdges{{{0, 0.97}, {2, 0.03}, {1, -0.98}, {3, -0.02}}};

TEST(Redundant, OnePairOfPoints_IsHeldTwice) {
  EXPECT_TRUE(found({kCopies, kEdges}));
  EXPECT_FALSE(found({kCopies, kEdges}, false)) << "elsewhere points are counted";
  EXPECT_FALSE(found({kCopies}));
  EXPECT_FALSE(found({kEdges}));
}

TEST(Redundant, ThreePoints_MoveAgainstEachOtherInTwoWays) {
  const Held second{{{1, 1}, {4, -1}}}, third{{{4, 1}, {0, -1}}};
  EXPECT_FALSE(found({kCopies, second}));
  EXPECT_TRUE(found({kCopies, second, third}));
}

// What else touches, and holds points of its own, hides nothing.
TEST(Redundant, ContactsBeside_AreNotCounted) {
  const Held face{{{1, 1}, {5, -0.3}, {6, -0.3}, {7, -0.4}}}, beyond{{{5, 1}, {8, -1}}};
  EXPECT_FALSE(found({kCopies, face, beyond}));
  EXPECT_TRUE(found({kCopies, face, beyond, kEdges}));
}

}  // namespace
