#include "mesh/raw_mesh.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <span>

#include "math/vec3.h"
#include "mesh/cells.h"

namespace dfm {
namespace {

// Corners of a polygon up to which its ears are looked for, which takes the cube of them at worst.
constexpr size_t kMaxEars = 512;
constexpr double kRounding = 1e-12;  // of areas, of the polygon's

// Whether a triangle of the fan about the first corner is inverted. Needs no memory; called for every polygon
// of a file.
bool fan_folds(const Array<double> &points, const uint32_t *corners, size_t n) {
  const auto at = [&](size_t k) { return load3(&points[3 * size_t{corners[k]}]); };
  const auto twice = [&](size_t k) { return cross(at(k - 1) - at(0), at(k) - at(0)); };
  Vec3 normal;
  for (size_t k = 2; k < n; ++k) normal += twice(k);
  const double least = -kRounding * norm2(normal);
  for (size_t k = 2; k < n; ++k)
    if (dot(normal, twice(k)) < least) return true;
  return false;
}

// A polygon seen along its normal, for which triangles count with their sign.
class Outline {
 public:
  Outline(const Memory &memory, const Array<double> &points, const uint32_t *corners, size_t n)
      : corners_(corners, n), at_(memory), left_(memory) {
    at_.reserve(n);
    for (size_t k = 0; k < n; ++k) at_.push_back(load3(&points[3 * size_t{corners[k]}]));
    for (size_t k = 2; k < n; ++k) normal_ += cross(at_[k - 1] - at_[0], at_[k] - at_[0]);
    least_ = kRounding * norm2(normal_);
  }
  // emit(a, b, c) for corners of the triangles. A self-intersecting polygon may run out of ears: the
  // remainder is cut into a fan.
  template <class Emit>
  void cut(Emit &&emit) {
    left_.resize(at_.size());
    std::iota(left_.begin(), left_.end(), 0u);
    for (size_t at = 1, tried = 0; left_.size() > 3 && tried < left_.size(); ++at, ++tried) {
      const size_t n = left_.size(), k = at % n;
      const uint32_t before = left_[(k + n - 1) % n], next = left_[(k + 1) % n];
      if (!ear(before, left_[k], next)) continue;
      emit(corners_[before], corners_[left_[k]], corners_[next]);
      left_.erase(left_.begin() + std::ptrdiff_t(k));
      at = k;
      tried = 0;
    }
    for (size_t k = 2; k < left_.size(); ++k)
      emit(corners_[left_[0]], corners_[left_[k - 1]], corners_[left_[k]]);
  }

 private:
  double area(uint32_t a, uint32_t b, uint32_t c) const {
    return dot(normal_, cross(at_[b] - at_[a], at_[c] - at_[a]));
  }
  // A triangle with the orientation of the polygon that contains no other corner.
  bool ear(uint32_t a, uint32_t b, uint32_t c) const {
    if (!(area(a, b, c) > least_)) return false;
    return std::none_of(left_.begin(), left_.end(), [&](uint32_t p) {
      const auto is = [&](uint32_t q) { return norm2(at_[p] - at_[q]) == 0; };
      return !is(a) && !is(b) && !is(c) && area(a, b, p) >= -least_ && area(b, c, p) >= -least_ &&
             area(c, a, p) >= -least_;
    });
  }

