#include "world/measure.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>

#include "core/error.h"
#include "mesh/cells.h"
#include "plugin/on_behalf.h"
#include "plugin/params.h"
#include "plugin/registry.h"
#include "plugin/tables.h"
#include "state/world.h"
#include "step/stages.h"
#include "step/step_bound.h"
#include "world/body_model.h"

namespace dfm {

double kinetic_of(const Body &b) {
  double sum = 0;
  for (uint32_t i = 0; i < b.p.n; ++i) sum += 0.5 * b.p.mass[i] * norm2(b.p.v_at(i));
  return sum;
}

CenterMotion center_motion(const Body &b) {
  Vec3 com, momentum;
  for (uint32_t i = 0; i < b.p.n; ++i) {
    com += b.p.mass[i] * b.p.x_at(i);
    momentum += b.p.mass[i] * b.p.v_at(i);
  }
  return {(1 / b.mass) * com, (1 / b.mass) * momentum, momentum};
}

double elastic_energy(Body &b) {
  if (!b.model.can(DFM_CAP_ENERGY)) return NAN;
  const std::lock_guard one_at_a_time(b.querying);
  double joule = 0;
  const dfm_kin k = b.dynamics->kin(b.world->time, 0);
  const OnBehalf prefix(b.name);
  const auto query = [&] { return b.model.ops->energy(b.model.self, &k, &joule); };
  return b.model.call("energy", query) == DFM_OK ? joule : NAN;
}

dfm_body_measure measure(Body &b) {
  dfm_body_measure m{};
  m.mass = b.mass;
  m.rest_volume = b.rest_volume;
  const Phyxels &p = b.p;
  const auto [com, velocity, momentum] = center_motion(b);
  double fastest = 0;
  for (uint32_t i = 0; i < p.n; ++i) fastest = std::max(fastest, norm2(p.v_at(i)));
  Vec3 angular;
  for (uint32_t i = 0; i < p.n; ++i) angular += p.mass[i] * cross(p.x_at(i) - com, p.v_at(i) - velocity);
  m.inverted = inverted_cells(b);
  for (size_t c = 0; c < b.inside.size() / kInsidePoints; ++c)
    each_inside(p.x.data(), kStride, &b.cells[8 * c], &b.inside[kInsidePoints * c],
                [&](double volume, Vec3) { m.volume += volume; });
  for (size_t t = 0; b.inside.empty() && t < b.tets.size(); t += 4)
    m.volume += (b.share.empty() ? 1 : b.share[t / 4]) * tet_volume(p.x.data(), kStride, &b.tets[t]);
  store3(m.com, com);
  store3(m.velocity, velocity);
  store3(m.momentum, momentum);
  store3(m.angular, angular);
  store3(m.contact_impulse,
         b.contact_impulse +
             (b.sleep_state.asleep ? b.world->time - b.sleep_state.since : 0) * b.sleep_state.force);
  m.kinetic = kinetic_of(b);
  m.speed_max = std::sqrt(fastest);
  m.elastic = elastic_energy(b);
  return m;
}

namespace {

// Values of a model by cell at the present positions. give: the function of an extension that has one.
template <class Table, class Entry>
void query_by_cell(Body &b, const char *id, const char *name, const char *what, size_t width,
                   const Entry &entry_of, double *out) {
  const char *const type = b.model.type->id;
  const std::lock_guard one_at_a_time(b.querying);
  const auto table =
      copy_table<Table>(b.model.extension(id), 2 * sizeof(uint32_t) + sizeof(void *), type, name);
  if (!table || !entry_of(*table))
    fail(DFM_E_UNSUPPORTED, "model '%s' of body '%s' offers no %s per cell", type, b.name.c_str(), what);
  const dfm_kin k = b.dynamics->kin(b.world->time, 0);
  const char *const entry = name + std::strlen("dfm_");
  if (b.model.call(entry, [&] { return entry_of(*table)(b.model.self, &k, out); }) != DFM_OK)
    fail(DFM_E_FATAL, "model '%s' could not give its %s per cell", type, what);
  // each tetrahedron of a cell has the cell's; the last one first, so that none is overwritten before
  const size_t each = cell_kind(b.cell_type).tets;
  for (size_t t = b.ncell(); each > 1 && t-- > 0;)
    std::copy_n(out + width * (t / each), width, out + width * t);
}

}  // namespace

bool offers(const Body &b, const char *extension) { return b.model.extension(extension) != nullptr; }

void energy_density(Body &b, double *out) {
  const auto entry_of = [](const dfm_cell_energy &table) { return table.cell_energy; };
  query_by_cell<dfm_cell_energy>(b, DFM_EXT_CELL_ENERGY, "dfm_cell_energy", "energy", 1, entry_of, out);
}

void cell_stress(Body &b, double *out) {
  const auto entry_of = [](const dfm_cell_stress &table) { return table.cell_stress; };
  query_by_cell<dfm_cell_stress>(b, DFM_EXT_CELL_STRESS, "dfm_cell_stress", "stress", 6, entry_of, out);
}

namespace {

// The effects that the parameters call for. changed() does not allocate.
class EffectsAtWork {
 public:
  explicit EffectsAtWork(const ModelInstance &model) : model_(model), names_(effects(*model.type)) {
    for (const std::string &name : names_) at_work_.push_back(model.works(name));
  }
  bool changed() const {
    for (size_t i = 0; i < names_.size(); ++i)
      if (model_.works(names_[i]) != at_work_[i]) return true;
    return false;
  }

