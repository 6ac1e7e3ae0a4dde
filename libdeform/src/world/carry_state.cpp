#include "world/carry_state.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "plugin/context.h"
#include "plugin/tables.h"

namespace dfm {
namespace {

constexpr size_t kTopologyHead = offsetof(dfm_topology, carry) + sizeof(void *);

// Maps previous points to present points, with the share of each copy in the mass of all copies.
class Copies {
 public:
  Copies(const CutMesh &mesh, const Body &b, uint32_t before) : begin_(before + 1) {
    for (const uint32_t p : mesh.point) ++begin_[p + 1];
    for (uint32_t p = 0; p < before; ++p) begin_[p + 1] += begin_[p];
    std::vector<uint32_t> next(begin_.begin(), begin_.end() - 1);
    copy_.resize(mesh.point.size());
    for (uint32_t i = 0; i < mesh.point.size(); ++i) copy_[next[mesh.point[i]]++] = i;
    share_.assign(copy_.size(), 1);
    for (uint32_t p = 0; p < before; ++p) {
      double mass = 0;
      for (uint32_t k = begin_[p]; k < begin_[p + 1]; ++k) mass += b.p.mass[copy_[k]];
      for (uint32_t k = begin_[p]; begin_[p + 1] - begin_[p] > 1 && k < begin_[p + 1]; ++k)
        share_[k] = b.p.mass[copy_[k]] / mass;
    }
  }
  template <class Use>
  void each(uint32_t point, Use &&use) const {
    for (uint32_t k = begin_[point]; k < begin_[point + 1]; ++k) use(copy_[k], share_[k]);
  }