  std::span<const uint32_t> corners_;
  Array<Vec3> at_;
  Array<uint32_t> left_;
  Vec3 normal_;
  double least_ = 0;
};

}  // namespace

uint32_t RawMesh::group(const Cursor &at, int32_t dimension, int32_t tag) {
  if (tag == 0) return kNoGroup;
  const auto [entry, fresh] = group_index_.try_emplace({dimension, tag}, uint32_t(groups.size()));
  if (fresh) {
    if (groups.size() == kMaxGroups) at.refuse("more than %u groups", kMaxGroups);
    groups.push_back({std::to_string(tag), dimension, tag, Array<uint32_t>(*memory)});
  }
  return entry->second;
}

uint32_t RawMesh::named_group(const Cursor &at, int32_t dimension, std::string_view name) {
  if (name.empty()) return kNoGroup;
  std::pair key(dimension, std::string(name));
  const auto known = name_index_.find(key);
  if (known != name_index_.end()) return known->second;
  const uint32_t made = group(at, dimension, static_cast<int32_t>(groups.size()) + 1);
  groups[made].name = name;
  name_index_.emplace(std::move(key), made);
  return made;
}

void RawMesh::expect_tets(size_t n) {
  if (n >= kMaxTets) return;  // add_cell says so
  const size_t all = ntet() + n;
  if (tets.capacity() >= 4 * all) return;
  // many small blocks still cost linear time
  const size_t room = tets.empty() ? all : std::max(all, 2 * size_t(ntet()));
  tets.reserve(4 * room);
  tet_group.reserve(room);
}

void RawMesh::add_cell(const Cursor &at, uint32_t kind, const uint32_t *nodes, uint32_t in_group) {
  const CellKind &of = cell_kind(kind);
  if (cell && cell != kind)
    at.unsupported("%s beside %s; a body has cells of one kind: write one of them alone", of.name,
                   cell_kind(cell).name);
  cell = kind;
  if (tet_group.size() + of.tets >= kMaxTets) at.unsupported("more than %u tetrahedra", kMaxTets - 1);
  if (of.tets > 1) cells.insert(cells.end(), nodes, nodes + of.nodes);
  tets.resize(tets.size() + 4 * of.tets);
  tets_of(of, nodes, &tets[tets.size() - 4 * of.tets]);
  tet_group.insert(tet_group.end(), of.tets, in_group);
}

void RawMesh::add_triangle(const Cursor &at, uint32_t a, uint32_t b, uint32_t c, uint32_t in_group) {
  if (tri_group.size() == kMaxTris - 1) at.unsupported("more than %u triangles", kMaxTris - 1);
  tris.insert(tris.end(), {a, b, c});
  tri_group.push_back(in_group);
}

void RawMesh::add_polygon(const Cursor &at, const uint32_t *corners, size_t n, uint32_t in_group) {
  const auto add = [&](uint32_t a, uint32_t b, uint32_t c) { add_triangle(at, a, b, c, in_group); };
  const auto known = [&](uint32_t corner) { return corner < npoint(); };
  uint32_t quad[4];
  if (n == 4) {  // as tets_of() cuts the faces of hexahedra
    std::rotate_copy(corners, std::min_element(corners, corners + 4), corners + 4, quad);
    corners = quad;
  }
  const bool small = n > 3 && n <= kMaxEars && std::all_of(corners, corners + n, known);
  if (small && fan_folds(points, corners, n)) Outline(*memory, points, corners, n).cut(add);
  else
    for (size_t k = 2; k < n; ++k) add(corners[0], corners[k - 1], corners[k]);
  keep_points(corners, n, in_group);
}

void RawMesh::add_second_order(const Cursor &at, const uint32_t *nodes, size_t n, uint32_t in_group) {
  const auto add = [&](int a, int b, int c) { add_triangle(at, nodes[a], nodes[b], nodes[c], in_group); };
  const auto add_quadrangle = [&](const std::array<int, 4> &of) {
    uint32_t corners[4];
    for (size_t k = 0; k < 4; ++k) corners[k] = nodes[of[k]];
    add_polygon(at, corners, 4, in_group);
  };
  if (n == 6)
    for (const auto &[a, b, c] : {std::array{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}}) add(a, b, c);
  if (n == 8) {
    for (const auto &[a, b, c] : {std::array{0, 4, 7}, {1, 5, 4}, {2, 6, 5}, {3, 7, 6}}) add(a, b, c);
    add_quadrangle({4, 5, 6, 7});
  }
  if (n == 9)
    for (const auto &of : {std::array{0, 4, 8, 7}, {4, 1, 5, 8}, {8, 5, 2, 6}, {7, 8, 6, 3}})
      add_quadrangle(of);
  keep_points(nodes, n, in_group);
}

void RawMesh::add_strip(const Cursor &at, const uint32_t *corners, size_t n, uint32_t in_group) {
  for (size_t k = 2; k < n; ++k) {
    const bool odd = k % 2 != 0;
    add_triangle(at, corners[k - 2], corners[k - !odd], corners[k - odd], in_group);
  }
  keep_points(corners, n, in_group);
}

void read_corners(Cursor &in, Number type, uint64_t face, int64_t n, uint32_t npoint, Array<uint32_t> &out) {
  if (n < 3) in.refuse("face %llu has %lld corners; expected 3 or more", ull(face), ll(n));
  in.count(n, 1, type, "corners of a face");
  out.clear();
  for (int64_t k = 0; k < n; ++k) {
    const int64_t p = in.integer(type, "a face's vertex");
    if (p < 0 || p >= int64_t(npoint))
      in.refuse("face %llu refers to vertex %lld; the file has vertices 0 to %lld", ull(face), ll(p),
                ll(npoint) - 1);
    out.push_back(static_cast<uint32_t>(p));
  }
}

}  // namespace dfm