 private:
  const ModelInstance &model_;
  const std::vector<std::string> names_;
  std::vector<bool> at_work_;
};

// In the model and its values.
void set_values(Body &b, const std::vector<double> &values) {
  const char *const type = b.model.type->id;
  const dfm_status status = b.model.put_params(values, b.dynamics->abilities().claims);
  if (status == DFM_E_NOMEM)
    refuse(b, DFM_E_NOMEM, ": model '%s' ran out of memory with these parameters; nothing was changed", type);
  if (status == DFM_E_UNSUPPORTED && b.dynamics->abilities().claims)
    refuse(b, DFM_E_UNSUPPORTED,
           ": model '%s' does not accept these parameters during a run, or its stiffness matrix would change "
           "in kind; set the model again with them (dfm_body_set_model)",
           type);
  if (status != DFM_OK) refuse(b, ": model '%s' refuses these parameters; see the log", type);
  b.model.params = values;
}

}  // namespace

void set_model_params(Body &b, const dfm_params &params) {
  const dfm_type &type = *b.model.type;
  check_given(b, params);
  const std::span<const dfm_param_value> given(params.values, params.n);
  for (const dfm_param_value &value : given)
    for (const CellField &f : b.fields)
      if (value.key && f.key == value.key)
        refuse(b,
               ": parameter '%s' differs by cell (from %s), so one value cannot replace it during a run; "
               "create the body again",
               f.key.c_str(), f.from.c_str());
  const std::vector<double> &before_requested =
      b.switched_off.requested.empty() ? b.model.params : b.switched_off.requested;
  const std::vector<double> requested = changed_params(type, given, before_requested);
  std::vector<double> values = requested;
  for (size_t k = 0; k < values.size(); ++k)  // what the list of effects leaves out remains left out
    if (before_requested[k] != b.model.params[k]) values[k] = b.model.params[k];
  size_t at = 0;
  for (uint32_t i = 0; i < type.nparam; at += type.params[i++].width)
    if (!(type.params[i].flags & DFM_PARAM_RUNTIME) &&
        !std::equal(&values[at], &values[at] + type.params[i].width, &b.model.params[at]))
      refuse(b, ": parameter '%s' of model '%s' cannot change during a run", type.params[i].key, type.id);
  if (!b.model.ops->set_params)
    fail(DFM_E_UNSUPPORTED, "model '%s' accepts no parameters during a run", type.id);
  const EffectsAtWork before(b.model);
  std::vector<uint8_t> by_cell = differs_by_cell(type, b.fields);
  b.switched_off.by_cell.resize(type.nparam);
  const bool cells = std::count(b.switched_off.by_cell.begin(), b.switched_off.by_cell.end(), 1) > 0;
  const std::vector<double> present = b.model.params;
  set_values(b, values);
  try {
    const auto works = [&](const std::string &effect) { return b.model.works(effect); };
    if (b.world->selection.listed() &&
        omit_effects(type, b.model.effect_rows(), b.world->selection, works, values, by_cell))
      set_values(b, values);
    b.switched_off.requested = requested == values && !cells ? std::vector<double>() : requested;
  } catch (...) {
    set_values(b, present);
    throw;
  }
  values_changed(*b.world);
  if (before.changed()) b.world->changed = true;  // the plan names the effects that parameters call for
  b.integrator.share = 1;                         // what holds if it cannot be measured
  if (b.dynamics->unknowns().diagonal) measure_explicit(*b.world, b);
}

}  // namespace dfm
