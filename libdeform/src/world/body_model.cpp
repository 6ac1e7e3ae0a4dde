#include "world/body_model.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/hash.h"
#include "mesh/cells.h"
#include "plugin/context.h"
#include "plugin/on_behalf.h"
#include "plugin/params.h"
#include "state/world.h"
#include "step/step_bound.h"
#include "world/body_surface.h"
#include "world/create.h"
#include "world/idle.h"

namespace dfm {
namespace {

// An additional parameter, unless the model has one of that name: 0 double, 1 single.
constexpr char kPrecision[] = "precision";

bool is_precision(const dfm_type &type, const char *key) {
  return key && std::strcmp(key, kPrecision) == 0 && !find_row(type, kPrecision);
}

bool needs_single(const dfm_type &type, const ModelParams &params) {
  bool single = false;
  for (const GivenParam &p : rows_of(params))
    if (is_precision(type, p.key.c_str())) single = *p.values == 1;
  return single;
}

}  // namespace

const dfm_type &default_model(const Registry &types, uint32_t cell) {
  const dfm_type &springs = types.find(DFM_KIND_MODEL, "msm");
  return model_of(springs).cells & cell ? springs : types.find(DFM_KIND_MODEL, "corotational_fem");
}

std::vector<GivenParam> rows_of(const ModelParams &params) {
  std::vector<GivenParam> out;
  const char *key = params.keys.c_str();
  const double *values = params.values.data();
  for (const uint32_t width : params.widths) {
    const char *const end = std::strchr(key, '\n');
    out.push_back({{key, end}, values, width});
    key = end + 1;
    values += width;
  }
  return out;
}

void check_integrator(const Body &b, int32_t integrator) {
  if (integrator < DFM_INTEGRATOR_AUTO || integrator > DFM_INTEGRATOR_TR_BDF2)
    refuse(b, DFM_E_UNSUPPORTED,
           ": integrator %d is not available; use DFM_INTEGRATOR_AUTO, DFM_INTEGRATOR_SYMPLECTIC_EULER, "
           "DFM_INTEGRATOR_IMPLICIT_EULER or DFM_INTEGRATOR_TR_BDF2",
           integrator);
}

void check_given(const Body &b, const dfm_params &params) {
  if (params.n && !params.values)
    refuse(b, ": %u parameters are announced, but params.values is NULL", params.n);
}

namespace {

// None: its points move explicitly, or the integrator is not chosen yet (out.open).
std::optional<ImplicitOptions> implicit_of(const World &w, const Body &b, int32_t requested,
                                           Integrator &out) {
  check_integrator(b, requested);
  const int32_t which = requested == DFM_INTEGRATOR_AUTO ? w.def.integrator : requested;
  out.open = which == DFM_INTEGRATOR_AUTO;
  if (out.open || which == DFM_INTEGRATOR_SYMPLECTIC_EULER) return std::nullopt;
  ImplicitOptions options = w.implicit;
  options.second_order = which == DFM_INTEGRATOR_TR_BDF2;
  out.used = static_cast<uint32_t>(which);
  return options;
}

// The longest explicit sub-step of the body, for the choice of the integrator and the plan of impacts.
void query_explicit_bound(const World &w, double time, Body &b) {
  Integrator &out = b.integrator;
  StepBound bound;
  if (w.def.step == 0 || !b.dynamics->bound(time, out.share, [](double *, double *) {}, bound)) return;
  out.step = kBoundShare * bound.step;
  out.point = bound.point;
}

Pose rest_frame(const Body &b) { return rests_unplaced(*b.model.type) ? Pose{} : b.origin.frame; }

}  // namespace

void measure_explicit(const World &w, Body &b) {
  const ExplicitTime found = b.dynamics->measure(rest_frame(b), !b.cut.whole);
  b.integrator.share = found.share;
  const bool had = b.p.dampers.lag > 0;
  b.p.dampers.lag = found.lag;
  if (had != (found.lag > 0)) b.relax_dampers();
  query_explicit_bound(w, w.time, b);
}

bool rest_rows(const Body &b, double share, RestRows &out) {
  return b.dynamics->rest_rows(rest_frame(b), share, out);
}

void set_scaled_mass(Body &b, double share) {
  if (!(share > 0 && share <= kMaxScaled))
    refuse(b, ": mass_scaling %g; it is a share of the body's mass in [0, %g]", share, kMaxScaled);
  RestRows rows;
  if (!rest_rows(b, 1, rows))
    refuse(b, DFM_E_UNSUPPORTED,
           ": mass_scaling lengthens the explicit sub-steps of a body, and nothing bounds those of this one "
           "(model %s%s); leave it out",
           b.model.type->id, b.model.stepper ? ", which steps itself" : "");
  std::vector<double> mass;
  b.scaling = scale_mass(b.p, rows, share, mass);
  std::copy(mass.begin(), mass.end(), b.p.mass.begin());
  update_inverse_mass(b.p);
}

namespace {

// [n,3] rest positions transformed by the frame, for a model whose forces do not rotate with the body; empty
// for other models.
std::vector<double> rest_for(const dfm_type &type, const Body &b, const Pose &frame) {
  std::vector<double> placed;
  if (rests_unplaced(type)) return placed;
  placed.resize(b.p.rest.size());
  for (size_t i = 0; i < b.p.rest.size(); i += 3) store3(&placed[i], place(frame, load3(&b.p.rest[i])));
  return placed;
}

// Fields for which the type has no parameter stay with the mesh, and are reported.
std::vector<dfm_cell_field> fields_for(const dfm_type &type, const Body &b, std::vector<Unused> &unused) {
  std::vector<dfm_cell_field> out;
  for (const CellField &f : b.composition.given) {
    if (by_cell(type, f.key)) out.push_back({f.key.c_str(), f.values.data(), f.width});
    else unused.push_back({f.key, ""});
  }
  return out;
}

// Also sets what depends on them: fields, unused entries.
std::vector<double> values_for(const World &w, const Body &b, const dfm_type &type, const ModelParams &params,
                               MadeModel &out) {
  CellMaterials cells;
  for (const Material &m : b.composition.materials) cells.list.push_back(&m);
  cells.of = b.composition.of;
  out.unused = find_unused(type, cells);
  const std::vector<dfm_cell_field> given = fields_for(type, b, out.unused);
  const std::vector<GivenParam> own = rows_of(params);
  std::vector<dfm_param_value> rows;
  for (const GivenParam &p : own)
    if (!is_precision(type, p.key.c_str())) rows.push_back({p.key.c_str(), p.values, p.width});
  dfm_body_def def = dfm_body_def_default();
  def.ntet = b.ncell();
  def.model_params = {sizeof(dfm_params), static_cast<uint32_t>(rows.size()), rows.data()};
  def.nfield = static_cast<uint32_t>(given.size());
  def.fields = given.data();
  return model_values(w, b, type, def, cells, out.fields);
}

// An instance that the body had before with the same inputs, or none.
bool take_cached(Body &b, const dfm_type &type, const std::vector<double> &values, MadeModel &out) {
  const ModelOrigin &origin = out.origin;
  const bool turns = rests_unplaced(type);
  const auto fits = [&](const CachedModel &s) {
    return s.instance.type == &type && s.requested() == values && s.origin.params == origin.params &&
           s.origin.held == origin.held &&
           (turns || std::memcmp(&s.origin.frame, &origin.frame, sizeof origin.frame) == 0);
  };
  const auto found = std::find_if(b.cached_models.begin(), b.cached_models.end(), fits);
  if (found == b.cached_models.end()) return false;
  found->instance.start();
  out.model.swap(found->instance);
  out.switched_off = std::move(found->switched_off);
  b.cached_models.erase(found);
  return true;
}

void make_instance(World &w, Body &b, const dfm_type &type, std::vector<double> values, MadeModel &out) {
  const Memory &m = w.memory();
  const MeshCoupling coupling(m, b.surface);
  std::vector<const char *> field_keys;
  std::vector<const double *> fields;
  const uint32_t each = cell_kind(b.cell_type).tets;
  std::vector<std::vector<double>> by_cell;  // of the first tetrahedron of each cell
  for (const CellField &f : out.fields) {
    field_keys.push_back(f.key.c_str());
    fields.push_back(f.values.data());
    if (each == 1) continue;
    std::vector<double> &first = by_cell.emplace_back();
    for (size_t t = 0; t < b.ncell(); t += each)
      first.insert(first.end(), &f.values[f.width * t], &f.values[f.width * t] + f.width);
    fields.back() = first.data();
  }
  field_keys.push_back(nullptr);
  dfm_mesh mesh{};
  mesh.size = sizeof mesh;
  mesh.npoint = b.p.n;
  mesh.ncell = b.ncell() / each;
  mesh.cell = b.cell_type;
  const std::vector<double> placed = rest_for(type, b, out.origin.frame);
  mesh.rest = placed.empty() ? b.p.rest.data() : placed.data();
  mesh.cells = each == 1 ? b.tets.data() : b.cells.data();
  mesh.mass = b.p.mass.data();
  mesh.params = values.data();
  mesh.field_keys = field_keys.data();
  mesh.fields = fields.data();
  mesh.nedge = static_cast<uint32_t>(b.edges.size() / 2);
  mesh.edges = b.edges.data();
  mesh.fixed = out.origin.held.data();
  mesh.inside = b.inside.empty() ? nullptr : b.inside.data();
  coupling.fill_mesh(mesh);
  if (!take_cached(b, type, values, out)) out.model.create(type, w.context->host, mesh, m, std::move(values));
  if (needs_single(type, out.origin.params)) out.model.use_single();
}

void drop_fields(const dfm_type &type, const SwitchedOff &switched_off, std::vector<CellField> &fields) {
  std::erase_if(fields, [&](const CellField &f) {
    const dfm_param *const row = find_row(type, f.key.c_str());
    return row && switched_off.by_cell[size_t(row - type.params)] != 0;
  });
}

// Leaves out effects that are not in the list of effects. First makes an instance with all parameters: it
// knows which effects are active and what switches them off.
void make_selected(World &w, Body &b, const dfm_type &type, std::vector<double> values, MadeModel &out) {
  make_instance(w, b, type, values, out);
  if (!w.selection.listed()) return;
  if (!out.switched_off.requested.empty())
    return drop_fields(type, out.switched_off, out.fields);  // from the cache
  SwitchedOff switched_off{values, differs_by_cell(type, out.fields)};
  std::vector<uint8_t> left = switched_off.by_cell;
  const auto works = [&](const std::string &effect) { return out.model.works(effect); };
  if (!omit_effects(type, out.model.effect_rows(), w.selection, works, values, left)) return;
  for (uint32_t row = 0; row < type.nparam; ++row)
    switched_off.by_cell[row] = switched_off.by_cell[row] && !left[row];
  drop_fields(type, switched_off, out.fields);
  ModelInstance().swap(out.model);
  make_instance(w, b, type, std::move(values), out);
  out.switched_off = std::move(switched_off);
}

void make_model(World &w, Body &b, const dfm_type &type, std::vector<double> values, int32_t integrator,
                MadeModel &out) {
  const auto implicit = implicit_of(w, b, integrator, out.integrator);
  const OnBehalf prefix(b.name);
  make_selected(w, b, type, std::move(values), out);
  // the dynamics of a body refer to its own instance and points, which are the new ones by now
  struct Lent {
    Body &b;
    MadeModel &made;
    Lent(Body &x, MadeModel &y) : b(x), made(y) { exchange(b, made); }
    Lent(const Lent &) = delete;
    ~Lent() { exchange(b, made); }
  } lent(b, out);
  use_memory(w.meters.dynamics.memory(), b.p.dampers.v, b.p.dampers.slow);
  b.p.dampers = out.dampers;  // of the points, which are the same
  b.dynamics = make_dynamics(w.meters.dynamics.memory(), b.p, b.surface, b.model, b.edges,
                             implicit ? &*implicit : nullptr);
  if (implicit) return;
  measure_explicit(w, b);
}

}  // namespace

std::unique_ptr<MadeModel> make_body_instance(World &w, Body &b, const dfm_type &type, ModelOrigin origin) {
  auto out = std::make_unique<MadeModel>();
  out->origin = std::move(origin);
  const OnBehalf prefix(b.name);
  make_selected(w, b, type, values_for(w, b, type, out->origin.params, *out), *out);
  return out;
}

void set_dynamics(World &w, Body &b, const double *bound_at) {
  const auto implicit = implicit_of(w, b, static_cast<int32_t>(b.integrator.used), b.integrator);
  b.dynamics = make_dynamics(w.meters.dynamics.memory(), b.p, b.surface, b.model, b.edges,
                             implicit ? &*implicit : nullptr);
  if (!implicit && bound_at) query_explicit_bound(w, *bound_at, b);
}

ModelParams keep_params(const dfm_type &type, const dfm_params &given) {
  const std::span<const dfm_param_value> rows(given.values, given.values ? given.n : 0);
  std::vector<dfm_param_value> own;
  bool named = false;
  for (const dfm_param_value &row : rows) {
    if (!is_precision(type, row.key)) {
      own.push_back(row);
      continue;
    }
    if (named || !row.value || row.width != 1 || (*row.value != 0 && *row.value != 1))
      fail(DFM_E_ARG, "%s: precision is 0 (double) or 1 (single), given once", type.id);
    named = true;
  }
  pack_params(type, own);
  ModelParams out;
  for (const dfm_param_value &row : rows) {
    out.keys += row.key;
    out.keys += '\n';
    out.widths.push_back(row.width);
    out.values.insert(out.values.end(), row.value, row.value + row.width);
  }
  return out;
}

std::vector<double> requested_values(const World &w, const Body &b, const dfm_type &type,
                                     const ModelParams &params) {
  MadeModel unused;
  return values_for(w, b, type, params, unused);
}

std::vector<double> requested_values(const World &w, const Body &b) {
  return requested_values(w, b, *b.model.type, b.origin.params);
}

std::unique_ptr<MadeModel> make_body_model(World &w, Body &b, const dfm_type &type, ModelOrigin origin,
                                           int32_t integrator) {
  auto out = std::make_unique<MadeModel>();
  out->origin = std::move(origin);
  make_model(w, b, type, values_for(w, b, type, out->origin.params, *out), integrator, *out);
  return out;
}

void warn_of_own_steps(const Body &b, const ModelInstance &model, int32_t integrator) {
  if (!model.stepper || integrator == DFM_INTEGRATOR_AUTO) return;
  b.world->context->warn(b, ": model '%s' steps itself, so its integrator, %s, is not used", model.type->id,
                         integrator_name(uint32_t(integrator)));
}

uint64_t model_hash(const Body &b) {
  Hash h;
  const ModelParams &p = b.origin.params;
  h.add(b.model.type->id, std::strlen(b.model.type->id));
  h.list(p.keys, p.values);
  h.add(b.origin.frame);
  h.add(b.origin.integrator);
  return h.value;
}

void exchange(Body &b, MadeModel &other) noexcept {
  std::swap<BodyModel>(b, other);
  std::swap(b.p.dampers, other.dampers);
  b.bound.known = false;
}

}  // namespace dfm
