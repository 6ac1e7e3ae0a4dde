// Sums over a body: momentum, energy, volume; the model's own energy and its runtime parameters.
#pragma once
#include "state/body.h"

namespace dfm {

dfm_body_measure measure(Body &b);
double kinetic_of(const Body &b);                         // J
struct CenterMotion { Vec3 place, velocity, momentum; };  // of the center of mass: m, m/s, kg m/s
CenterMotion center_motion(const Body &b);
double elastic_energy(Body &b);  // J; NaN if the model has none
// [ntet] J/m3; throws if the model has none
void energy_density(Body &b, double *out);
// [ntet,6] Pa; throws if the model has none
void cell_stress(Body &b, double *out);
void point_stress(Body &b, double *out);  // the same at its points, [npoint,6]
bool offers(const Body &b, const char *extension);
void set_model_params(Body &b, const dfm_params &params);  // runtime rows only; throws Error

}  // namespace dfm
