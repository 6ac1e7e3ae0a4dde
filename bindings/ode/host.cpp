#include "host.h"

#include <chrono>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <new>

#include "own_world.h"
#include "trap.h"

namespace dfm_ode_detail {
namespace {

template <class F>
dfm_status shielded(F &&f) noexcept {
  try {
    return f();
  } catch (const std::bad_alloc &) {
    return dfm_fail(DFM_E_NOMEM, "ode: out of memory");
  } catch (const Refused &refused) {
    return refused.status;
  } catch (...) {
    return DFM_E_FATAL;
  }
}

Host &host_of(void *self) { return *static_cast<Host *>(self); }

// One body of the caller's world.
class SeatHost : public Host {
 public:
  explicit SeatHost(Seat &seat) : seat_(seat), member_(seat.member) {}
  dfm_status predict(const dfm_rigid_step &step, double *velocity) override {
    if (!member_.engine->in_step)
      return dfm_fail(DFM_E_STATE,
                      "a world with an ODE adapter is stepped by dfm_ode_step, not by dfm_world_step");
    member_.engine->predict(member_, step, 0, velocity);
    return DFM_OK;
  }
  void respond(const dfm_rigid_step &, uint32_t, double *matrix) override {
    member_.engine->respond(member_, matrix);
  }
  void push(const dfm_rigid_step &, const double *impulse) override {
    member_.engine->push(member_, impulse);
  }
  bool commit(const dfm_rigid_step &step, dfm_rigid_state *state, double *extra) override {
    return member_.engine->commit(member_, 0, state, extra, step.h);
  }

  dfm_status may_destroy() override {
    if (seat_.leaves) return DFM_OK;
    return failed(DFM_E_STATE,
                  "the rigid body stands for ODE's body %p, which owns it, and dfm_rigid_destroy would leave "
                  "the adapter without it; call dBodyDestroy, or take its geoms out of the adapter's space, "
                  "and the next dfm_ode_step lets it go; dfm_ode_detach takes all of them away",
                  static_cast<void *>(member_.body));
  }

 private:
  Seat &seat_;
  Member &member_;
};

dfm_status create(void *, const dfm_rigid_set_def *set, void **self, uint32_t *group, uint32_t *nextra) {
  return shielded([&] {
    if (!set->data) return create_own_world(*set, self, group, nextra);
    Seat &seat = *static_cast<Seat *>(set->data);
    if (seat.magic != Seat::kMagic)
      return dfm_fail(DFM_E_ARG, "host \"ode\": the set's data is not an adapter's; leave it NULL");
    *self = static_cast<Host *>(new SeatHost(seat));
    group[0] = 0;
    *nextra = Member::kExtra;
    return dfm_status{DFM_OK};
  });
}
void destroy(void *self) { delete &host_of(self); }
dfm_status predict(void *self, const dfm_rigid_step *step, double *velocity) {
  return shielded([&] { return host_of(self).predict(*step, velocity); });
}
dfm_status respond(void *self, const dfm_rigid_step *step, uint32_t group, double *matrix) {
  return shielded([&] {
    host_of(self).respond(*step, group, matrix);
    return dfm_status{DFM_OK};
  });
}
dfm_status push(void *self, const dfm_rigid_step *step, const double *impulse) {
  return shielded([&] {
    host_of(self).push(*step, impulse);
    return dfm_status{DFM_OK};
  });
}
dfm_status commit(void *self, const dfm_rigid_step *step, const double *, dfm_rigid_state *state,
                  double *extra) {
  return shielded([&] {
    return host_of(self).commit(*step, state, extra) ? dfm_status{DFM_RIGID_AGAIN} : dfm_status{DFM_OK};
  });
}
dfm_status may_destroy(void *self) {
  return shielded([&] { return host_of(self).may_destroy(); });
}
dfm_status set_motor(void *self, uint32_t joint, double velocity, double max, double *extra) {
  return shielded([&] { return host_of(self).set_motor(joint, velocity, max, extra); });
}
dfm_status joint(void *self, const dfm_rigid_state *state, const double *extra, uint32_t number,
                 double *position, double *rate, double *effort) {
  return shielded([&] { return host_of(self).joint(state, extra, number, position, rate, effort); });
}

}  // namespace

dfm_status failed(dfm_status status, const char *format, ...) {
  char text[512];
  va_list args;
  va_start(args, format);
  std::vsnprintf(text, sizeof text, format, args);
  va_end(args);
  return dfm_fail(status, text);
}

dfm_status check_ode() {
  if (sizeof(dReal) != 8 || !dCheckConfiguration("ODE_double_precision"))
    return failed(DFM_E_UNSUPPORTED,
                  "the ODE that is loaded is not of double precision (%s); libdeform_ode needs libode-dev "
                  "0.16 as Debian builds it",
                  dGetConfiguration());
  if (!dCheckConfiguration("ODE_EXT_trimesh"))
    return failed(DFM_E_UNSUPPORTED,
                  "the ODE that is loaded has no triangle meshes (%s); libdeform_ode needs libode-dev 0.16 "
                  "as Debian builds it",
                  dGetConfiguration());
  return DFM_OK;
}

dfm_status register_host() {
  static std::mutex mutex;
  static bool done = false;
  std::lock_guard lock(mutex);
  if (done) return DFM_OK;
  dfm_rigid_host table{};
  table.size = sizeof table;
  table.create = create;
  table.destroy = destroy;
  table.predict = predict;
  table.respond = respond;
  table.commit = commit;
  table.push = push;
  table.set_motor = set_motor;
  table.joint = joint;
  table.may_destroy = may_destroy;
  const dfm_status status = dfm_rigid_host_register("ode", &table);
  done = status == DFM_OK;
  return status;
}

}  // namespace dfm_ode_detail
