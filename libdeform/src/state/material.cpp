#include "state/material.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "core/error.h"
#include "core/handle.h"
#include "core/names.h"
#include "math/quadratics.h"
#include "mesh/cells.h"
#include "plugin/context.h"
#include "plugin/params.h"
#include "state/world.h"

namespace dfm {

CellMaterials cell_materials(const World &w, const dfm_body_def &def, const Body &b, const Material &plain) {
  CellMaterials out;
  auto find = [&](dfm_material handle) -> const Material & {
    if (!handle) return plain;
    const Material &m = resolve<Material>(Kind::material, handle);
    if (m.world != &w)
      refuse(b, DFM_E_HANDLE, ": its material '%s' belongs to another world", m.name.c_str());
    return m;
  };
  const Material &whole = find(def.material);
  if (!def.cell_materials) {
    out.list.push_back(&whole);
    return out;
  }
  std::map<dfm_material, uint32_t> known;
  out.of.resize(def.ntet);
  const uint32_t each = def.cells ? cell_kind(def.cell).tets : 1;
  for (uint32_t t = 0; t < def.ntet; ++t) {
    const dfm_material of_cell = def.cell_materials[t / each * each];
    const dfm_material handle = of_cell ? of_cell : def.material;
    const auto [at, fresh] = known.try_emplace(handle, uint32_t(out.list.size()));
    if (fresh) out.list.push_back(&find(handle));
    out.of[t] = at->second;
  }
  if (out.list.size() == 1) out.of.clear();
  return out;
}

void check_share(const dfm_body_def &def, const Body &b) {
  for (uint32_t t = 0; def.cell_share && t < def.ntet; ++t)
    if (!(def.cell_share[t] > 0 && def.cell_share[t] <= 1))
      refuse(b, ": the share of cell %u is %g; it must lie above 0 and be at most 1 (leave empty cells out)",
             t, def.cell_share[t]);
}

namespace {

// The masses of cells with more nodes, of which lump_mass() knows the tetrahedra.
void share_mass(Body &b, const double *density, double all) {
  const CellKind &kind = cell_kind(b.cell_type);
  std::fill(b.p.mass.begin(), b.p.mass.end(), 0.0);
  for (size_t c = 0; c < b.ncell() / kind.tets; ++c) {
    const uint32_t *const cell = &b.cells[kind.nodes * c];
    double mass = 0, share[kMaxNodes];
    for (size_t t = kind.tets * c; t < kind.tets * (c + 1); ++t)
      mass += (density ? density[t] : all) * tet_volume(b.p.rest.data(), &b.tets[4 * t]);
    mass_shares(kind, b.p.rest.data(), cell, share);
    for (uint32_t k = 0; k < kind.nodes; ++k) b.p.mass[cell[k]] += share[k] * mass;
  }
}

// Least part of its mass that a point keeps when moments are set right.
constexpr double kMinMass = 0.1;

// Lumps the masses of a lattice. Equal shares of a cell's material to its nodes leave no point without mass,
// but keep neither center nor moments of inertia. So all masses change by factors that are a quadratic
// polynomial of the place, by which these are those of the material; where a factor would be less than
// kMinMass, the moments come as near as it allows.
void lump_inside(Body &b, const double *density, double all) {
  const size_t tets = cell_kind(b.cell_type).tets, ncell = b.ncell() / tets;
  std::vector<Vec3> place;
  for (uint32_t i = 0; i < b.p.n; ++i) place.push_back(b.p.rest_at(i));
  std::vector<double> mass(b.p.n), factor(b.p.n, 1.0);
  const auto each = [&](const auto &use) {  // use(volume, density, place, cell)
    for (size_t c = 0; c < ncell; ++c)
      each_inside(b.p.rest.data(), 3, &b.cells[8 * c], &b.inside[kInsidePoints * c],
                  [&](double volume, Vec3 x) { use(volume, density ? density[tets * c] : all, x, c); });
  };
  b.mass = b.rest_volume = 0;
  each([&](double volume, double rho, Vec3, size_t c) {
    b.rest_volume += volume;
    for (size_t k = 8 * c; k < 8 * (c + 1); ++k) mass[b.cells[k]] += rho * volume / 8;
  });
  const OrthonormalQuadratics terms(place, mass, [&](const auto &use) {
    each([&](double volume, double rho, Vec3 x, size_t) { use(rho * volume, x); });
  });
  for (const auto &[from, to] : {std::pair<size_t, size_t>{1, 4}, {4, kQuadratics}}) {
    std::vector<double> change(b.p.n);
    for (size_t k = from; k < to; ++k)
      for (uint32_t i = 0; i < b.p.n; ++i) change[i] += terms.sums[k] * terms.at[i][k];
    double by = 1;
    for (uint32_t i = 0; i < b.p.n; ++i)
      if (factor[i] + change[i] < kMinMass) by = std::min(by, (factor[i] - kMinMass) / -change[i]);
    for (uint32_t i = 0; i < b.p.n; ++i) factor[i] += by * change[i];
  }
  for (uint32_t i = 0; i < b.p.n; ++i) b.mass += b.p.mass[i] = factor[i] * mass[i];
}

}  // namespace

void lump_body(Body &b, const dfm_body_def &def, const CellMaterials &cells) {
  std::vector<double> density;
  for (uint32_t k : cells.of) density.push_back(cells.list[k]->def.density);
  const LumpedMass lumped =
      lump_mass(b.p.n, b.p.rest.data(), def.ntet, b.tets.data(), cells.list[0]->def.density,
                density.empty() ? nullptr : density.data(), def.cell_share, b.p.mass.data());
  if (!b.cells.empty()) share_mass(b, density.empty() ? nullptr : density.data(), cells.list[0]->def.density);
  b.rest_volume = lumped.volume;
  b.mass = lumped.mass;
  if (!b.inside.empty())
    lump_inside(b, density.empty() ? nullptr : density.data(), cells.list[0]->def.density);
}

namespace {

// A model parameter that the body does not give comes from the material's entry of the same key.
std::vector<double> values_of(const dfm_type &type, const dfm_params &given, const Material &m) {
  std::vector<dfm_param_value> entries;
  for (const auto &[key, at] : kMaterialMembers) entries.push_back({key, &(m.def.*at), 1});
  for (size_t i = 0; i < m.extra_keys.size(); ++i)
    entries.push_back(
        {m.extra_keys[i].c_str(), m.extra_values[i].data(), static_cast<uint32_t>(m.extra_values[i].size())});
  return pack_params(type, {given.values, given.values ? given.n : 0},
                     [&](const char *key) -> const dfm_param_value * {
                       for (const auto &e : entries)
                         if (std::strcmp(e.key, key) == 0) return &e;
                       return nullptr;
                     });
}

[[noreturn]] void unknown_field(const dfm_type &type, const Body &b, const char *key) {
  std::vector<std::string> keys;
  for (uint32_t i = 0; i < type.nparam; ++i)
    if (type.params[i].flags & DFM_PARAM_PER_CELL) keys.push_back(type.params[i].key);
  const std::string meant =
      find_row(type, key) ? ", it holds for the whole body" : did_you_mean(key, keys, '\'');
  const std::string has = keys.empty() ? "it takes no parameter by cell" : "by cell it takes: " + join(keys);
  refuse(b, ": field '%s': %s has no such parameter by cell%s; %s", key, type.id, meant.c_str(), has.c_str());
}

void check_field_values(const dfm_param &row, const dfm_cell_field &f, uint32_t ntet, const Body &b) {
  if (f.width != row.width)
    refuse(b, ": field '%s' has %u value%s per cell, %u expected", f.key, f.width, f.width == 1 ? "" : "s",
           row.width);
  const bool whole = row.flags & (DFM_PARAM_INTEGER | DFM_PARAM_ENUM);
  for (size_t i = 0; i < size_t(ntet) * row.width; ++i)
    if (!(f.values[i] >= row.min && f.values[i] <= row.max) ||
        (whole && f.values[i] != std::floor(f.values[i])))
      refuse(b, ": field '%s': cell %zu is %g; expected a %s in [%g, %g]%s%s", f.key, i / row.width,
             f.values[i], whole ? "whole number" : "number", row.min, row.max,
             std::strcmp(row.unit, "1") == 0 ? "" : " ", std::strcmp(row.unit, "1") == 0 ? "" : row.unit);
}

}  // namespace

void check_fields(const dfm_type &type, const dfm_body_def &def, const Body &b) {
  if (def.nfield && !def.fields) refuse(b, ": %u fields are announced, but fields is NULL", def.nfield);
  for (uint32_t n = 0; n < def.nfield; ++n) {
    const dfm_cell_field &f = def.fields[n];
    if (!f.key || !f.values) refuse(b, ": field %u has no %s", n, f.key ? "values" : "key");
    if (!by_cell(type, f.key)) unknown_field(type, b, f.key);
    for (uint32_t k = 0; k < n; ++k)
      if (std::strcmp(def.fields[k].key, f.key) == 0) refuse(b, ": the field '%s' is given twice", f.key);
    for (uint32_t k = 0; def.model_params.values && k < def.model_params.n; ++k)
      if (def.model_params.values[k].key && std::strcmp(def.model_params.values[k].key, f.key) == 0)
        refuse(b, ": '%s' is given both as one value and as a field; keep one", f.key);
    check_field_values(*find_row(type, f.key), f, def.ntet, b);
  }
}

namespace {

// One parameter of the table: the place of its values among the packed ones, and its values for each
// material.
struct Row {
  const dfm_param &param;
  size_t at;
  const std::vector<std::vector<double>> &packed;  // by material
  const double *of(size_t material) const { return &packed[material][at]; }
  bool differs(size_t *where) const {
    for (size_t k = 1; k < packed.size(); ++k)
      if (!std::equal(of(0), of(0) + param.width, of(k))) {
        *where = k;
        return true;
      }
    return false;
  }
};

CellField *add_field(std::vector<CellField> &fields, const World &w, const dfm_param &row, const char *from,
                     uint32_t ntet) {
  fields.push_back({row.key, from, row.width, Array<double>(size_t(ntet) * row.width, 0.0, w.memory())});
  return &fields.back();
}

// A modulus or a stress: a cell that is filled in part has its share of it.
bool is_shared(const dfm_param &p) { return p.width == 1 && std::strcmp(p.unit, "Pa") == 0; }

void scale_by_share(const Body &b, const World &w, const char *model, const Row &row,
                    std::vector<CellField> &fields, CellField *field, uint32_t ntet) {
  const dfm_param &p = row.param;
  const auto is_used = [&](double value) {
    return value != 0 && (value != p.def || !(p.flags & DFM_PARAM_AUTO));
  };
  if (!(field ? std::ranges::any_of(field->values, is_used) : is_used(*row.of(0)))) return;
  if (!(p.flags & DFM_PARAM_PER_CELL)) {
    w.context->warn(b,
                    ": %s takes one '%s' for all cells, so that of cells that are filled in part is as large "
                    "as that of full ones",
                    model, p.key);
    return;
  }
  if (!field) {
    field = add_field(fields, w, p, "share", ntet);
    std::fill(field->values.begin(), field->values.end(), *row.of(0));
  } else {
    field->from += " and share";
  }
  for (uint32_t t = 0; t < ntet; ++t)
    if (double &value = field->values[t]; is_used(value)) value = std::max(p.min, value * b.share[t]);
}

}  // namespace

bool by_cell(const dfm_type &type, const std::string &key) {
  const dfm_param *const row = find_row(type, key.c_str());
  return row && (row->flags & DFM_PARAM_PER_CELL);
}

std::vector<uint8_t> differs_by_cell(const dfm_type &type, const std::vector<CellField> &fields) {
  std::vector<uint8_t> out(type.nparam);
  for (uint32_t row = 0; row < type.nparam; ++row)
    out[row] = std::ranges::find(fields, type.params[row].key, &CellField::key) != fields.end();
  return out;
}

std::vector<double> model_values(const World &w, const Body &b, const dfm_type &type, const dfm_body_def &def,
                                 const CellMaterials &cells, std::vector<CellField> &fields) {
  check_fields(type, def, b);
  std::vector<std::vector<double>> packed;
  for (const Material *m : cells.list) packed.push_back(values_of(type, def.model_params, *m));
  size_t at = 0;
  for (uint32_t i = 0; i < type.nparam; at += type.params[i++].width) {
    const Row row{type.params[i], at, packed};
    const dfm_param &p = row.param;
    CellField *field = nullptr;
    const dfm_cell_field *given = nullptr;
    for (uint32_t n = 0; n < def.nfield; ++n)
      if (std::strcmp(def.fields[n].key, p.key) == 0) given = &def.fields[n];
    size_t other = 0;
    if (given) {
      field = add_field(fields, w, p, "field", def.ntet);
      std::copy_n(given->values, field->values.size(), field->values.begin());
    } else if (row.differs(&other)) {
      if (!(p.flags & DFM_PARAM_PER_CELL))
        refuse(b,
               ": %s takes one '%s' for all cells, but its materials '%s' and '%s' differ in it (%g and %g); "
               "give it in the model's parameters",
               type.id, p.key, cells.list[0]->name.c_str(), cells.list[other]->name.c_str(), *row.of(0),
               *row.of(other));
      field = add_field(fields, w, p, "materials", def.ntet);
      for (uint32_t t = 0; t < def.ntet; ++t)
        std::copy_n(row.of(cells.of[t]), p.width, &field->values[size_t(t) * p.width]);
    }
    if (!b.share.empty() && is_shared(p)) scale_by_share(b, w, type.id, row, fields, field, def.ntet);
  }
  return std::move(packed[0]);
}

}  // namespace dfm
