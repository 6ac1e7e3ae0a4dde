// Builds blocks from a mesh: rows of springs in quads, halos, and the sums of forces between blocks.
#include <algorithm>

#include "msm_body.h"

namespace msm {
namespace {
constexpr double kNoLimit = 1e150;  // of a cell that fills up a block
}

void Body::take_mesh(const dfm_mesh &m) {
  npoint = m.npoint;
  Material::take_mesh(host, kId, m);
  mass.create_copy(host, m.mass, npoint);
  for (Buffer<double> *each : {&weight, &spring_sum, &coupled, &rest_rows}) each->create(host, npoint);
  edge_energy.create(host, nedge);
}

struct Body::Layout : Order {
  // springs by their end of lower rank, other ends ascending
  Buffer<uint32_t> row, edge;
  Buffer<uint32_t> cell_order, cell_begin;  // cells by block
};

void Body::order_springs(Layout &l) const {
  const auto each = [&](const auto &use) {
    for (uint32_t e = 0; e < nedge; ++e)
      use(std::min(l.rank[edges[2 * size_t(e)]], l.rank[edges[2 * size_t(e) + 1]]), e);
  };
  model::make_lists(host, npoint, each, l.row, l.edge);
  for (uint32_t r = 0; r < npoint; ++r)
    std::sort(l.edge.data() + l.row[r], l.edge.data() + l.row[r + 1],
              [&](uint32_t a, uint32_t b) { return high_rank(l, a) < high_rank(l, b); });
}

uint32_t Body::high_rank(const Layout &l, uint32_t e) const {
  return std::max(l.rank[edges[2 * size_t(e)]], l.rank[edges[2 * size_t(e) + 1]]);
}

// A cell goes to the block that owns most of its points, the first of equals; within the block by
// its lowest rank.
void Body::order_cells(Layout &l) const {
  Buffer<uint32_t> block_of_cell;
  l.cell_order.create(host, ncell);
  block_of_cell.create(host, ncell);
  const auto lowest = [&](uint32_t c) { return lowest_rank(l, cells.data() + 4 * size_t(c)); };
  for (uint32_t c = 0; c < ncell; ++c) {
    uint32_t of[4], best = 0, best_count = 0;
    for (int n = 0; n < 4; ++n) of[n] = l.block_of[l.rank[cells[4 * size_t(c) + n]]];
    std::sort(of, of + 4);
    for (uint32_t n = 0; n < 4; ++n) {
      const uint32_t count = uint32_t(std::count(of, of + 4, of[n]));
      if (count > best_count) {
        best = of[n];
        best_count = count;
      }
    }
    block_of_cell[c] = best;
  }
  Buffer<uint64_t> key;  // {lowest rank, cell}
  const auto each = [&](const auto &use) {
    for (uint32_t c = 0; c < ncell; ++c) use(block_of_cell[c], uint64_t(lowest(c)) << 32 | c);
  };
  model::make_lists(host, nblock, each, l.cell_begin, key);
  for (uint32_t b = 0; b < nblock; ++b)
    std::sort(key.data() + l.cell_begin[b], key.data() + l.cell_begin[b + 1]);
  for (uint32_t n = 0; n < ncell; ++n) l.cell_order[n] = uint32_t(key[n]);
}

uint32_t Body::spring_halo(Layout &l, uint32_t b) const {
  return find_halo(l, b, [&](auto &&see) {
    for (uint32_t s = l.row[l.begin[b]]; s < l.row[l.begin[b + 1]]; ++s) see(high_rank(l, l.edge[s]));
    for (uint32_t c = l.cell_begin[b]; c < l.cell_begin[b + 1]; ++c)
      for (int a = 0; a < 4; ++a) see(l.rank[cells[4 * size_t(l.cell_order[c]) + a]]);
  });
}

// Rows of springs as quads from quads_at on; a short one is filled up with its first end: no stiffness, and
// no point of another row.
size_t Body::fill_springs(const Layout &l, Block &out, uint32_t b, size_t quads_at) {
  out.quad = quad.data() + quads_at;
  out.stiffness = stiffness.data() + 4 * quads_at;
  out.rest = rest.data() + 4 * quads_at;
  const size_t first = quads_at;
  for (uint32_t r = l.begin[b]; r < l.begin[b + 1]; ++r)
    for (uint32_t s = l.row[r]; s < l.row[r + 1]; s += 4, ++quads_at) {
      Quad &q = quad[quads_at];
      q.i = uint16_t(l.local[r]);
      for (uint32_t n = 0; n < 4; ++n) {
        const bool real = s + n < l.row[r + 1];
        const uint32_t e = l.edge[real ? s + n : l.row[r]];
        q.j[n] = uint16_t(l.local[high_rank(l, e)]);
        spring_edge[4 * quads_at + n] = real ? e : kNone;
        rest[4 * quads_at + n] = real ? edge_length[e] : 0;
      }
    }
  if ((quads_at - first) % 2) {  // the widest kernel takes two quads at a time
    quad[quads_at] = quad[quads_at - 1];
    std::fill_n(spring_edge.data() + 4 * quads_at, 4, kNone);
    ++quads_at;
  }
  out.quads = uint32_t(quads_at - first);
  return quads_at;
}

size_t Body::fill_cells(const Layout &l, Block &out, uint32_t b, size_t cells_at) {
  out.cell = cell.data() + cells_at;
  out.bulk = bulk.data() + cells_at;
  out.volume6 = volume6.data() + cells_at;
  out.collapse = collapse.data() + cells_at;
  out.limit = limit.data() + cells_at;
  out.least_limit = kNoLimit;
  out.cells = (l.cell_begin[b + 1] - l.cell_begin[b] + 7) / 8 * 8;
  for (uint32_t n = 0; n < out.cells; ++n, ++cells_at) {
    const bool real = l.cell_begin[b] + n < l.cell_begin[b + 1];
    const uint32_t c = l.cell_order[l.cell_begin[b] + (real ? n : 0)];
    for (int a = 0; a < 4; ++a) cell[cells_at].p[a] = uint16_t(l.local[l.rank[cells[4 * size_t(c) + a]]]);
    cell_id[cells_at] = real ? c : kNone;
    volume6[cells_at] = cell_volume6[c];
    limit[cells_at] = real ? limit_of(c) : kNoLimit;
    out.least_limit = std::min(out.least_limit, limit[cells_at]);
  }
  return cells_at;
}

void Body::build_blocks() {
  Layout l;
  order_points(l, rest_point.data());
  order_springs(l);
  order_cells(l);
  // Sizes, then one allocation per array, then the data of each block.
  create_points(l, [&](uint32_t b) { return spring_halo(l, b); });
  if (largest > kMaxLocal)
    throw "a part of 1024 points has springs to more than 64,000 others; check the mesh for points that "
          "share an edge with very many others";
  size_t nquad = 0, ncells = 0;
  for (uint32_t b = 0; b < nblock; ++b) {
    for (uint32_t r = l.begin[b]; r < l.begin[b + 1]; ++r) nquad += (l.row[r + 1] - l.row[r] + 3) / 4;
    nquad += nquad % 2;
    ncells += (l.cell_begin[b + 1] - l.cell_begin[b] + 7) / 8 * 8;
  }
  const size_t nslot = slot_begin[nblock];
  slot_weight.create(host, nslot);
  std::fill(slot_weight.data(), slot_weight.data() + nslot, 1.0);
  row.create(host, 8 * nslot);
  quad.create(host, nquad);
  stiffness.create(host, 4 * nquad);
  rest.create(host, 4 * nquad);
  spring_edge.create(host, 4 * nquad);
  cell.create(host, ncells);
  bulk.create(host, ncells);
  volume6.create(host, ncells);
  cell_id.create(host, ncells);
  collapse.create(host, ncells);
  limit.create(host, ncells);
  limited.create(host, nblock);

  size_t quads_at = 0, cells_at = 0;
  for (uint32_t b = 0; b < nblock; ++b) {
    Block &out = place_points(l, b, spring_halo(l, b));
    out.edge = spring_edge.data() + 4 * quads_at;
    out.limited = limited.data() + b;
    out.row = row.data() + 8 * size_t(slot_begin[b]);
    out.weight = slot_weight.data() + slot_begin[b];
    quads_at = fill_springs(l, out, b, quads_at);
    cells_at = fill_cells(l, out, b, cells_at);
  }
  build_merge(l);
}

void Body::create(const dfm_host *h, const dfm_mesh &m) {
  host = h;
  if (!valid(h, m.params)) throw Refused{};
  kernels = choose_kernels(h);
  take_mesh(m);
  build_blocks();
  apply_params(m.params);
}

}  // namespace msm
