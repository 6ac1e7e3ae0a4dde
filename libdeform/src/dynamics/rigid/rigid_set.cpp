#include "dynamics/rigid/rigid_set.h"

#include <algorithm>
#include <new>

#include "math/turn.h"
#include "math/vec3.h"

namespace dfm {
namespace {

constexpr size_t kStateValues = sizeof(dfm_rigid_state) / sizeof(double);

}  // namespace

void need_memory(dfm_status status) {
  if (status == DFM_E_NOMEM) throw std::bad_alloc();
}

bool finite_values(std::span<const dfm_rigid_state> states) {
  return all_finite(reinterpret_cast<const double *>(states.data()), kStateValues * states.size());
}

RigidSet::RigidSet(World &w, const Memory &m, const std::string &name)
    : world(&w), host_name(name), host(find_host(name)) {
  use_memory(m, state, next, motors);
  use_memory(m, extra, next_extra, velocity, impulse, first, revised, total, wrench);
}

RigidSet::~RigidSet() {
  if (self) host.destroy(self);
}

void RigidSet::begin(const SubStep &now) {
  step = {sizeof step,
          static_cast<uint32_t>(defs.size()),
          now.time,
          now.h,
          {now.gravity.x, now.gravity.y, now.gravity.z},
          state.data(),
          extra.data()};
}

HostFault RigidSet::free_motion() {
  std::fill(velocity.begin(), velocity.end(), 0.0);
  const dfm_status status = host.predict(self, &step, velocity.data());
  if (status != DFM_OK) return {status, "gave no velocities"};
  if (!all_finite(velocity.data(), velocity.size())) return {DFM_OK, "gave velocities that are not finite"};
  return {};
}

HostFault RigidSet::respond(uint32_t of_group, uint32_t bodies, double *matrix) {
  const size_t width = 6 * size_t{bodies};
  const dfm_status status = host.respond(self, &step, of_group, matrix);
  if (status != DFM_OK || !all_finite(matrix, width * width)) return {status, "does not answer impulses"};
  return {};
}

HostFault RigidSet::revise(bool &changed) {
  uint32_t any = 0;
  const dfm_status status = host.revise(self, &step, impulse.data(), revised.data(), &any);
  changed = any != 0;
  if (status != DFM_OK || !all_finite(revised.data(), revised.size()))
    return {status, "does not answer contact"};
  return {};
}

HostFault RigidSet::take_impulses() {
  const dfm_status status = host.push ? host.push(self, &step, impulse.data()) : DFM_OK;
  return status == DFM_OK ? HostFault{} : HostFault{status, "did not take its impulses"};
}

HostFault RigidSet::end_state(bool &again) {
  const dfm_status status = host.commit(self, &step, impulse.data(), next.data(), next_extra.data());
  if (status != DFM_OK && status != DFM_RIGID_AGAIN) return {status, "could not end its step"};
  again = status == DFM_RIGID_AGAIN;
  for (uint32_t i = 0; i < defs.size(); ++i)
    if (group[i] == DFM_RIGID_STILL) next[i] = state[i];
  if (!finite_values(next) || !all_finite(next_extra.data(), next_extra.size()))
    return {DFM_OK, "ended its step with something not finite"};
  return {};
}

void RigidSet::commit(const SubStep &now, double fraction) {
  for (uint32_t i = 0; fraction < 1 && i < defs.size(); ++i) {
    const dfm_rigid_state &from = state[i];
    dfm_rigid_state &to = next[i];
    store3(to.position, load3(from.position) + fraction * (load3(to.position) - load3(from.position)));
    store_quat(to.rotation, slerp(load_quat(from.rotation), load_quat(to.rotation), fraction));
  }
  state.swap(next);
  extra.swap(next_extra);
  for (uint32_t i = 0; i < defs.size(); ++i)
    for (uint32_t k = 0; k < 3; ++k) total[3 * i + k] += impulse[6 * i + k];
  for (size_t k = 0; k < wrench.size(); ++k) wrench[k] = impulse[k] / now.h;
}

}  // namespace dfm