 private:
  std::vector<uint32_t> begin_, copy_;
  std::vector<double> share_;
};

// parts: missing points are in other bodies. Each body gets the share of the spring that its points have of
// the weights, so that the total force and its work are unchanged.
Spring carried(const Spring &s, const Copies &copies, bool parts) {
  Spring out = s;
  out.points.clear();
  out.weights.clear();
  double sum = 0;
  for (size_t i = 0; i < s.points.size(); ++i)
    copies.each(s.points[i], [&](uint32_t point, double share) {
      out.points.push_back(point);
      out.weights.push_back(share * s.weights[i]);
      sum += share * s.weights[i];
    });
  for (double &w : out.weights) w = sum > 0 && sum != 1 ? w / sum : w;
  if (!(sum > 0)) out.points.clear();
  if (parts && out.points.size() < s.points.size()) {
    out.stiffness *= sum;
    out.damping *= sum;
  }
  return out;
}

}  // namespace

std::vector<uint32_t> edges_before(const Array<uint32_t> &before, const CutMesh &mesh,
                                   const Array<uint32_t> &now) {
  std::vector<uint64_t> keys;
  for (size_t e = 0; e < before.size(); e += 2) keys.push_back(uint64_t{before[e]} << 32 | before[e + 1]);
  std::vector<uint32_t> out;
  for (size_t e = 0; e < now.size(); e += 2) {
    const auto ends = std::minmax(mesh.point[now[e]], mesh.point[now[e + 1]]);
    const uint64_t key = uint64_t{ends.first} << 32 | ends.second;
    const auto at = std::lower_bound(keys.begin(), keys.end(), key);
    out.push_back(at != keys.end() && *at == key ? uint32_t(at - keys.begin()) : kNone);
  }
  return out;
}

void carry_loads(const Former &before, const CutMesh &mesh, Body &b) {
  const bool loaded = std::ranges::any_of(before.p.load, [](double f) { return f != 0 || std::signbit(f); });
  if (!loaded && before.loads.empty() && before.springs.empty() && before.motions.empty()) return;
  const Copies copies(mesh, b, before.p.n);
  for (const Load &l : before.loads) {
    Load out = l;
    out.points.clear();
    out.force.clear();
    for (size_t i = 0; i < l.points.size(); ++i)
      copies.each(l.points[i], [&](uint32_t point, double share) {
        out.points.push_back(point);
        for (size_t k = 0; k < 3; ++k) out.force.push_back(share * l.force[3 * i + k]);
      });
    b.loads.push_back(std::move(out));
  }
  for (const Spring &s : before.springs)
    if (Spring out = carried(s, copies, before.parts); !out.points.empty())
      b.springs.push_back(std::move(out));
  for (const HeldMotion &m : before.motions) {
    HeldMotion out = m;
    out.points.clear();
    out.start.clear();
    for (size_t i = 0; i < m.points.size(); ++i)
      copies.each(m.points[i], [&](uint32_t point, double) {
        out.points.push_back(point);
        out.start.insert(out.start.end(), &m.start[3 * i], &m.start[3 * i] + 3);
      });
    if (!out.points.empty()) b.motions.push_back(std::move(out));
  }
  for (uint32_t p = 0; p < before.p.n; ++p)
    copies.each(p, [&](uint32_t point, double share) {
      for (size_t k = 0; k < kStride; ++k)
        b.p.load[size_t{kStride} * point + k] = share * before.p.load[size_t{kStride} * p + k];
    });
}

std::optional<dfm_topology> topology_of(const ModelInstance &model) {
  const void *table = nullptr;
  if (model.ops->extension)
    model.call("extension", [&] {
      table = model.ops->extension(model.self, DFM_EXT_TOPOLOGY);
      return DFM_OK;
    });
  return copy_table<dfm_topology>(table, kTopologyHead, model.type->id, "dfm_topology");
}

void carry_state(const Former &before, const CutMesh &mesh, const std::vector<uint32_t> &edge, Body &b) {
  const ModelInstance &old = before.model;
  ModelInstance &now = b.model;
  const auto same = [](const dfm_slot &l, const dfm_slot &r) {
    return l.unit == r.unit && l.width == r.width && l.kind == r.kind;
  };
  if (!std::equal(old.slots.begin(), old.slots.end(), now.slots.begin(), now.slots.end(), same))
    fail(DFM_E_FATAL,
         "body '%s': model '%s' has another state for the cells that are left; report it to its "
         "author",
         b.name.c_str(), now.type->id);
  size_t from = 0, to = 0;
  for (const dfm_slot &slot : now.slots) {
    const bool by_point = slot.unit == DFM_PER_POINT, by_cell = slot.unit == DFM_PER_CELL,
               by_edge = slot.unit == DFM_PER_EDGE;
    const size_t n = by_point ? b.p.n : by_cell ? mesh.cell.size() : by_edge ? edge.size() : 1;
    for (size_t i = 0; i < n; ++i) {
      const uint32_t was = by_point ? mesh.point[i] : by_cell ? mesh.cell[i] : by_edge ? edge[i] : 0;
      if (was == kNone) continue;
      std::copy_n(old.state.begin() + std::ptrdiff_t(from + size_t{slot.width} * was), slot.width,
                  now.state.begin() + std::ptrdiff_t(to + slot.width * i));
    }
    const size_t count = by_point  ? before.p.n
                         : by_cell ? before.tets.size() / 4
                         : by_edge ? before.edges.size() / 2
                                   : 1;
    from += slot.width * count;
    to += slot.width * n;
  }
  const std::optional<dfm_topology> table = topology_of(now);
  if (!table || !table->carry) return;
  const dfm_topology_maps maps{sizeof maps,
                               b.p.n,
                               static_cast<uint32_t>(mesh.cell.size()),
                               static_cast<uint32_t>(edge.size()),
                               mesh.point.data(),
                               mesh.cell.data(),
                               edge.data()};
  const Overheard why;
  const dfm_status s =
      now.call("carry", [&] { return table->carry(old.self, now.self, &maps, now.state.data()); });
  if (s != DFM_OK)
    fail(s < 0 ? s : DFM_E_FATAL, "body '%s': model '%s' cannot continue with the remaining cells: %s",
         b.name.c_str(), now.type->id, *why.text() ? why.text() : dfm_status_name(s));
}

std::vector<uint32_t> surfels_before(const Body &before, const CutMesh &mesh, const Surface &now) {
  std::vector<uint32_t> surfel(before.p.n, kNone), out(now.nsurfel, kNone);
  for (uint32_t s = 0; s < before.surface.nsurfel; ++s) surfel[before.surface.point[s]] = s;
  for (uint32_t s = 0; s < now.nsurfel; ++s) out[s] = std::exchange(surfel[mesh.point[now.point[s]]], kNone);
  return out;
}

void carry_surfels(const Array<double> &from, const std::vector<uint32_t> &surfel, Array<double> &to) {
  to.assign(3 * surfel.size(), 0.0);
  for (size_t s = 0; s < surfel.size(); ++s)
    if (surfel[s] != kNone) std::copy_n(&from[size_t{3} * surfel[s]], 3, &to[3 * s]);
}

}  // namespace dfm
