// Which group and which material each triangle of a body's surface has.
#pragma once
#include "state/material.h"

namespace dfm {

inline constexpr char kFrictionKey[] = "friction";  // a material's entry

// The material's coefficient of friction, or kDefaultFriction where it has none.
double friction_of(const Material &material);

// Fills b.zones; the surface and its coupling are there. Throws Error(ARG).
void make_zones(Body &b, const dfm_body_def &def, const CellMaterials &materials, const Material &plain);

}  // namespace dfm
