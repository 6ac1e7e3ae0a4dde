// A cut finds which cells go and which faces open, makes the body that is left beside the one that is there
// (world/body_shape.h), and exchanges the two. Contacts are found again by the names of their features, which
// those that are left keep; nothing is done to them here but to end those whose feature has gone.
#include "world/cut.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "mesh/cut_mesh.h"
#include "mesh/mesh.h"
#include "plugin/on_behalf.h"
#include "state/world.h"
#include "step/method.h"
#include "step/stages.h"
#include "world/body_shape.h"
#include "world/carry_state.h"
#include "world/change_energy.h"
#include "world/create.h"
#include "world/measure.h"

namespace dfm {
namespace {

constexpr double kRounding = 1e-12;  // of the mass of a point that copies share

uint32_t cells_of(const Body &b) { return static_cast<uint32_t>(b.tets.size() / 4); }

void corners_of(const Body &b, uint32_t cell, Vec3 x[4]) {
  for (size_t k = 0; k < 4; ++k) x[k] = load3(&b.p.x[size_t{kStride} * b.tets[size_t{4} * cell + k]]);
}

double kinetic_of(const Body &b) {
  double sum = 0;
  for (uint32_t i = 0; i < b.p.n; ++i) sum += 0.5 * b.p.mass[i] * norm2(load3(&b.p.v[size_t{kStride} * i]));
  return sum;
}

// m2 at rest of triangles that are no part of the surface before.
double new_area(const Body &b, const BodyShape &before) {
  uint32_t next = before.cut.whole ? before.cut.next_name[2] : before.surface.ntri;
  double sum = 0;
  for (uint32_t t = 0; t < b.surface.ntri; ++t) {
    if (b.surface.name[2][t] < next) continue;
    const auto x = [&](size_t k) {
      return load3(&b.p.rest[size_t{3} * b.surface.point[b.surface.tri[size_t{3} * t + k]]]);
    };
    sum += 0.5 * norm(cross(x(1) - x(0), x(2) - x(0)));
  }
  return sum;
}

void tell_what_went(const BodyShape &before, const CutMesh &mesh, const Body &b, CutReport &out) {
  std::vector<double> lost(before.p.mass.begin(), before.p.mass.end());
  for (uint32_t i = 0; i < b.p.n; ++i) lost[mesh.point[i]] -= b.p.mass[i];
  for (uint32_t i = 0; i < before.p.n; ++i) {
    const double mass = std::fabs(lost[i]) > kRounding * before.p.mass[i] ? lost[i] : 0;
    out.mass += mass;
    out.momentum += mass * load3(&before.p.v[size_t{kStride} * i]);
  }
}

// ---- what names the surface's features, and lasts ---------------------------------------------------------

// Numbers now by numbers before, the first of copies; kNone: gone.
struct FeatureMap {
  std::vector<uint32_t> of[3];  // surfels, edges, triangles
  FeatureMap(const Surface &before, const Surface &now) {
    const uint32_t counts[3] = {before.nsurfel, before.nedge, before.ntri};
    for (size_t kind = 0; kind < 3; ++kind) {
      std::vector<std::pair<uint32_t, uint32_t>> by_name;
      for (uint32_t i = 0; i < now.name[kind].size(); ++i) by_name.push_back({now.name[kind][i], i});
      std::sort(by_name.begin(), by_name.end());
      for (uint32_t i = 0; i < counts[kind]; ++i) {
        const uint32_t name = before.name[kind].empty() ? i : before.name[kind][i];
        const auto at = std::lower_bound(by_name.begin(), by_name.end(), std::pair(name, 0u));
        of[kind].push_back(at != by_name.end() && at->first == name ? at->second : kNone);
      }
    }
  }
};

// Of one attachment: the places that are still there. The stiffness of the whole is that of its places.
Attachment carried(const Attachment &a, uint64_t id, const FeatureMap &map) {
  Attachment out = a;
  out.surfels.clear();
  out.place.clear();
  out.node.clear();
  out.weight.clear();
  out.impulse.clear();
  const std::vector<uint32_t> &surfel = map.of[0];
  for (size_t i = 0; i < a.surfels.size(); ++i) {
    const uint32_t own = a.body == id ? surfel[a.surfels[i]] : a.surfels[i];
    bool there = own != kNone;
    for (size_t k = kAnchors * i; !a.obstacle && a.to == id && k < kAnchors * (i + 1); ++k)
      there = there && (a.weight[k] == 0 || surfel[a.node[k]] != kNone);
    if (!there) continue;
    out.surfels.push_back(own);
    for (size_t k = 0; k < 3; ++k) {
      if (a.obstacle) out.place.push_back(a.place[3 * i + k]);
      out.impulse.push_back(a.impulse[3 * i + k]);
    }
    for (size_t k = kAnchors * i; !a.obstacle && k < kAnchors * (i + 1); ++k) {
      const uint32_t node = a.to == id ? surfel[a.node[k]] : a.node[k];
      out.node.push_back(node == kNone ? 0 : node);
      out.weight.push_back(a.weight[k]);
    }
  }
  const double share = double(out.surfels.size()) / double(a.surfels.size());
  out.stiffness *= share;
  out.damping *= share;
  return out;
}

// What the world keeps by numbers of the surface's features, with the numbers that they have now.
struct Lasting {
  std::vector<Attachment> attachments;
  Array<Crossing> crossings;
  Array<ContactPoint> contacts;  // of the report
  std::vector<uint8_t> ended;    // [contacts of the store] its feature has gone

