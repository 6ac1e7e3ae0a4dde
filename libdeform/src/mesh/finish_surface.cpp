// Turns separate triangles into an oriented surface. Order matters: coincident points are merged (an STL file
// repeats every corner), which makes neighbors, and so are rims that differ by rounding; triangles without
// area are removed, and if one is flat along a side of a neighbor, that neighbor is split, so that no slit
// opens; duplicates are removed; the rest is oriented consistently and outward. Nothing else is closed, and
// nothing is smoothed. All thresholds are relative.
#include <algorithm>
#include <array>
#include <bit>
#include <cfloat>
#include <cmath>
#include <unordered_map>

#include "core/disjoint_sets.h"
#include "core/error.h"
#include "core/lists.h"
#include "deform/plugin.h"
#include "math/vec3.h"
#include "mesh/faces.h"
#include "mesh/finish.h"
#include "mesh/topology_tri.h"

namespace dfm {
namespace {

constexpr int kSplitRounds = 16;  // a flat triangle next to a flat one waits for the next round

struct Repairs { uint32_t same = 0, rim = 0, split = 0, flat = 0, doubles = 0, walls = 0, twisted = 0; };
using Corners3 = std::array<uint32_t, 3>;

uint32_t count(const RawMesh &raw) { return uint32_t(raw.tris.size() / 3); }
const uint32_t *corners(const RawMesh &raw, uint32_t t) { return &raw.tris[3 * size_t(t)]; }

Corners3 sorted_corners(const uint32_t *c) {
  Corners3 key{c[0], c[1], c[2]};
  std::sort(key.begin(), key.end());
  return key;
}

// ---- points at one place ----------------------------------------------------------------------------------

uint64_t place_hash(const double *p) {
  uint64_t h = 0;
  for (int k = 0; k < 3; ++k) {  // splitmix64; + 0.0 makes the two zeros one
    h = (h ^ std::bit_cast<uint64_t>(p[k] + 0.0)) * 0x9e3779b97f4a7c15u;
    h = (h ^ h >> 30) * 0xbf58476d1ce4e5b9u;
    h ^= h >> 27;
  }
  return h;
}

// Every used point is replaced by the first used one at exactly the same place. Open addressing in file
// order, so the result is unique.
uint32_t merge_points(RawMesh &raw) {
  const uint32_t n = raw.npoint();
  Array<uint32_t> into(n, kNoGroup, *raw.memory);
  for (const uint32_t p : raw.tets) into[p] = p;
  for (const uint32_t p : raw.tris) into[p] = p;
  Array<uint32_t> table(std::bit_ceil(2 * size_t(n) + 1), kNoGroup, *raw.memory);
  const size_t mask = table.size() - 1;
  uint32_t merged = 0;
  for (uint32_t p = 0; p < n; ++p) {
    if (into[p] == kNoGroup) continue;
    const double *x = &raw.points[3 * size_t(p)];
    size_t slot = place_hash(x) & mask;
    while (table[slot] != kNoGroup && !std::equal(x, x + 3, &raw.points[3 * size_t(table[slot])]))
      slot = (slot + 1) & mask;
    if (table[slot] == kNoGroup) {
      table[slot] = p;
    } else {
      into[p] = table[slot];
      ++merged;
    }
  }
  for (uint32_t &p : raw.tets) p = into[p];
  for (uint32_t &p : raw.tris) p = into[p];
  return merged;
}

// ---- rims that differ by rounding -------------------------------------------------------------------------

// Programs that compute a seam or a pole twice write coordinates that differ in the last digits: of a double,
// of a single, or of a text with six digits (1e-5 of the value at most). A gap as narrow as that is no
// opening. Only points on open edges are merged, within 1e-5 of the largest coordinate and a thousandth of
// the edges there, so that no shape is lost. The first point of a place, in file order, is looked up.
constexpr double kRounding = 1e-5, kOfEdge = 1e-3;

class Rims {
 public:
  explicit Rims(RawMesh &raw) : raw_(raw) {}

