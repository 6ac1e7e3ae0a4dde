// What adapters of attached worlds share: bodies and obstacles that represent the engine's, and the handles
// by which callers name an adapter.
#pragma once
#include <algorithm>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>
#include <unordered_map>
#include <vector>

#include "host.h"

namespace dfm_rigid_detail {

#define TRY(call)                                                             \
  do {                                                                        \
    if (const dfm_status status_ = (call); status_ != DFM_OK) return status_; \
  } while (0)

dfm_pose to_pose(const Pose &p);

// The states of a dfm_world's rigid bodies, asked for in one call.
class States {
 public:
  dfm_status poll(dfm_world world);
  // Quick where bodies are asked for in the order in which they were made.
  // null: there is no such body.
  const dfm_rigid_state *of(dfm_rigid rigid);

 private:
  std::vector<dfm_rigid> rigids_;
  std::vector<dfm_rigid_state> states_;
  size_t count_ = 0, next_ = 0;
};

// A body of an attached world and what stands for it.
struct Seated {
  Seat seat;
  dfm_rigid rigid = 0;
  dfm_rigid_state world{};  // what the dfm_world had when both agreed last; of the engine: Member::mark()
  // fresh: the engine's state counts, whatever the dfm_world has been restored to
  bool found = true, fresh = true;

  // member: with its engine and inertia
  dfm_status create(dfm_world in, const char *host, Member &member);
  // Who has moved the body since both worlds agreed: the caller in the engine, or a restore in the dfm_world,
  // which counts for all bodies that were there.
  dfm_status agree(bool restored, States &now);
  dfm_status release();
  // after a step of the dfm_world that ended with `of_step`
  dfm_status after(dfm_status of_step, States &now);
};

// The dfm_world's time and steps when both worlds last agreed: other values mean that it has been restored.
struct Clock {
  double time = 0;
  uint64_t steps = 0;
  bool restored = false;  // until both agree again
  dfm_status poll(dfm_world world);
};

// A step of the dfm_world and with it of the engine. The status of the step comes first, then those of the
// bodies; all bodies are updated after an error. each: calls what it is given for every Seated.
template <class Each>
dfm_status step_both(Engine &engine, dfm_world world, double h, uint32_t *trouble, States &states,
                     Clock &clock, Each &&each) {
  dfm_status status = DFM_OK;
  {
    const Stepping stepping(engine, world);
    status = dfm_world_step(world, h, trouble);
  }
  dfm_status of_states = states.poll(world);
  each([&](Seated &body) {
    const dfm_status of_body = body.after(status, states);
    if (of_states == DFM_OK) of_states = of_body;
  });
  TRY(clock.poll(world));
  clock.restored = false;
  return status != DFM_OK ? status : of_states;
}

// The caller may have destroyed the obstacle that represents a shape: then the shape takes no further part.
dfm_status unbind(dfm_obstacle &obstacle);
// known: of a shape without a body, which is put where it is now without a motion, as if made again; null: of
// a body's
dfm_status set_filter(dfm_obstacle &obstacle, uint32_t category, uint32_t collides_with, Pose *known,
                      const Pose &now);
// known: where the surface of a shape without a body is, after a restore of the dfm_world
dfm_status find_again(dfm_obstacle &obstacle, Pose &known);
// A shape without a body that the caller has moved: its surface comes along within the next step.
dfm_status follow(dfm_obstacle &obstacle, Pose &known, const Pose &now);

// Adapters by handle. Handles count up and are never used twice. Never destroyed: an adapter that was not
// detached is in use by the dfm_world and by the engine. At the program's end these may be destroyed before
// it or after it, and a late call that detaches it must still find it.
template <class Adapter>
class Registry {
 public:
  static Registry &get() {
    static Registry *const registry = new Registry;
    return *registry;
  }
  std::shared_ptr<Adapter> find(uint64_t handle) {
    std::lock_guard lock(mutex_);
    const auto at = all_.find(handle);
    return at == all_.end() ? nullptr : at->second;
  }
  // make: after `clash` has found nothing wrong with the others
  template <class Clash, class Make>
  dfm_status add(Clash &&clash, Make &&make, uint64_t *out) {
    std::lock_guard lock(mutex_);
    for (auto &[handle, other] : all_) TRY(clash(*other));
    all_.emplace(next_, make());
    *out = next_++;
    return DFM_OK;
  }
  void remove(uint64_t handle) {
    std::shared_ptr<Adapter> gone;
    std::lock_guard lock(mutex_);
    gone = std::move(all_[handle]);
    all_.erase(handle);
  }

