// The floating-point environment that the library computes in, whatever the host's threads have.
#pragma once
#include <cfenv>
#include <cstdint>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace dfm {

// The part of a thread's floating-point environment that changes results or raises signals; the sticky
// exception flags are not part of it.
class FloatEnv {
 public:
  static FloatEnv now() noexcept;
  // Rounding to nearest, denormal numbers, no signals: as a process starts.
  static FloatEnv usual() noexcept;
  void apply() const noexcept;  // not inline, so that no arithmetic of the caller moves before it
  bool operator==(const FloatEnv &) const = default;
  // What differs from `other`, as text: "the rounding mode".
  const char *difference(const FloatEnv &other) const noexcept;

 private:
#if defined(__x86_64__)
  // Intel SDM 1, 10.2.3; the low bits are the flags
  static constexpr uint32_t kMxcsr = 0xffc0, kMxcsrRounding = 0x6000, kMxcsrDenormals = 0x8040;
  // Intel SDM 1, 8.1.5
  static constexpr uint16_t kX87 = 0x0f3f, kX87Rounding = 0x0c00, kX87Precision = 0x0300;
  uint32_t mxcsr_ = 0;
  uint16_t x87_ = 0;
#elif defined(__aarch64__)
  uint64_t fpcr_ = 0;
#else
  int rounding_ = 0;
#endif
};

#if defined(__x86_64__)
inline FloatEnv FloatEnv::now() noexcept {
  FloatEnv e;
  uint16_t control = 0;
  asm volatile("fnstcw %0" : "=m"(control));
  e.mxcsr_ = _mm_getcsr() & kMxcsr;
  e.x87_ = control & kX87;
  return e;
}
inline FloatEnv FloatEnv::usual() noexcept {
  FloatEnv e;
  e.mxcsr_ = 0x1f80;
  e.x87_ = 0x033f;
  return e;
}
inline const char *FloatEnv::difference(const FloatEnv &o) const noexcept {
  const uint32_t sse = mxcsr_ ^ o.mxcsr_, x87 = static_cast<uint32_t>(x87_ ^ o.x87_);
  if ((sse & kMxcsrRounding) || (x87 & kX87Rounding)) return "the rounding mode";
  if (sse & kMxcsrDenormals) return "how denormal numbers are treated";
  return x87 & kX87Precision ? "the precision of the x87 unit"
                             : "which floating-point exceptions raise a signal";
}
#elif defined(__aarch64__)
inline FloatEnv FloatEnv::now() noexcept {
  FloatEnv e;
  asm volatile("mrs %0, fpcr" : "=r"(e.fpcr_));
  return e;
}
inline FloatEnv FloatEnv::usual() noexcept { return {}; }
inline const char *FloatEnv::difference(const FloatEnv &o) const noexcept {
  const uint64_t changed = fpcr_ ^ o.fpcr_;  // RMode 22-23, FZ 24
  return changed & 0xc00000    ? "the rounding mode"
         : changed & 0x1000000 ? "how denormal numbers are treated"
                               : "which floating-point exceptions raise a signal";
}
#else
inline FloatEnv FloatEnv::now() noexcept {
  FloatEnv e;
  e.rounding_ = std::fegetround();
  return e;
}
inline FloatEnv FloatEnv::usual() noexcept {
  FloatEnv e;
  e.rounding_ = FE_TONEAREST;
  return e;
}
inline const char *FloatEnv::difference(const FloatEnv &) const noexcept { return "the rounding mode"; }
#endif

// While an object of this type exists, its thread computes in the usual environment; then it has its own.
class UsualFloatEnv {
 public:
  UsualFloatEnv() noexcept : outer_(FloatEnv::now()), other_(!(outer_ == FloatEnv::usual())) {
    if (other_) FloatEnv::usual().apply();
  }
  ~UsualFloatEnv() {
    if (other_) outer_.apply();
  }
  UsualFloatEnv(const UsualFloatEnv &) = delete;

 private:
  const FloatEnv outer_;
  const bool other_;
};

}  // namespace dfm
