// The table by which the bodies of an engine take part, shared by adapters: for bodies of a world that the
// caller attached, and for sets that consist of definitions only.
#pragma once
#include <functional>

#include "engine.h"

namespace dfm_rigid_detail {

struct Refused { dfm_status status; };  // thrown; the sentence is set; ends a call of the host

// dfm_rigid_set_def.data of a set that stands for one body of an attached world.
struct Seat {
  static constexpr uint64_t kMagic = 0x6465666f726d6f64ull;
  uint64_t magic = kMagic;
  Member *member = nullptr;
  bool removable = false;              // its adapter removes it
  std::function<dfm_status()> refuse;  // dfm_rigid_destroy: the sentence that says what to call instead
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

// One engine of physics, for the length of the program.
struct EngineKind {
  const char *host;  // name of the rigid host
  const char *call;  // what steps a world with an adapter
  dfm_status (*own_world)(const dfm_rigid_set_def &set, void **self, uint32_t *group, uint32_t *nextra);
};

dfm_rigid_host table_of(const EngineKind &kind);
dfm_status register_host(const EngineKind &kind);  // a second call does nothing
dfm_status failed(dfm_status status, const char *format, ...) __attribute__((format(printf, 2, 3)));
dfm_status missing(const char *argument);

}  // namespace dfm_rigid_detail
