// Selects among the kernels compiled for several vector widths.
#pragma once
#include <cstdlib>
#include <cstring>

#include "entry.h"

namespace model {

enum Width { kSse2, kAvx2, kAvx512 };

#if defined(__x86_64__)
inline constexpr bool kHasWider = true;  // than 128 bits: other processors get no such kernels
inline bool has_avx2() { return __builtin_cpu_supports("avx2"); }
inline bool has_avx512() {
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
         __builtin_cpu_supports("avx512dq");
}
#else
inline constexpr bool kHasWider = false;
inline bool has_avx2() { return false; }
inline bool has_avx512() { return false; }
#endif

// The widest that this processor has, or that of DEFORM_SIMD. `who` begins the sentence in the log.
inline Width choose_width(const dfm_host *host, const char *who) {
  const bool avx2 = has_avx2(), avx512 = has_avx512();
  const Width best = avx512 ? kAvx512 : avx2 ? kAvx2 : kSse2;
  const char *forced = std::getenv("DEFORM_SIMD");
  if (!forced || !*forced) return best;
  if (!std::strcmp(forced, "sse2")) return kSse2;
  if (!std::strcmp(forced, "avx2") && avx2) return kAvx2;
  if (!std::strcmp(forced, "avx512") && avx512) return kAvx512;
  say(host, 2, who,
      "DEFORM_SIMD is none of sse2, avx2, avx512 or this processor lacks it; the best it has is used");
  return best;
}

}  // namespace model
