// The engine that a program of this folder is built for: ODE, or Bullet of single or double precision.
#pragma once
#include "rigid.h"
#ifdef DEFORM_TEST_BULLET
#include "deform/bullet_host.h"
#else
#include "deform/ode_host.h"
#endif

namespace test {

#ifdef DEFORM_TEST_BULLET
constexpr const char *kEngine = "bullet";
constexpr double kRounding = DEFORM_TEST_BULLET == 64 ? 1e-16 : 6e-8;  // of the engine's own numbers
constexpr bool kKeepsContacts = true;                                  // from step to step, in no snapshot
inline dfm_status register_engine() { return dfm_bullet_register(); }
#else
constexpr const char *kEngine = "ode";
constexpr double kRounding = 1e-16;
constexpr bool kKeepsContacts = false;
inline dfm_status register_engine() { return dfm_ode_register(); }
#endif

}  // namespace test
