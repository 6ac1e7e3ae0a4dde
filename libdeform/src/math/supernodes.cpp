#include "math/nested_dissection.h"
#include "math/supernodes.h"

#include <algorithm>
#include <vector>

#include "core/lists.h"

namespace dfm {

namespace {

constexpr uint32_t kNone = Supernodes::kNone;

struct Graph {  // neighbors of column j that come later, or earlier
  std::vector<uint32_t> begin, other;
};

Graph neighbors(const BlockPattern &pattern, const Array<uint32_t> &place, bool later) {
  Graph g;
  const auto each = [&](auto &&f) {
    for (uint32_t b = 0; b < pattern.nb; ++b) {
      const uint32_t i = place[pattern.ij[2 * size_t{b}]], j = place[pattern.ij[2 * size_t{b} + 1]];
      if (i != j) f(later ? std::min(i, j) : std::max(i, j), later ? std::max(i, j) : std::min(i, j));
    }
  };
  make_lists(pattern.n, each, g.begin, g.other);
  return g;
}

// Elimination tree with compressed paths (Liu 1990, section 5): the parent of a column is the row of the
// first entry below its diagonal.
std::vector<uint32_t> elimination_tree(const Graph &earlier) {
  const uint32_t n = uint32_t(earlier.begin.size() - 1);
  std::vector<uint32_t> parent(n, kNone), ancestor(n, kNone);
  for (uint32_t j = 0; j < n; ++j)
    for (uint32_t e = earlier.begin[j]; e < earlier.begin[j + 1]; ++e)
      for (uint32_t i = earlier.other[e], next; i != kNone && i < j; i = next) {
        next = ancestor[i];
        ancestor[i] = j;
        if (next == kNone) parent[i] = j;
      }
  return parent;
}

// position[j] of column j in postorder: each subtree is contiguous and precedes its root.
std::vector<uint32_t> postorder(const std::vector<uint32_t> &parent) {
  const uint32_t n = uint32_t(parent.size());
  std::vector<uint32_t> size(n, 1), position(n);
  for (uint32_t j = 0; j < n; ++j)
    if (parent[j] != kNone) size[parent[j]] += size[j];
  // The root is the last column of its subtree; its children fill the columns before it, the last child last.
  uint32_t end = n;
  std::vector<uint32_t> room(n);  // end of the range that the children of a column have not filled yet
  for (uint32_t j = n; j-- > 0;) {
    uint32_t &limit = parent[j] == kNone ? end : room[parent[j]];
    position[j] = limit - 1;
    room[j] = limit - 1;
    limit -= size[j];
  }
  return position;
}

// Whether columns may be stored with the rows of their parent. A few stored zeros cost less than many narrow
// panels.
bool worth_merging(uint64_t columns, uint64_t zeros, uint64_t all) {
  const double share = double(zeros) / double(all);
  return columns <= 2 ? share < 0.8 : columns <= 6 ? share < 0.5 : columns <= 16 ? share < 0.2 : share < 0.05;
}

// A supernode while they are found: columns begin..end-1, the rows below them, and the zeros that it stores.
struct Node {
  uint32_t begin, end, zeros;
  std::vector<uint32_t> rows;
};

// Merges the last supernode with its child, if that ends where it begins and the cost falls.
bool merge_last(std::vector<Node> &nodes) {
  if (nodes.size() < 2) return false;
  Node &own = nodes.back();
  const Node &child = nodes[nodes.size() - 2];
  if (child.rows.empty() || child.rows[0] < own.begin || child.rows[0] >= own.end) return false;
  const uint64_t wide = own.end - child.begin, child_wide = child.end - child.begin;
  const uint64_t fresh = child_wide * ((own.end - own.begin) + own.rows.size() - child.rows.size());
  const uint64_t zeros = own.zeros + child.zeros + fresh;
  const uint64_t all = wide * (wide + 1) / 2 + wide * own.rows.size();
  if (fresh && !worth_merging(wide, zeros, all)) return false;
  own.zeros = uint32_t(zeros);
  own.begin = child.begin;
  nodes.erase(nodes.end() - 2);
  return true;
}

// Rows of a column: those of the matrix and those of its children in the elimination tree. later: neighbors
// in the matrix, above: the parent of a column.
std::vector<Node> find_nodes(const Graph &later, const std::vector<uint32_t> &above) {
  const uint32_t n = uint32_t(above.size());
  std::vector<std::vector<uint32_t>> children(n);
  for (uint32_t j = 0; j < n; ++j)
    if (above[j] != kNone) children[above[j]].push_back(j);
  std::vector<Node> nodes;
  std::vector<uint32_t> node_of(n), seen(n, kNone), found;
  const auto add = [&](uint32_t j, uint32_t row) {
    if (row == j || seen[row] == j) return;
    seen[row] = j;
    found.push_back(row);
  };
  for (uint32_t j = 0; j < n; ++j) {
    found.clear();
    for (uint32_t e = later.begin[j]; e < later.begin[j + 1]; ++e) add(j, later.other[e]);
    for (const uint32_t c : children[j])
      for (const uint32_t row : nodes[node_of[c]].rows) add(j, row);
    std::sort(found.begin(), found.end());
    nodes.push_back({j, j + 1, 0, found});
    while (merge_last(nodes)) {}
    for (uint32_t k = nodes.back().begin; k <= j; ++k) node_of[k] = uint32_t(nodes.size() - 1);
  }
  return nodes;
}

}  // namespace

Supernodes::Supernodes(const Memory &memory) {
  use_memory(memory, place, begin, owner, parent, row_begin, rows, relative);
  use_memory(memory, value_begin);
}

void Supernodes::build(const BlockPattern &pattern) {
  std::vector<uint32_t> order(pattern.n);
  minimum_degree(pattern, order.data());
  build(pattern, order.data());
}

void Supernodes::build(const BlockPattern &pattern, const uint32_t *order) {
  const uint32_t n = pattern.n;
  place.resize(n);
  for (uint32_t k = 0; k < n; ++k) place[order[k]] = k;
  const std::vector<uint32_t> position = postorder(elimination_tree(neighbors(pattern, place, false)));
  for (uint32_t i = 0; i < n; ++i) place[i] = position[place[i]];
  const std::vector<uint32_t> above = elimination_tree(neighbors(pattern, place, false));
  const Graph later = neighbors(pattern, place, true);

  const std::vector<Node> nodes = find_nodes(later, above);
  const uint32_t ns = uint32_t(nodes.size());
  begin.resize(size_t{ns} + 1);
  row_begin.resize(size_t{ns} + 1);
  value_begin.resize(size_t{ns} + 1);
  parent.resize(ns);
  owner.resize(n);
  rows.clear();
  begin[0] = row_begin[0] = 0;
  value_begin[0] = 0;
  for (uint32_t s = 0; s < ns; ++s) {
    const Node &node = nodes[s];
    begin[s + 1] = node.end;
    rows.insert(rows.end(), node.rows.begin(), node.rows.end());
    row_begin[s + 1] = uint32_t(rows.size());
    value_begin[s + 1] = value_begin[s] + 9 * size_t{width(s)} * height(s);
    for (uint32_t k = node.begin; k < node.end; ++k) owner[k] = s;
  }
  link_parents();
}

void Supernodes::link_parents() {
  const uint32_t ns = count();
  relative.resize(rows.size());
  stack = 0;
  size_t used = 0;
  std::vector<size_t> held(ns, 0);  // updates of children on the stack
  const auto square = [&](uint32_t s) { return 9 * size_t{below(s)} * below(s); };
  for (uint32_t s = 0; s < ns; ++s) {
    stack = std::max(stack, used + square(s));
    used += square(s) - held[s];
    parent[s] = below(s) ? owner[rows[row_begin[s]]] : kNone;
    if (parent[s] == kNone) continue;
    const uint32_t p = parent[s];
    held[p] += square(s);
    uint32_t k = row_begin[p];
    for (uint32_t e = row_begin[s]; e < row_begin[s + 1]; ++e) {
      if (rows[e] < begin[p + 1]) {
        relative[e] = rows[e] - begin[p];
        continue;
      }
      while (rows[k] != rows[e]) ++k;
      relative[e] = width(p) + k - row_begin[p];
    }
  }
}

}  // namespace dfm
