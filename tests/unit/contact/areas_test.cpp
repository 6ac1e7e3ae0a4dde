// The area that contacts between two meshes stand for: what carries load shares the patch, once.
#include <gtest/gtest.h>

#include <vector>

#include "contact/areas.h"

namespace {

using dfm::ContactPoint;

constexpr double kTouch = 1e-5;  // m; where a distance is not set it is 0

// Corner `node` of body a on a face of body b, or the other way round; weights on the face's corners.
ContactPoint corner(uint32_t a, uint32_t b, uint32_t node, std::vector<std::pair<uint32_t, double>> face,
                    double area) {
  ContactPoint c{};
  c.kind = dfm::kVertexFace;
  c.slot_a = a;
  c.slot_b = b;
  c.feature_a = node;
  c.area = area;
  c.node[0] = node;
  c.weight[0] = 1;
  c.nnode = 1;
  for (const auto &[n, w] : face) {
    c.node[c.nnode] = n;
    c.weight[c.nnode++] = -w;
  }
  return c;
}

ContactPoint crossing(uint32_t a0, uint32_t a1, double s, uint32_t b0, uint32_t b1, double t) {
  ContactPoint c{};
  c.kind = dfm::kEdgeEdge;
  c.type_a = 1;
  c.slot_a = 0;
  c.slot_b = 1;
  c.nnode = 4;
  const uint32_t node[4] = {a0, a1, b0, b1};
  const double weight[4] = {1 - s, s, t - 1, -t};
  for (int k = 0; k < 4; ++k) {
    c.node[k] = node[k];
    c.weight[k] = weight[k];
  }
  return c;
}

std::vector<double> shared(const std::vector<ContactPoint> &contacts, const std::vector<double> &load) {
  std::vector<double> impulse(3 * contacts.size()), area(contacts.size());
  for (size_t i = 0; i < load.size(); ++i) impulse[3 * i] = load[i];
  dfm::AreaShares areas(dfm::Memory::standard());
  areas.share(contacts, impulse.data(), kTouch, area.data());
  return area;
}

}  // namespace

// Body a's nodes are 0.., body b's 100.. . Detection gives halves: 1 of 2.
TEST(AreaShares, CornersOfOneSideOnly_HaveTheirWholeAreas) {
  const std::vector<ContactPoint> c{corner(0, 1, 0, {{100, 0.2}, {101, 0.3}, {102, 0.5}}, 1),
                                    corner(0, 1, 1, {{100, 0.6}, {101, 0.2}, {102, 0.2}}, 1)};
  EXPECT_EQ(shared(c, {1, 1}), (std::vector<double>{2, 2}));
}

TEST(AreaShares, CornersOfBothSides_HaveHalfWhereTheOtherSideIsCovered) {
  const std::vector<ContactPoint> c{corner(0, 1, 0, {{100, 0.25}, {101, 0.25}, {102, 0.5}}, 1),
                                    corner(1, 0, 100, {{0, 1}}, 1)};
  EXPECT_EQ(shared(c, {1, 1}), (std::vector<double>{2 / 1.25, 1}));
  EXPECT_EQ(shared(c, {1, 0})[0], 2) << "what carries nothing covers nothing";
}

// Beside a concave edge the place on the other face's plane lies beyond that face.
TEST(AreaShares, PlaceBeyondAFace_NeverMakesAnAreaNegative) {
  const std::vector<ContactPoint> c{corner(0, 1, 0, {{100, -2}, {101, 1.5}, {102, 1.5}}, 1),
                                    corner(1, 0, 100, {{0, 1}}, 1)};
  EXPECT_EQ(shared(c, {1, 1})[0], 2);
  EXPECT_GE(shared(c, {0, 0})[0], 0);
}

TEST(AreaShares, Crossing_TakesFromLoadedCornersAndMakesNone) {
  const std::vector<ContactPoint> c{corner(0, 1, 0, {{110, 1}}, 1), corner(0, 1, 1, {{111, 1}}, 1),
                                    crossing(0, 1, 0.25, 100, 101, 0.5)};
  const std::vector<double> all = shared(c, {1, 1, 1});
  EXPECT_DOUBLE_EQ(all[0] + all[1] + all[2], 4);
  EXPECT_DOUBLE_EQ(all[2], 2 * 0.75 / 1.75 + 2 * 0.25 / 1.25);
  const std::vector<double> idle = shared(c, {1, 1, 0});
  EXPECT_EQ(idle[0], 2) << "a crossing that carries nothing takes nothing";
  EXPECT_DOUBLE_EQ(idle[2], all[2]) << "and will not start with nothing";
}

TEST(AreaShares, CrossingBetweenIdleCorners_StillHasSome) {
  const std::vector<ContactPoint> c{corner(0, 1, 0, {{110, 1}}, 1), crossing(0, 1, 0.25, 100, 101, 0.5)};
  EXPECT_GT(shared(c, {0, 1})[1], 0);
}

// Of redundant contacts in one place some idle: the patch is theirs that bear.
TEST(AreaShares, CornerThatTouchesIdle_GivesAllToCrossingsBesideIt) {
  std::vector<ContactPoint> c{corner(0, 1, 0, {{110, 1}}, 1), corner(0, 1, 1, {{111, 1}}, 1),
                              crossing(0, 1, 0.25, 100, 101, 0.5), crossing(0, 1, 0.5, 101, 102, 0.5)};
  const std::vector<double> idle = shared(c, {0, 1, 1, 1});
  EXPECT_DOUBLE_EQ(idle[1] + idle[2] + idle[3], 4);
  EXPECT_DOUBLE_EQ(idle[2], 2 * 0.75 / 1.25 + 2 * 0.25 / 1.75);
  EXPECT_GT(idle[0], 0) << "and will not start with nothing";
  c[0].distance = 2 * kTouch;
  const std::vector<double> apart = shared(c, {0, 1, 1, 1});
  EXPECT_DOUBLE_EQ(apart[1] + apart[2] + apart[3], 2)
      << "a corner that does not touch is no part of the patch";
}
