#include "dynamics/model.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

#include "body/phyxels.h"
#include "core/error.h"
#include "mesh/cells.h"
#include "plugin/context.h"
#include "plugin/tables.h"

namespace dfm {
namespace {

// The part of these tables that every version has.
constexpr size_t kStepperHead = offsetof(dfm_stepper, commit) + sizeof(void *);
constexpr size_t kLatePoints = offsetof(dfm_late_points, look) + sizeof(void *);
constexpr size_t kOneFunction = 2 * sizeof(uint32_t) + sizeof(void *);
constexpr size_t kPartForces = offsetof(dfm_part_forces, forces) + sizeof(void *);
constexpr size_t kF32Head = offsetof(dfm_f32, add_forces) + sizeof(void *);

}  // namespace

dfm_kin kin_at(double time, double h, const double *x, const double *v, const double *state) {
  dfm_kin k{};
  k.size = sizeof k;
  k.stride = kStride;
  k.t = time;
  k.dt = h;
  k.x = x;
  k.v = v;
  k.state = state;
  return k;
}

size_t model_state_size(std::span<const dfm_slot> slots, uint32_t npoint, uint32_t ncell, uint32_t nedge) {
  size_t total = 0;
  for (const dfm_slot &slot : slots) {
    const size_t count = slot.unit == DFM_PER_POINT  ? npoint
                         : slot.unit == DFM_PER_CELL ? ncell
                         : slot.unit == DFM_PER_EDGE ? nedge
                                                     : 1;
    total += count * slot.width;
  }
  return total;
}

void ModelInstance::create(const dfm_type &t, const dfm_host &h, const dfm_mesh &mesh, const Memory &memory,
                           std::vector<double> values) {
  type = &t;
  host = &h;
  ops = static_cast<const dfm_model *>(t.ops);
  params = std::move(values);
  if (!(ops->cells & mesh.cell))
    fail(DFM_E_UNSUPPORTED,
         "model '%s' does not accept %s; take corotational_fem, linear_fem, modal or condensed, or a mesh of "
         "first-order tetrahedra",
         t.id, cell_kind(mesh.cell).name);
  if (mesh.inside && !(ops->caps & DFM_CAP_INSIDE))
    fail(DFM_E_UNSUPPORTED,
         "model '%s' takes whole hexahedra, not the cells of a lattice; take corotational_fem, linear_fem, "
         "modal or condensed",
         t.id);
  {
    const Overheard why;
    const dfm_status s = call("create", [&] { return ops->create(host, &mesh, &self); });
    if (s != DFM_OK || !self) {
      self = nullptr;
      fail(s < 0 ? s : DFM_E_FATAL, "model '%s' refused the body: %s", t.id,
           *why.text() ? why.text()
           : s < 0     ? dfm_status_name(s)
                       : "it gave no reason");
    }
    if (*why.text()) static_cast<const dfm_context *>(h.ctx)->log(DFM_LOG_ERROR, why.text());
  }
  const std::optional<std::vector<dfm_slot>> own = query_extensions();
  if (!stepper && !ops->add_forces)
    fail(DFM_E_UNSUPPORTED, "model '%s' neither adds forces nor steps itself; report it to its author", t.id);
  if (own) slots = *own;
  else slots.assign(ops->slots, ops->slots + ops->nslot);
  const size_t nstate = model_state_size(slots, mesh.npoint, mesh.ncell, mesh.nedge);
  state = Array<double>(nstate, 0.0, memory);
  state_out = state;
  find_seen(mesh);
  start();
}

void ModelInstance::find_seen(const dfm_mesh &mesh) {
  const auto seen = copy_table<dfm_seen_velocity>(extension(DFM_EXT_SEEN_VELOCITY), sizeof(dfm_seen_velocity),
                                                  type->id, "dfm_seen_velocity");
  if (!seen) return;
  if (seen->slot >= slots.size() || slots[seen->slot].unit != DFM_PER_POINT ||
      slots[seen->slot].kind != DFM_SLOT_VECTOR)
    bad_type(type->id, "dfm_seen_velocity.slot is no vector by point of its state");
  seen_at = model_state_size(std::span(slots).first(seen->slot), mesh.npoint, mesh.ncell, mesh.nedge);
  nseen = size_t{3} * mesh.npoint;
}

std::optional<std::vector<dfm_slot>> ModelInstance::query_extensions() {
  const auto take = [&]<class T>(std::optional<T> &to, const char *extension_id, size_t head,
                                 const char *name) {
    to = copy_table<T>(extension(extension_id), head, type->id, name);
  };
  take(stepper, "dfm.stepper/1", kStepperHead, "dfm_stepper");
  if (stepper && !(stepper->predict && stepper->respond && stepper->commit))
    fail(DFM_E_UNSUPPORTED,
         "model '%s' steps itself without predict, respond and commit; report it to its author", type->id);
  take(effects, DFM_EXT_EFFECTS, kOneFunction, "dfm_effects");
  take(idle, DFM_EXT_IDLE, kOneFunction, "dfm_idle");
  take(limited, DFM_EXT_LIMITED, kOneFunction, "dfm_limited");
  take(claims, DFM_EXT_CAPS, kOneFunction, "dfm_caps");
  take(f32, DFM_EXT_F32, kF32Head, "dfm_f32");
  take(part_forces, DFM_EXT_PART_FORCES, kPartForces, "dfm_part_forces");
  if (part_forces && !(part_forces->parts && part_forces->forces)) part_forces.reset();
  take(late, DFM_EXT_LATE_POINTS, kLatePoints, "dfm_late_points");
  if (late && !(stepper && late->commit && late->points && late->look)) late.reset();
  if (query_caps() != DFM_OK)
    fail(DFM_E_FATAL, "model '%s' failed to report its abilities; see the log", type->id);
  return copy_slots(type->id, static_cast<const dfm_slots *>(extension(DFM_EXT_SLOTS)), false);
}

void ModelInstance::use_single() {
  if (!f32 || !f32->prepare || !f32->add_forces)
    fail(DFM_E_UNSUPPORTED,
         "model '%s' computes only in double precision; leave precision out, or take a model that has single "
         "precision, such as msm",
         type->id);
  const Overheard why;
  const dfm_status s = call("prepare", [&] { return f32->prepare(self); });
  if (s != DFM_OK)
    fail(s < 0 ? s : DFM_E_FATAL, "model '%s' has no single precision for this body: %s", type->id,
         *why.text() ? why.text() : dfm_status_name(s));
  single = true;
}

dfm_status ModelInstance::query_caps() noexcept {
  uint32_t hold = ~uint32_t{0};
  if (claims && claims->active) {
    const auto query = [&] { hold = claims->active(self); };
    if (const dfm_status s = call("caps", query); s != DFM_OK) return s;
  }
  caps_ = ops->caps & hold;
  if (!ops->energy) caps_ &= ~uint32_t{DFM_CAP_ENERGY};
  return DFM_OK;
}

dfm_status ModelInstance::put_params(const std::vector<double> &values, uint32_t needed) noexcept {
  if (!ops->set_params) return DFM_E_UNSUPPORTED;
  const auto put = [&](const std::vector<double> &v) {
    return call("set_params", [&] { return ops->set_params(self, v.data()); });
  };
  if (const dfm_status s = put(values); s != DFM_OK) return s;
  const dfm_status s = query_caps();
  if (s == DFM_OK && can(needed)) return DFM_OK;
  put(params);
  query_caps();
  return s == DFM_OK ? DFM_E_UNSUPPORTED : s;
}

void ModelInstance::put_initial(Array<double> &to) const {
  to.assign(state.size(), 0.0);
  if (!to.empty() && ops->state_init &&
      call("state_init", [&] { return ops->state_init(self, to.data()); }) != DFM_OK)
    fail(DFM_E_FATAL, "model '%s' could not initialize its state", type->id);
}

bool ModelInstance::works(std::string_view effect) const {
  if (!effects || !effects->active) return true;
  const char *const *active = ask("effects", [&] { return effects->active(self); });
  for (; active && *active; ++active)
    if (effect == *active) return true;
  return false;
}

const void *ModelInstance::extension(const char *id) const noexcept {
  return ops->extension ? ask("extension", [&] { return ops->extension(self, id); }) : nullptr;
}

std::vector<EffectRow> ModelInstance::effect_rows() const {
  return copy_effect_rows(*type, extension(DFM_EXT_EFFECT_ROWS));
}

uint32_t ModelInstance::limited_cells() const {
  return limited && limited->count ? ask("limited", [&] { return limited->count(self); }) : 0;
}

std::string ModelInstance::idle_reason(uint32_t row) const {
  if (!idle || !idle->why) return "";
  const char *const why = ask("idle", [&] { return idle->why(self, row); });
  return why ? why : "";
}

}  // namespace dfm
