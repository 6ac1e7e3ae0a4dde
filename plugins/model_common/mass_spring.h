// What the parameters of org.deform.msm make of the springs and cells of a mesh, in the order of the mesh:
// stiffness, frozen extra coordinates, dampers, drag, volume terms. org.deform.msm_gpu has the same. What
// nothing calls for stays empty.
#pragma once
#include <deform/elementary.h>
#include <deform/plugin_draft.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "edges.h"
#include "params.h"
#include "small.h"
#include "spring_directions.h"
#include "volume_limits.h"

namespace msm {

using model::Buffer;
using model::square_between;

// Rows of the parameter table; a row's value begins at its number, the last row is three wide.
enum Param : uint32_t {
  kYoung,
  kPoisson,
  kDampingStiffness,
  kDampingMass,
  kVolume,
  kCollapse,
  kSlope,
  kAxisKind,
  kAxisForm,
  kDamper,
  kRelaxationRatio,
  kRelaxationTime,
  kAxis,
  kParamCount,
  kValueCount = kAxis + 3
};
enum Kind : uint32_t { kSofter, kStiffer };
enum Force : uint32_t { kFormB, kFormA };
enum Damper : uint32_t { kVoigt, kMaxwell, kStandardLinear };
inline constexpr double kFromPoisson = -1;  // of `volume`: what gives the body the ratio `poisson`

inline constexpr uint32_t kRun = DFM_PARAM_RUNTIME, kCell = DFM_PARAM_PER_CELL;
inline constexpr const char *kKinds[] = {"softer", "stiffer", nullptr};
inline constexpr const char *kForces[] = {"B", "A", nullptr};
inline constexpr const char *kDampers[] = {"voigt", "maxwell", "sls", nullptr};
inline constexpr dfm_param kParams[kParamCount] = {
    {"young", "Young's modulus", "Pa", 1e-3, 1e13, 1e5, kRun | DFM_PARAM_LOG_SCALE | kCell, 1, nullptr},
    {"poisson", "Poisson ratio; the model gives 1/4 and more", "1", -0.99, 0.4999, 0.3, kRun | kCell, 1,
     nullptr},
    {"damping_stiffness", "damper over stiffness of each spring", "s", 0, 1e3, 0, kRun | kCell, 1, nullptr},
    {"damping_mass", "drag over mass of each point", "1/s", 0, 1e6, 0, kRun | kCell, 1, nullptr},
    {"volume",
     "volume stiffness in bulk moduli E/(3(1-2 nu)); 0: off; auto, -1: what makes poisson the body's ratio",
     "1", kFromPoisson, 1e6, kFromPoisson, kRun | kCell | DFM_PARAM_AUTO, 1, nullptr},
    {"collapse", "stiffness against collapse of a cell below 0.6 of its volume, over young; 0: off", "1", 0,
     1e3, 3, kRun | kCell, 1, nullptr},
    {"anisotropy_slope", "slope of the extra coordinates; 0: isotropic", "1", 0, 1e3, 0, kRun | kCell, 1,
     nullptr},
    {"anisotropy_kind", "what the body is along the axis", "1", 0, 1, kSofter, kRun | DFM_PARAM_ENUM, 1,
     kKinds},
    {"anisotropy_form", "force of a tilted spring: projected (B) or turned back (A)", "1", 0, 1, kFormB,
     DFM_PARAM_ENUM, 1, kForces},
    {"damper", "voigt: beside the spring; maxwell: behind it; sls: a spring beside both", "1", 0, 2, kVoigt,
     DFM_PARAM_ENUM, 1, kDampers},
    {"relaxation_ratio", "sls: stiffness of the branch over that of the spring", "1", 1e-6, 1e3, 1, kRun, 1,
     nullptr},
    {"relaxation_time", "maxwell and sls: dashpot over stiffness of the branch", "s", 1e-9, 1e9, 0.1,
     kRun | DFM_PARAM_LOG_SCALE, 1, nullptr},
    {"anisotropy_axis", "axis of the anisotropy; its length does not matter", "1", -1e6, 1e6, 1, kRun | kCell,
     3, nullptr},
};
inline constexpr dfm_effect_row kOff[] = {
    {"volume", kVolume, 0, 0},       {"damping", kDampingStiffness, 0, 0},
    {"damping", kDampingMass, 0, 0}, {"damping", kDamper, 0, kVoigt},
    {"anisotropy", kSlope, 0, 0},    {"deform.relaxation", kDamper, 0, kVoigt}};
inline constexpr const char *kEffects[] = {"volume",     "damping",           "large_rotation",
                                           "anisotropy", "deform.relaxation", nullptr};

// Whether all parameters fit together, beside their ranges; false after the reason was logged.
inline bool fit_together(const dfm_host *h, const char *who, const double *values) {
  if (values[kVolume] < 0 && values[kVolume] != kFromPoisson) {
    model::complain(
        h, who, "parameter volume is between -1 and 0; give -1 (from poisson), 0 (off) or a positive number");
    return false;
  }
  if (!model::has_direction(values + kAxis)) {
    model::complain(h, who, "parameter anisotropy_axis is zero; give a direction");
    return false;
  }
  if (uint32_t(values[kAxisForm]) == kFormA && uint32_t(values[kDamper]) != kVoigt) {
    model::complain(h, who,
                    "parameter anisotropy_form A works with damper voigt only, since with other dampers its "
                    "force has no energy; choose form B");
    return false;
  }
  return true;
}

// `volume` that gives Poisson's ratio nu; springs alone give 1/4 and no volume modulus that is not
// negative gives less.
inline double volume_for(double nu) { return nu > 0.25 ? 3 * (4 * nu - 1) / (2 * (1 + nu)) : 0; }

// Scale of the springs that keeps Young's modulus when the volume term is on: springs give lambda = mu, the
// term adds kV to lambda, and E = mu (3 lambda + 2 mu) / (lambda + mu) is solved for mu; without it mu =
// 0.4 E. r = kV/E.
inline double spring_scale(double r) {
  if (r == 0) return 1;
  const double b = 3 * r - 2;
  return (__builtin_sqrt(b * b + 20 * r) - b) / 10 / 0.4;
}

// Six times the volume and the length of a spring, by the operations of the kernels, so that forces of the
// rest shape are exactly zero.
inline double volume6_of(const double *x0, const double *x1, const double *x2, const double *x3) {
  const double a[3] = {x1[0] - x0[0], x1[1] - x0[1], x1[2] - x0[2]};
  const double c[3] = {x2[0] - x0[0], x2[1] - x0[1], x2[2] - x0[2]};
  const double d[3] = {x3[0] - x0[0], x3[1] - x0[1], x3[2] - x0[2]};
  double g[3];
  model::cross(c, d, g);
  return model::dot(a, g);
}
inline double length_of(const double *x, const double *y) { return __builtin_sqrt(square_between(x, y)); }

// Energy of a cell from its corners, its stiffness over 36 V0, six volumes at rest and its limit.
inline double cell_energy_of(const double *const *x, double bulk, double collapse, double rest,
                             double limit) {
  double q = 0;
  for (int a = 1; a < 4; ++a)
    for (int b = 0; b < a; ++b) q += square_between(x[a], x[b]);
  const double u = limit / std::max(q, limit);
  const double now = volume6_of(x[0], x[1], x[2], x[3]) * (__builtin_sqrt(u) * u * (2.5 - 1.5 * u));
  const double kept = std::min(std::max(now, kMinVolume * rest), kMaxVolume * rest), more = kept - rest;
  const double lost = std::max(kCollapseBelow * rest - kept, 0.0);
  return 0.5 * bulk * (more * more) + 0.5 * collapse * (lost * lost) +
         (bulk * more - collapse * lost) * (now - kept);
}

// exp(-x) and (1 - exp(-x))/x, of a branch over a step of x relaxation times.
struct Decay { double keep, next; };
inline Decay decay_of(double x) {
  if (x > 0.25) {
    const double keep = dfm_exp(-x);
    return {keep, (1 - keep) / x};
  }
  double series = 1;  // 1 - E would lose digits: its series over x
  for (int n = 14; n > 1; --n) series = 1 - x / n * series;
  return {1 - x * series, series};
}

struct Material {
  uint32_t ncell = 0, nedge = 0;
  double params[kValueCount] = {};
  Buffer<double> field[kParamCount];  // [ncell,width] values by cell in place of a parameter's; empty without

