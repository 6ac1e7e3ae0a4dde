#include "springs.h"

#include "../model_common/even_rows.h"
#include "../model_common/spring_energy.h"
#include "as_cpp.h"

namespace gpu {
namespace {

// Edges whose products of squares stay far inside the range of a float.
constexpr double kShortestEdge = 1e-6, kLongestEdge = 1e4;
constexpr uint32_t kNone = ~0u;

using model::square_between;

#define COLLAPSE_BELOW msm::kCollapseBelow
#define COLLAPSE_COUNTED msm::kCollapseCounted
#define FADE1 float(msm::kFade1)
#define FADE2 float(msm::kFade2)
// The kernels: their functions are members here.
struct Points {
  const Call &call;
#include "spring_step.glsl"
};
struct Volumes {
  const Call &call;
#include "volume_forces.glsl"
};

void move_points(const Call &call, uint32_t begin, uint32_t end) {
  Points points{call};
  for (uint32_t i = begin; i < end; ++i) points.move_point(i);
}
void find_forces(const Call &call, uint32_t begin, uint32_t end) {
  Volumes cells{call};
  for (uint32_t c = begin; c < end; ++c) cells.force_of_volume(c);
}

}  // namespace

constinit const Springs::Rows Springs::kRows;

bool Springs::valid(const dfm_host *h, const double *values) {
  return model::in_range(h, kId, kRows.of, kParamCount, values) && msm::fit_together(h, kId, values);
}

void Springs::create(const dfm_host *h, const dfm_mesh &m) {
  take_points(h, m);
  take_mesh(h, kId, m);
  lay_out(h, npoint, nedge, edges.data());
  for (Buffer<double> *each : {&rest_square_, &stiffness_}) each->create(h, nspring_);
  for (uint32_t e = 0; e < nspring_; ++e) {
    if (!(edge_length[e] >= kShortestEdge && edge_length[e] <= kLongestEdge))
      throw "edges of 1e-6 m to 1e4 m are expected; scale the mesh, or take the model msm";
    rest_square_[e] = square_between(&rest_point[3 * size_t(edges[2 * size_t(e)])],
                                     &rest_point[3 * size_t(edges[2 * size_t(e) + 1])]);
  }
}

void Springs::lay_out(const dfm_host *h, uint32_t points, uint32_t n, const uint32_t *springs) {
  host = h;
  npoint = points;
  nspring_ = n;
  places_.create(h, npoint);
  for (size_t end = 0; end < 2 * size_t(n); ++end) ++places_[springs[end]].y;
  room_ = gpu::lay_out(places_, npoint);
  ends_.create(h, room_);
  edge_of_.create(h, room_);
  end_of_.create(h, n);
  std::fill(edge_of_.data(), edge_of_.data() + room_, kNone);
  Buffer<uint32_t> next;
  next.create(h, npoint);
  for (uint32_t e = 0; e < n; ++e)
    for (int end = 0; end < 2; ++end) {
      const uint32_t i = springs[2 * size_t(e) + end];
      const size_t at = places_[i].x + size_t(kSide) * next[i]++;
      edge_of_[at] = e;
      end_of_[e] = uint32_t(at);
      ends_[at].x = springs[2 * size_t(e) + 1 - end];
    }
}

void Springs::put(const double *stiffness, const double *rest_square) {
  for (size_t s = 0; s < room_; ++s) {
    if (edge_of_[s] == kNone) continue;
    const uint64_t square = std::bit_cast<uint64_t>(rest_square[edge_of_[s]]);
    ends_[s].y = std::bit_cast<uint32_t>(float(stiffness[edge_of_[s]]));
    ends_[s].z = uint32_t(square);
    ends_[s].w = uint32_t(square >> 32);
  }
}

void Springs::fill(const double *values) {
  Room room;
  model::try_params(params, values, [&] { make_room(host, npoint, room); });
  take_params(npoint, room);
  damping = damping_on ? damp_scale() * largest_of(msm::kDampingStiffness) : 0;
  drag = params[msm::kDampingMass];
  drags = point_drag.empty() ? nullptr : point_drag.data();
  drawn = cells_on;
  if (has_branch())
    branches = {nspring_, room_, edge_of_.data(), end_of_.data(), part(), params[msm::kRelaxationTime]};
  put_stiffness();
  put_options();
  find_rows();
}

void Springs::put_stiffness() {
  for (uint32_t e = 0; e < nspring_; ++e) stiffness_[e] = stiffness_of(e);
  put(stiffness_.data(), rest_square_.data());
  put_cells();
}

void Springs::put_options() {
  if (edge_tilt.empty() && edge_damp.empty()) return options_.drop();
  if (options_.empty()) options_.create(host, room_);
  for (size_t s = 0; s < room_; ++s) {
    const uint32_t e = edge_of_[s];
    if (e == kNone) continue;
    const float tilt = edge_tilt.empty() ? 0 : float(edge_tilt[e]),
                share = edge_damp.empty() ? 1 : float(edge_damp[e] / damping);
    options_[s] = {std::bit_cast<uint32_t>(tilt), std::bit_cast<uint32_t>(share)};
  }
}

void Springs::put_cells() {
  if (!cells_on) return;
  if (grown_.empty()) {
    corners_.create(host, npoint, ncell, cells.data());
    volumes_.create(host, ncell);
    grown_.create(host, npoint);
  }
  for (uint32_t c = 0; c < ncell; ++c) {
    const CellStiffness own = cell_stiffness(c);
    volumes_[c] = {own.bulk, own.collapse, cell_volume6[c], limit_of(c)};
  }
}

// Row sums of springs that hold in every shape: the derivative of a spring, k [(1 - s) d d^T/L^2 + s I] with
// s = 1 - L0/L, is at most k in norm for s <= 1. So D_i = sum_j k_ij (1 + w_j / w_i) for any weights w > 0,
// and the step is stable if h^2 D + 2 h F <= 4 m, F = damping_stiffness D + damping_mass m
// (doc/models/msm.md, step bound), with springs that are off, too. Cells add what their shape asks for, here
// that at rest.
void Springs::find_rows() {
  Buffer<double> weight, next, gradient;
  weight.create(host, npoint);
  next.create(host, npoint);
  if (volume_on) gradient.create(host, 4 * size_t(ncell));
  for (uint32_t c = 0; volume_on && c < ncell; ++c) rest_gradients(c, &gradient[4 * size_t(c)]);
  const auto add_springs = [&](double *out) {
    for (uint32_t e = 0; e < nspring_; ++e) {
      const uint32_t i = edges[2 * size_t(e)], j = edges[2 * size_t(e) + 1];
      const double both = full_stiffness(e) * (weight[i] + weight[j]);
      out[i] += both;
      out[j] += both;
    }
  };
  const auto add_cells = [&](double *out) {
    for (uint32_t c = 0; volume_on && c < ncell; ++c) {
      const uint32_t *const q = &cells[4 * size_t(c)];
      const double *const g = &gradient[4 * size_t(c)];
      double sum = 0;
      for (int a = 0; a < 4; ++a) sum += g[a] * weight[q[a]];
      for (int a = 0; a < 4; ++a) out[q[a]] += g[a] * sum;
    }
  };
  model::even_rows(npoint, mass.data(), weight.data(), next.data(), [&](double *out) {
    add_springs(out);
    add_cells(out);
  });
  for (Buffer<double> *each : {&row, &undamped}) std::fill(each->data(), each->data() + npoint, 0.0);
  add_springs(row.data());
  add_cells(undamped.data());
  for (uint32_t i = 0; i < npoint; ++i) {
    row[i] /= weight[i];
    undamped[i] /= weight[i];
  }
  if (!cells_on) return;
  corners_.put_rows(row.data(), mass.data(), npoint);
  for (uint32_t c = 0; c < ncell; ++c) {
    float share[4];
    for (int a = 0; a < 4; ++a) share[a] = float(weight[cells[4 * size_t(c) + size_t(a)]]);
    corners_.put_shares(c, share);
  }
}

// Rows at rest are those that the bound has already; no shape counts as less stiff.
void Springs::add_growth(const dfm_kin &k, double *ksum, double *) {
  std::fill(grown_.data(), grown_.data() + npoint, 0.0);
  const Call none{};
  Volumes of{none};
  for (size_t c = 0; c < ncell; ++c) {
    const uint32_t *const q = &cells[4 * c];
    double d[9], force[9], rows[4];
    for (size_t n = 0; n < 9; ++n)
      d[n] = k.x[size_t(q[n / 3 + 1]) * k.stride + n % 3] - k.x[size_t(q[0]) * k.stride + n % 3];
    of.resist(d, volumes_[c], corners_.cell[Corners::entry_of(c, 2)], force, rows);
    for (int a = 0; a < 4; ++a) grown_[q[a]] += rows[a];
  }
  for (uint32_t i = 0; i < npoint; ++i) ksum[i] += std::max(grown_[i] - undamped[i], 0.0);
}

Work Springs::work() const {
  Work w;
  uint32_t with = kWithOptions * !options_.empty() | kWithBranches * (branches.n > 0) | kTurned * is_turned();
  if (cells_on) {
    with |= kWithCells;
    w.add(kVolumeForces, 0, ncell, find_forces);
    corners_.add_to(w, npoint);
    w.array[kShapes] = {sizeof(dvec4) * ncell, volumes_.data()};
  }
  w.add(kSpringStep, with, npoint, move_points);
  w.array[kSpringRows] = {sizeof(uvec2) * npoint, places_.data()};
  w.array[kSprings] = {sizeof(uvec4) * room_, ends_.data()};
  if (!options_.empty()) w.array[kOptions] = {sizeof(uvec2) * room_, options_.data()};
  w.nstretch = branches.room;
  return w;
}

double Springs::energy(const dfm_kin &k, uint32_t begin, uint32_t end) const {
  const double *const state = branches.n && k.state ? k.state + of_stretch(0) : nullptr;
  const auto at = [&](uint32_t i) { return k.x + size_t(i) * k.stride; };
  double sum = 0;
  for (size_t n = begin; n < end; ++n) {
    if (n >= nspring_) {
      const size_t c = n - nspring_;
      const double *x[4];
      for (size_t a = 0; a < 4; ++a) x[a] = at(cells[4 * c + a]);
      const dvec4 &of = volumes_[c];
      sum += msm::cell_energy_of(x, of.x, of.y, of.z, of.w);
      continue;
    }
    sum += msm::spring_energy(*this, uint32_t(n), k, state);
  }
  return sum;
}

}  // namespace gpu
