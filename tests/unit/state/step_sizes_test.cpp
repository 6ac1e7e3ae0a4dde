#include "state/step_sizes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

using namespace dfm;

namespace {

// Sub-steps taken; sizes that differ from the one before.
struct Count {
  uint64_t substeps = 0, changes = 0;
  double last = 0;
};

void step(StepSizes &s, double dt, double stable, Count &c) {
  const double n = choose_substeps(s, dt, stable);
  ASSERT_LE(dt / n, stable * (1 + 1e-8));
  const double size = dt / n;
  if (c.last > 0 && std::fabs(size - c.last) > 1e-9 * size) ++c.changes;
  c.last = size;
  for (uint64_t i = 0; i < uint64_t(n); ++i) pass(s, size);
  c.substeps += uint64_t(n);
}

}  // namespace

TEST(StepSizes, FixedStep_IsCutIntoNumbersOfAShortList) {
  for (double q = 0.01; q < 3000; q *= 1.013) {
    StepSizes s;
    const double n = choose_substeps(s, q, 1);
    EXPECT_GE(n, q - 1e-6);
    EXPECT_LE(n, std::max(1.0, q + 1) * 1.25);
    int e;
    const double m = std::frexp(n, &e) * 8;  // 4 to 8: three bits are enough
    EXPECT_EQ(m, std::floor(m)) << n;
  }
  for (const double n : {1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32}) {
    StepSizes s;
    EXPECT_EQ(choose_substeps(s, n, 1), n) << "what divides evenly is not cut finer";
  }
}

TEST(StepSizes, OfferedStep_IsARungNotAboveTheStableOneAndNotCut) {
  for (double stable = 1e-9; stable < 10; stable *= 1.017) {
    StepSizes s;
    const double offer = offered_step(s, stable);
    EXPECT_LE(offer, stable);
    EXPECT_GE(offer, 0.8 * stable);
    EXPECT_EQ(choose_substeps(s, offer, stable), 1);
    EXPECT_EQ(offered_step(s, stable), offer);
  }
  const double none = std::numeric_limits<double>::infinity();
  EXPECT_EQ(offered_step({}, none), none);
  StepSizes s;
  EXPECT_EQ(choose_substeps(s, 5, none), 1);
}

// A bound that wobbles by 30 % for ever, at any period: sizes change with the logarithm of the number of
// sub-steps, then once in some 1e4.
// unsanitized: too slow there; shorter tests run the same code
TEST(StepSizes, BoundThatSwings_ChangesThemEverMoreRarely) {
  for (const bool fed_back : {false, true})
    for (const double period : {2.0, 31.0, 700.0, 9000.0, 2e5}) {
      StepSizes s;
      Count c;
      for (int i = 0; i < 400000; ++i) {
        const double stable = 1e-4 * (1 + 0.3 * std::sin(6.283 * i / period));
        step(s, fed_back ? offered_step(s, stable) : 3.1e-4, stable, c);
      }
      EXPECT_LE(c.changes, 60 + 4 * c.substeps / kMaxPatience) << fed_back << ' ' << period;
    }
}

TEST(StepSizes, BoundOfNoise_ChangesThemRarely) {
  std::mt19937 random(3);
  StepSizes s;
  Count c;
  for (int i = 0; i < 1000000; ++i) {
    const double stable = 1e-4 * (1 - 0.4 * double(random()) / 4294967296.0);
    step(s, offered_step(s, stable), stable, c);
  }
  EXPECT_LE(c.changes, 40u);
}

TEST(StepSizes, AfterADeepDip_RecoverSoon) {
  StepSizes s;
  Count c;
  for (int dip = 0; dip < 12; ++dip) {
    step(s, 1, 1e-3, c);  // patience has grown to its end after these
    const uint64_t start = c.substeps;
    for (int i = 0; i < 100 && c.last < 0.5; ++i) step(s, 1, 1, c);
    EXPECT_GE(c.last, 0.5) << dip;
    EXPECT_LE(c.substeps - start, 4000u) << dip;
  }
}

// Frames of uneven length that a host measures: the number of sub-steps stays, their sizes vary no more
// than the frames.
TEST(StepSizes, FramesThatDifferALittle_KeepTheirNumberOfSubSteps) {
  std::mt19937 random(5);
  StepSizes s;
  double last = 0, changed = 0;
  for (int i = 0; i < 10000; ++i) {
    const double dt = (1 + 0.03 * (double(random()) / 2147483648.0 - 1)) / 60;
    const double stable = 1.3e-3 * (1 + 0.02 * std::sin(0.1 * i));
    const double n = choose_substeps(s, dt, stable);
    changed += last > 0 && n != last;
    last = n;
    for (int k = 0; k < int(n); ++k) pass(s, dt / n);
  }
  EXPECT_LE(changed, 8);
}

