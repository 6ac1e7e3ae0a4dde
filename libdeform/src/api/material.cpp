#include "deform/material.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "api/objects.h"
#include "world/body_zones.h"

using namespace dfm;

namespace {

// Entries of one value that the library itself reads. zero: whether that is one.
constexpr struct {
  const char *key, *unit, *must;
  bool zero;
} kEntries[] = {{kFrictionKey, "", "coefficient, zero or positive, and finite", true},
                {kTearKey, "", "strain, positive and finite", false},
                {kToughnessKey, " J/m2", "value, zero or positive, and finite", true}};

}  // namespace

dfm_status dfm_material_create(dfm_world world, const dfm_material_def *def, dfm_material *out) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    need(out, "out");
    auto m = std::make_unique<Material>();
    m->def = take_def(def, dfm_material_def_default());
    check_flags(m->def, 0, "dfm_material_def");
    m->world = &w;
    m->name = m->def.name ? m->def.name : "";
    const char *const name = m->name.empty() ? "(unnamed)" : m->name.c_str();
    auto positive = [&](double v, const char *key, const char *unit) {
      if (!(v > 0 && std::isfinite(v)))
        fail(DFM_E_ARG, "material '%s': %s is %g %s; it must be positive and finite", name, key, v, unit);
    };
    positive(m->def.density, "density", "kg/m3");
    positive(m->def.young, "young", "Pa");
    if (!(m->def.poisson > -1 && m->def.poisson < 0.5))
      fail(DFM_E_ARG, "material '%s': poisson is %g; it must lie in (-1, 0.5)", name, m->def.poisson);
    if (!(m->def.damping_mass >= 0 && std::isfinite(m->def.damping_mass) && m->def.damping_stiffness >= 0 &&
          std::isfinite(m->def.damping_stiffness)))
      fail(DFM_E_ARG,
           "material '%s': damping_mass is %g 1/s and damping_stiffness %g s; both must be zero or positive, "
           "and finite",
           name, m->def.damping_mass, m->def.damping_stiffness);
    if (!m->name.empty())
      for (auto &other : w.materials)
        if (other->name == m->name)
          fail(DFM_E_ARG, "material '%s': the name is taken in this world; names are unique", name);
    if (m->def.extra.n && !m->def.extra.values)
      fail(DFM_E_ARG, "material '%s': %u extra entries are announced, but extra.values is NULL", name,
           m->def.extra.n);
    for (uint32_t i = 0; i < m->def.extra.n; ++i) {
      const dfm_param_value &v = m->def.extra.values[i];
      if (!v.key || !v.value)
        fail(DFM_E_ARG, "material '%s': extra entry %u has no %s", name, i, v.key ? "value" : "key");
      if (is_material_member(v.key) || !std::strcmp(v.key, "density") ||
          std::ranges::count(m->extra_keys, v.key))
        fail(DFM_E_ARG, "material '%s': extra entry %u gives '%s' a second time", name, i, v.key);
      for (const auto &[key, unit, must, zero] : kEntries)
        if (!std::strcmp(v.key, key) &&
            !(v.width == 1 && (zero ? v.value[0] >= 0 : v.value[0] > 0) && std::isfinite(v.value[0])))
          fail(DFM_E_ARG, "material '%s': %s is %g%s of %u values; it must be one %s", name, key,
               v.width ? v.value[0] : 0.0, unit, v.width, must);
      m->extra_keys.push_back(v.key);
      m->extra_values.emplace_back(v.value, v.value + v.width);
    }
    m->def.extra = {};
    m->def.name = nullptr;
    w.materials.reserve(w.materials.size() + 1);
    m->handle = handle_create(Kind::material, m.get());
    *out = m->handle;
    w.materials.push_back(std::move(m));
  });
}

dfm_status dfm_material_destroy(dfm_material material) {
  return as_status(material_of, material, [&](Material &m) {
    World &w = exclusive(*m.world);
    handle_destroy(material);
    std::erase_if(w.materials, [&](auto &p) { return p.get() == &m; });
  });
}