  Lasting(const World &w, const Body &b, const FeatureMap &map)
      : crossings(w.store.crossings.get_allocator()), contacts(w.report.contacts.get_allocator()) {
    for (const Attachment &a : w.attachments)
      attachments.push_back(a.body == b.id || (!a.obstacle && a.to == b.id) ? carried(a, b.id, map) : a);
    for (Crossing c : w.store.crossings) {
      if (c.id_a == b.id) c.edge_a = map.of[1][c.edge_a];
      if (c.id_b == b.id) c.edge_b = map.of[1][c.edge_b];
      if (c.edge_a != kNone && c.edge_b != kNone) crossings.push_back(c);
    }
    std::sort(crossings.begin(), crossings.end());
    contacts = w.report.contacts;
    ended.assign(w.store.n, 0);
    for (uint32_t i = 0; i < w.report.n; ++i) ended[i] = !renumber(contacts[i], b.slot, map);
  }

 private:
  static bool renumber(ContactPoint &c, uint32_t slot, const FeatureMap &map) {
    const uint32_t kind_b = c.kind == kEdgeEdge ? 1 : 2;
    bool there = true;
    if (c.slot_a == slot) there = (c.feature_a = map.of[c.type_a][c.feature_a]) != kNone;
    if (!c.obstacle && c.slot_b == slot)
      there = (c.feature_b = map.of[kind_b][c.feature_b]) != kNone && there;
    if (!there) c.feature_a = c.feature_b = 0;  // of a contact that has ended
    return there;
  }
};

void exchange(World &w, Lasting &other) noexcept {
  w.attachments.swap(other.attachments);
  w.store.crossings.swap(other.crossings);
  w.report.contacts.swap(other.contacts);
}

// Contacts whose feature has gone, and attachments that hold nothing any more. Reserved before.
void end_what_went(World &w, const Lasting &lasting) {
  for (uint32_t i = 0; i < w.report.n; ++i) {
    if (!lasting.ended[i]) continue;
    if (w.store.touching[i])
      add_event(w, DFM_EVENT_END, w.store.id_a[i], w.store.id_b[i], w.store.key[i], w.time);
    w.store.touching[i] = 0;
    std::fill_n(w.report.impulse.begin() + std::ptrdiff_t{3} * i, 3, 0.0);
  }
  for (Attachment &a : w.attachments) {
    if (!a.surfels.empty() || a.released) continue;
    a.released = true;
    add_event(w, DFM_EVENT_RELEASE, a.body, a.to, a.number, w.time);
  }
  std::erase_if(w.attachments, [](const Attachment &a) { return a.surfels.empty(); });
}

// ---- cuts -------------------------------------------------------------------------------------------------

CutReport empty(Body &b) {
  World &w = *b.world;
  CutReport out;
  out.removed = cells_of(b);
  out.mass = b.mass;
  for (uint32_t i = 0; i < b.p.n; ++i) out.momentum += b.p.mass[i] * load3(&b.p.v[size_t{kStride} * i]);
  out.kinetic = kinetic_of(b);
  out.elastic = elastic_energy(b);
  reserve_places(w);
  leave_contacts(w, b.id, false);
  set_emptied(w, b, true);
  return out;
}

// open: faces of the whole body that are open, ascending; those of the present body by its own numbers.
CutReport cut(Body &b, const Array<uint8_t> &removed, Array<uint64_t> &&open,
              const Array<uint64_t> &own_open) {
  World &w = *b.world;
  const Memory &m = w.memory();
  CutReport out;
  CutMesh mesh = make_cut_mesh(m, b.p.n, cells_of(b), b.tets.data(), removed, own_open);
  if (mesh.cell.empty()) return empty(b);
  out.removed = cells_of(b) - static_cast<uint32_t>(mesh.cell.size());
  const double elastic = elastic_energy(b), kinetic = kinetic_of(b);
  const HostWork work(b);
  CutMesh numbers(m);
  numbers.point = Array<uint32_t>(mesh.point);
  const std::unique_ptr<BodyShape> before = cut_body(b, std::move(mesh), std::move(open));
  try {
    Lasting lasting(w, b, FeatureMap(before->surface, b.surface));
    reserve_events(w, w.store.n + w.attachments.size());
    for (const Attachment &a : lasting.attachments)
      if (a.surfels.empty()) w.overlaps.place(a.body);  // what it held may touch now
    exchange(w, lasting);
    w.changed = true;
    try {
      prepare(w);
    } catch (...) {
      exchange(w, lasting);
      throw;
    }
    end_what_went(w, lasting);
  } catch (...) {
    exchange(b, *before);
    throw;
  }
  wake(w, b);
  w.changed = true;  // without the attachments that have ended
  tell_what_went(*before, numbers, b, out);
  out.area = new_area(b, *before);
  out.kinetic = kinetic - kinetic_of(b);
  out.elastic = elastic - elastic_energy(b);
  out.parts = count_parts(m, b.p.n, cells_of(b), b.tets.data());
  std::vector<uint8_t> seen(before->p.n);
  for (const uint32_t p : numbers.point) out.copies += std::exchange(seen[p], uint8_t{1});
  return out;
}

// Faces that are open already and `more` (present cells), as those of the whole body and of the present one.
CutReport cut(Body &b, const Array<uint8_t> &removed, const Array<uint64_t> &more) {
  const HookAllocator<uint64_t> a(b.world->memory());
  const OnBehalf speaks(b.name);
  prepare(*b.world);
  check_may_cut(b, b.model);
  Array<uint64_t> open(b.cut.open, a), own(more, a);
  const auto whole = [&](uint64_t cell) { return b.cut.whole ? b.cut.cell[cell] : uint32_t(cell); };
  for (const uint64_t face : more) open.push_back(open_face(whole(face >> 32), whole(face & kNone)));
  const auto in_order = [](Array<uint64_t> &list) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  };
  in_order(open);
  const bool opens = open.size() > b.cut.open.size();
  if (!opens && std::find(removed.begin(), removed.end(), 1) == removed.end()) {
    CutReport none;
    none.parts = count_parts(b.world->memory(), b.p.n, cells_of(b), b.tets.data());
    return none;
  }
  // cells keep their order, so numbers in the whole body are found by bisection
  for (const uint64_t face : b.cut.open) {
    const auto own_number = [&](uint64_t cell) {
      const auto at = std::lower_bound(b.cut.cell.begin(), b.cut.cell.end(), uint32_t(cell));
      return at != b.cut.cell.end() && *at == cell ? uint32_t(at - b.cut.cell.begin()) : kNone;
    };
    const uint32_t i = own_number(face >> 32), j = own_number(face & kNone);
    if (i != kNone && j != kNone) own.push_back(open_face(i, j));
  }
  in_order(own);
  return cut(b, removed, std::move(open), own);
}

}  // namespace

