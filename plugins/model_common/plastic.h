// Plastic flow at a point of a cell (a first-order tetrahedron has one), for vectors of lanes and for double
// alike. With e the strain in the frame, p the plastic strain (trace 0) and a its length so far (accumulated
// equivalent plastic strain), the stress is
//   2 mu (dev e - p) + k tr(e) I,   size = sqrt(3/2) 2 mu |dev e - p|  (von Mises).
// Beyond the yield stress Y = yield + hardening a it flows along dev e - p by the equivalent plastic strain
//   g = min(flow (size - Y) / (3 mu + hardening), limit - a),
// radial return (Simo and Hughes, Computational Inelasticity, 1998) where flow is 1; with flow = 1 -
// exp(-creep h) the stress relaxes to the yield surface in the time 1/creep (Duvaut and Lions; same book).
// That is the minimum in g >= 0 of
//   mu |dev e - p(g)|^2 + Y g + hardening/2 g^2 + (1/flow - 1) (3 mu + hardening)/2 g^2,  a + g <= limit,
// so forces at the end of the flow are the gradient of this potential in x alone, and its second derivative
// is no more than that of the elastic cell. The potential is
//   mu |dev e - p|^2 - g (size - Y - (3 mu + hardening)/(2 flow) g).
// Once p and a are taken over as the state, the elastic energy is less by Y g and more: what has dissipated.
#pragma once
#include <cstdint>

namespace model {
namespace plastic {

constexpr uint32_t kState = 7;  // doubles by point: the plastic strain, its length so far
constexpr double kEquivalent = 0x1.3988e1409212ep+0;  // sqrt(3/2)

template <class Ops>
struct PlasticState {
  typename Ops::V strain[6], length;
};  // xx yy zz xy yz zx, the tensor's shears
// The first three times the volume.
template <class Ops>
struct PlasticLaw {
  typename Ops::V mu2, yield, hardening, limit, flow, per_flow;
};
template <class Ops>
struct PlasticFlow {
  typename Ops::V way[6], norm;  // dev e - p before the flow, |way|
  typename Ops::V over, stiff, step,
      share;  // size - Y where above 0, 3 mu + hardening, g, and what of `way` flows
};

template <class Ops>
static inline __attribute__((always_inline)) typename Ops::V square_of(const typename Ops::V *e) {
  return ((e[0] * e[0] + e[1] * e[1]) + e[2] * e[2]) +
         Ops::splat(2) * ((e[3] * e[3] + e[4] * e[4]) + e[5] * e[5]);
}

template <class Ops>
static inline __attribute__((always_inline)) void find_flow(const PlasticLaw<Ops> &law,
                                                            const typename Ops::V *e,
                                                            const PlasticState<Ops> &s,
                                                            PlasticFlow<Ops> &out) {
  using V = typename Ops::V;
  const V third = Ops::splat(1.0 / 3) * ((e[0] + e[1]) + e[2]), zero = Ops::splat(0);
  for (int k = 0; k < 6; ++k) out.way[k] = (k < 3 ? e[k] - third : e[k]) - s.strain[k];
  out.norm = Ops::root(square_of<Ops>(out.way));
  const V most = law.yield + law.hardening * s.length;
  out.over = Ops::more(Ops::splat(kEquivalent) * (law.mu2 * out.norm) - most, zero);
  out.stiff = Ops::splat(1.5) * law.mu2 + law.hardening;
  const V free = (law.flow * out.over) / (out.stiff + Ops::splat(1e-300));
  out.step = Ops::less(free, Ops::more(law.limit - s.length, zero));
  out.share = (Ops::splat(kEquivalent) * out.step) / (out.norm + Ops::splat(1e-300));
}

template <class Ops>
static inline __attribute__((always_inline)) void take_flow(const PlasticFlow<Ops> &flow,
                                                            PlasticState<Ops> &s) {
  for (int k = 0; k < 6; ++k) s.strain[k] = s.strain[k] + flow.share * flow.way[k];
  s.length = s.length + flow.step;
}

// The potential less the energy of the elastic material, before the flow is taken.
template <class Ops>
static inline __attribute__((always_inline)) typename Ops::V flow_energy(const PlasticLaw<Ops> &law,
                                                                         const typename Ops::V *e,
                                                                         const PlasticState<Ops> &s,
                                                                         const PlasticFlow<Ops> &flow) {
  using V = typename Ops::V;
  const V own = (s.strain[0] * e[0] + s.strain[1] * e[1]) + s.strain[2] * e[2];
  const V mixed = (s.strain[3] * e[3] + s.strain[4] * e[4]) + s.strain[5] * e[5];
  const V kept = law.mu2 * (Ops::splat(0.5) * square_of<Ops>(s.strain) - (own + Ops::splat(2) * mixed));
  return kept - flow.step * (flow.over - Ops::splat(0.5) * ((flow.stiff * law.per_flow) * flow.step));
}

// Adds to the elasticity d (material.h) what the flow takes: the shear modulus falls by the share of the way
// that flows, and along the way it becomes that of hardening. False: nothing flows.
template <class Ops>
static inline bool soften(const PlasticLaw<Ops> &law, const PlasticFlow<Ops> &flow, double (*d)[6]) {
  if (!(flow.step > 0)) return false;
  // at the limit nothing flows any more
  const bool ended = flow.step < law.flow * flow.over / flow.stiff;
  const double along = ended ? 1 : 1 - 1.5 * law.flow * law.mu2 / flow.stiff, across = 1 - flow.share;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) {
      const double deviator = (i == j ? (i < 3 ? 1 : 0.5) : 0) - (i < 3 && j < 3 ? 1.0 / 3 : 0);
      const double dyad = flow.way[i] / flow.norm * (flow.way[j] / flow.norm);
      d[i][j] += law.mu2 * ((across - 1) * (deviator - dyad) + (along - 1) * dyad);
    }
  return true;
}

}  // namespace plastic
}  // namespace model
