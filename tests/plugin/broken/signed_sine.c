/* F02: the elasto-plastic map of Dupont et al. 2002 with a signed deflection in its sine, as ported from
 * one dimension. */
#include "base.h"

static double alpha(double z, double zba, double zmax) {
  if (fabs(z) <= zba) return 0;
  if (fabs(z) >= zmax) return 1;
  return 0.5 + 0.5 * sin(3.14159265358979323846 * (z - 0.5 * (zmax + zba)) / (zmax - zba));
}

static void signed_sine(struct lane *l) {
  project(l);
  const double t[2] = {l->z[0] + l->h * l->v[0], l->z[1] + l->h * l->v[1]};
  const double length = sqrt(t[0] * t[0] + t[1] * t[1]);
  const double zmax = l->cone / l->stiff, flow = length > 0 ? (t[0] * l->v[0] + t[1] * l->v[1]) / length : 0;
  const double a = alpha(t[0] < 0 ? -length : length, 0.7 * zmax, zmax);
  double share = zmax > 0 ? 1 / (1 + (flow > 0 ? l->h * flow * a / zmax : 0)) : 0;
  if (share * length > zmax) share = zmax / length;
  l->next[0] = share * t[0];
  l->next[1] = share * t[1];
  finish(l, share < 1);
}

#define FLAGS DFM_FRIC_ISOTROPIC
#define LANE signed_sine
#include "law.h"
