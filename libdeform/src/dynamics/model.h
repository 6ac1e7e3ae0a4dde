// One body's model: the plugin instance, its parameters and its state. Everything else in the library calls
// models through here.
#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/memory.h"
#include "deform/plugin.h"
#include "deform/plugin_draft.h"
#include "plugin/call.h"
#include "plugin/selection.h"

namespace dfm {

struct ModelInstance {
  const dfm_type *type = nullptr;
  const dfm_model *ops = nullptr;
  const dfm_host *host = nullptr;
  // What the instance's extensions answer, of this library's size.
  std::optional<dfm_stepper> stepper;   // none: a force model, the host integrates
  std::optional<dfm_late_points> late;  // none: a step moves all points
  std::optional<dfm_effects> effects;   // none: whatever the type promises is at work
  std::optional<dfm_idle> idle;         // none: every parameter does what its row says
  std::optional<dfm_limited> limited;   // none: the model limits nothing, or does not say
  std::optional<dfm_caps> claims;       // none: what the type claims holds with all parameters
  std::optional<dfm_f32> f32;           // none: it computes in double precision alone
  bool single = false;                  // add_forces() computes in single precision
  void *self = nullptr;
  std::vector<double> params;
  std::vector<dfm_slot> slots;     // of its state
  Array<double> state, state_out;  // slots end to end

  ModelInstance() = default;
  ModelInstance(const ModelInstance &) = delete;
  ModelInstance &operator=(const ModelInstance &) = delete;
  ~ModelInstance() {
    if (self && ops->destroy)
      call("destroy", [&] {
        ops->destroy(self);
        return DFM_OK;
      });
  }

  // Creates the instance and its state; throws Error naming the plugin where it refuses.
  void create(const dfm_type &t, const dfm_host &host, const dfm_mesh &mesh, const Memory &memory,
              std::vector<double> values);
  // Runs f, which calls into the plugin: an exception becomes a status, a failure is logged as `what`.
  template <class F>
  dfm_status call(const char *what, F &&f) const noexcept {
    return call_plugin(*host, *type, what, f);
  }
  // DFM_CAP_* that hold with the present parameters. Whoever asks what this model can asks here: what
  // dfm_model.caps says holds with some parameters of the type.
  uint32_t caps() const { return caps_; }
  bool can(uint32_t cap) const { return (caps_ & cap) == cap; }
  // From now on add_forces() computes in single precision; throws Error where the model cannot.
  void use_single();
  dfm_status add_forces(const dfm_kin &k, double *f) const noexcept {
    return call("add_forces",
                [&] { return single ? f32->add_forces(self, &k, f) : ops->add_forces(self, &k, f); });
  }
  // Other values, of RUNTIME rows alone; `params` is the caller's to set. Not DFM_OK: nothing has changed.
  // DFM_E_UNSUPPORTED: with them it could not do what is `needed` (DFM_CAP_*), or it takes none.
  dfm_status put_params(const std::vector<double> &values, uint32_t needed) noexcept;
  // Is this effect of the type called for by the present parameters?
  bool works(const std::string &effect) const;
  std::vector<EffectRow> effect_rows() const;  // the model's extension "dfm.effect_rows/1"
  // Why the parameter of this row does nothing now; empty where it does what it says.
  std::string idle_reason(uint32_t row) const;
  uint32_t limited_cells() const;  // at the last bound
  void swap(ModelInstance &other) noexcept;
  void start();  // its state as at first; throws Error
  void commit_state() {
    if (!state.empty()) state.swap(state_out);
  }

 private:
  std::optional<std::vector<dfm_slot>> ask_extensions();  // and its own state slots; throws Error
  dfm_status ask_caps() noexcept;                         // not DFM_OK: it failed, and caps_ is as before
  uint32_t caps_ = 0;
};

// Is a model of this type made with the rest positions as they are before the body's pose? Asked before there
// is an instance, so what the type claims decides (dfm_mesh.rest), whatever its parameters take away.
inline bool rests_unplaced(const dfm_type &type) {
  return static_cast<const dfm_model *>(type.ops)->caps & DFM_CAP_ROTATION_INVARIANT;
}

// Number of state values that slots need on a mesh of these counts.
size_t model_state_size(std::span<const dfm_slot> slots, uint32_t npoint, uint32_t ncell, uint32_t nedge);

}  // namespace dfm