void check_may_cut(const Body &b, const ModelInstance &model) {
  const char *const name = b.name.c_str();
  if (!b.surface.identity())
    fail(DFM_E_UNSUPPORTED,
         "body '%s' can be neither cut nor torn: it wears a surface of its own; make it with the "
         "surface of its cells",
         name);
  if (b.world->method->point_values)
    fail(DFM_E_UNSUPPORTED,
         "body '%s' can be neither cut nor torn: the contact method %s keeps values of its points; take "
         "another",
         name, b.world->method->name);
  if (!topology_of(model))
    fail(DFM_E_UNSUPPORTED,
         "body '%s' can be neither cut nor torn: model '%s' needs all of its cells; take msm or "
         "corotational_fem",
         name, model.type->id);
}

CutReport open_faces(Body &b, const Array<uint64_t> &faces) {
  return cut(b, Array<uint8_t>(cells_of(b), 0, HookAllocator<uint8_t>(b.world->memory())), faces);
}

CutReport remove_cells(Body &b, const Array<uint8_t> &removed) {
  return cut(b, removed, Array<uint64_t>(HookAllocator<uint64_t>(b.world->memory())));
}

CutReport remove_by_shape(Body &b, const CutShape &shape, uint32_t most) {
  Array<uint8_t> removed(cells_of(b), 0, HookAllocator<uint8_t>(b.world->memory()));
  uint32_t n = 0, left = 0;
  for (uint32_t c = 0; c < cells_of(b); ++c) {
    Vec3 x[4];
    corners_of(b, c, x);
    if (!meets_tetrahedron(shape, x)) continue;
    if (most > 0 && n == most) {
      ++left;
      continue;
    }
    removed[c] = 1;
    ++n;
  }
  CutReport out = remove_cells(b, removed);
  out.left = left;
  return out;
}

