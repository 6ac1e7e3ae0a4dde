// A class of the library as the table of a rigid host: what each has of it. No exception leaves it.
#pragma once
#include <new>

#include "deform/rigid.h"

namespace dfm {

template <class F>
dfm_status shielded(F &&f) noexcept {
  try {
    f();
    return DFM_OK;
  } catch (const std::bad_alloc &) {
    return DFM_E_NOMEM;
  } catch (...) {
    return DFM_E_FATAL;
  }
}

template <class Host>
struct HostTable {
  static Host &of(void *self) { return *static_cast<Host *>(self); }
  static void destroy(void *self) { delete static_cast<Host *>(self); }
  static dfm_status predict(void *self, const dfm_rigid_step *step, double *velocity) {
    return shielded([&] { of(self).predict(*step, velocity); });
  }
  static dfm_status respond(void *self, const dfm_rigid_step *step, uint32_t group, double *matrix) {
    return shielded([&] { of(self).respond(*step, group, matrix); });
  }
  static dfm_status commit(void *self, const dfm_rigid_step *step, const double *impulse,
                           dfm_rigid_state *state, double *extra) {
    return shielded([&] { of(self).commit(*step, impulse, state, extra); });
  }
  static dfm_rigid_host make(decltype(dfm_rigid_host::create) create) {
    dfm_rigid_host t{};
    t.size = sizeof t;
    t.create = create;
    t.destroy = destroy;
    t.predict = predict;
    t.respond = respond;
    t.commit = commit;
    return t;
  }
};

}  // namespace dfm
