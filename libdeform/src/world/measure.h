// Sums over a body: momentum, energy, volume; the model's own energy and its runtime parameters.
#pragma once
#include "state/body.h"

namespace dfm {

dfm_body_measure measure(Body &b);
double elastic_energy(Body &b);  // J; NaN where the model gives none
// [ntet] J/m3; throws where the model offers none
void energy_density(Body &b, double *out);
// [ntet,6] Pa; throws where the model offers none
void cell_stress(Body &b, double *out);
bool offers(const Body &b, const char *extension);
void set_model_params(Body &b, const dfm_params &params);  // runtime rows only; throws

}  // namespace dfm
