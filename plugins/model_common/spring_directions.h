// Stiffness of each spring at rest, a product of two (doc/models/msm.md derives both,
// doc/decisions/models.md says why the second):
//   Van Gelder   sum of E V over the cells around the edge / L0^2: the size of the cells drops out,
//   directions   a factor of mean 1, multiplied by m.S m in each step, m = n n^T, S the inverse of the body's
//                mean C = 6 sum w m m^T / sum w, w the volumes around each edge times the factor so far. One
//                step, up to eight for a stretched mesh.
// C is the tensor of the body under a uniform strain if every cell had Young's modulus 1, so m.S m = 1 / E(n)
// is its compliance along the spring: where a mesh has many edges one way (the surface of a bar one cell
// thick) they soften, where it has few they stiffen. It is the multiplicative algorithm for D-optimal designs
// (Silvey, Titterington, Torsney 1978), whose fixed point has the
// largest det C, and that is an isotropic C whenever one can be had (log det is concave). At that point m.S m
// is 1 for each spring that keeps stiffness and less for the others (Kiefer, Wolfowitz 1960), so
// steps end there. The weighted mean of the factor is 1, it is positive, turns with the body, and is 1 for a
// single cell and for an even spread of directions.
// C belongs to the whole body: where nearly all edges lie in a plane or along a line, the few that do not (a
// knob on a sheet) would take all that the rest lacks, a hundred times their stiffness and more. So the
// factor is at most 3. A spring of a direction that a stretched mesh has too much of would vanish: the factor
// is at least 1/8, so that no point loses its hold. The next step gives back what the limits take:
// otherwise each step would soften the whole body.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace model {
namespace directions {

constexpr int kN = 6;
// Below this share of the mean pivot the edges all but leave out a strain (points in a plane):
// nothing to even out.
constexpr double kFlat = 1e-6;
constexpr double kMinFactor = 1.0 / 8, kMaxFactor = 3;
constexpr int kMaxSteps = 8;
// A mesh is stretched where, after one step, springs of m.S m < kStiff hold more than the share kStretched of
// sum w (stretched cylinders: 0.07 to 0.09, others below 0.01). Steps end where no m.S m is above kSoftest.
constexpr double kStiff = 0.7, kStretched = 0.04, kSoftest = 1.02;
constexpr double kShortestSquared = 1e-200;  // m2: two points at one place

// Components of n n^T such that the dot product of two is that of the tensors.
inline void dyad_of(const double *a, const double *b, double length, double *m) {
  const double n[3] = {(b[0] - a[0]) / length, (b[1] - a[1]) / length, (b[2] - a[2]) / length};
  const double root2 = __builtin_sqrt(2.0);
  m[0] = n[0] * n[0];
  m[1] = n[1] * n[1];
  m[2] = n[2] * n[2];
  m[3] = root2 * (n[1] * n[2]);
  m[4] = root2 * (n[2] * n[0]);
  m[5] = root2 * (n[0] * n[1]);
}

// C = l l^T in place, lower triangle; false where C is not safely positive.
inline bool factor(double (*c)[kN]) {
  for (int i = 0; i < kN; ++i)
    for (int j = 0; j <= i; ++j) {
      double sum = c[i][j];
      for (int k = 0; k < j; ++k) sum -= c[i][k] * c[j][k];
      if (i == j && !(sum > kFlat)) return false;
      c[i][j] = i == j ? __builtin_sqrt(sum) : sum / c[j][j];
    }
  return true;
}

inline double inverse_form(const double (*l)[kN], const double *m) {
  double y[kN], sum = 0;
  for (int i = 0; i < kN; ++i) {
    y[i] = m[i];
    for (int k = 0; k < i; ++k) y[i] -= l[i][k] * y[k];
    y[i] /= l[i][i];
    sum += y[i] * y[i];
  }
  return sum;
}

}  // namespace directions

// per_modulus [nedge] = stiffness over the sum of E V around the edge. rest [npoint,3] m; edge_length m,
// edge_volume m3, the sum over the cells around it.
inline void find_directions(uint32_t nedge, const uint32_t *edges, const double *rest,
                            const double *edge_length, const double *edge_volume, double *per_modulus) {
  using namespace directions;
  double m[kN];
  const auto directed = [&](uint32_t e) {  // two points at one place: no direction, no spring
    const bool yes = edge_length[e] * edge_length[e] > kShortestSquared;
    if (yes)
      dyad_of(rest + 3 * size_t(edges[2 * size_t(e)]), rest + 3 * size_t(edges[2 * size_t(e) + 1]),
              edge_length[e], m);
    return yes;
  };
  for (uint32_t e = 0; e < nedge; ++e) per_modulus[e] = directed(e);  // the factor, until the end
  double nominal = 0;                                                 // sum w of factor 1
  for (int step = 0; step < kMaxSteps; ++step) {
    double c[kN][kN] = {}, total = 0, softest = 0, stiff = 0;
    for (uint32_t e = 0; e < nedge; ++e) {
      if (!directed(e)) continue;
      const double w = per_modulus[e] * edge_volume[e];
      total += w;
      for (int i = 0; i < kN; ++i)
        for (int j = 0; j <= i; ++j) c[i][j] += w * (m[i] * m[j]);
    }
    for (int i = 0; i < kN; ++i)
      for (int j = 0; j <= i; ++j) c[i][j] *= total > 0 ? kN / total : 0;
    if (step == 0) nominal = total;
    if (!factor(c)) break;
    for (uint32_t e = 0; step > 0 && e < nedge; ++e) {
      if (!directed(e)) continue;
      const double compliance = inverse_form(c, m);
      softest = std::max(softest, compliance);
      if (compliance < kStiff) stiff += per_modulus[e] * edge_volume[e];
    }
    if (step > 0 && (softest <= kSoftest || (step == 1 && stiff <= kStretched * total))) break;
    for (uint32_t e = 0; e < nedge; ++e)
      if (directed(e))
        per_modulus[e] =
            std::clamp(per_modulus[e] * inverse_form(c, m) * (nominal / total), kMinFactor, kMaxFactor);
  }
  for (uint32_t e = 0; e < nedge; ++e)
    if (directed(e)) per_modulus[e] /= edge_length[e] * edge_length[e];
}

}  // namespace model
