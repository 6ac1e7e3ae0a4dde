#include "mesh/raw_mesh.h"

#include <algorithm>

namespace dfm {
namespace {

constexpr uint32_t kMaxGroups = 1u << 16;  // a file cannot make us keep more names than this

}  // namespace

uint32_t RawMesh::group(const Cursor &at, int32_t dimension, int32_t tag) {
  if (tag == 0) return kNoGroup;
  const auto [entry, fresh] = group_index_.try_emplace({dimension, tag}, uint32_t(groups.size()));
  if (fresh) {
    if (groups.size() == kMaxGroups) at.refuse("more than %u groups", kMaxGroups);
    groups.push_back(
        {std::to_string(tag), dimension, tag, Array<uint32_t>(HookAllocator<uint32_t>(*memory))});
  }
  return entry->second;
}

uint32_t RawMesh::named_group(const Cursor &at, int32_t dimension, std::string_view name) {
  if (name.empty()) return kNoGroup;
  const auto known = name_index_.find(name);
  if (known != name_index_.end()) return known->second;
  const uint32_t made = group(at, dimension, static_cast<int32_t>(groups.size()) + 1);
  groups[made].name = name;
  name_index_.emplace(name, made);
  return made;
}

void RawMesh::expect_tets(size_t n) {
  if (n >= kMaxTets) return;  // add_tet says so
  const size_t cells = ntet() + n;
  if (tets.capacity() >= 4 * cells) return;
  // many small blocks still cost linear time
  const size_t room = tets.empty() ? cells : std::max(cells, 2 * size_t(ntet()));
  tets.reserve(4 * room);
  tet_group.reserve(room);
}

void RawMesh::add_tet(const Cursor &at, const uint32_t corners[4], uint32_t in_group) {
  if (tet_group.size() == kMaxTets - 1) at.unsupported("more than %u tetrahedra", kMaxTets - 1);
  tets.insert(tets.end(), corners, corners + 4);
  tet_group.push_back(in_group);
}

void RawMesh::add_triangle(const Cursor &at, uint32_t a, uint32_t b, uint32_t c, uint32_t in_group) {
  if (tri_group.size() == kMaxTris - 1) at.unsupported("more than %u triangles", kMaxTris - 1);
  tris.insert(tris.end(), {a, b, c});
  tri_group.push_back(in_group);
}

void RawMesh::add_polygon(const Cursor &at, const uint32_t *corners, size_t n, uint32_t in_group) {
  for (size_t k = 2; k < n; ++k) add_triangle(at, corners[0], corners[k - 1], corners[k], in_group);
  if (in_group != kNoGroup)
    groups[in_group].points.insert(groups[in_group].points.end(), corners, corners + n);
}

void RawMesh::add_strip(const Cursor &at, const uint32_t *corners, size_t n, uint32_t in_group) {
  for (size_t k = 2; k < n; ++k) {
    const bool turned = k % 2 != 0;
    add_triangle(at, corners[k - 2], corners[k - !turned], corners[k - turned], in_group);
  }
  if (in_group != kNoGroup)
    groups[in_group].points.insert(groups[in_group].points.end(), corners, corners + n);
}

uint32_t point_count(const Cursor &at, uint64_t n, const char *what) {
  if (n > kMaxPoints) at.unsupported("%llu %s; up to %u are read", ull(n), what, kMaxPoints);
  return uint32_t(n);
}

}  // namespace dfm
