#include "host.h"

#include <cstdarg>
#include <cstdio>
#include <mutex>
#include <new>
#include <vector>

namespace dfm_rigid_detail {
namespace {

template <class F>
dfm_status shielded(F &&f) noexcept {
  try {
    return f();
  } catch (const std::bad_alloc &) {
    return dfm_fail(DFM_E_NOMEM, "rigid host: out of memory");
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
  SeatHost(const EngineKind &kind, Seat &seat) : kind_(kind), seat_(seat), member_(*seat.member) {}
  dfm_status predict(const dfm_rigid_step &step, double *velocity) override {
    if (!member_.engine->in_step)
      return failed(DFM_E_STATE, "a world with an adapter of host \"%s\" is stepped by %s alone", kind_.host,
                    kind_.call);
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
  dfm_status may_destroy() override { return seat_.removable ? dfm_status{DFM_OK} : seat_.refuse(); }

 private:
  const EngineKind &kind_;
  Seat &seat_;
  Member &member_;
};

dfm_status create(void *user, const dfm_rigid_set_def *set, void **self, uint32_t *group, uint32_t *nextra) {
  return shielded([&] {
    const EngineKind &kind = *static_cast<const EngineKind *>(user);
    if (!set->data) return kind.own_world(*set, self, group, nextra);
    Seat &seat = *static_cast<Seat *>(set->data);
    if (seat.magic != Seat::kMagic)
      return failed(DFM_E_ARG, "host \"%s\": the set's data is not an adapter's; leave it NULL", kind.host);
    *self = static_cast<Host *>(new SeatHost(kind, seat));
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

dfm_status missing(const char *what) { return failed(DFM_E_ARG, "argument '%s' is NULL", what); }

dfm_rigid_host table_of(const EngineKind &kind) {
  dfm_rigid_host table{};
  table.size = sizeof table;
  table.user = const_cast<EngineKind *>(&kind);
  table.create = create;
  table.destroy = destroy;
  table.predict = predict;
  table.respond = respond;
  table.commit = commit;
  table.push = push;
  table.set_motor = set_motor;
  table.joint = joint;
  table.may_destroy = may_destroy;
  return table;
}

dfm_status register_host(const EngineKind &kind) {
  static std::mutex mutex;
  static std::vector<const EngineKind *> done;
  std::lock_guard lock(mutex);
  for (const EngineKind *each : done)
    if (each == &kind) return DFM_OK;
  done.reserve(done.size() + 1);
  const dfm_rigid_host table = table_of(kind);
  const dfm_status status = dfm_rigid_host_register(kind.host, &table);
  if (status == DFM_OK) done.push_back(&kind);
  return status;
}

}  // namespace dfm_rigid_detail