TEST(StepSizes, BoundThatFallsInAStep_HalvesItsSubSteps) {
  StepSizes s;
  EXPECT_EQ(choose_substeps(s, 6, 1), 6);
  EXPECT_EQ(cut_finer(s, 1, 0.97), 2);
  EXPECT_EQ(choose_substeps(s, 6, 0.97), 12) << "the next step goes on with the same size";
  EXPECT_EQ(cut_finer(s, 0.5, 0.97), 1);
  EXPECT_GE(cut_finer(s, 1, 0), 1e15) << "no number of sub-steps is enough";
}

// Steps of a host: in turn, in rhythm, and at random. Symplectic Euler moves single modes, from slow ones to
// the stiffest that the bound allows; each takes the damping that is due.
// unsanitized: too slow there; shorter tests run the same code
TEST(StepSizes, ThatAHostVaries_PutNoEnergyIntoAnyMode) {
  std::mt19937 random(7);
  const auto uniform = [&] { return double(random()) / 4294967296.0; };
  struct Host {
    const char *name;
    std::function<double(int)> dt;
  };
  const std::vector<Host> hosts{
      {"a third more or less", [&](int) { return (0.7 + 0.6 * uniform()) / 240; }},
      {"short and uneven", [&](int) { return (0.7 + 0.6 * uniform()) / 2000; }},
      {"a tenth more or less", [&](int) { return (0.9 + 0.2 * uniform()) / 60; }},
      {"any", [&](int) { return std::pow(10, -4.5 + 3 * uniform()); }},
      {"a late one at times", [&](int) { return uniform() < 0.05 ? 0.1 : 1.0 / 144; }},
      {"two in turn", [](int k) { return k % 2 ? 1.0 / 240 : 1.0 / 280; }},
      {"nearly the same two in turn", [](int k) { return k % 2 ? 4.4e-3 : 4e-3; }},
      {"long ones in turn", [](int k) { return k % 2 ? 0.016 : 0.017; }},
      {"three in turn", [](int k) { return k % 3 ? 0.017 : 0.016; }},
      {"sevens in turn", [](int k) { return k / 7 % 2 ? 1.0 / 240 : 1.0 / 280; }},
      {"a long one, a short one", [](int k) { return k % 3 == 0   ? 0.016
                                                     : k % 3 == 1 ? 1e-3
                                                                  : 1e-4; }}};
  constexpr int kModes = 200;
  for (const double bound : {5e-3, 1.3e-3, 6e-4})  // s, of the stiffest mode: 2 / w
    for (const Host &host : hosts) {
      StepSizes s;
      std::vector<double> w(kModes), x(kModes), v(kModes), energy(kModes);
      for (int m = 0; m < kModes; ++m) {
        w[m] = std::pow(0.999 * 2 / bound, m / (kModes - 1.0));
        const double phase = 6.283 * uniform();
        x[m] = std::cos(phase) / w[m];
        v[m] = std::sin(phase);
        energy[m] = 0.5;
      }
      double h = 0;
      for (double t = 0, k = 0; t < 6; ++k) {
        const double dt = host.dt(int(k)), n = choose_substeps(s, dt, 0.9 * bound);
        h = dt / n;
        for (int i = 0; i < int(n); ++i) {
          const double c = next_damping(s, h, bound);
          for (int m = 0; m < kModes; ++m) {
            v[m] -= w[m] * w[m] * (c * v[m] + h * x[m]);
            x[m] += h * v[m];
          }
          pass(s, h);
        }
        t += dt;
      }
      double most = 0;
      for (int m = 0; m < kModes; ++m) {
        const double u = w[m] * x[m], kept = 0.5 * (v[m] * v[m] + u * u - h * w[m] * u * v[m]);
        most = std::max(most, kept / energy[m]);
      }
      // A size has an energy of its own, up to 1 / (1 - w h / 2) times that at the start.
      EXPECT_LT(most, 3) << host.name << ", bound " << bound;
    }
}

// A step that varies once costs damping once, and one that is steady none.
TEST(StepSizes, ThatStaySteady_CallForNoDamping) {
  StepSizes s;
  for (int i = 0; i < 100; ++i) {
    const double stable = 1e-3 * (1 + 0.3 * std::sin(0.1 * i));
    choose_substeps(s, i < 50 ? 1.0 / 60 : 1.0 / 60 * 2, stable);
    EXPECT_EQ(next_damping(s, 1e-4, stable), 0) << i;
  }
}

TEST(StepSizes, StateThatNoWorldReaches_IsReported) {
  EXPECT_TRUE(is_valid(StepSizes{}));
  for (int bad = 0; bad < 6; ++bad) {
    StepSizes s;
    if (bad == 0) s.cut.size = NAN;
    if (bad == 1) s.offer.size = -1;
    if (bad == 2) s.cut.patience = 0;
    if (bad == 3) s.offer.quiet_steps = kMaxPatience + 1;
    if (bad == 4) s.steady = 2 * kSteady;
    if (bad == 5) s.damping = -1;
    EXPECT_FALSE(is_valid(s)) << bad;
  }
}
