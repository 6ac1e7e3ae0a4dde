#include "springs.h"

#include "../model_common/edges.h"
#include "../model_common/even_rows.h"
#include "../model_common/small.h"
#include "../model_common/spring_directions.h"
#include "as_cpp.h"

namespace gpu {
namespace {

// Edges whose products of squares stay far inside the range of a float.
constexpr double kShortestEdge = 1e-6, kLongestEdge = 1e4;
constexpr uint32_t kNone = ~0u;

using model::square_between;

double volume_of(const double *x0, const double *x1, const double *x2, const double *x3) {
  const auto from = [&](const double *x, double *d) {
    for (int a = 0; a < 3; ++a) d[a] = x[a] - x0[a];
  };
  double a[3], b[3], c[3], normal[3];
  from(x1, a);
  from(x2, b);
  from(x3, c);
  model::cross(b, c, normal);
  return std::fabs(model::dot(a, normal)) / 6;
}

// The kernel: its functions are members here.
struct Points {
  const Call &call;
#define ROW(i) call.of<const uvec2>(kOwn)[i]
#define SPRING(i) call.of<const uvec4>(kOwn + 1)[i]
#include "spring_step.glsl"
};

void move_points(const Call &call, uint32_t begin, uint32_t end) {
  Points points{call};
  for (uint32_t i = begin; i < end; ++i) points.move_point(i);
}

}  // namespace

// The stiffness of an edge is that of model msm without its volume term.
void Springs::create(const dfm_host *h, const dfm_mesh &m) {
  Buffer<double> field[kPoisson], length, volume, modulus;
  model::take_fields(h, kId, gpu::kParams, kParams, m, field, [](uint32_t, double) { return true; });
  by_cell_ = !field[kYoung].empty();
  lay_out(h, m.npoint, m.nedge, m.edges);
  std::copy(m.mass, m.mass + npoint, mass.data());
  for (Buffer<double> *each : {&rest_square_, &share_, &stiffness_, &length, &volume, &modulus})
    each->create(h, nspring_);
  for (uint32_t e = 0; e < nspring_; ++e) {
    rest_square_[e] = square_between(m.rest + 3 * size_t(edges_[2 * size_t(e)]),
                                     m.rest + 3 * size_t(edges_[2 * size_t(e) + 1]));
    length[e] = std::sqrt(rest_square_[e]);
    if (!(length[e] >= kShortestEdge && length[e] <= kLongestEdge))
      throw "edges of 1e-6 m to 1e4 m are expected; scale the mesh, or take the model msm";
  }
  Buffer<uint32_t> rows;
  rows.create(h, size_t(npoint) + 1);
  model::find_rows(edges_.data(), nspring_, npoint, rows.data());
  for (uint32_t c = 0; c < m.ncell; ++c) {
    const uint32_t *const q = m.cells + 4 * size_t(c);
    const auto at = [&](int a) { return m.rest + 3 * size_t(q[a]); };
    const double own = volume_of(at(0), at(1), at(2), at(3));
    uint32_t of_cell[6];
    model::find_edges_by_rows(edges_.data(), rows.data(), q, of_cell);
    for (const uint32_t e : of_cell) {
      volume[e] += own;
      share_[e] += by_cell_ ? own * field[kYoung][c] : own;
    }
  }
  model::find_directions(nspring_, edges_.data(), m.rest, length.data(), volume.data(), modulus.data());
  for (uint32_t e = 0; e < nspring_; ++e) share_[e] *= modulus[e];
}

void Springs::lay_out(const dfm_host *h, uint32_t points, uint32_t n, const uint32_t *edges) {
  take_points(h, points);
  nspring_ = n;
  edges_.create_copy(h, edges, 2 * size_t(n));
  places_.create(h, npoint);
  for (size_t end = 0; end < 2 * size_t(n); ++end) ++places_[edges[end]].y;
  room_ = gpu::lay_out(places_, npoint);
  ends_.create(h, room_);
  edge_of_.create(h, room_);
  std::fill(edge_of_.data(), edge_of_.data() + room_, kNone);
  Buffer<uint32_t> next;
  next.create(h, npoint);
  for (uint32_t e = 0; e < n; ++e)
    for (int end = 0; end < 2; ++end) {
      const uint32_t i = edges[2 * size_t(e) + end];
      const size_t at = places_[i].x + size_t(kSide) * next[i]++;
      edge_of_[at] = e;
      ends_[at].x = edges[2 * size_t(e) + 1 - end];
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

void Springs::fill(const double *params) {
  for (uint32_t e = 0; e < nspring_; ++e) stiffness_[e] = by_cell_ ? share_[e] : params[kYoung] * share_[e];
  put(stiffness_.data(), rest_square_.data());
  damping = params[kDampingStiffness];
  drag = params[kDampingMass];
  find_rows();
}

// Row sums that hold in every shape: the derivative of a spring, k [(1 - s) n n^T + s I] with s = 1 - L0/L,
// is at most k in norm for s <= 1. So D_i = sum_j k_ij (1 + w_j / w_i) for any weights w > 0, and the step is
// stable if h^2 D + 2 h F <= 4 m, F = damping_stiffness D + damping_mass m (doc/models/msm.md, step bound).
void Springs::find_rows() {
  Buffer<double> weight, next;
  weight.create(host, npoint);
  next.create(host, npoint);
  const auto add = [&](double *out) {
    for (uint32_t e = 0; e < nspring_; ++e) {
      const uint32_t i = edges_[2 * size_t(e)], j = edges_[2 * size_t(e) + 1];
      out[i] += stiffness_[e] * (weight[i] + weight[j]);
      out[j] += stiffness_[e] * (weight[i] + weight[j]);
    }
  };
  model::even_rows(npoint, mass.data(), weight.data(), next.data(), add);
  std::fill(row.data(), row.data() + npoint, 0.0);
  add(row.data());
  for (uint32_t i = 0; i < npoint; ++i) row[i] /= weight[i];
}

void Springs::bound(const dfm_kin &, double *ksum, double *csum) {
  for (uint32_t i = 0; i < npoint; ++i) {
    ksum[i] += stiff(i);
    csum[i] += damper(i);
  }
}

Work Springs::work() const {
  return {{{gpu::kSprings, npoint, move_points}},
          1,
          {{sizeof(uvec2) * npoint, places_.data()}, {sizeof(uvec4) * room_, ends_.data()}}};
}

double Springs::energy(const dfm_kin &k, uint32_t begin, uint32_t end) const {
  double sum = 0;
  for (size_t e = begin; e < end; ++e) {
    const double square =
        square_between(k.x + size_t(edges_[2 * e]) * k.stride, k.x + size_t(edges_[2 * e + 1]) * k.stride);
    const double stretch = std::sqrt(square) - std::sqrt(rest_square_[e]);
    sum += 0.5 * stiffness_[e] * (stretch * stretch);
  }
  return sum;
}

}  // namespace gpu
