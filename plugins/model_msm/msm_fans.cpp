#include "msm_fans.h"

#include "../model_common/edges.h"

namespace msm {
namespace {

constexpr uint32_t kMaxAround = 64;  // cells around an edge that are considered together
constexpr uint32_t kTogether = 64;   // fans that may change places, so that those of a group are as long

// Cells of one block at a time.
class Finder {
 public:
  // memory for the largest block
  explicit Finder(const Body &body);
  // Fills `out` with the fans of block n, which are at most as many as its cells; returns how many.
  uint32_t find(uint32_t n, Fan *out);

 private:
  struct Around { uint32_t edge, slot; };
  struct Side { uint32_t from, to; };  // of the ring
  const Body &body_;
  Buffer<Around> around_;  // cells by edge
  Buffer<uint8_t> taken_;  // by place in the block
  uint32_t first_ = 0;     // place of the block's first cell
  Side side_of(uint32_t slot, uint32_t a, uint32_t b) const;
  uint32_t longest(const Around *cells, uint32_t n, uint32_t a, uint32_t b, Fan &fan) const;
};

Finder::Finder(const Body &body) : body_(body) {
  uint32_t most = 0;
  for (uint32_t n = 0; n < body.nblock; ++n) most = std::max(most, body.block[n].cells);
  around_.create_raw(body.host, 6 * size_t(most));
  taken_.create_raw(body.host, most);
}

// The two points of a cell beside a and b, so that a, b, from, to is an even permutation of its list.
Finder::Side Finder::side_of(uint32_t slot, uint32_t a, uint32_t b) const {
  const uint16_t *p = body_.cell[slot].p;
  int at[4], n = 2;
  for (int k = 0; k < 4; ++k) {
    if (p[k] == a) at[0] = k;
    else if (p[k] == b) at[1] = k;
    else at[n++] = k;
  }
  int swaps = 0;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j) swaps += at[j] > at[i];
  return swaps % 2 ? Side{p[at[3]], p[at[2]]} : Side{p[at[2]], p[at[3]]};
}

// The longest row of cells around an edge that are in no fan yet, each beginning where the last one ends.
uint32_t Finder::longest(const Around *cells, uint32_t n, uint32_t a, uint32_t b, Fan &fan) const {
  Side side[kMaxAround];
  uint32_t slot[kMaxAround], free = 0;
  for (uint32_t k = 0; k < n && free < kMaxAround; ++k) {
    if (taken_[cells[k].slot - first_]) continue;
    slot[free] = cells[k].slot;
    side[free++] = side_of(cells[k].slot, a, b);
  }
  fan.cells = 0;
  for (uint32_t start = 0; start < free; ++start) {
    Fan row;
    row.ring[0] = side[start].from;
    row.cells = 0;
    uint64_t used = 0;
    for (uint32_t at = start; at < free && row.cells < kMaxInFan;) {
      used |= uint64_t(1) << at;
      row.slot[row.cells++] = slot[at];
      row.ring[row.cells] = side[at].to;
      const uint32_t end = side[at].to;
      for (at = 0; at < free && ((used >> at & 1) || side[at].from != end);) ++at;
    }
    if (row.cells > fan.cells) fan = row;
  }
  fan.a = a;
  fan.b = b;
  fan.springs = 0;
  return fan.cells;
}

uint32_t Finder::find(uint32_t n, Fan *out) {
  const Block &b = body_.block[n];
  first_ = uint32_t(b.cell - body_.cell.data());
  uint32_t entries = 0, found = 0;
  for (uint32_t slot = first_; slot < first_ + b.cells; ++slot) {
    taken_[slot - first_] = body_.cell_id[slot] == Body::kNone;
    for (uint32_t k = 0; k < 6 && !taken_[slot - first_]; ++k)
      around_[entries++] = {body_.cell_edge[6 * size_t(body_.cell_id[slot]) + k], slot};
  }
  std::sort(around_.data(), around_.data() + entries, [](const Around &i, const Around &j) {
    return i.edge != j.edge ? i.edge < j.edge : i.slot < j.slot;
  });
  // the longest first: what is left of the others is shorter
  for (uint32_t wanted = kMaxInFan; wanted > 0; --wanted)
    for (uint32_t begin = 0, end; begin < entries; begin = end) {
      const uint32_t edge = around_[begin].edge;
      for (end = begin; end < entries && around_[end].edge == edge;) ++end;
      if (end - begin < wanted) continue;
      // the ends as the first cell has them
      const uint32_t slot = around_[begin].slot, *own = &body_.cell_edge[6 * size_t(body_.cell_id[slot])];
      const auto *ends = model::kEdgeOf[std::find(own, own + 6, edge) - own];
      const uint32_t p = body_.cell[slot].p[ends[0]], q = body_.cell[slot].p[ends[1]];
      Fan fan;
      while (longest(&around_[begin], end - begin, std::min(p, q), std::max(p, q), fan) >= wanted) {
        for (uint32_t k = 0; k < fan.cells; ++k) taken_[fan.slot[k] - first_] = 1;
        out[found++] = fan;
      }
    }
  return found;
}

bool before(const Fan &i, const Fan &j) {
  return i.a != j.a ? i.a < j.a : i.b != j.b ? i.b < j.b : i.ring[0] < j.ring[0];
}

// The other way round: b a, and the ring backwards.
void turn(Fan &fan) {
  std::swap(fan.a, fan.b);
  std::reverse(fan.ring, fan.ring + fan.cells + 1);
  std::reverse(fan.slot, fan.slot + fan.cells);
}

}  // namespace

