// The sound of a series (support/wav.h, belt_study --wav): what the header says, and the period
// that is heard.
#include "wav.h"

#include <gtest/gtest.h>

namespace {

uint32_t number(const std::string &s, size_t at, int bytes) {
  uint32_t v = 0;
  for (int k = 0; k < bytes; ++k) v |= uint32_t(uint8_t(s[at + size_t(k)])) << (8 * k);
  return v;
}

}  // namespace

// Stick-slip as on the belt: 0.1 m/s, and every 6.36 s for two seconds a swing back; 60 s at 1 kHz, a hundred
// times as fast.
TEST(Wav, StickSlip_HasItsHeaderAndItsPeriod) {
  constexpr double kPeriod = 6.36, kFaster = 100, kRate = 1000;
  std::vector<double> speed;
  for (int i = 0; i < 60000; ++i) {
    const double t = std::fmod(i / kRate, kPeriod);
    speed.push_back(t < 2 ? 0.1 - 0.3 * std::sin(1.5707963267948966 * t) : 0.1);
  }
  const std::string s = test::wav(speed, kFaster * kRate);
  const uint32_t n = number(s, 40, 4) / 2;
  EXPECT_EQ(s.substr(0, 4) + s.substr(8, 8) + s.substr(36, 4), "RIFFWAVEfmt data");
  EXPECT_EQ(number(s, 4, 4), s.size() - 8);
  EXPECT_EQ(s.size(), 44 + 2 * size_t(n));
  EXPECT_EQ(number(s, 16, 4), 16u);
  EXPECT_EQ(number(s, 20, 2), 1u) << "PCM";
  EXPECT_EQ(number(s, 22, 2), 1u) << "mono";
  EXPECT_EQ(number(s, 24, 4), 44100u);
  EXPECT_EQ(number(s, 28, 4), 88200u);
  EXPECT_EQ(number(s, 32, 2), 2u);
  EXPECT_EQ(number(s, 34, 2), 16u);
  EXPECT_NEAR(n / 44100.0, 0.6, 1e-4);

  std::vector<double> v;
  int most = 0;
  for (uint32_t i = 0; i < n; ++i) {
    v.push_back(int16_t(number(s, 44 + 2 * size_t(i), 2)));
    most = std::max(most, std::abs(int(v.back())));
  }
  EXPECT_EQ(most, 32767);
  uint32_t best = 0;  // lag of the largest autocorrelation beyond half a period
  double top = -INFINITY;
  for (uint32_t lag = 1500; lag < 4500; ++lag) {
    double sum = 0;
    for (uint32_t i = 0; i + 4500 < n; ++i) sum += v[i] * v[i + lag];
    if (sum > top) {
      top = sum;
      best = lag;
    }
  }
  EXPECT_NEAR(best / 44100.0, kPeriod / kFaster, 0.002 * kPeriod / kFaster);
}
