// Group and material of each triangle of a body's surface.
#pragma once
#include "state/material.h"

namespace dfm {

inline constexpr char kFrictionKey[] = "friction";  // a material's entry

// The friction coefficient of the material, or kDefaultFriction if it has none.
double friction_of(const Material &material);

// Fills b.zones; the surface and its coupling are there. Throws Error(ARG).
void make_zones(Body &b, const dfm_body_def &def, const CellMaterials &materials, const Material &plain);

}  // namespace dfm