CutReport split_by_blade(Body &b, const CutShape &blade, uint32_t most) {
  const Memory &m = b.world->memory();
  std::vector<Vec3> middle;
  for (uint32_t c = 0; c < cells_of(b); ++c) {
    Vec3 x[4];
    corners_of(b, c, x);
    middle.push_back(0.25 * ((x[0] + x[1]) + (x[2] + x[3])));
  }
  const Vec3 way = (blade.corner[3] - blade.corner[0]) + (blade.corner[2] - blade.corner[1]);
  const auto is_open = [&](uint32_t i, uint32_t j) {
    return !b.cut.open.empty() &&
           std::binary_search(b.cut.open.begin(), b.cut.open.end(), open_face(b.cut.cell[i], b.cut.cell[j]));
  };
  std::vector<std::pair<double, uint64_t>> met;
  each_inner_face(m, cells_of(b), b.tets.data(), [&](uint32_t i, uint32_t j) {
    if (crosses_blade(blade, middle[i], middle[j]) && !is_open(i, j))
      met.push_back({dot(way, middle[i] + middle[j]), open_face(i, j)});
  });
  std::sort(met.begin(), met.end());
  const size_t n = most > 0 ? std::min<size_t>(most, met.size()) : met.size();
  Array<uint64_t> more{HookAllocator<uint64_t>(m)};
  for (size_t k = 0; k < n; ++k) more.push_back(met[k].second);
  CutReport out = open_faces(b, more);
  out.left = static_cast<uint32_t>(met.size() - n);
  return out;
}

void reserve_places(World &w) {
  w.bodies.reserve(w.bodies.size() + w.emptied.size() + 1);
  w.emptied.reserve(w.bodies.size() + w.emptied.size() + 1);
}

void set_emptied(World &w, Body &b, bool emptied) noexcept {
  if (b.emptied == emptied) return;
  auto &from = emptied ? w.bodies : w.emptied, &to = emptied ? w.emptied : w.bodies;
  const auto at = std::find_if(from.begin(), from.end(), [&](auto &p) { return p.get() == &b; });
  const auto place = std::find_if(to.begin(), to.end(), [&](auto &p) { return p->id > b.id; });
  to.insert(place, std::move(*at));
  from.erase(at);
  b.emptied = emptied;
  w.sensors += b.sensor ? (emptied ? -1u : 1u) : 0;
  w.bound.body = nullptr;
  w.changed = true;
}

}  // namespace dfm