  // In the host's order.
  // shape: stiffness over `scale`, see find_shapes
  Buffer<double> shape, edge_volume, edge_length;
  Buffer<double> per_modulus;  // [nedge] stiffness over the sum of E V around the edge
  Buffer<uint32_t> edges, cells, cell_edge;
  Buffer<double> cell_volume6;
  Buffer<double> rest_point;  // [npoint,3]
  double scale = 1;           // of shape

  // Empty if the effect is off.
  Buffer<double> edge_tilt, edge_rest;  // [nedge] w^2 and sqrt(L0^2 + w^2)
  // [nedge], [npoint] damper over stiffness and its largest around a point, where it differs
  Buffer<double> edge_damp, damp_most;
  Buffer<double> point_drag;           // [npoint] drag over mass, where it differs
  Buffer<uint8_t> edge_off;            // [nedge] springs that are switched off
  const char *active_effects[8] = {};  // of the present parameters, NULL-terminated

  bool volume_on = false, cells_on = false;  // the volume term; that or the resistance to collapse
  bool damping_on = false, drag_on = false;

  uint32_t choice(Param which) const { return uint32_t(params[which]); }
  bool is_turned() const { return !edge_tilt.empty() && choice(kAxisForm) == kFormA; }
  // Branches: a spring of share `part` of the stiffness in series with a dashpot.
  bool has_branch() const { return choice(kDamper) != kVoigt; }
  double part() const {
    return choice(kDamper) == kMaxwell ? 1
           : choice(kDamper) == kVoigt ? 0
                                       : params[kRelaxationRatio] / (1 + params[kRelaxationRatio]);
  }

