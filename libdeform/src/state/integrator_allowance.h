// What implicit steps may cost beyond explicit ones, where the library has chosen them
// (step/counting.h, doc/decisions/implicit_time.md).
#pragma once
#include <cmath>
#include <cstdint>

namespace dfm {

inline constexpr uint32_t kMostTries = 5;

// Part of snapshots: a restored world continues with it.
struct IntegratorAllowance {
  uint32_t open = 0;   // it has been filled for the first time
  uint32_t tries = 0;  // of implicit time that were given up since it has last paid
  double credit = 0;   // s of explicit time
  // s of explicit time: work of single steps that were given up, less what implicit steps have saved since
  double lost = 0;
  double struck_until = 0;  // s, time until which bodies are explicit because of an impact; 0: none
};
// Simulated time by integrator, where the library may change integrators; not in snapshots.
struct IntegratorTimes {
  double all = 0, implicit = 0;  // s
  uint64_t changes = 0;
  bool told = false;       // a warning has said that bodies are implicit
  bool told_blow = false;  // and one that a body did not rebound
};
inline bool sound(const IntegratorAllowance &p) {
  return p.open <= 1 && p.tries <= kMostTries && std::isfinite(p.credit) && p.lost >= 0 &&
         std::isfinite(p.lost) && p.struck_until >= 0 && std::isfinite(p.struck_until);
}

}  // namespace dfm
