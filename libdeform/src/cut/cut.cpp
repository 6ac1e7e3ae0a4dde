// A cut finds which cells are removed and which faces open, makes the shape that is left beside the present
// one (cut/body_shape.h), and exchanges the two. Remaining features keep their names, by which the next
// step finds their contacts again. Contacts whose feature is gone end here.
#include "cut/cut.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/lists.h"
#include "cut/blade_sweep.h"
#include "cut/body_shape.h"
#include "cut/carry_state.h"
#include "cut/cut_lasting.h"
#include "mesh/cut_mesh.h"
#include "plugin/on_behalf.h"
#include "state/material.h"
#include "state/world.h"
#include "step/stages.h"
#include "step/step_impulses.h"
#include "world/change_energy.h"
#include "world/create.h"
#include "world/may_cut.h"
#include "world/measure.h"

namespace dfm {
namespace {

constexpr double kRounding = 1e-12;  // of the mass of a point that copies share

// Open faces, ascending: of the whole body, and those between present cells.
struct OpenFaces { Array<uint64_t> whole, own; };

// Area at rest, m2, of the triangles that the surface did not have before.
double new_area(const Body &b, const BodyShape &before) {
  uint32_t next = before.cut.whole ? before.cut.next_name[2] : before.surface.ntri;
  double sum = 0;
  for (uint32_t t = 0; t < b.surface.ntri; ++t) {
    if (b.surface.name[2][t] < next) continue;
    sum += 0.5 * norm(b.surface.area2(t, [&](uint32_t s) { return b.p.rest_at(b.surface.point[s]); }));
  }
  return sum;
}

// lost: the masses before.
void sum_up_removed(const BodyShape &before, const CutMesh &mesh, const Body &b, std::vector<double> &lost,
                    CutReport &out) {
  for (uint32_t i = 0; i < b.p.n; ++i) lost[mesh.point[i]] -= b.p.mass[i];
  for (uint32_t i = 0; i < before.p.n; ++i) {
    const double mass = std::fabs(lost[i]) > kRounding * before.p.mass[i] ? lost[i] : 0;
    out.mass += mass;
    add3(out.momentum, mass * before.p.v_at(i));
  }
}

// ---- cuts -------------------------------------------------------------------------------------------------

CutReport empty(Body &b) {
  World &w = *b.world;
  CutReport out;
  out.cells = b.ncell();
  out.mass = b.mass;
  for (uint32_t i = 0; i < b.p.n; ++i) add3(out.momentum, b.p.mass[i] * b.p.v_at(i));
  out.kinetic = kinetic_of(b);
  out.elastic = elastic_energy(b);
  reserve_places(w, 0);
  end_contacts(w, b.id, false);
  set_place(w, b, true, false);
  return out;
}

// Exchanges the body with what a cut has left of it.
std::unique_ptr<BodyShape> put(Body &b, MadeShape &made, bool ahead) {
  World &w = *b.world;
  wake(w, b);  // while its attachments have all that they bore
  end_idle(w);
  std::unique_ptr<BodyShape> before = take_shape(b, made, false, ahead);
  try {
    Lasting lasting(w, *before, {{b.id, &b, made.features}});
    reserve_ends(w, 0);
    w.changed = true;
    prepare_with(w, lasting);
  } catch (...) {
    exchange(b, *before);
    throw;
  }
  return before;
}

// open: faces of the whole body that are open, ascending; those of the present body by its own numbers.
CutReport cut(Body &b, const Array<uint8_t> &removed, OpenFaces &&open) {
  const Memory &m = b.world->memory();
  CutReport out;
  CutMesh mesh = make_cut_mesh(m, b.p.n, b.ncell(), b.tets.data(), removed, open.own, b.inner);
  if (mesh.cell.empty()) return empty(b);
  out.cells = b.ncell() - static_cast<uint32_t>(mesh.cell.size());
  // all memory is taken before the cut is made, because a cut that is made must be reported
  out.parts = count_parts(m, uint32_t(mesh.point.size()), uint32_t(mesh.cell.size()), mesh.tets.data());
  std::vector<uint8_t> seen(b.p.n);
  for (const uint32_t p : mesh.point) out.points += std::exchange(seen[p], uint8_t{1});
  std::vector<double> mass(b.p.mass.begin(), b.p.mass.end());
  const double elastic = elastic_energy(b), kinetic = kinetic_of(b);
  const HostWork work(b);
  const std::unique_ptr<MadeShape> made = make_shape(b, std::move(mesh), std::move(open.whole), nullptr);
  const std::unique_ptr<BodyShape> before = put(b, *made, false);
  sum_up_removed(*before, made->mesh, b, mass, out);
  out.area = new_area(b, *before);
  out.kinetic = kinetic - kinetic_of(b);
  out.elastic = elastic - elastic_energy(b);
  return out;
}

// Faces that are open already and `more` (of the whole body).
OpenFaces with_open(const Body &b, const Array<uint64_t> &more) {
  const HookAllocator<uint64_t> a(b.world->memory());
  OpenFaces out{Array<uint64_t>(b.cut.open, a), Array<uint64_t>(a)};
  out.whole.insert(out.whole.end(), more.begin(), more.end());
  sort_unique(out.whole);
  for (const uint64_t face : out.whole) {
    const auto [i, j] = present_cells(b, face);
    if (i != kNone && j != kNone) out.own.push_back(open_face(i, j));
  }
  sort_unique(out.own);
  return out;
}

// Opens `more` faces (present cells).
CutReport cut(Body &b, const Array<uint8_t> &removed, const Array<uint64_t> &more) {
  const OnBehalf prefix(b.name);
  prepare(*b.world);
  check_may_cut(b, b.model);
  Array<uint64_t> whole(b.world->memory());
  for (const uint64_t face : more) whole.push_back(face_of_whole(b, face));
  OpenFaces open = with_open(b, whole);
  const bool opens = open.whole.size() > b.cut.open.size();
  if (!opens && std::find(removed.begin(), removed.end(), 1) == removed.end()) {
    CutReport none;
    none.parts = count_parts(b.world->memory(), b.p.n, b.ncell(), b.tets.data());
    return none;
  }
  return cut(b, removed, std::move(open));
}

Array<uint8_t> none_removed(const Body &b) { return Array<uint8_t>(b.ncell(), 0, b.world->memory()); }

// Turns a plane into a blade in it, so large that the whole body lies within the first of the blade's two
// triangles: no line of the body meets the edge between them.
CutShape through(const Body &b, const CutShape &shape) {
  if (shape.kind != CutKind::plane) return shape;
  const Extent box = extent_of(b.p.x.data(), b.p.n, kStride);
  const Vec3 normal = normalized(shape.corner[1]), middle = 0.5 * (box.lo + box.hi);
  const Vec3 other = std::fabs(normal.x) < 0.5 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 u = normalized(cross(normal, other)), v = cross(normal, u);
  const double reach = norm(box.hi - box.lo);
  CutShape out;
  out.kind = CutKind::blade;
  Vec3 *const c = out.corner;
  c[1] = middle - dot(middle - shape.corner[0], normal) * normal - reach * (u + v);
  c[0] = c[1] + 8 * reach * u;
  c[2] = c[1] + 8 * reach * v;
  c[3] = c[0] + (c[2] - c[1]);
  return out;
}

}  // namespace

void reserve_cut_events(World &w, size_t n) { reserve_events(w, w.store.n + w.attachments.size() + n); }

std::array<uint32_t, 2> present_cells(const Body &b, uint64_t face) {
  const auto present = [&](uint32_t whole) {
    if (!b.cut.whole) return whole < b.ncell() ? whole : kNone;
    const auto at = std::lower_bound(b.cut.cell.begin(), b.cut.cell.end(), whole);
    return at != b.cut.cell.end() && *at == whole ? uint32_t(at - b.cut.cell.begin()) : kNone;
  };
  return {present(uint32_t(face >> 32)), present(uint32_t(face & kNone))};
}

uint64_t face_of_whole(const Body &b, uint64_t face) {
  if (!b.cut.whole) return face;
  return open_face(b.cut.cell[face >> 32], b.cut.cell[face & kNone]);
}

CutReport open_faces(Body &b, const Array<uint64_t> &faces) { return cut(b, none_removed(b), faces); }

std::unique_ptr<MadeShape> make_opened(const Body &b, const Array<uint64_t> &faces, double open_time) {
  const Memory &m = b.world->memory();
  OpenFaces open = with_open(b, faces);
  CutMesh mesh = make_cut_mesh(m, b.p.n, b.ncell(), b.tets.data(), none_removed(b), open.own, b.inner);
  return make_shape(b, std::move(mesh), std::move(open.whole), &open_time);
}

std::unique_ptr<BodyShape> put_opened(Body &b, MadeShape &made) {
  const OnBehalf prefix(b.name);
  prepare(*b.world);
  check_may_cut(b, b.model);
  const HostWork work(b);
  return put(b, made, true);
}

CutReport remove_cells(Body &b, const Array<uint8_t> &removed) {
  return cut(b, removed, Array<uint64_t>(b.world->memory()));
}

CutReport remove_by_shape(Body &b, const CutShape &requested, uint32_t most) {
  const CutShape shape = through(b, requested);
  Array<uint8_t> removed = none_removed(b);
  uint32_t n = 0, left = 0;
  for (uint32_t c = 0; c < b.ncell(); ++c) {
    const Vec3 x[4] = {b.corner(c, 0), b.corner(c, 1), b.corner(c, 2), b.corner(c, 3)};
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

CutReport split_by_blade(Body &b, const CutShape &requested, uint32_t most) {
  const CutShape blade = through(b, requested);
  BladeSweep sweep(b, blade, nullptr);
  const std::vector<SweptFace> &met = sweep.faces;
  const size_t n = most > 0 ? std::min<size_t>(most, met.size()) : met.size();
  Array<uint64_t> more{b.world->memory()};
  Vec3 way;
  for (size_t k = 0; k < n; ++k) {
    more.push_back(met[k].face);
    way += (1 / double(n)) * met[k].way;
  }
  CutReport out = open_faces(b, more);
  const double work = sweep.energy(n);
  out.left = static_cast<uint32_t>(met.size() - n);
  out.opened = static_cast<uint32_t>(n);
  out.fracture = work;
  if (requested.kind == CutKind::plane) return out;  // a plane has no way: no force, and nothing to continue
  if (norm2(way) > 0) store3(out.force, (-work / norm2(way)) * way);
  // without memory for it, the next blade here starts anew
  found_memory([&] { sweep.keep(b); });
  return out;
}

void reserve_places(World &w, size_t more) {
  const size_t n = w.bodies.size() + w.emptied.size() + w.rolled_back.size() + more;
  for (auto *list : {&w.bodies, &w.emptied, &w.rolled_back}) list->reserve(n);
}

void set_place(World &w, Body &b, bool emptied, bool rolled_back) noexcept {
  if (b.emptied == emptied && b.rolled_back == rolled_back) return;
  const auto list = [&](bool no_cells, bool gone) -> auto & {
    return gone ? w.rolled_back : no_cells ? w.emptied : w.bodies;
  };
  const auto counts = [&] { return uint32_t(b.sensor && !b.emptied && !b.rolled_back); };
  auto &from = list(b.emptied, b.rolled_back), &to = list(emptied, rolled_back);
  w.sensors -= counts();
  w.tearing -= b.tears && !b.rolled_back;
  b.emptied = emptied;
  b.rolled_back = rolled_back;
  w.sensors += counts();
  w.tearing += b.tears && !b.rolled_back;
  w.bound.body = nullptr;
  w.changed = true;
  if (&from == &to) return;
  const auto at = std::find_if(from.begin(), from.end(), [&](auto &p) { return p.get() == &b; });
  const auto place = std::find_if(to.begin(), to.end(), [&](auto &p) { return p->id > b.id; });
  to.insert(place, std::move(*at));
  from.erase(at);
}

}  // namespace dfm