  double at(Param which, uint32_t c) const { return field[which].empty() ? params[which] : field[which][c]; }
  double largest_of(Param which) const { return model::largest_of(field[which], params[which], ncell); }
  // Moduli over Young's: the springs' scale and the volume modulus kV. See doc/models/msm.md.
  double volume_of(uint32_t c) const {
    const double given = at(kVolume, c);
    return given < 0 ? volume_for(at(kPoisson, c)) : given;
  }
  double volume_ratio(uint32_t c) const { return volume_of(c) / (3 * (1 - 2 * at(kPoisson, c))); }
  double largest_volume() const;
  // The stiffness of spring e with its branch, switched off or not; its damper over that; its rest length as
  // it counts.
  double full_stiffness(uint32_t e) const { return scale * shape[e]; }
  double stiffness_of(uint32_t e) const { return edge_off.empty() || !edge_off[e] ? scale * shape[e] : 0; }
  double damp_scale() const {
    return choice(kDamper) == kStandardLinear ? 1 / (1 + params[kRelaxationRatio]) : 1;
  }
  double rest_length(uint32_t e) const { return edge_rest.empty() ? edge_length[e] : edge_rest[e]; }
  // over 36 V0; both 0 for a cell that is flat at rest or cut
  struct CellStiffness { double bulk, collapse; };
  CellStiffness cell_stiffness(uint32_t c) const;
  bool has_volume(uint32_t c) const {  // none: it is flat at rest
    const double side = edge_length[cell_edge[6 * size_t(c)]];
    return cell_volume6[c] / 6 > 1e-12 * side * side * side;
  }
  double collapse_share(uint32_t c) const;
  double limit_of(uint32_t c) const {
    double sum = 0;
    for (int n = 0; n < 6; ++n)
      sum += edge_length[cell_edge[6 * size_t(c) + n]] * edge_length[cell_edge[6 * size_t(c) + n]];
    return sum > 0 ? kLimit * sum : 1;  // four points at one place have no volume to keep
  }
  // [4] 6 |dV/dx_a| sqrt(kV / (36 V0)) at rest
  void rest_gradients(uint32_t c, double *out) const;
  // why a parameter has no effect with the present others; NULL if it has
  const char *idle(Param which) const;

  void take_mesh(const dfm_host *host, const char *who, const dfm_mesh &m);
  // memory for new parameters, allocated before anything changes: arrays to swap in, sums
  struct Room {
    Buffer<double> edge_tilt, edge_rest, edge_damp, damp_most, point_drag, damp_share, drag_around;
  };
  void make_room(const dfm_host *host, uint32_t npoint, Room &room) const;
  void take_params(uint32_t npoint, Room &room);

