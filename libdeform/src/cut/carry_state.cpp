#include "cut/carry_state.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/lists.h"
#include "cut/body_shape.h"
#include "mesh/mesh.h"
#include "plugin/context.h"
#include "world/body_zones.h"
#include "world/may_cut.h"
#include "world/triangle_list.h"

namespace dfm {
namespace {

// Maps previous points to present points, with the share of each copy in the mass of all copies.
class Copies {
 public:
  Copies(const CutMesh &mesh, const Body &b, uint32_t before) {
    list_by(before, mesh.point.size(), [&](uint32_t i) { return mesh.point[i]; }, begin_, copy_);
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
  std::vector<uint32_t> out;
  for (size_t e = 0; e < now.size(); e += 2)
    out.push_back(edge_number(before, mesh.point[now[e]], mesh.point[now[e + 1]]));
  return out;
}

void carry_loads(const BodyShape &before, const CutMesh &mesh, bool parts, Body &b) {
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
    if (Spring out = carried(s, copies, parts); !out.points.empty()) b.springs.push_back(std::move(out));
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

void carry_state(const BodyShape &before, const CutMesh &mesh, const std::vector<uint32_t> &edge, Body &b) {
  const ModelInstance &old = before.model;
  ModelInstance &now = b.model;
  const auto same = [](const dfm_slot &l, const dfm_slot &r) {
    return l.unit == r.unit && l.width == r.width && l.kind == r.kind;
  };
  if (!std::equal(old.slots.begin(), old.slots.end(), now.slots.begin(), now.slots.end(), same))
    refuse(b, DFM_E_FATAL,
           ": model '%s' has another state for the cells that are left; report it to its author",
           now.type->id);
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
    refuse(b, s < 0 ? s : DFM_E_FATAL, ": model '%s' cannot continue with the remaining cells: %s",
           now.type->id, *why.text() ? why.text() : dfm_status_name(s));
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

// ---- names and zones --------------------------------------------------------------------------------

namespace {

// Gives out each old name once, and new names from `next` on.
class Names {
 public:
  Names(const Array<uint32_t> &old, uint32_t n, uint32_t &next) : old_(old), taken_(n), next_(next) {}
  uint32_t of(uint32_t feature) {  // kNone: no feature before
    if (feature == kNone || taken_[feature]) return next_++;
    taken_[feature] = 1;
    return old_.empty() ? feature : old_[feature];
  }

 private:
  const Array<uint32_t> &old_;
  std::vector<uint8_t> taken_;
  uint32_t &next_;
};

uint32_t above_all(const Array<uint32_t> &names) {
  return names.empty() ? 0 : *std::max_element(names.begin(), names.end()) + 1;
}

// old [ntri]: the previous number of each triangle, or kNone.
void name_patches(const Surface &before, const std::vector<uint32_t> &old, Surface &surface, uint32_t &next) {
  std::vector<uint32_t> name(above_all(surface.patch), kNone);
  std::vector<uint8_t> taken(above_all(before.patch));
  for (uint32_t t = 0; t < surface.ntri; ++t) {
    if (old[t] == kNone || name[surface.patch[t]] != kNone || taken[before.patch[old[t]]]) continue;
    name[surface.patch[t]] = before.patch[old[t]];
    taken[before.patch[old[t]]] = 1;
  }
  for (uint32_t &n : name)
    if (n == kNone) n = next++;
  for (uint32_t &p : surface.patch) p = name[p];
}

}  // namespace

void name_features(const Body &b, const CutMesh &mesh, Surface &surface, CutRecord &record) {
  const Surface &before = b.surface;
  if (b.cut.whole) {
    std::copy(b.cut.next_name, b.cut.next_name + kFeatureKinds, record.next_name);
  } else {
    const uint32_t next[kFeatureKinds] = {before.nsurfel, before.nedge, before.ntri, above_all(before.patch)};
    std::copy(next, next + kFeatureKinds, record.next_name);
  }
  std::vector<uint32_t> surfel_of(b.p.n, kNone);
  for (uint32_t s = 0; s < before.nsurfel; ++s) surfel_of[before.point[s]] = s;
  std::vector<uint32_t> was(surface.nsurfel);  // surfel before
  for (uint32_t s = 0; s < surface.nsurfel; ++s) was[s] = surfel_of[mesh.point[surface.point[s]]];

  Names surfels(before.name[0], before.nsurfel, record.next_name[0]);
  for (uint32_t s = 0; s < surface.nsurfel; ++s) surface.name[0].push_back(surfels.of(was[s]));
  Names edges(before.name[1], before.nedge, record.next_name[1]);
  const Array<uint32_t> &edge = surface.edge;
  for (size_t e = 0; e < edge.size(); e += 2)
    surface.name[1].push_back(edges.of(edge_number(before.edge, was[edge[e]], was[edge[e + 1]])));
  const TriangleList list(before.ntri, [&](size_t k) { return before.tri[k]; });
  std::vector<uint32_t> old(surface.ntri);
  Names triangles(before.name[2], before.ntri, record.next_name[2]);
  for (uint32_t t = 0; t < surface.ntri; ++t) {
    const uint32_t *const c = &surface.tri[3 * size_t{t}];
    old[t] = list.find(sorted(was[c[0]], was[c[1]], was[c[2]]));
    surface.name[2].push_back(triangles.of(old[t]));
  }
  name_patches(before, old, surface, record.next_name[3]);
}

void find_coincident(const Memory &m, const WholeBody &whole, const CutRecord &record, Surface &surface) {
  use_memory(m, surface.coincident, surface.coincident_surfel, surface.coincident_tip, surface.place,
             surface.origin, surface.coincident_begin, surface.coincident_around, surface.coincident_normal);
  if (record.open.empty()) return;
  std::vector<Corners> open;
  for (const uint64_t face : record.open) {
    const uint32_t *const a = &whole.tets[4 * size_t(face >> 32)], *const b = &whole.tets[4 * (face & kNone)];
    std::vector<uint32_t> common;
    for (int k = 0; k < 4; ++k)
      if (std::find(b, b + 4, a[k]) != b + 4) common.push_back(a[k]);
    if (common.size() == 3) open.push_back(sorted(common[0], common[1], common[2]));
  }
  std::sort(open.begin(), open.end());
  std::vector<std::pair<Corners, uint32_t>> found;  // and the place in `coincident`
  for (uint32_t t = 0; t < surface.ntri; ++t) {
    const auto point = [&](size_t k) { return record.point[surface.point[surface.tri[3 * size_t{t} + k]]]; };
    const Corners corners = sorted(point(0), point(1), point(2));
    if (!std::binary_search(open.begin(), open.end(), corners)) continue;
    found.push_back({corners, static_cast<uint32_t>(surface.coincident.size())});
    surface.coincident.push_back(t);
    for (size_t k = 0; k < 3; ++k) surface.coincident_surfel.push_back(surface.tri[3 * size_t{t} + k]);
  }
  sort_unique(surface.coincident_surfel);
  std::sort(found.begin(), found.end());
  surface.coincident_tip.assign(surface.coincident.size(), 0);
  for (size_t i = 1; i < found.size(); ++i) {
    if (found[i].first != found[i - 1].first) continue;
    surface.slit = true;
    const uint32_t l = found[i].second, other = found[i - 1].second;
    for (const uint32_t side : {l, other}) surface.coincident_tip[side] |= kOfSlit;
    const uint32_t *const c = &surface.tri[3 * size_t{surface.coincident[l]}],
                          *const d = &surface.tri[3 * size_t{surface.coincident[other]}];
    for (uint32_t k = 0; k < 3; ++k)
      for (uint32_t j = 0; j < 3; ++j) {
        if (c[k] != d[j]) continue;
        surface.coincident_tip[l] = static_cast<uint8_t>(surface.coincident_tip[l] | 1u << k);
        surface.coincident_tip[other] = static_cast<uint8_t>(surface.coincident_tip[other] | 1u << j);
      }
  }
  if (surface.coincident.empty()) return;
  surface.coincident_normal.assign(3 * surface.coincident.size(), 0.0);
  std::vector<std::pair<uint32_t, uint32_t>> around;  // surfel, triangle of `coincident`
  for (uint32_t l = 0; l < surface.coincident.size(); ++l)
    for (uint32_t k = 0; k < 3; ++k)
      if (!(surface.coincident_tip[l] >> k & 1))
        around.push_back({surface.tri[3 * size_t{surface.coincident[l]} + k], l});
  std::sort(around.begin(), around.end());
  for (const uint32_t surfel : surface.coincident_surfel) {
    const auto at = std::lower_bound(around.begin(), around.end(), std::pair(surfel, 0u));
    surface.coincident_begin.push_back(static_cast<uint32_t>(at - around.begin()));
  }
  surface.coincident_begin.push_back(static_cast<uint32_t>(around.size()));
  for (const auto &a : around) surface.coincident_around.push_back(a.second);
  surface.place.assign(size_t{4} * surface.nsurfel, 0.0);
  for (const uint32_t p : surface.point) surface.origin.push_back(record.point[p]);
}

void take_names(const std::string &body, FeatureNames &names, Surface &surface, CutRecord &record) {
  const uint32_t counts[kFeatureKinds] = {surface.nsurfel, surface.nedge, surface.ntri, surface.ntri};
  for (uint32_t k = 0; k < kFeatureKinds; ++k) {
    const Array<uint32_t> &of = names.of[k];
    if (of.size() != counts[k] || above_all(of) > names.next[k])
      fail(DFM_E_FORMAT,
           "the snapshot is damaged: body '%s': names of its surface: expected one for each feature; "
           "nothing was restored",
           body.c_str());
    record.next_name[k] = names.next[k];
    (k < 3 ? surface.name[k] : surface.patch).swap(names.of[k]);
  }
  surface.named.swap(names.named);
}

void make_cut_zones(const Memory &m, const WholeBody &whole, const CutRecord &record,
                    const Composition &composition, const Array<uint32_t> &tets, const Surface &surface,
                    SurfaceZones &out) {
  const TriangleList skin(static_cast<uint32_t>(whole.tri.size() / 3),
                          [&](size_t k) { return whole.tri[k]; });
  const auto point = [&](size_t k) { return surface.point[surface.tri[k]]; };
  out.list = whole.zones.list;
  use_memory(m, out.of);
  out.of.assign(surface.ntri, 0);
  bool one = true;
  const auto of_material = [&](const Material &made_of) {
    const auto same = [&](const SurfaceZones::Zone &z) {
      return z.group == kCutGroup && z.material == made_of.name;
    };
    const auto at = std::find_if(out.list.begin(), out.list.end(), same);
    const uint32_t zone = uint32_t(at - out.list.begin());
    if (at == out.list.end()) out.list.push_back({kCutGroup, made_of.name, friction_of(made_of)});
    return zone;
  };
  // whose: the material of the cell that has it
  const auto find_zone = [&](uint32_t t, const Corners &face, const Material &whose) {
    const uint32_t was =
        skin.find(sorted(record.point[face[0]], record.point[face[1]], record.point[face[2]]));
    if (was == kNone) out.of[t] = of_material(whose);
    else out.of[t] = whole.zones.of.empty() ? 0 : whole.zones.of[was];
    one = one && out.of[t] == 0;
  };
  if (composition.of.empty()) {  // of one material: the cells need not be looked at
    for (uint32_t t = 0; t < surface.ntri; ++t) {
      const size_t k = 3 * size_t{t};
      find_zone(t, sorted(point(k), point(k + 1), point(k + 2)), composition.materials[0]);
    }
  } else {
    const TriangleList own(surface.ntri, point);
    for (size_t c = 0; c < tets.size(); c += 4)
      for (const auto &f : kTetFace) {
        const Corners face = sorted(tets[c + f[0]], tets[c + f[1]], tets[c + f[2]]);
        if (const uint32_t t = own.find(face); t != kNone)
          find_zone(t, face, composition.materials[composition.of[c / 4]]);
      }
  }
  if (one && out.list.size() == 1) out.of.clear();
}

}  // namespace dfm
