// From a mesh to blocks: cells side by side in groups, halos, and who adds up whose forces.
#include <cmath>

#include "../model_common/edges.h"
#include "../model_common/width.h"
#include "corot_body.h"

namespace corot {
namespace {

// of a pass over the blocks at most: enough for the workers that one body can feed
constexpr uint32_t kPieces = 32;

const Kernels *choose_kernels(const dfm_host *host) {
  const model::Width width = model::choose_width(host, "corotational_fem");
  return width == model::kAvx512 ? kernels_avx512() : width == model::kAvx2 ? kernels_avx2() : kernels_sse2();
}

}  // namespace

// A cell without volume keeps none of its gradients and with them no stiffness.
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
  mass.create(host, npoint);
  weight.create(host, npoint);
  rest_rows.create(host, npoint);
  damp_rows.create(host, npoint);
  volume.create(host, ncell);
  cells.create(host, 4 * size_t(ncell));
  edges.create(host, 2 * size_t(nedge));
  height_inverse.create(host, 4 * size_t(ncell));
  twist_share.create(host, 4 * size_t(ncell));
  place_of.create(host, ncell);
  std::copy(m.mass, m.mass + npoint, mass.data());
  std::copy(m.cells, m.cells + 4 * size_t(ncell), cells.data());
  std::copy(m.edges, m.edges + 2 * size_t(nedge), edges.data());
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

// What leads from the mesh to the blocks; a rank is a point's place in the order of partition_points.
struct Body::Layout {
  // points by rank, ranks by point, first rank of each block, block of a rank
  Buffer<uint32_t> order, rank, begin, block_of;
  Buffer<uint32_t> cell_order, cell_begin;  // cells by block
  // last block that saw a rank, its number there, ranks outside the block
  Buffer<uint32_t> mark, local, halo;
};

// A cell belongs to the block of its lowest rank, in the order of that rank.
void Body::order_cells(Layout &l) const {
  l.cell_order.create(host, ncell);
  l.cell_begin.create(host, size_t(nblock) + 1);
  const auto lowest = [&](uint32_t c) {
    const uint32_t *q = cells.data() + 4 * size_t(c);
    return std::min(std::min(l.rank[q[0]], l.rank[q[1]]), std::min(l.rank[q[2]], l.rank[q[3]]));
  };
  for (uint32_t c = 0; c < ncell; ++c) {
    l.cell_order[c] = c;
    ++l.cell_begin[l.block_of[lowest(c)] + 1];
  }
  for (uint32_t b = 0; b < nblock; ++b) l.cell_begin[b + 1] += l.cell_begin[b];
  std::sort(l.cell_order.data(), l.cell_order.data() + ncell,
            [&](uint32_t a, uint32_t b) { return lowest(a) != lowest(b) ? lowest(a) < lowest(b) : a < b; });
}

// Ranks outside block b that its cells touch, ascending, in l.halo; returns how many.
uint32_t Body::find_halo(Layout &l, uint32_t b) const {
  uint32_t n = 0;
  for (uint32_t c = l.cell_begin[b]; c < l.cell_begin[b + 1]; ++c)
    for (int a = 0; a < 4; ++a) {
      const uint32_t r = l.rank[cells[4 * size_t(l.cell_order[c]) + a]];
      if (l.block_of[r] == b || l.mark[r] == b) continue;
      l.mark[r] = b;
      l.halo[n++] = r;
    }
  std::sort(l.halo.data(), l.halo.data() + n);
  return n;
}

// The last group is filled up with the block's first cell, which then has no stiffness.
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

// Halo sums by owner, sources in block order: the order of the sums is the mesh's, never the threads'.
void Body::build_merge(const Layout &l) {
  merge_begin.create(host, size_t(nblock) + 1);
  const auto each = [&](auto &&use) {
    for (uint32_t b = 0; b < nblock; ++b)
      for (uint32_t n = block[b].owned; n < block[b].local; ++n) use(b, n, l.rank[block[b].point[n]]);
  };
  each([&](uint32_t, uint32_t, uint32_t r) { ++merge_begin[l.block_of[r] + 1]; });
  for (uint32_t b = 0; b < nblock; ++b) merge_begin[b + 1] += merge_begin[b];
  merge.create(host, merge_begin[nblock]);
  Buffer<uint32_t> at;
  at.create(host, nblock);
  std::copy(merge_begin.data(), merge_begin.data() + nblock, at.data());
  each([&](uint32_t b, uint32_t n, uint32_t r) {
    const uint32_t owner = l.block_of[r];
    merge[at[owner]++] = {slot_begin[b] + n, slot_begin[owner] + (r - l.begin[owner])};
  });
}

void Body::build_blocks(const dfm_mesh &m) {
  Layout l;
  l.order.create(host, npoint);
  l.rank.create(host, npoint);
  l.block_of.create(host, npoint);
  l.begin.create(host, model::partition_capacity(npoint));
  nblock = model::partition_points(m.rest, npoint, l.order.data(), l.begin.data());
  for (uint32_t b = 0; b < nblock; ++b)
    for (uint32_t r = l.begin[b]; r < l.begin[b + 1]; ++r) {
      l.rank[l.order[r]] = r;
      l.block_of[r] = b;
    }
  order_cells(l);
  l.mark.create(host, npoint);
  l.local.create(host, npoint);
  l.halo.create(host, npoint);
  std::fill(l.mark.data(), l.mark.data() + npoint, kNone);

  // Sizes, then one allocation per array, then each block's share.
  slot_begin.create(host, size_t(nblock) + 1);
  block.create(host, nblock);
  for (uint32_t b = 0; b < nblock; ++b) {
    slot_begin[b + 1] = slot_begin[b] + (l.begin[b + 1] - l.begin[b]) + find_halo(l, b);
    largest = std::max(largest, slot_begin[b + 1] - slot_begin[b]);
    block[b].groups = (l.cell_begin[b + 1] - l.cell_begin[b] + kGroup - 1) / kGroup;
    groups += block[b].groups;
  }
  grain = (nblock + kPieces - 1) / kPieces;
  point.create(host, slot_begin[nblock]);
  p.create(host, 8 * size_t(largest) * ((nblock + grain - 1) / grain));
  f.create(host, 4 * size_t(slot_begin[nblock]));
  group.create(host, groups);
  slots.create(host, groups);
  cell_id.create(host, lanes());
  value.create(host, lanes());

  std::fill(l.mark.data(), l.mark.data() + npoint, kNone);
  uint32_t groups_at = 0;
  for (uint32_t b = 0; b < nblock; ++b) {
    const uint32_t owned = l.begin[b + 1] - l.begin[b], nhalo = find_halo(l, b);
    uint32_t *const points = point.data() + slot_begin[b];
    for (uint32_t n = 0; n < owned; ++n) {
      l.local[l.begin[b] + n] = n;
      points[n] = l.order[l.begin[b] + n];
    }
    for (uint32_t n = 0; n < nhalo; ++n) {
      l.local[l.halo[n]] = owned + n;
      points[owned + n] = l.order[l.halo[n]];
    }
    Block &out = block[b];
    out.owned = owned;
    out.local = owned + nhalo;
    out.point = points;
    out.f = f.data() + 4 * size_t(slot_begin[b]);
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
  if (nodal()) build_patches();
  params[kYield] = m.params[kYield];
  made_plastic = largest_of(kYield) > 0;
  if (plastic()) plastic_group.create(host, groups);
  apply_params(m.params);
}

}  // namespace corot