 private:
  void find_shapes();
  void find_tilts(Room &room);
  void find_dampers(Room &room);
  void find_drag(uint32_t npoint, Room &room);
  void find_effects();
};

inline void Material::take_mesh(const dfm_host *host, const char *who, const dfm_mesh &m) {
  const uint32_t npoint = m.npoint;
  ncell = m.ncell;
  nedge = m.nedge;
  shape.create(host, nedge);
  edge_volume.create(host, nedge);
  edge_length.create(host, nedge);
  rest_point.create_copy(host, m.rest, 3 * size_t(npoint));
  edges.create_copy(host, m.edges, 2 * size_t(nedge));
  cells.create_copy(host, m.cells, 4 * size_t(ncell));
  cell_edge.create(host, 6 * size_t(ncell));
  cell_volume6.create(host, ncell);
  for (uint32_t e = 0; e < nedge; ++e)
    edge_length[e] =
        length_of(m.rest + 3 * size_t(edges[2 * size_t(e)]), m.rest + 3 * size_t(edges[2 * size_t(e) + 1]));
  for (uint32_t c = 0; c < ncell; ++c) {
    uint32_t *q = cells.data() + 4 * size_t(c);
    const auto six = [&] {
      const double *x[4];
      for (int a = 0; a < 4; ++a) x[a] = m.rest + 3 * size_t(q[a]);
      return volume6_of(x[0], x[1], x[2], x[3]);
    };
    if (six() < 0) std::swap(q[2], q[3]);  // a volume below the one at rest is then less of it
    cell_volume6[c] = six();
    const double volume = cell_volume6[c] / 6;
    uint32_t *const e = cell_edge.data() + 6 * size_t(c);
    model::find_edges(edges.data(), nedge, q, e);
    for (int n = 0; n < 6; ++n) edge_volume[e[n]] += volume;
  }
  per_modulus.create(host, nedge);
  model::find_directions(nedge, edges.data(), rest_point.data(), edge_length.data(), edge_volume.data(),
                         per_modulus.data());
  const auto fits = [](uint32_t which, double x) { return which != kVolume || x >= 0 || x == kFromPoisson; };
  model::take_fields(host, who, kParams, kParamCount, m, field, fits);
}

// Every cell gives each of its edges E V, times what spring_directions.h finds. What all cells share (Young's
// modulus, the volume term's correction, a branch) stays outside.
inline void Material::find_shapes() {
  const bool scaled = !field[kVolume].empty() || !field[kPoisson].empty(), stiff = !field[kYoung].empty();
  scale = (scaled ? 1.0 : spring_scale(volume_ratio(0))) * (stiff ? 1.0 : params[kYoung]);
  if (choice(kDamper) == kStandardLinear) scale *= 1 + params[kRelaxationRatio];
  std::fill(shape.data(), shape.data() + nedge, 0.0);
  for (uint32_t c = 0; c < ncell; ++c) {
    const double volume = cell_volume6[c] / 6;
    const double share =
        volume * (stiff ? field[kYoung][c] : 1.0) * (scaled ? spring_scale(volume_ratio(c)) : 1.0);
    for (int n = 0; n < 6; ++n) shape[cell_edge[6 * size_t(c) + n]] += share;
  }
  for (uint32_t e = 0; e < nedge; ++e) shape[e] *= per_modulus[e];
}

// w^2 of a spring d at rest: softer, g^2 (a.d)^2, one extra coordinate g a.X; stiffer, g^2 (|d|^2 - (a.d)^2),
// two of them along any two axes across a. Springs between cells that differ take the mean over the volume
// around them, which knows no sign of an axis.
inline void Material::find_tilts(Room &room) {
  const bool by_cell = !field[kSlope].empty() || !field[kAxis].empty();
  const double steepest = largest_of(kSlope);
  edge_tilt.swap(room.edge_tilt);
  edge_rest.swap(room.edge_rest);
  if (!(steepest > 0)) return;
  const auto squared = [&](uint32_t c, uint32_t e) {
    const double *x = rest_point.data() + 3 * size_t(edges[2 * size_t(e)]);
    const double *y = rest_point.data() + 3 * size_t(edges[2 * size_t(e) + 1]);
    const double *axis = field[kAxis].empty() ? params + kAxis : field[kAxis].data() + 3 * size_t(c);
    const double slope = at(kSlope, c);
    const double d[3] = {y[0] - x[0], y[1] - x[1], y[2] - x[2]};
    const double ad = (axis[0] * d[0] + axis[1] * d[1]) + axis[2] * d[2];
    const double aa = (axis[0] * axis[0] + axis[1] * axis[1]) + axis[2] * axis[2];
    const double along = ad * ad / aa, all = (d[0] * d[0] + d[1] * d[1]) + d[2] * d[2];
    return slope * slope * (choice(kAxisKind) == kSofter ? along : std::max(all - along, 0.0));
  };
  for (uint32_t c = 0; by_cell && c < ncell; ++c)
    for (int n = 0; n < 6; ++n) {
      const uint32_t e = cell_edge[6 * size_t(c) + n];
      if (edge_volume[e] > 0) edge_tilt[e] += cell_volume6[c] / 6 / edge_volume[e] * squared(c, e);
    }
  for (uint32_t e = 0; e < nedge; ++e) {
    if (!by_cell) edge_tilt[e] = squared(0, e);
    const uint32_t *ends = edges.data() + 2 * size_t(e);
    edge_rest[e] = __builtin_sqrt(
        square_between(rest_point.data() + 3 * size_t(ends[0]), rest_point.data() + 3 * size_t(ends[1])) +
        edge_tilt[e]);
  }
}

// Dampers by cell add up like the springs: c of an edge is the sum of its cells' damping_stiffness times
// their share of k.
inline void Material::find_dampers(Room &room) {
  const Buffer<double> &by_cell = field[kDampingStiffness];
  damping_on = largest_of(kDampingStiffness) > 0;
  if (by_cell.empty() || !damping_on) return;
  Buffer<double> &share = room.damp_share;
  edge_damp.swap(room.edge_damp);
  damp_most.swap(room.damp_most);
  for (uint32_t c = 0; c < ncell; ++c) {
    const double k = cell_volume6[c] * at(kYoung, c) * spring_scale(volume_ratio(c));
    for (int n = 0; n < 6; ++n) {
      const uint32_t e = cell_edge[6 * size_t(c) + n];
      edge_damp[e] += k * by_cell[c];
      share[e] += k;
    }
  }
  for (uint32_t e = 0; e < nedge; ++e) {
    edge_damp[e] = share[e] > 0 ? damp_scale() * (edge_damp[e] / share[e]) : 0;
    for (int n = 0; n < 2; ++n) {
      double &most = damp_most[edges[2 * size_t(e) + n]];
      most = std::max(most, edge_damp[e]);
    }
  }
}

inline void Material::find_drag(uint32_t npoint, Room &room) {
  const Buffer<double> &drag = field[kDampingMass];
  drag_on = largest_of(kDampingMass) > 0;
  if (drag.empty() || !drag_on) return;
  Buffer<double> &around = room.drag_around;
  point_drag.swap(room.point_drag);
  for (uint32_t c = 0; c < ncell; ++c)
    for (int a = 0; a < 4; ++a) {
      const uint32_t i = cells[4 * size_t(c) + a];
      point_drag[i] += cell_volume6[c] * drag[c];
      around[i] += cell_volume6[c];
    }
  for (uint32_t i = 0; i < npoint; ++i) point_drag[i] = around[i] > 0 ? point_drag[i] / around[i] : 0;
}

// How far resistance to collapse counts in a cell of this shape. Its stiffness against a change of volume is
// kC sum |grad V|^2 / V0, with |grad V| = A/3 at each point: 0.707 kC L for a regular cell of edge L, and r
// times that for others, while their springs get softer by 1/r. A flat cell turns over within a step wherever
// a body vibrates; with the full kC it would bring down the bound of the whole body each time. Beyond r =
// 1.5, kC falls with 1/r^4, so that beside the springs of the same cell it counts as 1/r^2. The energy with
// which these springs resist turning over falls as
// fast, from a sixth of that of kC in a regular cell.
inline double Material::collapse_share(uint32_t c) const {
  constexpr double kRegular = 0.70710678118654752, kFull = 1.5;
  const auto at = [&](int a) { return &rest_point[3 * size_t(cells[4 * size_t(c) + size_t(a)])]; };
  double areas = 0, edges_sum = 0;
  for (int a = 0; a < 4; ++a) {
    const double *const first = at((a + 1) % 4);
    const double *const second = at((a + 2) % 4);
    const double *const third = at((a + 3) % 4);
    const double u[3] = {second[0] - first[0], second[1] - first[1], second[2] - first[2]};
    const double v[3] = {third[0] - first[0], third[1] - first[1], third[2] - first[2]};
    const double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    areas += 0.25 * (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  }
  for (int n = 0; n < 6; ++n) edges_sum += edge_length[cell_edge[6 * size_t(c) + size_t(n)]];
  const double own = areas / 9 / (cell_volume6[c] / 6), regular = kRegular * (edges_sum / 6);
  const double share = kFull * regular / own;
  return share < 1 ? (share * share) * (share * share) : 1;
}

// A cell that is flat at rest has no volume to keep, and neither has one that lost a spring (it is cut).
inline Material::CellStiffness Material::cell_stiffness(uint32_t c) const {
  const double v0 = cell_volume6[c] / 6;
  for (int n = 0; !edge_off.empty() && n < 6; ++n)
    if (edge_off[cell_edge[6 * size_t(c) + n]]) return {0, 0};
  if (!has_volume(c)) return {0, 0};
  const double unit = at(kYoung, c) / (36 * v0), ratio = volume_ratio(c);
  return {ratio * unit, std::max(at(kCollapse, c) * collapse_share(c) - ratio, 0.0) * unit};
}

inline void Material::rest_gradients(uint32_t c, double *out) const {
  const uint32_t *q = cells.data() + 4 * size_t(c);
  const double *x[4], v0 = cell_volume6[c] / 6;
  for (int a = 0; a < 4; ++a) x[a] = rest_point.data() + 3 * size_t(q[a]);
  for (int a = 0; a < 4; ++a) {
    const double *o = x[(a + 1) & 3], *y = x[(a + 2) & 3], *z = x[(a + 3) & 3];
    const double u[3] = {y[0] - o[0], y[1] - o[1], y[2] - o[2]};
    const double w[3] = {z[0] - o[0], z[1] - o[1], z[2] - o[2]};
    const double r[3] = {u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]};
    const double k = has_volume(c) ? volume_ratio(c) * at(kYoung, c) / (36 * v0) : 0;
    out[a] = __builtin_sqrt(k * ((r[0] * r[0] + r[1] * r[1]) + r[2] * r[2]));
  }
}

inline void Material::find_effects() {
  size_t n = 0;
  if (volume_on) active_effects[n++] = "volume";
  if (damping_on || drag_on || has_branch()) active_effects[n++] = "damping";
  active_effects[n++] = "large_rotation";
  if (!edge_tilt.empty()) active_effects[n++] = "anisotropy";
  if (has_branch()) active_effects[n++] = "deform.relaxation";
  active_effects[n] = nullptr;
}

inline const char *Material::idle(Param which) const {
  switch (which) {
    case kPoisson: {
      bool below = false, other = false;
      for (uint32_t c = 0; c < ncell; ++c) {
        const double nu = at(kPoisson, c);
        below |= at(kVolume, c) < 0 && nu < 0.25;
        other |= nu != 0.25;
      }
      if (below)
        return "springs alone give 1/4, and no volume term that is stable gives less; cells that ask for "
               "less have 1/4";
      return other && !volume_on
                 ? "volume is 0, and springs alone give 1/4 whatever it says; leave volume at auto"
                 : nullptr;
    }
    case kCollapse: {
      bool works = largest_of(kCollapse) == 0;
      for (uint32_t c = 0; c < ncell && !works; ++c) works = at(kCollapse, c) > volume_ratio(c);
      return works ? nullptr : "the volume term is as stiff as that already";
    }
    case kAxisKind:
    case kAxisForm:
    case kAxis: return edge_tilt.empty() ? "anisotropy_slope is 0" : nullptr;
    case kRelaxationRatio:
      return choice(kDamper) == kStandardLinear ? nullptr : "only damper sls has a second spring";
    case kRelaxationTime: return has_branch() ? nullptr : "damper is voigt";
    default: return nullptr;
  }
}

inline double Material::largest_volume() const {
  double most = volume_of(0);
  const bool by_cell = !field[kVolume].empty() || !field[kPoisson].empty();
  for (uint32_t c = 1; by_cell && c < ncell; ++c) most = std::max(most, volume_of(c));
  return most;
}

inline void Material::make_room(const dfm_host *host, uint32_t npoint, Room &room) const {
  if (largest_of(kSlope) > 0) {
    room.edge_tilt.create(host, nedge);
    room.edge_rest.create(host, nedge);
  }
  if (!field[kDampingStiffness].empty() && largest_of(kDampingStiffness) > 0) {
    room.edge_damp.create(host, nedge);
    room.damp_share.create(host, nedge);
    room.damp_most.create(host, npoint);
  }
  if (!field[kDampingMass].empty() && largest_of(kDampingMass) > 0) {
    room.point_drag.create(host, npoint);
    room.drag_around.create(host, npoint);
  }
}

inline void Material::take_params(uint32_t npoint, Room &room) {
  volume_on = largest_volume() > 0;
  cells_on = volume_on || largest_of(kCollapse) > 0;
  find_shapes();
  find_tilts(room);
  find_dampers(room);
  find_drag(npoint, room);
  find_effects();
}

}  // namespace msm
