// The model of one body: plugin instance, parameters and state. The rest of the library calls models only
// through this file.
#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/memory.h"
#include "deform/plugin.h"
#include "deform/plugin_draft.h"
#include "plugin/call.h"
#include "plugin/selection.h"

namespace dfm {

// The state in which a model is asked: [n,4] places and velocities of the points, and its own values.
dfm_kin kin_at(double time, double h, const double *x, const double *v, const double *state);

// What an instance consists of: all that two exchange.
struct ModelParts {
  const dfm_type *type = nullptr;
  const dfm_model *ops = nullptr;
  const dfm_host *host = nullptr;
  // The extensions of the instance, in the sizes of this library.
  std::optional<dfm_stepper> stepper;          // none: a force model, which the library integrates
  std::optional<dfm_late_points> late;         // none: a step moves all points
  std::optional<dfm_effects> effects;          // none: all effects that the type promises are active
  std::optional<dfm_idle> idle;                // none: every parameter has an effect
  std::optional<dfm_limited> limited;          // none: the model limits nothing, or does not report it
  std::optional<dfm_caps> claims;              // none: the claims of the type hold with all parameters
  std::optional<dfm_f32> f32;                  // none: double precision only
  std::optional<dfm_part_forces> part_forces;  // none: forces come for all points at once
  bool single = false;                         // forces are computed in single precision
  void *self = nullptr;
  std::vector<double> params;
  std::vector<dfm_slot> slots;     // of its state
  Array<double> state, state_out;  // slots end to end
  size_t seen_at = 0, nseen = 0;   // of `state`: velocities that dampers see with a lag; 0: none

 protected:
  uint32_t caps_ = 0;
};

struct ModelInstance : ModelParts {
  ModelInstance() = default;
  // exchange the two
  ModelInstance(ModelInstance &&other) noexcept { swap(other); }
  ModelInstance &operator=(ModelInstance &&other) noexcept {
    swap(other);
    return *this;
  }
  ~ModelInstance() {
    if (self && ops->destroy) call("destroy", [&] { ops->destroy(self); });
  }

  // Creates the instance and its state; throws Error, which names the plugin, if it refuses.
  void create(const dfm_type &t, const dfm_host &host, const dfm_mesh &mesh, const Memory &memory,
              std::vector<double> values);
  const void *extension(const char *id) const noexcept;  // its table; null: none
  // Runs f, which calls into the plugin: an exception becomes a status, a failure is logged as `what`.
  template <class F>
  dfm_status call(const char *what, F &&f) const noexcept {
    return call_plugin(*host, *type, what, f);
  }
  // What f returns; after a failure zero or null.
  template <class F>
  auto ask(const char *what, F &&f) const noexcept {
    decltype(f()) answer{};
    call(what, [&] { answer = f(); });
    return answer;
  }
  // DFM_CAP_* that hold with the present parameters. Use this and not dfm_model.caps, which holds for some
  // parameters of the type only.
  uint32_t caps() const { return caps_; }
  bool can(uint32_t cap) const { return (caps_ & cap) == cap; }
  // From now on forces are computed in single precision; throws Error if the model does not support it.
  void use_single();
  dfm_status add_forces(const dfm_kin &k, double *f) const noexcept {
    return call("add_forces",
                [&] { return single ? f32->add_forces(self, &k, f) : ops->add_forces(self, &k, f); });
  }
  // With part_forces only: take(part, n, point, f) for each part, on any worker.
  template <class Take>
  dfm_status add_part_forces(const dfm_kin &k, const Take &take) const noexcept {
    const dfm_take_part_fn give = [](void *user, uint32_t part, uint32_t n, const uint32_t *point,
                                     const double *f) {
      (*static_cast<const Take *>(user))(part, n, point, f);
    };
    return call("part_forces",
                [&] { return part_forces->forces(self, &k, single, give, const_cast<Take *>(&take)); });
  }
  // Changes values of RUNTIME rows; the caller sets `params`. After an error nothing has changed.
  // DFM_E_UNSUPPORTED: with these values the model would lack what is `needed` (DFM_CAP_*), or it accepts no
  // changes.
  dfm_status put_params(const std::vector<double> &values, uint32_t needed) noexcept;
  // Whether the present parameters call for this effect of the type.
  bool works(std::string_view effect) const;
  std::vector<EffectRow> effect_rows() const;  // the model's extension "dfm.effect_rows/1"
  // Why the parameter of this row has no effect now; empty if it has one.
  std::string idle_reason(uint32_t row) const;
  uint32_t limited_cells() const;                                                // at the last bound
  std::span<double> seen_velocity() { return {state.data() + seen_at, nseen}; }  // [n,3] m/s, or empty
  void swap(ModelInstance &other) noexcept { std::swap<ModelParts>(*this, other); }
  void start() { put_initial(state); }      // throws Error
  void put_initial(Array<double> &) const;  // the state that it starts from; throws Error
  void commit_state() {
    if (!state.empty()) state.swap(state_out);
  }

 private:
  std::optional<std::vector<dfm_slot>> query_extensions();  // and its own state slots; throws Error
  void find_seen(const dfm_mesh &mesh);                     // throws Error
  dfm_status query_caps() noexcept;                         // after an error caps_ is unchanged
};

// Whether a model of this type is created with the rest positions before the pose of the body is applied.
// There is no instance yet, so the claims of the type decide (dfm_mesh.rest), independent of parameters.
inline bool rests_unplaced(const dfm_type &type) {
  return static_cast<const dfm_model *>(type.ops)->caps & DFM_CAP_ROTATION_INVARIANT;
}

// Number of state values that slots need on a mesh of these counts.
size_t model_state_size(std::span<const dfm_slot> slots, uint32_t npoint, uint32_t ncell, uint32_t nedge);

}  // namespace dfm
