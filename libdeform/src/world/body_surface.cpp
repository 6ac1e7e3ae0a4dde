#include "world/body_surface.h"

#include <cmath>

#include "body/make_surface.h"
#include "core/error.h"
#include "geometry/area.h"
#include "geometry/bulge.h"
#include "mesh/mesh.h"
#include "plugin/context.h"
#include "state/world.h"
#include "world/triangle_list.h"

namespace dfm {
namespace {

// mean distances; beyond it rows hold hundreds of phyxels and the surface no longer follows the body
constexpr double kMaxSupport = 10;
// of the diagonal of the cells: more than the distance between the boundary of a coarse lattice and a curved
// surface
constexpr double kWarnOutside = 0.02;

void check_surface(const dfm_surface_def &def, const Body &b) {
  if (def.size < sizeof(dfm_surface_def))
    refuse(b, ": surface->size is %u, expected %zu; set it to sizeof", def.size, sizeof(dfm_surface_def));
  if (def.coupling < DFM_COUPLING_BARYCENTRIC || def.coupling > DFM_COUPLING_THESIS)
    refuse(b, ": surface->coupling %d is unknown; use DFM_COUPLING_BARYCENTRIC, MLS or THESIS", def.coupling);
  if (!(def.support >= 0 && def.support <= kMaxSupport))
    refuse(b, ": surface->support is %g mean distances; it must lie between 0 (which means 3) and %g",
           def.support, kMaxSupport);
  check_triangles(def, b, "surface ");
  std::vector<uint8_t> used(def.npoint);
  for (size_t i = 0; i < size_t{3} * def.ntriangle; ++i) used[def.triangles[i]] = 1;
  for (uint32_t i = 0; i < def.npoint; ++i)
    if (!used[i]) refuse(b, ": surface point %u belongs to no triangle; drop it (dfm_mesh_create does)", i);
}

// A closed surface that faces inward would exchange inside and outside.
void check_outward(const Surface &s, const Body &b) {
  for (uint32_t e = 0; e < 2 * s.nedge; ++e)
    if (s.edge_tri[e] == kNone) return;
  if (signed_volume(s.tri, [&](uint32_t i) { return load3(&s.x[4 * size_t{i}]); }) < 0)
    refuse(b, ": its surface is closed and faces inward; reverse its triangles (dfm_mesh_create does)");
}

void couple(Body &b, const dfm_surface_def &def) {
  const Memory &m = b.world->memory();
  CouplingInput in;
  in.npoint = b.p.n;
  in.ntet = b.ncell();
  in.nsurfel = def.npoint;
  in.point = b.p.rest.data();
  in.tet = b.tets.data();
  in.surfel = def.points;
  if (!b.cells.empty()) in.cells = b.cells.data();
  in.kind = b.cell_type;
  if (def.support > 0) in.support = def.support;
  Coupling c = def.coupling == DFM_COUPLING_MLS      ? couple_mls(m, in)
               : def.coupling == DFM_COUPLING_THESIS ? couple_thesis(m, in)
                                                     : couple_barycentric(m, in);
  const Extent box = extent_of(b.p.rest.data(), b.p.n, 3);
  const double size = norm(box.hi - box.lo);
  if (c.farthest > size)
    refuse(b,
           ": its surface lies up to %g m from its cells, which are %g m across; both must be in the same "
           "frame and unit (m)",
           c.farthest, size);
  // the cells of a lattice need not cover its surface
  if (b.inside.empty() && c.farthest > kWarnOutside * size)
    b.world->context->warn(b,
                           ": %u of %u surfels hang on the nearest cell from outside, the farthest %g m "
                           "away; cells that cover the surface follow it better",
                           c.outside, def.npoint, c.farthest);
  wear_coupling(std::move(c), b.surface);
}

// A scene splits them; here the triangles are the caller's.
void warn_long_edges(const Body &b) {
  double cells = 0, longest = 0;
  for (size_t e = 0; e < b.edges.size(); e += 2)
    cells = std::max(cells, norm(b.p.rest_at(b.edges[e]) - load3(&b.p.rest[size_t{3} * b.edges[e + 1]])));
  const Surface &s = b.surface;
  for (size_t e = 0; e < s.edge.size(); e += 2)
    longest =
        std::max(longest, norm(load3(&s.x[size_t{4} * s.edge[e]]) - load3(&s.x[size_t{4} * s.edge[e + 1]])));
  if (longest > kLongestEdge * (1 + 1e-6) * cells)
    b.world->context->warn(
        b,
        ": its surface has edges of up to %.3g m, and the cells that fill it of up to %.3g m, so it will "
        "sink into what it touches; split edges longer than %.3g m, or let a scene fill the body",
        longest, cells, kLongestEdge * cells);
}

}  // namespace

void make_body_surface(Body &b, const dfm_surface_def *def, double smooth) {
  const Memory &m = b.world->memory();
  if (!(smooth >= 0 && smooth <= 180))
    refuse(b, ": smooth %g; it is an angle between faces in degrees, 0 (flat faces) to 180", smooth);
  if (def) {
    check_surface(*def, b);
    make_surface(m, def->npoint, def->points, def->triangles, def->ntriangle, b.surface);
    check_outward(b.surface, b);
    if (!b.share.empty() || !b.inside.empty()) warn_long_edges(b);
    couple(b, *def);
  } else {
    const Array<uint32_t> boundary = boundary_triangles(m, b.ncell(), b.tets.data());
    make_surface(m, b.p.n, b.p.rest.data(), boundary.data(), static_cast<uint32_t>(boundary.size() / 3),
                 b.surface);
  }
  b.smooth = smooth;
  if (smooth > 0) make_bulges(b.surface, smooth);
  gather_surface(b.surface, b.p.x.data(), b.p.v.data());
}

MeshCoupling::MeshCoupling(const Memory &memory, const Surface &surface) : surface_(surface) {
  use_memory(memory, row_, col_, weight_);

  if (!surface.identity()) return;
  col_ = surface.point;
  weight_.assign(surface.nsurfel, 1.0);
  for (uint32_t s = 0; s <= surface.nsurfel; ++s) row_.push_back(s);
}

void MeshCoupling::fill_mesh(dfm_mesh &mesh) const {
  const bool own = surface_.identity();
  mesh.nsurfel = surface_.nsurfel;
  mesh.row = own ? row_.data() : surface_.row.data();
  mesh.col = own ? col_.data() : surface_.col.data();
  mesh.weight = own ? weight_.data() : surface_.weight.data();
}

}  // namespace dfm
