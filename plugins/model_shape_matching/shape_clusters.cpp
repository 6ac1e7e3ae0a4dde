// Clusters of a body, from its mesh alone. Centers are points, each the farthest from those before it; a
// point belongs to its nearest center, and to the others that are not farther than that by more than the
// overlap. So every point has a cluster, and the same mesh always has the same ones.
#include <algorithm>
#include <cmath>

#include "../model_common/index.h"
#include "../model_common/rotation.h"
#include "shape_fit.h"

namespace shape {

namespace {
// Factor of the mass of fully held points in a cluster's fit and momentum: the cluster hangs on them.
constexpr double kHeavy = 1e7;

// What those of n points that `use` takes span: 0 nothing, 1 a point, 2 a line, 3 more.
template <class At, class Use>
int span_of(const At &at, uint32_t n, const Use &use) {
  const double *first = nullptr, *second = nullptr;
  double far = 0, off = 0;
  for (uint32_t k = 0; k < n; ++k) {
    if (!use(k)) continue;
    if (!first) first = at(k);
    const double d = model::square_between(at(k), first);
    if (d > far) {
      far = d;
      second = at(k);
    }
  }
  if (!second) return first ? 1 : 0;
  for (uint32_t k = 0; k < n; ++k) {
    if (!use(k)) continue;
    double along = 0;
    for (int a = 0; a < 3; ++a) along += (at(k)[a] - first[a]) * (second[a] - first[a]);
    off = std::max(off, model::square_between(at(k), first) - along * along / far);
  }
  return off > 1e-8 * far ? 3 : 2;
}
}  // namespace

void Body::create(const dfm_host *h, const dfm_mesh &m) {
  host = h;
  std::copy(m.params, m.params + kParamCount, params);
  npoint = m.npoint;
  nsurfel = m.row ? m.nsurfel : 0;
  take_mesh(m);
  make_clusters();
  frame.create(h, ncluster);
  for (Buffer<double> *b : {&position, &velocity, &change, &matched}) b->create(h, 3 * size_t(npoint));
  momentum.create(h, 6 * size_t(ncluster));
  touched.create(h, npoint);
  is_touched.create(h, npoint);
  met.create(h, ncluster);
  pushed.create(h, nsurfel);
  push_by.create(h, 3 * size_t(nsurfel));
  is_met.create(h, ncluster);
  slot.create(h, ncluster);
  for (uint32_t c = 0; c < ncluster; ++c) slot[c] = {DFM_PER_INSTANCE, kPlastic, DFM_SLOT_SCALAR, 0};
  slots = {sizeof(dfm_slots), ncluster, slot.data(), 0, 0};
  apply_params(m.params);
}

void Body::take_mesh(const dfm_mesh &m) {
  rest.create_copy(host, m.rest, 3 * size_t(npoint));
  weight.create(host, npoint);
  inverse.create(host, 3 * size_t(npoint));
  for (size_t i = 0; i < npoint; ++i) {
    if (!(m.mass[i] > 0)) throw "a point has no mass; drop it from the mesh";
    const unsigned held = m.fixed ? m.fixed[i] & 7u : 0;
    weight[i] = held == 7 ? kHeavy * m.mass[i] : m.mass[i];
    for (size_t a = 0; a < 3; ++a) inverse[3 * i + a] = held >> a & 1 ? 0 : 1 / m.mass[i];
  }
  row.create_copy(host, m.row, nsurfel ? size_t(nsurfel) + 1 : 0);
  col.create_copy(host, m.col, row[nsurfel]);
  coupling.create_copy(host, m.weight, row[nsurfel]);
}

void Body::make_clusters() {
  const uint32_t wanted = std::min(uint32_t(params[kClusters]), npoint);
  const auto x = [&](uint32_t i) { return rest.data() + 3 * size_t(i); };
  double middle[3] = {};
  for (uint32_t i = 0; i < npoint; ++i)
    for (int a = 0; a < 3; ++a) middle[a] += x(i)[a] / npoint;
  Buffer<double> near;  // of the nearest center, m2
  Buffer<uint32_t> center;
  near.create(host, npoint);
  center.create(host, wanted);
  for (uint32_t i = 0; i < npoint; ++i) near[i] = model::square_between(x(i), middle);
  double reach = HUGE_VAL;
  for (ncluster = 0; ncluster < wanted && reach > 0; ++ncluster) {
    center[ncluster] = uint32_t(std::max_element(near.data(), near.data() + npoint) - near.data());
    for (uint32_t i = 0; i < npoint; ++i) {
      const double d = model::square_between(x(i), x(center[ncluster]));
      near[i] = ncluster ? std::min(near[i], d) : d;
    }
    reach = std::sqrt(*std::max_element(near.data(), near.data() + npoint));
  }
  list_members(center.data(), near.data(), wanted > 1 ? params[kOverlap] * reach : HUGE_VAL);
  if (ncluster > 1) check_cohesion();
  cluster.create(host, ncluster);
  for (uint32_t c = 0; c < ncluster; ++c) make_cluster(c);
}

// Clusters draw each other by the points that they share. Two points leave them a hinge, so what a cluster
// shares with those that hold together already has to span as much as it does itself: three points that are
// not in a line, where it has them.
void Body::check_cohesion() const {
  Buffer<uint8_t> joined, reached;
  joined.create(host, ncluster);
  reached.create(host, npoint);
  const auto size = [&](uint32_t c) { return cluster_begin[c + 1] - cluster_begin[c]; };
  uint32_t largest = 0, count = 0;
  for (uint32_t c = 1; c < ncluster; ++c)
    if (size(c) > size(largest)) largest = c;
  const auto join = [&](uint32_t c) {
    joined[c] = 1;
    ++count;
    for (uint32_t k = cluster_begin[c]; k < cluster_begin[c + 1]; ++k) reached[cluster_point[k]] = 1;
  };
  join(largest);
  for (bool grows = true; grows;) {
    grows = false;
    for (uint32_t c = 0; c < ncluster; ++c) {
      if (joined[c]) continue;
      const uint32_t *const point = cluster_point.data() + cluster_begin[c];
      const auto at = [&](uint32_t k) { return rest.data() + 3 * size_t(point[k]); };
      const int shared = span_of(at, size(c), [&](uint32_t k) { return reached[point[k]] != 0; });
      if (shared == 0 || shared < span_of(at, size(c), [](uint32_t) { return true; })) continue;
      join(c);
      grows = true;
    }
  }
  if (count == ncluster) return;
  model::refuse(host, kId,
                "%u clusters of %u points do not hold together; take fewer clusters, or a larger overlap",
                ncluster, npoint);
}

// near [npoint] m2: from the nearest center.
void Body::list_members(const uint32_t *center, const double *near, double reach) {
  const auto each = [&](auto &&use) {
    for (uint32_t i = 0; i < npoint; ++i) {
      const double most = std::sqrt(near[i]) + reach;
      for (uint32_t c = 0; c < ncluster; ++c) {
        const double away =
            model::square_between(rest.data() + 3 * size_t(i), rest.data() + 3 * size_t(center[c]));
        if (std::sqrt(away) <= most) use(i, c);
      }
    }
  };
  point_begin.create(host, size_t(npoint) + 1);
  cluster_begin.create(host, size_t(ncluster) + 1);
  each([&](uint32_t i, uint32_t c) {
    ++point_begin[i + 1];
    ++cluster_begin[c + 1];
  });
  for (uint32_t i = 0; i < npoint; ++i)
    point_begin[i + 1] = model::after(point_begin[i], point_begin[i + 1],
                                      "the clusters have more than 4 billion points; take fewer clusters, or "
                                      "a smaller overlap");
  for (uint32_t c = 0; c < ncluster; ++c) cluster_begin[c + 1] += cluster_begin[c];
  const size_t members = point_begin[npoint];
  for (Buffer<uint32_t> *b : {&cluster_point, &point_cluster, &point_place}) b->create(host, members);
  part.create(host, members);
  q.create(host, 3 * members);
  Buffer<uint32_t> next;
  next.create(host, ncluster);
  uint32_t at = 0;
  each([&](uint32_t i, uint32_t c) {
    const uint32_t place = cluster_begin[c] + next[c]++;
    cluster_point[place] = i;
    point_cluster[at] = c;
    point_place[at++] = place;
    part[place] = weight[i] / (point_begin[i + 1] - point_begin[i]);
  });
}

void Body::make_cluster(uint32_t c) {
  Cluster &out = cluster[c];
  const uint32_t begin = cluster_begin[c], n = cluster_begin[c + 1] - begin;
  for (uint32_t k = begin; k < begin + n; ++k) {
    out.mass += part[k];
    std::copy_n(rest.data() + 3 * size_t(cluster_point[k]), 3, q.data() + 3 * size_t(k));
  }
  for (int twice = 0; twice < 2; ++twice)  // what rounding leaves of the first mean would move momentum
    for (size_t a = 0; a < 3; ++a) {
      double sum = 0;
      for (uint32_t k = begin; k < begin + n; ++k) sum += part[k] * q[3 * size_t(k) + a];
      for (uint32_t k = begin; k < begin + n; ++k) q[3 * size_t(k) + a] -= sum / out.mass;
    }
  double square = 0;
  for (size_t e = 3 * size_t(begin); e < 3 * (size_t(begin) + n); ++e) square += q[e] * q[e];
  out.size = square > 0 ? std::sqrt(square / n) : 1;
  const double *const from = q.data() + 3 * size_t(begin);
  measure([&](uint32_t k) { return from + 3 * size_t(k); }, part.data() + begin, n, mode(), out);
}

void Body::apply_params(const double *values) {
  std::copy(values, values + kParamCount, params);
  const char **effect = active_effects;
  *effect++ = "large_rotation";
  if (params[kDamping] > 0 || params[kDampingMass] > 0) *effect++ = "damping";
  if (params[kCreep] > 0) *effect++ = "plasticity";
  *effect = nullptr;
}

const char *Body::idle(Param which) const {
  if (which == kLinearity && mode() == kRigid) return "mode is rigid";
  if (which == kOverlap && ncluster == 1) return "there is one cluster";
  if ((which == kYield || which == kPlasticMax) && !(params[kCreep] > 0)) return "plastic_creep is 0";
  return nullptr;
}

void Body::init_state(double *state) const {
  for (uint32_t c = 0; c < ncluster; ++c) model::rotation::identity(state + kPlastic * size_t(c));
}

}  // namespace shape
