// From parameters and fields by cell to what the passes read: stiffness per spring, frozen extra
// coordinates, dampers, drag, springs that are switched off. What nothing calls for stays empty and its
// kernels are never chosen.
#include <algorithm>

#include "../model_common/params.h"
#include "msm_body.h"

namespace msm {

// Scale of the springs that keeps Young's modulus when the volume term is on: springs give lambda = mu, the
// term adds kV to lambda, and E = mu (3 lambda + 2 mu) / (lambda + mu) is solved for mu; without it mu =
// 0.4 E. r = kV/E.
static double spring_scale(double r) {
  if (r == 0) return 1;
  const double b = 3 * r - 2;
  return (__builtin_sqrt(b * b + 20 * r) - b) / 10 / 0.4;
}

void Body::take_fields(const dfm_mesh &m) {
  const auto fits = [](uint32_t which, double x) { return which != kVolume || x >= 0 || x == kFromPoisson; };
  model::take_fields(host, kId, kParams, kParamCount, m, field, fits);
}

// Every cell gives each of its edges E V, times what spring_directions.h finds. What all cells share (Young's
// modulus, the volume term's correction, a branch) stays outside.
void Body::find_shapes() {
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
void Body::find_tilts(Room &room) {
  const bool by_cell = !field[kSlope].empty() || !field[kAxis].empty();
  const double steepest = largest_of(kSlope);
  edge_tilt.swap(room.edge_tilt);
  edge_rest.swap(room.edge_rest);
  tilt.swap(room.tilt);
  if (steepest > 0) {
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
  for (size_t s = 0; s < spring_slots(); ++s) {
    const uint32_t e = spring_edge[s];
    rest[s] = e == kNone ? 0 : rest_length(e);
    if (steepest > 0) tilt[s] = e == kNone ? 0 : edge_tilt[e];
  }
  for (uint32_t b = 0; b < nblock; ++b)
    block[b].tilt = tilt.empty() ? nullptr : tilt.data() + (block[b].stiffness - stiffness.data());
}

// Dampers by cell add up like the springs: c of an edge is the sum of its cells' damping_stiffness times
// their share of k.
void Body::find_dampers(Room &room) {
  const Buffer<double> &by_cell = field[kDampingStiffness];
  damping_on = largest_of(kDampingStiffness) > 0;
  if (!by_cell.empty() && damping_on) {
    Buffer<double> &share = room.damp_share;
    edge_damp.swap(room.edge_damp);
    damp_most.swap(room.damp_most);
    damp.swap(room.damp);
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
    for (size_t s = 0; s < spring_slots(); ++s)
      damp[s] = spring_edge[s] == kNone ? 0 : edge_damp[spring_edge[s]];
    for (uint32_t b = 0; b < nblock; ++b)
      block[b].damp = damp.data() + (block[b].stiffness - stiffness.data());
  }
  const Buffer<double> &drag = field[kDampingMass];
  drag_on = largest_of(kDampingMass) > 0;
  if (!drag.empty() && drag_on) {
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
}

// How far resistance to collapse counts in a cell of this shape. Its stiffness against a change of volume is
// kC sum |grad V|^2 / V0, with |grad V| = A/3 at each point: 0.707 kC L for a regular cell of edge L, and r
// times that for others, while their springs get softer by 1/r. A flat cell turns over within a step wherever
// a body vibrates; with the full kC it would bring down the bound of the whole body each time. Beyond r =
// 1.5, kC falls with 1/r^4, so that beside the springs of the same cell it counts as 1/r^2. The energy with
// which these springs resist turning over falls as
// fast, from a sixth of that of kC in a regular cell.
double Body::collapse_share(uint32_t c) const {
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
Body::CellStiffness Body::cell_stiffness(uint32_t c) const {
  const double v0 = cell_volume6[c] / 6, side = edge_length[cell_edge[6 * size_t(c)]];
  for (int n = 0; !edge_off.empty() && n < 6; ++n)
    if (edge_off[cell_edge[6 * size_t(c) + n]]) return {0, 0};
  if (!(v0 > 1e-12 * side * side * side)) return {0, 0};
  const double unit = at(kYoung, c) / (36 * v0), ratio = volume_ratio(c);
  return {ratio * unit, std::max(at(kCollapse, c) * collapse_share(c) - ratio, 0.0) * unit};
}

void Body::fill_stiffness() {
  const size_t springs = spring_slots(), ncells = cell_slots();
  for (size_t s = 0; s < springs; ++s)
    stiffness[s] = spring_edge[s] == kNone ? 0 : stiffness_of(spring_edge[s]);
  for (size_t c = 0; c < ncells; ++c) {
    const CellStiffness k = cell_id[c] == kNone ? CellStiffness{0, 0} : cell_stiffness(cell_id[c]);
    bulk[c] = k.bulk;
    collapse[c] = k.collapse;
  }
}

void Body::find_effects() {
  size_t n = 0;
  if (volume_on) active_effects[n++] = "volume";
  if (damping_on || drag_on || has_branch()) active_effects[n++] = "damping";
  active_effects[n++] = "large_rotation";
  if (!edge_tilt.empty()) active_effects[n++] = "anisotropy";
  if (has_branch()) active_effects[n++] = "deform.relaxation";
  active_effects[n] = nullptr;
}

const char *Body::idle(Param which) const {
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

namespace {
struct Aside {  // the mask, while no spring counts as off
  Buffer<uint8_t> &mask, kept;
  explicit Aside(Buffer<uint8_t> &m) : mask(m) { kept.swap(mask); }
  ~Aside() { kept.swap(mask); }
};
}  // namespace

double Body::largest_of(Param which) const { return model::largest_of(field[which], params[which], ncell); }

double Body::largest_volume() const {
  double most = volume_of(0);
  const bool by_cell = !field[kVolume].empty() || !field[kPoisson].empty();
  for (uint32_t c = 1; by_cell && c < ncell; ++c) most = std::max(most, volume_of(c));
  return most;
}

void Body::make_room(Room &room) const {
  const size_t slots = spring_slots();
  const bool tilted = largest_of(kSlope) > 0;
  if (tilted) {
    room.edge_tilt.create(host, nedge);
    room.edge_rest.create(host, nedge);
  }
  if (tilted || has_branch()) room.tilt.create(host, slots);
  if (!field[kDampingStiffness].empty() && largest_of(kDampingStiffness) > 0) {
    room.edge_damp.create(host, nedge);
    room.damp_share.create(host, nedge);
    room.damp_most.create(host, npoint);
    room.damp.create(host, slots);
  }
  if (!field[kDampingMass].empty() && largest_of(kDampingMass) > 0) {
    room.point_drag.create(host, npoint);
    room.drag_around.create(host, npoint);
  }
  if (has_branch() && rest_now.empty()) room.rest_now.create(host, slots);
  room.own.create(host, npoint);
  room.next.create(host, npoint);
  room.tangent.create(host, nedge);
  room.gradient.create(host, largest_volume() > 0 ? 4 * size_t(ncell) : 0);
}

// All or nothing: what may fail comes first.
void Body::apply_params(const double *values) {
  Room room;
  model::try_params(params, values, [&] { make_room(room); });
  volume_on = largest_volume() > 0;
  cells_on = volume_on || largest_of(kCollapse) > 0;
  find_shapes();
  find_tilts(room);
  find_dampers(room);
  if (!room.rest_now.empty()) rest_now.swap(room.rest_now);
  {  // the weights of the step bound never depend on what is switched off, nor on when it was
    const Aside aside(edge_off);
    fill_stiffness();
    find_weights(room);
  }
  find_effects();
  if (!edge_off.empty()) fill_stiffness();
  fill_single();
}

// The rows of the step bound keep counting a spring that is off: a bound it stays, and a cut need not look
// for new weights.
void Body::mask_springs(uint32_t n, const uint32_t *which, bool on) {
  if (edge_off.empty()) edge_off.create(host, nedge);
  for (uint32_t k = 0; k < n; ++k) edge_off[which[k]] = !on;
  fill_stiffness();
  fill_single();
}

}  // namespace msm
