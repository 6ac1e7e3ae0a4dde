// How contacts of a patch share its area by what they carry.
#include <gtest/gtest.h>

#include <vector>

#include "contact/exchange.h"

namespace {

using dfm::AreaExchange;
using dfm::ContactPoint;

constexpr uint32_t kSide = 7, kCount = kSide * kSide;

// A sheet of unit squares, seen from below (normals of the body down, of the contacts up). alternate: the
// diagonals of neighbors mirror each other, so that corners have eight triangles and four in turn.
struct Sheet {
  dfm::Surface surface;
  std::vector<ContactPoint> contacts;
  std::vector<double> area = std::vector<double>(kCount), passed, impulse = std::vector<double>(3 * kCount);
  std::vector<uint32_t> law = std::vector<uint32_t>(kCount, 0);
  AreaExchange exchange{dfm::Memory::standard()};

  explicit Sheet(bool alternate) {
    for (uint32_t j = 0; j < kSide; ++j)
      for (uint32_t i = 0; i < kSide; ++i) surface.x.insert(surface.x.end(), {double(i), double(j), 0, 0});
    for (uint32_t j = 0; j + 1 < kSide; ++j)
      for (uint32_t i = 0; i + 1 < kSide; ++i) {
        const uint32_t a = j * kSide + i, b = a + 1, c = b + kSide, d = a + kSide;
        if (alternate && (i + j) % 2) surface.tri.insert(surface.tri.end(), {a, d, b, b, d, c});
        else surface.tri.insert(surface.tri.end(), {a, c, b, a, d, c});
      }
    surface.nsurfel = kCount;
    surface.ntri = uint32_t(surface.tri.size() / 3);
    for (uint32_t s = 0; s < kCount; ++s) {
      surface.fan_begin.push_back(uint32_t(surface.fan.size()));
      for (uint32_t t = 0; t < surface.ntri; ++t)
        for (int k = 0; k < 3; ++k)
          if (surface.tri[3 * t + uint32_t(k)] == s) {
            surface.fan.push_back(t);
            area[s] += 1.0 / 6;
          }
    }
    surface.fan_begin.push_back(uint32_t(surface.fan.size()));
    for (uint32_t s = 0; s < kCount; ++s) {
      ContactPoint c{};
      c.kind = dfm::kPrimitive;
      c.obstacle = 1;
      c.feature_a = s;
      c.nnode = 1;
      c.node[0] = s;
      c.weight[0] = 1;
      c.normal[2] = 1;
      c.area = area[s];
      contacts.push_back(c);
    }
  }
  template <class F>
  void pass(F &&load) {
    const dfm::DofSource source{0, kCount, 0, kCount, &surface, nullptr, nullptr};
    for (uint32_t s = 0; s < kCount; ++s) impulse[3 * s] = load(s);
    exchange.list(contacts, {&source, 1}, law.data(), area.data());
    passed = area;
    exchange.pass(contacts, {&source, 1}, impulse.data(), passed.data());
  }
  double sum() const {
    double a = 0;
    for (uint32_t s = 0; s < kCount; ++s) a += passed[s];
    return a;
  }
  double pressure(uint32_t s) const { return impulse[3 * s] / passed[s]; }
  static bool inner(uint32_t s) {
    return s % kSide > 1 && s % kSide + 2 < kSide && s / kSide > 1 && s / kSide + 2 < kSide;
  }
};

}  // namespace

TEST(AreaExchange, LoadThatAlternates_BecomesOnePressure) {
  Sheet sheet(true);
  // between the same for all and a third of the triangles each
  sheet.pass([&](uint32_t s) { return 0.3 + 0.7 * sheet.area[s]; });
  EXPECT_NEAR(sheet.sum(), 36, 1e-12);
  for (uint32_t s = 0; s < kCount; ++s)
    if (Sheet::inner(s)) {
      EXPECT_NEAR(sheet.pressure(s), sheet.pressure(kCount / 2), 1e-3) << s;
    }
  Sheet thirds(true);
  thirds.passed = thirds.area;
  for (uint32_t s = 0; s < kCount; ++s) thirds.impulse[3 * s] = 0.3 + 0.7 * thirds.area[s];
  EXPECT_GT(std::fabs(thirds.pressure(kCount / 2) - thirds.pressure(kCount / 2 + 1)), 0.2)
      << "what there was to even out";
}

TEST(AreaExchange, PressureThatFallsAcross_StaysSo) {
  Sheet sheet(false);
  sheet.pass([&](uint32_t s) { return sheet.area[s] * (1 + 0.05 * (s % kSide)); });
  for (uint32_t s = 0; s < kCount; ++s)
    if (Sheet::inner(s)) {
      EXPECT_NEAR(sheet.passed[s] / sheet.area[s], 1, 3e-3) << s;
    }
  EXPECT_NEAR(sheet.sum(), 36, 1e-12);
}

TEST(AreaExchange, CornerThatBeginsToCarry_TakesNothingAtOnce) {
  Sheet without(true), barely(true);
  without.pass([](uint32_t s) { return s == kCount / 2 ? 0.0 : 1.0; });
  barely.pass([](uint32_t s) { return s == kCount / 2 ? 1e-9 : 1.0; });
  for (uint32_t s = 0; s < kCount; ++s) EXPECT_NEAR(without.passed[s], barely.passed[s], 1e-7) << s;
  EXPECT_NEAR(without.sum(), 36, 1e-12);
}

TEST(AreaExchange, TwoLaws_KeepWhatTheyHave) {
  Sheet sheet(true);
  for (uint32_t s = 0; s < kCount; ++s) sheet.law[s] = s % kSide < 3 ? 0 : dfm::kNone;
  sheet.pass([](uint32_t) { return 1.0; });
  double with = 0, before = 0;
  for (uint32_t s = 0; s < kCount; ++s) {
    if (sheet.law[s] != dfm::kNone) {
      with += sheet.passed[s];
      before += sheet.area[s];
    } else {
      EXPECT_EQ(sheet.passed[s], sheet.area[s]) << s;
    }
  }
  EXPECT_NEAR(with, before, 1e-12);
}

// On an obstacle's vertices, which take a part of a corner's area, the corner stands for less than its
// triangles: it hands on no more than it has.
TEST(AreaExchange, CornerOfWhichOthersHaveTaken_KeepsSome) {
  Sheet sheet(true);
  const uint32_t middle = kCount / 2;
  sheet.area[middle] *= 0.2;
  sheet.pass([&](uint32_t s) { return s == middle ? 0.01 : 1.0; });
  for (uint32_t s = 0; s < kCount; ++s) EXPECT_GT(sheet.passed[s], 0) << s;
  sheet.contacts[middle].area = 0;  // added by the guard: detection gave it none
  sheet.pass([&](uint32_t s) { return s == middle ? 0.01 : 1.0; });
  EXPECT_EQ(sheet.passed[middle], sheet.area[middle]);
}