Fans::Fans(const Body &body) {
  all.create_raw(body.host, body.cell_slots());
  begin.create(body.host, size_t(body.nblock) + 1);
  Finder finder(body);
  for (uint32_t n = 0; n < body.nblock; ++n) {
    begin[n + 1] = begin[n] + finder.find(n, all.data() + begin[n]);
    std::sort(all.data() + begin[n], all.data() + begin[n + 1], before);
  }
  place_springs(body);
  add_rest(body);
}

// Each spring once: where it is an axis, then where it leads from a to the ring; a is the end that has more
// of those.
void Fans::place_springs(const Body &body) {
  placed_.create(body.host, body.nedge);
  const auto edge = [&](uint32_t n, uint32_t i, uint32_t j) {
    const uint32_t *point = body.block[n].point;
    return model::find_edge(body.edges.data(), body.nedge, point[i], point[j]);
  };
  const auto each = [&](const auto &use) {
    for (uint32_t n = 0; n < body.nblock; ++n)
      for (uint32_t k = begin[n]; k < begin[n + 1]; ++k) use(n, all[k]);
  };
  const auto put = [&](Fan &fan, uint32_t e, uint32_t bit) {
    if (!placed_[e]) fan.springs |= 1u << bit;
    placed_[e] = 1;
  };
  each([&](uint32_t n, Fan &fan) { put(fan, edge(n, fan.a, fan.b), 0); });
  each([&](uint32_t n, Fan &fan) {
    int more = 0;
    for (uint32_t k = 0; k <= fan.cells; ++k)
      more += placed_[edge(n, fan.a, fan.ring[k])] - placed_[edge(n, fan.b, fan.ring[k])];
    if (more > 0) turn(fan);
    for (uint32_t k = 0; k <= fan.cells; ++k) put(fan, edge(n, fan.a, fan.ring[k]), 1 + k);
  });
}

// The springs that are left, two that leave the same point together; then neighbors by length.
void Fans::add_rest(const Body &body) {
  const auto each_pair = [&](uint32_t n, const auto &use) {
    const Block &b = body.block[n];
    uint32_t start = 0, end = Body::kNone;
    for (size_t s = 0; s < 4 * size_t(b.quads); ++s) {
      const uint32_t e = b.edge[s], i = b.quad[s / 4].i, j = b.quad[s / 4].j[s % 4];
      if (e == Body::kNone || placed_[e]) continue;
      if (end == Body::kNone) {
        start = i;
        end = j;
        continue;
      }
      if (i == start) {
        use(i, end, j);
        end = Body::kNone;
        continue;
      }
      use(start, end, end);
      start = i;
      end = j;
    }
    if (end != Body::kNone) use(start, end, end);
  };
  size_t more = 0;
  for (uint32_t n = 0; n < body.nblock; ++n) each_pair(n, [&](uint32_t, uint32_t, uint32_t) { ++more; });
  Buffer<Fan> found;
  found.swap(all);
  all.create_raw(body.host, begin[body.nblock] + more);
  for (uint32_t n = 0, from = 0, at = 0; n < body.nblock; ++n) {
    const uint32_t first = at;
    for (; from < begin[n + 1]; ++from) all[at++] = found[from];
    begin[n] = first;
    each_pair(n, [&](uint32_t i, uint32_t j, uint32_t k) {
      Fan fan{0, i, j, {k}, {}, j == k ? 1u : 3u};
      all[at++] = fan;
    });
    if (n + 1 == body.nblock) begin[n + 1] = at;
    std::sort(all.data() + first, all.data() + at, before);
    for (uint32_t k = first; k < at; k += kTogether)
      std::sort(all.data() + k, all.data() + std::min(k + kTogether, at), [](const Fan &i, const Fan &j) {
        return i.cells != j.cells ? i.cells > j.cells : before(i, j);
      });
  }
}

}  // namespace msm
