// How far contacts' areas go to where they should be: nowhere without motion.
#include <gtest/gtest.h>

#include <vector>

#include "contact/renewal.h"

namespace {

using dfm::ContactPoint;
using dfm::Renewal;

// Two bodies and an obstacle: corners of 0 on 1 and of 1 on 0 are one patch, those of 0 on the obstacle of
// slot 1 another.
struct Patches {
  std::vector<ContactPoint> contacts;
  std::vector<double> impulse, dwell, renewed;
  std::vector<Renewal::Way> ways;
  Renewal renewal{dfm::Memory::standard()};

  Patches() {
    add(0, 1, false);
    add(0, 1, false);
    add(0, 1, true);
    add(1, 0, false);
    impulse.assign(3 * contacts.size(), 0);
    dwell.assign(contacts.size(), 1e3);
    renewed.resize(contacts.size());
    ways.assign(contacts.size(), {0, 1e-6});
    for (size_t i = 0; i < contacts.size(); ++i) impulse[3 * i] = 1;
    renewal.list(contacts, impulse.data());
  }
  void add(uint32_t a, uint32_t b, bool obstacle) {
    ContactPoint c{};
    c.slot_a = a;
    c.slot_b = b;
    c.obstacle = obstacle;
    contacts.push_back(c);
  }
  void measure() { renewal.measure(1e-3, impulse.data(), ways.data(), dwell.data(), renewed.data()); }
};

}  // namespace

TEST(Renewal, PatchThatSticks_IsNotRenewed) {
  Patches p;
  p.measure();
  EXPECT_EQ(p.renewed, std::vector<double>(4, 0));
}

TEST(Renewal, LoadThatGoesFromContactToContact_RenewsNothing) {
  Patches p;
  p.dwell.assign(4, 0);
  p.impulse[0] = 0;
  p.impulse[3] = 1.5;
  p.impulse[9] = 1.5;
  p.measure();
  EXPECT_EQ(p.renewed, std::vector<double>(4, 0));
}

TEST(Renewal, PatchThatSlides_IsRenewedByWayOverDeflectionWhereverItsContactsAre) {
  Patches p;
  p.ways[0].slid = 6e-7;
  p.measure();
  for (const size_t i : {0u, 1u, 3u}) EXPECT_NEAR(p.renewed[i], 0.2, 1e-12) << i;
  EXPECT_EQ(p.renewed[2], 0);
  p.ways[0].slid = 1;
  p.measure();
  EXPECT_EQ(p.renewed[3], 1);
}

TEST(Renewal, LoadThatGrows_RenewsAPatchThatIsBeingMadeAlone) {
  Patches young, old;
  for (Patches *p : {&young, &old}) {
    for (double &d : p->dwell) d = p == &young ? 0 : 10;
    for (double &l : p->impulse) l *= 2;
    p->measure();
  }
  EXPECT_NEAR(young.renewed[0], 0.5, 1e-12);
  EXPECT_NEAR(old.renewed[0], 1e-4, 1e-7);
}

TEST(Renewal, WhatAPatchLacks_GoesToThoseBelowTheirAimAndNoFurther) {
  Patches p;
  const std::vector<uint8_t> keeps_area{1, 1, 1, 0};
  const std::vector<double> target_area{3, 1, 1, 1};
  std::vector<double> area{1, 2, 4, 5};
  p.renewal.fill(keeps_area.data(), target_area.data(), area.data());
  // of 4 the patch had 3; an obstacle's has more than it should, and keeps it
  EXPECT_EQ(area, (std::vector<double>{2, 2, 4, 5}));
  p.renewal.list(p.contacts, p.impulse.data());
  p.renewal.fill(keeps_area.data(), target_area.data(), area.data());
  EXPECT_EQ(area, (std::vector<double>{2, 2, 4, 5}));
}