  uint32_t merge() {
    const Array<TriEdge> all = sorted_edges(*raw_.memory, count(raw_), raw_.tris.data());
    const Array<uint64_t> edges = open_edges(all);
    double reach = 0, longest = 0;
    for (const uint64_t e : edges) {
      longest = std::max(longest, distance(first_end(e), second_end(e)));
      for (const uint32_t p : {first_end(e), second_end(e)})
        for (int k = 0; k < 3; ++k) reach = std::max(reach, std::fabs(raw_.points[3 * size_t(p) + k]));
    }
    width_ = std::min(kRounding * reach, kOfEdge * longest);
    if (!(width_ > 0)) return 0;
    find_ends(edges, all);
    uint32_t merged = 0;
    std::unordered_map<uint32_t, uint32_t> into;
    std::unordered_multimap<uint64_t, uint32_t> first;  // by cell of a grid of that width
    std::vector<uint32_t> rim;
    for (const auto &[p, length] : open_) rim.push_back(p);
    std::sort(rim.begin(), rim.end());
    for (const uint32_t p : rim) {
      const uint32_t q = same_place(first, p);
      if (q == kNoGroup) {
        first.emplace(cell_of(p, {}), p);
      } else {
        into[p] = q;
        ++merged;
      }
    }
    for (uint32_t &p : raw_.tris)
      if (const auto found = into.find(p); found != into.end()) p = found->second;
    return merged;
  }

 private:
  static uint32_t first_end(uint64_t edge) { return uint32_t(edge >> 32); }
  static uint32_t second_end(uint64_t edge) { return uint32_t(edge); }

  Array<uint64_t> open_edges(const Array<TriEdge> &edges) const {
    Array<uint64_t> out{*raw_.memory};
    for (size_t i = 0, j = 0; i < edges.size(); i = j) {
      while (j < edges.size() && edges[j].key == edges[i].key) ++j;
      if (j - i == 1 && first_end(edges[i].key) != second_end(edges[i].key)) out.push_back(edges[i].key);
    }
    return out;
  }

  // Their ends, with the shortest of all edges there that is longer than rounding, or the longest.
  void find_ends(const Array<uint64_t> &open, const Array<TriEdge> &all) {
    for (const uint64_t e : open)
      for (const uint32_t p : {first_end(e), second_end(e)}) open_.try_emplace(p, 0);
    for (const TriEdge &e : all) {
      const double length = distance(first_end(e.key), second_end(e.key));
      for (const uint32_t p : {first_end(e.key), second_end(e.key)}) {
        const auto at = open_.find(p);
        if (at == open_.end()) continue;
        double &edge = at->second;
        if (edge <= width_ ? length > edge : length > width_ && length < edge) edge = length;
      }
    }
  }

  double distance(uint32_t a, uint32_t b) const {  // of the coordinates: a sum of squares may overflow
    double most = 0;
    for (int k = 0; k < 3; ++k)
      most = std::max(most, std::fabs(raw_.points[3 * size_t(a) + k] - raw_.points[3 * size_t(b) + k]));
    return most;
  }

  uint64_t cell_of(uint32_t p, const std::array<int, 3> &shift) const {
    double at[3];
    for (int k = 0; k < 3; ++k) at[k] = std::floor(raw_.points[3 * size_t(p) + k] / width_) + shift[k];
    return place_hash(at);
  }

  // Cells of one hash may be different cells: the distance decides, and among several the first point.
  uint32_t same_place(const std::unordered_multimap<uint64_t, uint32_t> &first, uint32_t p) const {
    uint32_t best = kNoGroup;
    for (int i = 0; i < 27; ++i) {
      const auto [begin, end] = first.equal_range(cell_of(p, {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1}));
      for (auto it = begin; it != end; ++it) {
        const uint32_t q = it->second;
        const double edge = std::min(open_.at(p), open_.at(q));
        if (q < best && distance(p, q) <= std::min(width_, kOfEdge * edge)) best = q;
      }
    }
    return best;
  }

