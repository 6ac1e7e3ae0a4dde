// The tables by which ODE's bodies take part: one for bodies of a world that the caller attached, one for
// sets that bring nothing but their defs.
#pragma once
#include "engine.h"

namespace dfm_ode_detail {

// dfm_rigid_set_def.data of a set that stands for one body of an attached world.
struct Seat {
  static constexpr uint64_t kMagic = 0x6465666f726d6f64ull;
  uint64_t magic = kMagic;
  Member member;
  bool leaves = false;  // its adapter takes it away
};

// What the table calls.
class Host {
 public:
  virtual ~Host() = default;
  virtual dfm_status predict(const dfm_rigid_step &step, double *velocity) = 0;
  virtual void respond(const dfm_rigid_step &step, uint32_t group, double *matrix) = 0;
  virtual void push(const dfm_rigid_step &step, const double *impulse) = 0;
  // true: solve again
  virtual bool commit(const dfm_rigid_step &step, dfm_rigid_state *state, double *extra) = 0;
  virtual dfm_status may_destroy() { return DFM_OK; }
  virtual dfm_status set_motor(uint32_t, double, double, double *) { return DFM_E_ARG; }
  virtual dfm_status joint(const dfm_rigid_state *, const double *, uint32_t, double *, double *, double *) {
    return DFM_E_ARG;
  }
};

dfm_status register_host();  // "ode"; a second call does nothing
dfm_status check_ode();      // precision and version at run time, with its sentence
dfm_status failed(dfm_status status, const char *format, ...) __attribute__((format(printf, 2, 3)));

}  // namespace dfm_ode_detail
