// Physics points of one body as a structure of arrays. Points lie 4 doubles apart (the fourth is zero), so
// that one point is one 256-bit load; the measurement behind it is doc/decisions/models.md.
#pragma once
#include <cstdint>

#include "core/memory.h"
#include "math/extent.h"
#include "math/vec3.h"

namespace dfm {

inline constexpr uint32_t kStride = 4;

// What the dampers of a model see of v in explicit sub-steps: a low pass of second order of it. So their
// forces are those of springs that yield, which bound a sub-step as stiffness does
// (doc/concepts/step.md#dampers).
struct Dampers {
  double lag = 0;         // s; 0: they see v
  Array<double> v, slow;  // [n,4] m/s, what they see and what that tends to; empty without a lag
};

struct Phyxels {
  uint32_t n = 0;
  Array<double> rest;          // [n,3] m, before pose
  Array<double> x, v;          // [n,4] m, m/s: start of the sub-step
  Array<double> v_free;        // [n,4] m/s: end of the sub-step without contact
  Array<double> x_end, v_end;  // [n,4] m, m/s: end of the sub-step with contact
  Array<double> f;             // [n,4] N: loads and the model's forces
  Array<double> load;          // [n,4] N: sum of lasting loads at the current time
  Array<double> load_before;   // [n,4] N: at the start of the sub-step; empty unless dynamics ask for it
  Array<double> impulse;       // [n,4] N s: contact impulses of the sub-step, J^T lambda
  Array<double> mass;          // [n] kg, lumped
  double least_mass = 0;       // kg
  Array<double> inv_mass;      // [n,4] 1/kg, zero where a component is held
  Array<uint8_t> held;         // [n] bits 1 x, 2 y, 4 z
  Dampers dampers;

  Vec3 rest_at(size_t i) const { return load3(&rest[3 * i]); }
  Vec3 x_at(size_t i) const { return load3(&x[kStride * i]); }
  Vec3 v_at(size_t i) const { return load3(&v[kStride * i]); }
  void size(const Memory &m, uint32_t points);  // all arrays but those of the dampers, with zeros
  uint8_t held_anywhere() const;                // bits of the components that are held at some point
  bool moves(size_t component) const { return inv_mass[component] > 0; }  // of [n,4]: not held
};

// Lumped mass of tetrahedra: a quarter of each cell's mass to each corner. cell_density [ntet] wins over
// density; share [ntet]: how much of a cell is material. Both may be null.
struct LumpedMass { double volume, mass; };
LumpedMass lump_mass(uint32_t npoint, const double *rest, uint32_t ntet, const uint32_t *tets, double density,
                     const double *cell_density, const double *share, double *mass);
void update_inverse_mass(Phyxels &p);  // and least_mass

Extent extent_of(const double *x, size_t n, size_t stride);  // of n points
double tet_volume(const double *x, uint32_t stride, const uint32_t tet[4]);

}  // namespace dfm
