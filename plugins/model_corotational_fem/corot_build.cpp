// Builds blocks from a mesh: cells side by side in groups, halos, and the sums of forces between blocks.
#include <cmath>

#include "../model_common/edges.h"
#include "../model_common/width.h"
#include "corot_body.h"

namespace corot {
namespace {

const Kernels *choose_kernels(const dfm_host *host) {
  const model::Width width = model::choose_width(host, "corotational_fem");
  if constexpr (model::kHasWider) {
    if (width != model::kSse2) return width == model::kAvx512 ? kernels_avx512() : kernels_avx2();
  }
  return kernels_sse2();
}

}  // namespace

// A cell without volume gets zero gradients, and so no stiffness.
model::Tetrahedron shape_of(const double *rest, const uint32_t *cell) {
  const double *x[4];
  for (int a = 0; a < 4; ++a) x[a] = rest + 3 * size_t(cell[a]);
  model::Tetrahedron shape;
  if (!model::make_tetrahedron(x[0], x[1], x[2], x[3], shape)) shape.volume = 0;
  return shape;
}

void Body::take_mesh(const dfm_mesh &m) {
  npoint = m.npoint;
  ncell = m.ncell;
  nedge = m.nedge;
  mass.create_copy(host, m.mass, npoint);
  weight.create(host, npoint);
  rest_rows.create(host, npoint);
  damp_rows.create(host, npoint);
  volume.create(host, ncell);
  cells.create_copy(host, m.cells, 4 * size_t(ncell));
  edges.create_copy(host, m.edges, 2 * size_t(nedge));
  height_inverse.create(host, 4 * size_t(ncell));
  twist_share.create(host, 4 * size_t(ncell));
  place_of.create(host, ncell);
  for (uint32_t c = 0; c < ncell; ++c) {
    uint32_t *q = cells.data() + 4 * size_t(c);
    std::sort(q, q + 4);
    const model::Tetrahedron shape = shape_of(m.rest, q);
    volume[c] = std::fabs(shape.volume);
    for (int a = 0; a < 4; ++a) {
      const double *g = shape.g[a];
      height_inverse[4 * size_t(c) + a] = __builtin_sqrt((g[0] * g[0] + g[1] * g[1]) + g[2] * g[2]);
    }
  }
}

struct Body::Layout : Order {
  Buffer<uint32_t> cell_order, cell_begin;  // cells by block
};

// A cell belongs to the block of its lowest rank, in the order of that rank.
void Body::order_cells(Layout &l) const {
  l.cell_order.create(host, ncell);
  l.cell_begin.create(host, size_t(nblock) + 1);
  const auto lowest = [&](uint32_t c) { return lowest_rank(l, cells.data() + 4 * size_t(c)); };
  for (uint32_t c = 0; c < ncell; ++c) {
    l.cell_order[c] = c;
    ++l.cell_begin[l.block_of[lowest(c)] + 1];
  }
  for (uint32_t b = 0; b < nblock; ++b) l.cell_begin[b + 1] += l.cell_begin[b];
  std::sort(l.cell_order.data(), l.cell_order.data() + ncell,
            [&](uint32_t a, uint32_t b) { return lowest(a) != lowest(b) ? lowest(a) < lowest(b) : a < b; });
}

uint32_t Body::cell_halo(Layout &l, uint32_t b) const {
  return find_halo(l, b, [&](auto &&see) {
    for (uint32_t c = l.cell_begin[b]; c < l.cell_begin[b + 1]; ++c)
      for (int a = 0; a < 4; ++a) see(l.rank[cells[4 * size_t(l.cell_order[c]) + a]]);
  });
}

// The last group is padded with the first cell of the block, without stiffness.
void Body::fill_groups(const Layout &l, const dfm_mesh &m, uint32_t b, uint32_t groups_at) {
  const uint32_t begin = l.cell_begin[b], count = l.cell_begin[b + 1] - begin;
  for (uint32_t n = 0; n < block[b].groups * kGroup; ++n) {
    const uint32_t c = l.cell_order[begin + (n < count ? n : 0)], lane = n % kGroup;
    const size_t place = size_t(groups_at) * kGroup + n;
    Group &out = group[groups_at + n / kGroup];
    const model::Tetrahedron shape = shape_of(m.rest, cells.data() + 4 * size_t(c));
    for (int k = 0; k < 9; ++k) out.g[k][lane] = shape.g[k / 3 + 1][k % 3];
    for (int a = 0; a < 4; ++a) out.p[lane][a] = l.local[l.rank[cells[4 * size_t(c) + a]]];
    uint32_t edge[6];
    model::find_edges(edges.data(), nedge, cells.data() + 4 * size_t(c), edge);
    for (int k = 0; k < 10; ++k)
      slots[groups_at + n / kGroup].slot[k][lane] =
          k < 4 ? cells[4 * size_t(c) + size_t(k)] : npoint + edge[k - 4];
    cell_id[place] = n < count ? c : kNone;
    if (n < count) place_of[c] = uint32_t(place);
  }
}

void Body::build_blocks(const dfm_mesh &m) {
  Layout l;
  order_points(l, m.rest);
  order_cells(l);
  // Sizes, then one allocation per array, then the data of each block.
  create_points(l, [&](uint32_t b) { return cell_halo(l, b); });
  for (uint32_t b = 0; b < nblock; ++b) {
    block[b].groups = (l.cell_begin[b + 1] - l.cell_begin[b] + kGroup - 1) / kGroup;
    groups += block[b].groups;
  }
  group.create(host, groups);
  slots.create(host, groups);
  cell_id.create(host, lanes());
  value.create(host, lanes());
  uint32_t groups_at = 0;
  for (uint32_t b = 0; b < nblock; ++b) {
    Block &out = place_points(l, b, cell_halo(l, b));
    out.group = group.data() + groups_at;
    out.slots = slots.data() + groups_at;
    out.value = value.data() + size_t(kGroup) * groups_at;
    fill_groups(l, m, b, groups_at);
    groups_at += out.groups;
  }
  build_merge(l);
}

void Body::create(const dfm_host *h, const dfm_mesh &m) {
  host = h;
  kernels = choose_kernels(h);
  take_mesh(m);
  take_fields(m);
  build_blocks(m);
  params[kLocking] = m.params[kLocking];  // cannot change later
  if (nodal()) {
    bulk.create(host, 2 * size_t(npoint));
    point_change.create(host, 2 * size_t(npoint));
  }
  made_plastic = may_yield(field[kYield], m.params[kYield]);
  if (plastic()) plastic_group.create(host, groups);
  apply_params(m.params);
}

}  // namespace corot
