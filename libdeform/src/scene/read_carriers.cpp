// What a body is made of, cell by cell, and what carries its surface: the keys fields, materials_by_group,
// anisotropy, surface and fill.
#include <algorithm>
#include <cmath>
#include <span>

#include "plugin/params.h"
#include "plugin/registry.h"
#include "scene/keys.h"
#include "scene/load.h"
#include "scene/read.h"

namespace dfm::scene {
namespace {

constexpr char kPrefix[] = "anisotropy_";
constexpr char kAxis[] = "anisotropy_axis";
constexpr double kMaxCells = 1e8;  // dfm_mesh_fill and dfm_body_create say the same of these two
constexpr double kWidestSupport = 10;

std::span<const dfm_param> rows_of(const dfm_type &type) { return {type.params, type.nparam}; }

void read_fields(const Node &node, const dfm_type *model, Body &b) {
  if (!node.value().is_object()) node.fail("expected an object of files by parameter of the model");
  std::vector<std::string> valid;
  for (const dfm_param &row : rows_of(*model))
    if (row.flags & DFM_PARAM_PER_CELL) valid.push_back(row.key);
  for (const auto &entry : node.value().items()) {
    const Node value = node.member(entry.key());
    const dfm_param *row = find_row(*model, entry.key().c_str());
    if (!row || !(row->flags & DFM_PARAM_PER_CELL))
      value.fail("%s", no_parameter(*model, "parameter by cell", entry.key(), valid).c_str());
    if (listed(b.params.keys, entry.key()))
      value.fail("\"%s\" is given in the model's params too; keep one", entry.key().c_str());
    b.fields.push_back({value.pointer(), entry.key(), value.text(), row->width ? row->width : 1, false});
  }
}

void read_materials_by_group(const Node &node, const ReadContext &context, Body &b) {
  if (!node.value().is_object()) node.fail("expected an object of materials by physical group");
  for (const auto &entry : node.value().items()) {
    const Node value = node.member(entry.key());
    b.by_group.push_back({value.pointer(), entry.key(), known(value, context.materials, "material")});
  }
}

// Parameters of the model by their short names: "slope" is the model's "anisotropy_slope".
void read_anisotropy_params(const Node &params, const dfm_type *model, Body &b) {
  if (!params.value().is_object()) params.fail("expected an object of parameters by key");
  std::vector<std::string> valid;
  for (const dfm_param &row : rows_of(*model)) {
    const std::string key = row.key;
    if (key.rfind(kPrefix, 0) == 0 && key != kAxis) valid.push_back(key.substr(sizeof kPrefix - 1));
  }
  for (const auto &entry : params.value().items()) {
    const Node value = params.member(entry.key());
    const dfm_param *row = find_row(*model, (kPrefix + entry.key()).c_str());
    if (!row) row = find_row(*model, entry.key().c_str());
    if (!row) value.fail("%s", no_parameter(*model, "anisotropy parameter", entry.key(), valid).c_str());
    if (std::string(row->key) == kAxis)
      value.fail("the direction is given by \"axis\" or \"field\" beside \"params\"");
    if (listed(b.params.keys, row->key))
      value.fail("\"%s\" is given in the model's params too; keep one", row->key);
    b.params.keys.push_back(row->key);
    b.params.values.push_back(read_param(value, *row));
  }
}

void read_anisotropy(const Node &node, const dfm_type *model, const Registry &types, Body &b) {
  node.object("anisotropy");
  const dfm_param *row = find_row(*model, kAxis);
  if (!row || row->width != 3) {
    std::vector<std::string> able;
    for (const dfm_type *t : types.list(DFM_KIND_MODEL))
      if (find_row(*t, kAxis)) able.push_back(t->id);
    node.fail(
        "%s is the same in all directions; %s%s", model->id,
        able.empty() ? "no loaded model has a direction" : "models with a direction: ", join(able).c_str());
  }
  if (node.has("axis") == node.has("field"))
    node.fail("expected either \"axis\" or \"field\" to say the direction");
  const bool taken =
      listed(b.params.keys, kAxis) ||
      std::any_of(b.fields.begin(), b.fields.end(), [](const FieldFile &f) { return f.key == kAxis; });
  if (taken) node.fail("the direction is given as \"%s\" too; keep one", kAxis);
  if (node.has("axis")) {
    double axis[3];
    node.member("axis").vector(axis);
    const double largest = std::max({std::fabs(axis[0]), std::fabs(axis[1]), std::fabs(axis[2])});
    if (!(largest > 0)) node.member("axis").fail("the direction cannot be zero");
    double square = 0;
    for (double &a : axis) {
      a /= largest;
      square += a * a;
    }
    for (double &a : axis) a /= std::sqrt(square);
    b.params.keys.push_back(kAxis);
    b.params.values.push_back({axis, axis + 3});
  } else {
    if (!(row->flags & DFM_PARAM_PER_CELL))
      node.member("field").fail("%s takes one direction for the whole body; give \"axis\"", model->id);
    b.fields.push_back({node.member("field").pointer(), kAxis, node.member("field").text(), 3, true});
  }
  if (node.has("params")) read_anisotropy_params(node.member("params"), model, b);
}

void read_lattice(const Node &node, Body &b) {
  node.object("lattice");
  if (node.has("cells") == node.has("size"))
    node.fail("expected either \"cells\", about how many, or \"size\", their edge in m");
  if (node.has("cells")) b.lattice_cells = read_count(node.at("cells"), 1, kMaxLattice);
  else b.lattice_size = node.at("size").number(kPositive);
}

void read_surface(const Node &node, OwnSurface &out) {
  node.object("surface");
  out.pointer = node.pointer();
  out.boundary = node.has("from");
  if (out.boundary) node.member("from").word("from");
  if (out.boundary && node.has("mesh"))
    node.member("mesh").fail("a surface is either \"from\": \"boundary\" or a mesh of its own; keep one");
  if (node.has("mesh")) out.mesh = node.member("mesh").text();
  out.coupled = node.has("coupling");
  if (out.boundary && out.coupled)
    node.member("coupling")
        .fail("the boundary's points are the body's own; a coupling is for a surface of its own");
  const std::string coupling = out.coupled ? node.member("coupling").word("coupling") : "barycentric";
  out.coupling = int32_t(number_of("coupling", coupling));
  if (!node.has("support")) return;
  if (coupling == "barycentric")
    node.member("support").fail(
        "a support is for the couplings mls and thesis; \"coupling\" is barycentric here");
  out.support = node.member("support").number(Range{0, kWidestSupport, true, false});
}

}  // namespace

void read_carriers(const Node &body, const dfm_type *model, ReadContext &context, Body &b) {
  if (body.has("surface")) read_surface(body.member("surface"), b.surface);
  if (body.has_value("fill")) {
    const Node cells = body.member("fill").object("fill").at("cells");
    const double n = cells.number(Range{0, kMaxCells, false, false});
    if (n != std::floor(n)) cells.fail("expected a whole number, found %g", n);
    b.fill = uint32_t(n);
  }
  b.lattice_open = context.planned && !body.has("lattice");
  if (body.has_value("lattice")) read_lattice(body.member("lattice"), b);
  if (b.lattice() && b.fill)
    body.member("lattice").fail("the body is filled with tetrahedra by \"fill\" too; keep one");
  if (body.has("materials_by_group")) read_materials_by_group(body.member("materials_by_group"), context, b);
  if (body.has("fields")) read_fields(body.member("fields"), model, b);
  if (body.has("anisotropy")) read_anisotropy(body.member("anisotropy"), model, context.types, b);
}

}  // namespace dfm::scene
