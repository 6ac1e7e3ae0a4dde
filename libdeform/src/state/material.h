// The materials of a body by cell: density, share of each cell that is material, and parameters of the model
// that differ between cells.
#pragma once
#include <algorithm>
#include <string>
#include <vector>

#include "deform/deform.h"

namespace dfm {

inline constexpr char kToughnessKey[] = "fracture_energy";  // J/m2 that a cut by a blade takes
inline constexpr char kTearKey[] = "tear";  // entry of a material: the strain at which it tears

// Members of the def that models have as parameters, too.
struct MaterialMember {
  const char *key;
  double dfm_material_def::*at;
};
inline constexpr MaterialMember kMaterialMembers[] = {
    {"young", &dfm_material_def::young},
    {"poisson", &dfm_material_def::poisson},
    {"damping_mass", &dfm_material_def::damping_mass},
    {"damping_stiffness", &dfm_material_def::damping_stiffness}};
inline bool is_material_member(const std::string &key) {
  return std::ranges::any_of(kMaterialMembers, [&](const MaterialMember &m) { return key == m.key; });
}

struct Body;
struct CellField;
struct World;

struct Material {
  uint64_t handle = 0;
  World *world = nullptr;
  std::string name;
  dfm_material_def def{};
  std::vector<std::string> extra_keys;
  std::vector<std::vector<double>> extra_values;
  // The first value of the entry of this key, or `none` if it has no such entry.
  double entry(const char *key, double none) const {
    for (size_t i = 0; i < extra_keys.size(); ++i)
      if (extra_keys[i] == key) return extra_values[i][0];
    return none;
  }
};

// The materials of a body's cells. One entry in `list`: the same everywhere, and `of` is empty.
struct CellMaterials {
  std::vector<const Material *> list;  // by first cell
  std::vector<uint32_t> of;            // [ntet] index into list; the same for all of a cell
};

// Throws Error(HANDLE) if the handle is no material, or one of another world. `plain` is used for handle 0.
CellMaterials cell_materials(const World &w, const dfm_body_def &def, const Body &b, const Material &plain);

// Throws Error(ARG) for a share outside (0,1].
void check_share(const dfm_body_def &def, const Body &b);

// Lumped mass of all points into b.p.mass; b.mass and b.rest_volume.
void lump_body(Body &b, const dfm_body_def &def, const CellMaterials &cells);

// Throws Error(ARG) for fields of the def that the model does not support, or that are invalid.
void check_fields(const dfm_type &type, const dfm_body_def &def, const Body &b);

// Values of the model's parameters for the whole body, as its table orders them; those that differ by cell go
// to `fields`. Of the def only model_params, ntet and fields count. A parameter comes from the def's fields,
// else from its model_params, else from the cells' materials, else it is the default; a share then scales
// "young".
std::vector<double> model_values(const World &w, const Body &b, const dfm_type &type, const dfm_body_def &def,
                                 const CellMaterials &cells, std::vector<CellField> &fields);
// Whether the parameter of this key may differ by cell.
bool by_cell(const dfm_type &type, const std::string &key);

}  // namespace dfm
