// A series as sound: RIFF WAVE, mono, 16 bit, 44.1 kHz, little-endian (Microsoft and IBM, Multimedia
// Programming Interface 1.0, 1991).
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace test {

constexpr uint32_t kWavRate = 44100;

// series: `rate` values to a second of the sound, linearly between them; its mean is silence and its largest
// deviation is full scale.
inline std::string wav(const std::vector<double> &series, double rate) {
  double mean = 0, most = 0;
  for (const double v : series) mean += v / double(series.size());
  for (const double v : series) most = std::max(most, std::fabs(v - mean));
  const uint32_t n = series.empty() ? 0 : uint32_t(double(series.size() - 1) / rate * kWavRate) + 1;
  std::string out;
  const auto number = [&](uint32_t v, int bytes) {
    for (int k = 0; k < bytes; ++k) out.push_back(char(v >> (8 * k) & 255));
  };
  out += "RIFF";
  number(36 + 2 * n, 4);
  out += "WAVEfmt ";
  number(16, 4);
  number(1, 2);
  number(1, 2);
  number(kWavRate, 4);
  number(2 * kWavRate, 4);
  number(2, 2);
  number(16, 2);
  out += "data";
  number(2 * n, 4);
  for (uint32_t i = 0; i < n; ++i) {
    const double at = std::min(i * rate / kWavRate, double(series.size() - 1));
    const size_t left = size_t(at), right = std::min(left + 1, series.size() - 1);
    const double v = series[left] + (at - double(left)) * (series[right] - series[left]) - mean;
    number(uint16_t(int16_t(std::lround(most > 0 ? 32767 * v / most : 0))), 2);
  }
  return out;
}

inline bool write_wav(const char *file, const std::vector<double> &series, double rate) {
  std::FILE *const f = std::fopen(file, "wb");
  if (!f) return false;
  const std::string bytes = wav(series, rate);
  const bool whole = std::fwrite(bytes.data(), 1, bytes.size(), f) == bytes.size();
  return std::fclose(f) == 0 && whole;
}

}  // namespace test
