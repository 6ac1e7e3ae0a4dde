// From a mesh to blocks: stiffness per spring (Van Gelder), rows of springs in quads, halos, and who adds up whose forces.
#include <algorithm>

#include "msm_body.h"

namespace msm {
namespace {

constexpr int kEdgeOf[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

uint32_t find_edge(const uint32_t *edges, uint32_t nedge, uint32_t i, uint32_t j) {
  if (i > j) std::swap(i, j);
  uint32_t lo = 0, hi = nedge;
  while (lo < hi) {
    const uint32_t mid = lo + (hi - lo) / 2;
    if (edges[2 * size_t(mid)] < i || (edges[2 * size_t(mid)] == i && edges[2 * size_t(mid) + 1] < j)) lo = mid + 1;
    else hi = mid;
  }
  const bool found = lo < nedge && edges[2 * size_t(lo)] == i && edges[2 * size_t(lo) + 1] == j;
  return found ? lo : Body::kNone;
}

// Springs by the point of lower rank, the others' ranks ascending; cells by block.
struct Rows {
  Buffer<uint32_t> begin, edge;
};

}  // namespace

// Scale of the springs that keeps Young's modulus when the volume term is on: springs give lambda = mu, the term adds kV to
// lambda, and E = mu (3 lambda + 2 mu) / (lambda + mu) is solved for mu; without it mu = 0.4 E.
double Body::spring_scale() const {
  const double r = volume_ratio();
  if (r == 0) return 1;
  const double b = 3 * r - 2;
  return (__builtin_sqrt(b * b + 20 * r) - b) / 10 / 0.4;
}

void Body::take_mesh(const dfm_mesh &m) {
  npoint = m.npoint, ncell = m.ncell, nedge = m.nedge;
  mass.create(host, npoint), shape.create(host, nedge), edge_volume.create(host, nedge), edge_length.create(host, nedge);
  edge_energy.create(host, nedge), rest_point.create(host, 3 * size_t(npoint));
  weight.create(host, npoint), spring_sum.create(host, npoint), coupled.create(host, npoint), diagonal.create(host, 6 * size_t(npoint));
  edges.create(host, 2 * size_t(nedge)), cells.create(host, 4 * size_t(ncell)), cell_edge.create(host, 6 * size_t(ncell));
  cell_volume6.create(host, ncell);
  std::copy(m.mass, m.mass + npoint, mass.data());
  std::copy(m.rest, m.rest + 3 * size_t(npoint), rest_point.data());
  std::copy(m.edges, m.edges + 2 * size_t(nedge), edges.data());
  std::copy(m.cells, m.cells + 4 * size_t(ncell), cells.data());
  for (uint32_t k = 0; m.field_keys && m.field_keys[k]; ++k)
    if (!std::strcmp(m.field_keys[k], "young")) {
      young_field = true;
      cell_young.create(host, ncell);
      std::copy(m.fields[k], m.fields[k] + ncell, cell_young.data());
    }
  for (uint32_t e = 0; e < nedge; ++e)
    edge_length[e] = length_of(m.rest + 3 * size_t(edges[2 * size_t(e)]), m.rest + 3 * size_t(edges[2 * size_t(e) + 1]));
  for (uint32_t c = 0; c < ncell; ++c) {
    const uint32_t *q = m.cells + 4 * size_t(c);
    cell_volume6[c] = volume6_of(m.rest + 3 * size_t(q[0]), m.rest + 3 * size_t(q[1]), m.rest + 3 * size_t(q[2]), m.rest + 3 * size_t(q[3]));
    const double volume = __builtin_fabs(cell_volume6[c]) / 6;
    for (int n = 0; n < 6; ++n) {
      const uint32_t e = find_edge(edges.data(), nedge, q[kEdgeOf[n][0]], q[kEdgeOf[n][1]]);
      if (e == kNone) throw "a cell has an edge that the mesh's edge list lacks";
      cell_edge[6 * size_t(c) + n] = e;
      edge_volume[e] += volume;
      shape[e] += volume * (young_field ? cell_young[c] : 1.0);
    }
  }
  for (uint32_t e = 0; e < nedge; ++e) {
    const double l2 = edge_length[e] * edge_length[e];
    shape[e] = l2 > kShortestSquared ? shape[e] / l2 : 0;  // two points at one place: no direction, no spring
  }
}

void Body::build_blocks() {
  Buffer<uint32_t> order, rank, begin, block_of;
  order.create(host, npoint), rank.create(host, npoint), begin.create(host, partition_capacity(npoint)), block_of.create(host, npoint);
  nblock = partition_points(rest_point.data(), npoint, order.data(), begin.data());
  for (uint32_t b = 0; b < nblock; ++b)
    for (uint32_t r = begin[b]; r < begin[b + 1]; ++r) rank[order[r]] = r, block_of[r] = b;

  Rows rows;  // springs by their end of lower rank
  rows.begin.create(host, size_t(npoint) + 1), rows.edge.create(host, nedge);
  const auto low = [&](uint32_t e) { return std::min(rank[edges[2 * size_t(e)]], rank[edges[2 * size_t(e) + 1]]); };
  const auto high = [&](uint32_t e) { return std::max(rank[edges[2 * size_t(e)]], rank[edges[2 * size_t(e) + 1]]); };
  for (uint32_t e = 0; e < nedge; ++e) rows.edge[e] = e;
  std::sort(rows.edge.data(), rows.edge.data() + nedge, [&](uint32_t a, uint32_t b) {
    return low(a) != low(b) ? low(a) < low(b) : high(a) < high(b);
  });
  for (uint32_t e = 0; e < nedge; ++e) ++rows.begin[low(e) + 1];
  for (uint32_t r = 0; r < npoint; ++r) rows.begin[r + 1] += rows.begin[r];

  Buffer<uint32_t> cell_order, cell_block, cell_begin;  // cells by the block that owns most of their points, the first of equals
  cell_order.create(host, ncell), cell_block.create(host, ncell), cell_begin.create(host, size_t(nblock) + 1);
  const auto lowest = [&](uint32_t c) {
    const uint32_t *q = cells.data() + 4 * size_t(c);
    return std::min(std::min(rank[q[0]], rank[q[1]]), std::min(rank[q[2]], rank[q[3]]));
  };
  for (uint32_t c = 0; c < ncell; ++c) {
    uint32_t of[4], best = 0, best_count = 0;
    for (int n = 0; n < 4; ++n) of[n] = block_of[rank[cells[4 * size_t(c) + n]]];
    std::sort(of, of + 4);
    for (uint32_t n = 0; n < 4; ++n) {
      const uint32_t count = uint32_t(std::count(of, of + 4, of[n]));
      if (count > best_count) best = of[n], best_count = count;
    }
    cell_order[c] = c, cell_block[c] = best, ++cell_begin[best + 1];
  }
  for (uint32_t b = 0; b < nblock; ++b) cell_begin[b + 1] += cell_begin[b];
  std::sort(cell_order.data(), cell_order.data() + ncell, [&](uint32_t a, uint32_t b) {
    if (cell_block[a] != cell_block[b]) return cell_block[a] < cell_block[b];
    return lowest(a) != lowest(b) ? lowest(a) < lowest(b) : a < b;
  });

  // Sizes, then one allocation per array, then each block's share.
  size_t nquad = 0, ncells = 0;
  for (uint32_t b = 0; b < nblock; ++b) {
    for (uint32_t r = begin[b]; r < begin[b + 1]; ++r) nquad += (rows.begin[r + 1] - rows.begin[r] + 3) / 4;
    nquad += nquad % 2;
  }
  for (uint32_t b = 0; b < nblock; ++b) ncells += (cell_begin[b + 1] - cell_begin[b] + 7) / 8 * 8;
  block.create(host, nblock), slot_begin.create(host, size_t(nblock) + 1), merge_begin.create(host, size_t(nblock) + 1);
  quad.create(host, nquad), stiffness.create(host, 4 * nquad), rest.create(host, 4 * nquad), spring_edge.create(host, 4 * nquad);
  cell.create(host, ncells), bulk.create(host, ncells), volume6.create(host, ncells), cell_id.create(host, ncells);

  Buffer<uint32_t> mark, local, halo;  // mark: last block that saw a point; local: its number there
  mark.create(host, npoint), local.create(host, npoint), halo.create(host, npoint);
  for (int pass = 0; pass < 2; ++pass) {  // first count the slots, then fill
    std::fill(mark.data(), mark.data() + npoint, kNone);
    size_t quads_at = 0, cells_at = 0;
    for (uint32_t b = 0; b < nblock; ++b) {
      const uint32_t owned = begin[b + 1] - begin[b];
      uint32_t nhalo = 0;
      const auto see = [&](uint32_t r) {
        if (block_of[r] != b && mark[r] != b) mark[r] = b, halo[nhalo++] = r;
      };
      for (uint32_t s = rows.begin[begin[b]]; s < rows.begin[begin[b + 1]]; ++s) see(high(rows.edge[s]));
      for (uint32_t c = cell_begin[b]; c < cell_begin[b + 1]; ++c)
        for (int n = 0; n < 4; ++n) see(rank[cells[4 * size_t(cell_order[c]) + n]]);
      if (pass == 0) {
        slot_begin[b + 1] = slot_begin[b] + owned + nhalo;
        continue;
      }
      std::sort(halo.data(), halo.data() + nhalo);
      uint32_t *const points = point.data() + slot_begin[b];
      for (uint32_t r = begin[b]; r < begin[b + 1]; ++r) local[r] = r - begin[b], points[r - begin[b]] = order[r];
      for (uint32_t n = 0; n < nhalo; ++n) local[halo[n]] = owned + n, points[owned + n] = order[halo[n]];

      Block &out = block[b];
      out.owned = owned, out.local = owned + nhalo, out.point = points;
      out.p = p.data() + 8 * size_t(slot_begin[b]), out.f = f.data() + 4 * size_t(slot_begin[b]);
      out.weight = slot_weight.data() + slot_begin[b];
      out.quad = quad.data() + quads_at, out.stiffness = stiffness.data() + 4 * quads_at, out.rest = rest.data() + 4 * quads_at;
      for (uint32_t r = begin[b]; r < begin[b + 1]; ++r)
        for (uint32_t s = rows.begin[r]; s < rows.begin[r + 1]; s += 4) {
          Quad &q = quad[quads_at];
          q.i = local[r];
          for (uint32_t n = 0; n < 4; ++n) {  // filled up with the row's first end: no stiffness, and no point of another row
            const bool real = s + n < rows.begin[r + 1];
            const uint32_t e = rows.edge[real ? s + n : rows.begin[r]];
            q.j[n] = local[high(e)];
            spring_edge[4 * quads_at + n] = real ? e : kNone;
            rest[4 * quads_at + n] = real ? edge_length[e] : 0;
          }
          ++quads_at;
        }
      if (quads_at % 2) {  // the widest kernel takes two quads at a time
        quad[quads_at] = quad[quads_at - 1];
        std::fill_n(spring_edge.data() + 4 * quads_at, 4, kNone);
        ++quads_at;
      }
      out.quads = uint32_t(quad.data() + quads_at - out.quad);

      out.cell = cell.data() + cells_at, out.bulk = bulk.data() + cells_at, out.volume6 = volume6.data() + cells_at;
      out.cells = (cell_begin[b + 1] - cell_begin[b] + 7) / 8 * 8;
      for (uint32_t n = 0; n < out.cells; ++n, ++cells_at) {
        const uint32_t rank_of = n;
        const bool real = cell_begin[b] + rank_of < cell_begin[b + 1];
        const uint32_t c = cell_order[real ? cell_begin[b] + rank_of : cell_begin[b]];
        for (int a = 0; a < 4; ++a) cell[cells_at].p[a] = local[rank[cells[4 * size_t(c) + a]]];
        cell_id[cells_at] = real ? c : kNone;
        volume6[cells_at] = cell_volume6[c];
      }
    }
    if (pass == 0) {
      point.create(host, slot_begin[nblock]);
      slot_weight.create(host, slot_begin[nblock]);
      p.create(host, 8 * size_t(slot_begin[nblock])), f.create(host, 4 * size_t(slot_begin[nblock]));
    }
  }

  // Halo sums by owner, sources in block order: the order of the sums is the mesh's, never the threads'.
  for (uint32_t b = 0; b < nblock; ++b)
    for (uint32_t n = block[b].owned; n < block[b].local; ++n) ++merge_begin[block_of[rank[block[b].point[n]]] + 1];
  for (uint32_t b = 0; b < nblock; ++b) merge_begin[b + 1] += merge_begin[b];
  merge.create(host, merge_begin[nblock]);
  Buffer<uint32_t> at;
  at.create(host, nblock);
  std::copy(merge_begin.data(), merge_begin.data() + nblock, at.data());
  for (uint32_t b = 0; b < nblock; ++b)
    for (uint32_t n = block[b].owned; n < block[b].local; ++n) {
      const uint32_t r = rank[block[b].point[n]], owner = block_of[r];
      merge[at[owner]++] = {slot_begin[b] + n, slot_begin[owner] + (r - begin[owner])};
    }
}

void Body::create(const dfm_host *h, const dfm_mesh &m) {
  host = h, kernels = choose_kernels(h);
  take_mesh(m);
  build_blocks();
  apply_params(m.params);
}

void Body::apply_params(const double *values) {
  std::copy(values, values + kParamCount, params);
  const double scale = spring_scale_of_shape(), ratio = volume_ratio();
  const Block &last = block[nblock - 1];
  const size_t nspring = 4 * size_t(last.quad + last.quads - quad.data()), ncells = size_t(last.cell + last.cells - cell.data());
  for (size_t s = 0; s < nspring; ++s) stiffness[s] = spring_edge[s] == kNone ? 0 : scale * shape[spring_edge[s]];
  for (size_t c = 0; c < ncells; ++c) {
    const double v0 = __builtin_fabs(volume6[c]) / 6;
    const double side = cell_id[c] == kNone ? 0 : edge_length[cell_edge[6 * size_t(cell_id[c])]];
    // A cell that is flat at rest has no volume to keep.
    bulk[c] = cell_id[c] != kNone && v0 > 1e-12 * side * side * side ? ratio * young_of(cell_id[c]) / (36 * v0) : 0;
  }
  find_weights();
}

}  // namespace msm