  RawMesh &raw_;
  double width_ = 0;
  std::unordered_map<uint32_t, double> open_;
};

// ---- boundary of cells ------------------------------------------------------------------------------------

// The file's own triangles stay only as the groups of the boundary's. Returns how many points lie inside.
uint32_t take_boundary(RawMesh &raw) {
  raw.tet_group.resize(raw.tets.size() / 4, kNoGroup);
  drop_duplicate_cells(raw);
  for (size_t t = 0; t < raw.tets.size(); t += 4)
    if (tet_volume(raw.points.data(), &raw.tets[t]) < 0) std::swap(raw.tets[t + 2], raw.tets[t + 3]);
  std::vector<std::pair<Corners3, uint32_t>> skin;
  for (uint32_t t = 0; t < count(raw); ++t)
    if (raw.tri_group[t] != kNoGroup) skin.emplace_back(sorted_corners(corners(raw, t)), raw.tri_group[t]);
  std::sort(skin.begin(), skin.end());
  raw.tris = boundary_triangles(raw.tets);
  raw.tri_group.assign(count(raw), kNoGroup);
  for (uint32_t t = 0; t < count(raw); ++t) {
    const std::pair<Corners3, uint32_t> key{sorted_corners(corners(raw, t)), 0};
    const auto found = std::lower_bound(skin.begin(), skin.end(), key);
    if (found != skin.end() && found->first == key.first) raw.tri_group[t] = found->second;
  }
  Array<uint8_t> inner(raw.npoint(), 0, *raw.memory);
  for (const uint32_t p : raw.tets) inner[p] = 1;
  for (const uint32_t p : raw.tris) inner[p] = 0;
  use_memory(*raw.memory, raw.cells, raw.tets, raw.tet_group, raw.share, raw.inside);
  return uint32_t(std::count(inner.begin(), inner.end(), 1));
}

// ---- triangles without area -------------------------------------------------------------------------------

bool has_double_corner(const uint32_t *c) { return c[0] == c[1] || c[1] == c[2] || c[2] == c[0]; }

// An altitude below a few roundings of the coordinates is meaningless. Relative to the longest edge, so that
// no product overflows.
bool is_flat(const RawMesh &raw, const uint32_t *c) {
  const auto [a, b, d] = corners_of(raw.points.data(), c);
  double longest = 0, reach = 0;
  for (int k = 0; k < 3; ++k) {
    longest = std::max({longest, std::fabs(b[k] - a[k]), std::fabs(d[k] - a[k]), std::fabs(d[k] - b[k])});
    reach = std::max({reach, std::fabs(a[k]), std::fabs(b[k]), std::fabs(d[k])});
  }
  const Vec3 u{(b.x - a.x) / longest, (b.y - a.y) / longest, (b.z - a.z) / longest};
  const Vec3 v{(d.x - a.x) / longest, (d.y - a.y) / longest, (d.z - a.z) / longest};
  return !(norm(cross(u, v)) > 8 * DBL_EPSILON * (1 + reach / longest));  // also where longest is 0
}

uint32_t longest_edge(const RawMesh &raw, uint32_t t) {
  uint32_t best = 3 * t;
  double length = -1;
  for (uint32_t h = 3 * t; h < 3 * t + 3; ++h) {
    const double l = norm2(load3(&raw.points[3 * size_t(raw.tris[next_half_edge(h)])]) -
                           load3(&raw.points[3 * size_t(raw.tris[h])]));
    if (l > length) {
      length = l;
      best = h;
    }
  }
  return best;
}

//        d                 d
//       / \               /|\        the flat triangle a b c and its neighbor c a d
//      /   \     ->      / | \       become a b d and b c d
//     a--b--c           a--b--c
uint32_t split_beside_flat(RawMesh &raw) {
  uint32_t split = 0, before = UINT32_MAX;
  for (int round = 0; round < kSplitRounds && before != split; ++round) {
    before = split;
    const uint32_t n = count(raw);
    Array<uint8_t> skip(n, 0, *raw.memory);  // flat, or changed in this round
    Array<uint32_t> flat{*raw.memory};
    for (uint32_t t = 0; t < n; ++t)
      if (is_flat(raw, corners(raw, t))) {
        skip[t] = 1;
        flat.push_back(t);
      }
    if (flat.empty()) break;
    const Array<uint32_t> twin = edge_twins(*raw.memory, sorted_edges(*raw.memory, n, raw.tris.data()));
    for (const uint32_t t : flat) {
      const uint32_t h = longest_edge(raw, t);
      const uint32_t a = raw.tris[h];
      const uint32_t c = raw.tris[next_half_edge(h)];
      const uint32_t b = raw.tris[previous_half_edge(h)];
      if (twin[h] >= kCrowdedEdge || skip[twin[h] / 3]) continue;
      const uint32_t u = twin[h] / 3;
      Corners3 first, second;
      for (int k = 0; k < 3; ++k) {
        const uint32_t p = corners(raw, u)[k];
        first[k] = p == c ? b : p;
        second[k] = p == a ? b : p;
      }
      if (has_double_corner(first.data()) || is_flat(raw, first.data()) || is_flat(raw, second.data()))
        continue;
      std::copy_n(first.data(), 3, &raw.tris[3 * size_t(u)]);
      std::copy_n(second.data(), 3, &raw.tris[3 * size_t(t)]);
      raw.tri_group[t] = raw.tri_group[u];
      skip[u] = 1;
      ++split;
    }
  }
  return split;
}

// ---- doubles ----------------------------------------------------------------------------------------------

// Duplicate triangles are either listed twice, or a wall between two touching pieces, which is inside and
// must be removed. They differ at their rim: across it a triangle listed twice has one neighbor, a wall two.
// A sheet that is doubled everywhere keeps one side.
class Walls {
 public:
  Walls(const RawMesh &raw, const Array<uint8_t> &drop, const Array<uint8_t> &twice)
      : patches_(*raw.memory, count(raw)), wall_(count(raw)), not_wall_(count(raw)) {
    const Array<TriEdge> edges = sorted_edges(*raw.memory, count(raw), raw.tris.data());
    for (int pass = 0; pass < 2; ++pass)  // patches first, then what their rims say
      for (size_t i = 0, j = 0; i < edges.size(); i = j) {
        uint32_t first = kNoGroup, others = 0;
        for (; j < edges.size() && edges[j].key == edges[i].key; ++j) {
          const uint32_t t = edges[j].half / 3;
          if (drop[t]) continue;
          if (!twice[t]) ++others;
          else if (first == kNoGroup) first = t;
          else if (pass == 0) patches_.join(first, t);
        }
        if (pass == 1 && first != kNoGroup && others > 0)
          (others % 2 ? not_wall_ : wall_)[patches_.root(first)] = 1;
      }
  }
  bool is_wall(uint32_t t) { return wall_[patches_.root(t)] && !not_wall_[patches_.root(t)]; }

