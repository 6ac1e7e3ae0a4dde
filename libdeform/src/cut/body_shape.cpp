#include "cut/body_shape.h"

#include <algorithm>

#include "body/make_surface.h"
#include "core/error.h"
#include "cut/carry_state.h"
#include "geometry/box_tree.h"
#include "geometry/bulge.h"
#include "mesh/mesh.h"
#include "state/material.h"
#include "state/search_tree.h"
#include "state/world.h"
#include "step/self_contact.h"

namespace dfm {
namespace {

// Copies rows of `width` values by their previous number.
template <class List, class From>
void take_rows(const From &from, const Array<uint32_t> &number, size_t width, List &to) {
  to.resize(width * number.size());
  const auto take = [&](auto n) {
    for (size_t i = 0; i < number.size(); ++i)
      for (size_t k = 0; k < n; ++k) to[n * i + k] = from[n * number[i] + k];
  };
  if (width == kStride) take(std::integral_constant<size_t, kStride>());  // known: no loop within a row
  else take(width);
}

// The cells of a mesh that is cut from a body with this rest shape, share and composition, and their surface.
// inner: with the list of inner faces, which takes the same sorted faces.
void take_cells(const Memory &m, const Array<double> &rest, const Array<double> &share,
                const Composition &composition, const CutMesh &mesh, bool inner, double smooth,
                BodyShape &out) {
  use_memory(m, out.anchor, out.surfel_impulse, out.share, out.surface.named);
  out.p.size(m, static_cast<uint32_t>(mesh.point.size()));
  take_rows(rest, mesh.point, 3, out.p.rest);
  if (!share.empty()) take_rows(share, mesh.cell, 1, out.share);
  out.composition.materials = composition.materials;
  if (!composition.of.empty()) take_rows(composition.of, mesh.cell, 1, out.composition.of);
  for (const CellField &f : composition.given) {
    out.composition.given.push_back({f.key, f.from, f.width, Array<double>(m)});
    take_rows(f.values, mesh.cell, f.width, out.composition.given.back().values);
  }
  const uint32_t ntet = static_cast<uint32_t>(mesh.cell.size());
  out.tets = Array<uint32_t>(mesh.tets);
  out.edges = unique_edges(m, ntet, out.tets.data());
  const Array<TetFace> faces = sorted_faces(m, ntet, out.tets.data());
  if (inner) out.inner = inner_faces(faces);
  const Array<uint32_t> boundary = boundary_triangles(faces, out.tets.data());
  make_surface(m, out.p.n, out.p.rest.data(), boundary.data(), static_cast<uint32_t>(boundary.size() / 3),
               out.surface);
  out.smooth = smooth;
  if (smooth > 0) make_bulges(out.surface, smooth);
}

void put_at_rest(Phyxels &p) {
  for (uint32_t i = 0; i < p.n; ++i) store3(&p.x[size_t{kStride} * i], p.rest_at(i));
}

void weigh(Body &b) {
  CellMaterials cells;
  for (const Material &material : b.composition.materials) cells.list.push_back(&material);
  cells.of = b.composition.of;
  dfm_body_def def = dfm_body_def_default();
  def.ntet = b.ncell();
  def.cell_share = b.share.empty() ? nullptr : b.share.data();
  lump_body(b, def, cells);
  update_inverse_mass(b.p);
}

// Keeps the chosen integrator.
void keep_integrator(Body &b, const Integrator &was) {
  b.integrator.chosen = was.chosen;
  b.integrator.open = was.open;
  if (was.chosen == Chosen::implicit) b.integrator.step = was.step;
}

void keep_params(Body &b, const BodyShape &before) {
  const std::vector<double> values = before.model.params;
  b.switched_off.requested = before.switched_off.requested;
  if (values == b.model.params) return;
  if (const dfm_status s = b.model.put_params(values, b.dynamics ? b.dynamics->abilities().claims : 0);
      s != DFM_OK)
    refuse(b, s, ": model '%s' does not take its present parameters for the cells that are left",
           b.model.type->id);
  b.model.params = values;
}

}  // namespace

void exchange(Body &b, BodyShape &other) noexcept {
  std::swap<BodyShape>(b, other);
  b.bound.known = false;
  ++b.x_version;
}

std::shared_ptr<const WholeBody> whole_of(const Body &b) {
  if (b.cut.whole) return b.cut.whole;
  const Memory &m = b.world->memory();
  auto out = std::make_shared<WholeBody>();
  use_memory(m, out->rest, out->mass, out->share, out->tets, out->tri);
  out->npoint = b.p.n;
  out->nsurfel = b.surface.nsurfel;
  out->rest = b.p.rest;
  out->mass = b.p.mass;
  out->share = b.share;
  out->tets = b.tets;
  for (const uint32_t s : b.surface.tri) out->tri.push_back(b.surface.point[s]);
  out->composition = b.composition;
  out->zones = b.zones;
  return out;
}

namespace {

// Copies of a point share its work of cutting.
void carry_cut_work(const CutMesh &mesh, const BladeTrack &from, BladeTrack &to) {
  if (from.cut_work.empty()) return;
  const auto at = [&](uint32_t point) {
    const auto before = [](const CutWork &d, uint32_t p) { return d.point < p; };
    const auto found = std::lower_bound(from.cut_work.begin(), from.cut_work.end(), point, before);
    return found != from.cut_work.end() && found->point == point ? size_t(found - from.cut_work.begin())
                                                                 : from.cut_work.size();
  };
  std::vector<uint32_t> copies(from.cut_work.size() + 1);
  for (const uint32_t p : mesh.point) ++copies[at(p)];
  for (uint32_t i = 0; i < mesh.point.size(); ++i) {
    const size_t k = at(mesh.point[i]);
    if (k == from.cut_work.size()) continue;
    CutWork copy = from.cut_work[k];
    copy.point = i;
    copy.energy /= copies[k];
    copy.force /= copies[k];
    to.cut_work.push_back(copy);
  }
}

// The part of the present mesh of b: what follows from its cells alone.
std::unique_ptr<BodyShape> structure_of_part(const Body &b, const CutMesh &mesh, Array<uint64_t> &&open,
                                             bool inner) {
  const Memory &m = b.world->memory();
  auto shape = std::make_unique<BodyShape>();
  BodyShape &out = *shape;
  out.cut.whole = whole_of(b);
  use_memory(m, out.cut.point, out.cut.cell);
  const bool again = b.cut.whole != nullptr;
  for (const uint32_t p : mesh.point) out.cut.point.push_back(again ? b.cut.point[p] : p);
  for (const uint32_t c : mesh.cell) out.cut.cell.push_back(again ? b.cut.cell[c] : c);
  out.cut.open = std::move(open);

  take_cells(m, b.p.rest, b.share, b.composition, mesh, inner, b.smooth, out);
  name_features(b, mesh, out.surface, out.cut);
  find_coincident(m, *out.cut.whole, out.cut, out.surface);
  make_cut_zones(m, *out.cut.whole, out.cut, out.composition, out.tets, out.surface, out.zones);
  return shape;
}

// The state of its points and surfels, and where blades are.
void take_points(const Memory &m, const BodyShape &from, const CutMesh &mesh,
                 const std::vector<uint32_t> &surfel, BodyShape &to) {
  Phyxels &p = to.p;
  take_rows(from.p.x, mesh.point, kStride, p.x);
  take_rows(from.p.v, mesh.point, kStride, p.v);
  p.dampers.lag = from.p.dampers.lag;
  use_memory(m, p.dampers.v, p.dampers.slow);
  if (p.dampers.lag > 0) {
    take_rows(from.p.dampers.v, mesh.point, kStride, p.dampers.v);
    take_rows(from.p.dampers.slow, mesh.point, kStride, p.dampers.slow);
  }
  take_rows(from.p.held, mesh.point, 1, p.held);
  if (!from.anchor.empty()) take_rows(from.anchor, mesh.point, kStride, to.anchor);
  for (const BladeTrack &t : from.blades) {
    BladeTrack &track = to.blades.emplace_back();
    use_memory(m, track.x, track.sides, track.cut_work);
    std::copy_n(t.edge, 6, track.edge);
    track.lead = t.lead;
    std::copy_n(t.way, 2, track.way);
    take_rows(t.x, mesh.point, kStride, track.x);
    for (BladeSide side : t.sides) {
      const auto at = std::lower_bound(mesh.cell.begin(), mesh.cell.end(), side.cell);
      if (at == mesh.cell.end() || *at != side.cell) continue;
      side.cell = uint32_t(at - mesh.cell.begin());
      track.sides.push_back(side);
    }
    track.credit = t.credit;
    track.part = t.part;
    carry_cut_work(mesh, t, track);
  }
  to.surface.back = from.surface.back;
  carry_surfels(from.surfel_impulse, surfel, to.surfel_impulse);
  gather_surface(to.surface, p.x.data(), p.v.data());
}

std::shared_ptr<const BoxTree> tree_at_rest(const Memory &m, const Body &b) {
  auto tree = std::make_shared<BoxTree>(m);
  tree->build(b.surface.tri, b.self_rest->x.data());
  return tree;
}

ModelOrigin origin_of(const Body &b, const CutMesh &mesh) {
  ModelOrigin origin = b.origin;
  take_rows(b.origin.held, mesh.point, 1, origin.held);
  return origin;
}

}  // namespace

std::unique_ptr<MadeShape> make_shape(const Body &b, CutMesh &&mesh, Array<uint64_t> &&open,
                                      const double *open_time) {
  World &w = *b.world;
  auto out = std::make_unique<MadeShape>(MadeShape{std::move(mesh), nullptr, {}, {}, {}, nullptr});
  out->shape = structure_of_part(b, out->mesh, std::move(open), open_time != nullptr);
  BodyShape &shape = *out->shape;
  shape.surface.named = b.surface.named;
  shape.search = std::make_unique<SearchTree>(w.memory());
  out->edge = edges_before(b.edges, out->mesh, shape.edges);
  out->surfel = surfels_before(b, out->mesh, shape.surface);
  out->features = FeatureMap(b.surface, shape.surface);

  Body like;  // the model is made for a body
  like.world = &w;
  like.name = b.name;
  like.material = b.material;
  ModelOrigin origin = origin_of(b, out->mesh);
  exchange(like, shape);
  put_at_rest(like.p);
  weigh(like);
  exchange(like, *make_body_instance(w, like, *b.model.type, std::move(origin)));
  keep_params(like, b);
  like.integrator.used = b.integrator.used;
  like.p.dampers.lag = b.p.dampers.lag;
  if (open_time) {
    set_dynamics(w, like, open_time);
    like.dynamics.reset();  // it refers to this body
    like.self_rest = std::make_unique<SelfRest>(self_rest_of(w.meters.detection.memory(), like));
    like.surface.tree = tree_at_rest(w.meters.detection.memory(), like);
  }
  exchange(like, shape);
  return out;
}

std::unique_ptr<BodyShape> take_shape(Body &b, MadeShape &made, bool parts, bool ahead, const Body *from) {
  World &w = *b.world;
  const CutMesh &mesh = made.mesh;
  std::unique_ptr<BodyShape> shape = std::move(made.shape);
  shape->shape = ++w.shapes;
  exchange(b, *shape);
  try {
    const BodyShape &before = from ? static_cast<const BodyShape &>(*from) : *shape;
    take_points(w.memory(), before, mesh, made.surfel, b);
    update_inverse_mass(b.p);
    carry_loads(before, mesh, parts, b);
    const double step = b.integrator.step;
    set_dynamics(w, b, ahead ? nullptr : &w.time);
    if (ahead) b.integrator.step = step;
    keep_integrator(b, before.integrator);
    carry_state(before, mesh, made.edge, b);
    if (!from)
      b.former_surface.reset(new FormerSurface{before.shape, b.shape, made.features, std::move(made.list)});
  } catch (...) {
    exchange(b, *shape);
    throw;
  }
  return shape;
}

std::unique_ptr<BodyShape> cut_body(Body &b, CutMesh &&mesh, Array<uint64_t> &&open, bool parts) {
  return take_shape(b, *make_shape(b, std::move(mesh), std::move(open), nullptr), parts, false);
}

// Copies are moved, so that they stay in the memory of the body.
std::unique_ptr<Body> structure_of(const Body &b) {
  auto out = std::make_unique<Body>();
  out->world = b.world;
  out->id = b.id;
  out->name = b.name;
  out->material = b.material;
  out->p.n = b.p.n;
  out->p.rest = Array<double>(b.p.rest);
  out->p.mass = Array<double>(b.p.mass);
  static_cast<Structure &>(*out) = Structure(b);
  out->origin = b.origin;
  out->integrator = b.integrator;
  out->p.dampers.lag = b.p.dampers.lag;
  out->model.type = b.model.type;
  out->model.params = b.model.params;
  out->switched_off = b.switched_off;
  return out;
}

std::unique_ptr<Body> structure_left(const Body &before, MadeShape &made) {
  Body like;
  like.world = before.world;
  like.id = before.id;
  like.name = before.name;
  like.material = before.material;
  exchange(like, *made.shape);
  std::unique_ptr<Body> out = structure_of(like);
  exchange(like, *made.shape);
  return out;
}

void shape_piece(const Body &from, CutMesh &&mesh, Array<uint64_t> &&open, Body &piece) {
  const std::unique_ptr<MadeShape> made = make_shape(from, std::move(mesh), std::move(open), nullptr);
  NamedBy there{from.id, {}};
  std::ranges::copy(made->shape->cut.next_name, there.below);
  made->shape->surface.named.push_back(there);
  take_shape(piece, *made, true, false, &from);
}

std::unique_ptr<BodyShape> restore_shape(Body &b, const Body &like, std::shared_ptr<const WholeBody> whole,
                                         CutMesh &&mesh, Array<uint64_t> &&open, FeatureNames *names) {
  const Memory &m = b.world->memory();
  auto shape = std::make_unique<BodyShape>();
  BodyShape &out = *shape;
  take_cells(m, whole->rest, whole->share, whole->composition, mesh, false, like.smooth, out);
  put_at_rest(out.p);
  if (b.world->def.sleep) out.anchor = out.p.x;
  out.surfel_impulse.assign(size_t{3} * out.surface.nsurfel, 0.0);
  if (names) {
    out.cut.whole = whole;
    out.cut.open = std::move(open);
    take_names(b.name, *names, out.surface, out.cut);
    use_memory(m, out.cut.point, out.cut.cell);
    out.cut.point = mesh.point;
    out.cut.cell = mesh.cell;
    make_cut_zones(m, *whole, out.cut, out.composition, out.tets, out.surface, out.zones);
    find_coincident(m, *whole, out.cut, out.surface);
  } else {
    out.zones = whole->zones;
  }
  gather_surface(out.surface, out.p.x.data(), out.p.v.data());
  out.shape = ++b.world->shapes;
  out.search = std::make_unique<SearchTree>(m);
  exchange(b, out);
  try {
    weigh(b);
    const BodyShape &before = &like == &b ? out : static_cast<const BodyShape &>(like);
    b.model.type = before.model.type;
    b.origin = before.origin;
    b.origin.held.assign(b.p.n, 0);
  } catch (...) {
    exchange(b, out);
    throw;
  }
  return shape;
}

}  // namespace dfm