 private:
  std::mutex mutex_;
  std::unordered_map<uint64_t, std::shared_ptr<Adapter>> all_;
  uint64_t next_ = 1;
};

// No exception leaves.
template <class F>
dfm_status guarded(const EngineKind &kind, F &&f) noexcept {
  try {
    return f();
  } catch (const std::bad_alloc &) {
    return failed(DFM_E_NOMEM, "%s: out of memory", kind.host);
  } catch (...) {
    return failed(DFM_E_FATAL, "%s: internal error: an unexpected exception", kind.host);
  }
}

// Runs f on an adapter, also within its step.
template <class Adapter, class F>
dfm_status with(const EngineKind &kind, uint64_t handle, F &&f) noexcept {
  return guarded(kind, [&] {
    const std::shared_ptr<Adapter> a = Registry<Adapter>::get().find(handle);
    if (!a)
      return failed(DFM_E_HANDLE,
                    "adapter %llu of host \"%s\" does not exist; it has been detached, or never was",
                    static_cast<unsigned long long>(handle), kind.host);
    return f(*a);
  });
}

template <class Adapter, class F>
dfm_status between_steps(const EngineKind &kind, uint64_t handle, F &&f) noexcept {
  return with<Adapter>(kind, handle, [&](Adapter &a) {
    if (a.in_step())
      return failed(DFM_E_BUSY, "the adapter of host \"%s\" is in a step; call this before it or after it",
                    kind.host);
    return f(a);
  });
}

// check: whether the def is one that the adapter takes
template <class Adapter, class Def>
dfm_status attach(const EngineKind &kind, dfm_world world, const Def *def, uint64_t *out,
                  dfm_status (*check)(const Def &)) noexcept {
  return guarded(kind, [&]() -> dfm_status {
    if (!def || !out) return missing(!def ? "def" : "out");
    TRY(check(*def));
    TRY(register_host(kind));
    uint32_t n = 0;
    TRY(dfm_world_bodies(world, 0, nullptr, &n));
    return Registry<Adapter>::get().add(
        [&](const Adapter &other) {
          const char *const shared = other.shares(world, *def);
          return !shared ? dfm_status{DFM_OK}
                         : failed(DFM_E_STATE, "this %s already has an adapter; call dfm_%s_detach first",
                                  shared, kind.host);
        },
        [&] { return std::make_shared<Adapter>(world, *def); }, out);
  });
}

template <class Adapter>
dfm_status detach(const EngineKind &kind, uint64_t handle) noexcept {
  return between_steps<Adapter>(kind, handle, [&](Adapter &) {
    Registry<Adapter>::get().remove(handle);
    return dfm_status{DFM_OK};
  });
}

// A struct of any size that the caller may have (deform/base.h, "structs of another version").
template <class Struct>
void write_sized(Struct *out, Struct value, uint32_t size) {
  value.size = size;
  std::memset(static_cast<void *>(out), 0, size);
  std::memcpy(static_cast<void *>(out), &value, std::min<size_t>(size, sizeof value));
}

// first: its size in 0.1
template <class Struct>
dfm_status give(Struct *out, const Struct &value, uint32_t first) {
  if (!out) return missing("out");
  write_sized(out, value, std::min<uint32_t>(out->size ? out->size : first, sizeof value));
  return DFM_OK;
}

}  // namespace dfm_rigid_detail