 private:
  DisjointSets patches_;
  std::vector<uint8_t> wall_, not_wall_;
};

void drop_doubles(RawMesh &raw, Repairs &done) {
  const uint32_t n = count(raw);
  std::vector<std::pair<Corners3, uint32_t>> keys;
  keys.reserve(n);
  for (uint32_t t = 0; t < n; ++t) keys.emplace_back(sorted_corners(corners(raw, t)), t);
  std::sort(keys.begin(), keys.end());
  Array<uint8_t> drop(n, 0, *raw.memory), twice = drop;
  for (size_t i = 0, j = 0; i < keys.size(); i = j) {
    while (j < keys.size() && keys[j].first == keys[i].first) ++j;
    for (size_t k = i + 1; k < j; ++k) {
      drop[keys[k].second] = 1;
      ++done.doubles;
    }
    twice[keys[i].second] = (j - i) % 2 == 0;
  }
  if (done.doubles == 0) return;
  Walls walls(raw, drop, twice);
  for (uint32_t t = 0; t < n; ++t)
    if (twice[t] && walls.is_wall(t)) {
      drop[t] = 1;
      ++done.walls;
    }
  done.doubles -= done.walls;  // both triangles of a wall are removed
  keep_triangles(raw, [&](uint32_t t) { return !drop[t]; });
}

// ---- numbers and groups -----------------------------------------------------------------------------------

void renumber(RawMesh &raw, uint32_t inner) {
  const uint32_t npoint = raw.npoint();
  const Array<uint32_t> number = keep_points(raw, raw.tris);
  for (uint32_t &p : raw.tris) p = number[p];
  raw.dropped_points = npoint - raw.merged_points - inner - raw.npoint();
}

// Groups that triangles carry, by number; their points are those of the triangles, not of the
// file's elements.
void keep_used_groups(RawMesh &raw) {
  std::vector<uint32_t> used(raw.tri_group.begin(), raw.tri_group.end());
  sort_unique(used);
  std::erase(used, kNoGroup);
  for (MeshGroup &group : raw.groups) {
    group.dimension = 2;
    use_memory(*raw.memory, group.points);
  }
  keep_groups(raw, std::move(used));
  add_to_groups(raw.groups, raw.tri_group, raw.tris);
}

// ---- what was done ----------------------------------------------------------------------------------------

void add_warnings(RestMesh &mesh, const Repairs &done) {
  const auto warn = [&](const std::string &text) { mesh.warnings.push_back(text); };
  const dfm_mesh_info s = mesh_statistics(mesh);
  add_count(mesh.warnings, done.same, "point", "", "merged with another at exactly the same place");
  add_count(mesh.warnings, done.rim, "point", " on open edges",
            "merged with another that differs by rounding only");
  add_count(mesh.warnings, done.split, "triangle", " without area", "taken up by splitting the neighbor");
  add_count(mesh.warnings, done.flat, "triangle", " without area", "dropped");
  add_count(mesh.warnings, done.doubles, "duplicate triangle", "", "dropped");
  add_count(mesh.warnings, done.walls, "pair", " of triangles where two pieces touch",
            "dropped, so the pieces are one");
  add_count(mesh.warnings, mesh.dropped_points, "point", " that no triangle uses", "dropped");
  if (mesh.turned)
    warn(format("%u of %u triangles faced the wrong way and %s turned", mesh.turned, s.ntriangle,
                was_were(mesh.turned)));
  if (done.twisted)
    warn(format("%u piece%s no two sides (like a Moebius strip) and %s left as in the file", done.twisted,
                done.twisted == 1 ? " has" : "s have", was_were(done.twisted)));
  if (s.open_edges)
    warn(format("the surface is open: %u edge%s with one triangle around %u hole%s", s.open_edges,
                plural(s.open_edges), s.holes, plural(s.holes)));
  if (s.nonmanifold_edges)
    warn(format("%u edge%s %s used by more than two triangles", s.nonmanifold_edges,
                plural(s.nonmanifold_edges), is_are(s.nonmanifold_edges)));
  if (const std::string coarse = coarse_coordinates(s.lo, s.hi, s.edge_min); !coarse.empty()) warn(coarse);
}

}  // namespace

RestMesh finish_surface(const std::string &path, RawMesh &&raw) {
  if (raw.tris.empty() && raw.tets.empty())
    fail(DFM_E_FORMAT, "%s: no triangles; a surface needs triangles, or polygons to cut into them",
         path.c_str());
  if (raw.tris.size() >= kCrowdedEdge)
    fail(DFM_E_UNSUPPORTED, "%s: %zu triangles; at most %u are possible", path.c_str(), raw.tris.size() / 3,
         kCrowdedEdge / 3);
  check_points(path, raw.points);
  raw.tri_group.resize(count(raw), kNoGroup);
  Repairs done;
  raw.merged_points = merge_points(raw);
  if (!raw.own_corners) done.same = raw.merged_points;
  if (raw.tets.empty()) raw.merged_points += done.rim = Rims(raw).merge();
  const uint32_t inner = raw.tets.empty() ? 0 : take_boundary(raw);

  const uint32_t given = count(raw);
  done.flat = keep_triangles(raw, [&](uint32_t t) { return !has_double_corner(corners(raw, t)); });
  done.split = split_beside_flat(raw);
  done.flat += keep_triangles(raw, [&](uint32_t t) { return !is_flat(raw, corners(raw, t)); });
  drop_doubles(raw, done);
  if (raw.tris.empty())
    fail(DFM_E_FORMAT,
         "%s: all %u triangles are without area or cancel each other; a surface needs triangles with three "
         "corners apart",
         path.c_str(), given);
  raw.dropped_cells = given - count(raw);
  renumber(raw, inner);
  keep_used_groups(raw);
  raw.turned = orient_triangles(*raw.memory, raw.points, raw.tris, &done.twisted);
  raw.cell = DFM_CELL_TET;  // as of every mesh without cells
  add_warnings(raw, done);
  return std::move(raw);
}

}  // namespace dfm
