#include "core/float_env.h"

namespace dfm {

void FloatEnv::apply() const noexcept {
#if defined(__x86_64__)
  uint16_t control = 0;
  asm volatile("fnstcw %0" : "=m"(control));
  control = static_cast<uint16_t>((control & ~kX87) | x87_);
  asm volatile("fldcw %0" : : "m"(control));
  _mm_setcsr((_mm_getcsr() & ~kMxcsr) | mxcsr_);
#elif defined(__aarch64__)
  asm volatile("msr fpcr, %0" : : "r"(fpcr_));
#else
  std::fesetround(rounding_);
#endif
}

}  // namespace dfm
