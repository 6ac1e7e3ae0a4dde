// Shared by the repair of tetrahedral meshes and of surfaces.
#pragma once
#include <algorithm>
#include <string>
#include <vector>

#include "core/error.h"
#include "mesh/raw_mesh.h"

namespace dfm {

inline constexpr double kLargestCoordinate = 1e100;  // m; beyond it squares of lengths overflow

// Keeps the used points, in the file's order: moves them together and fills file_point. Returns their new
// numbers, kNoGroup for the others.
Array<uint32_t> keep_points(RawMesh &raw, const Array<uint32_t> &used);
// Keeps triangles for which keep(number) is true; returns the number of the others.
template <class Keep>
uint32_t keep_triangles(RawMesh &raw, const Keep &keep) {
  uint32_t kept = 0;
  const uint32_t n = uint32_t(raw.tris.size() / 3);
  for (uint32_t t = 0; t < n; ++t)
    if (keep(t)) {
      std::copy_n(&raw.tris[3 * size_t(t)], 3, &raw.tris[3 * size_t(kept)]);
      raw.tri_group[kept++] = raw.tri_group[t];
    }
  raw.tris.resize(3 * size_t(kept));
  raw.tri_group.resize(kept);
  return n - kept;
}
void check_points(const std::string &path, const Array<double> &points);
void sort_once(Array<uint32_t> &points);  // points of a group: ascending, each once
// The points of cells or triangles, of each the group, into their groups.
void add_to_groups(std::vector<MeshGroup> &groups, const Array<uint32_t> &group,
                   const Array<uint32_t> &corners);
// Keeps these groups, by dimension and number, whatever order the file has them in.
void keep_groups(RawMesh &raw, std::vector<uint32_t> kept);
// Drops cells with the same four corners as an earlier cell; returns how many. file_cell (may be null):
// numbers of the kept cells, if any is dropped.
uint32_t drop_duplicate_cells(RawMesh &raw, Array<uint32_t> *file_cell = nullptr);
// Compares the bounding box with the rounding of its coordinates: a warning if they are coarse, else empty.
std::string coarse_coordinates(const double lo[3], const double hi[3], double edge_min);

// Grammar of a counted noun.
inline const char *plural(uint32_t n) { return n == 1 ? "" : "s"; }
inline const char *is_are(uint32_t n) { return n == 1 ? "is" : "are"; }
inline const char *was_were(uint32_t n) { return n == 1 ? "was" : "were"; }
// "2 points on open edges were dropped"; nothing for none.
inline void add_count(std::vector<std::string> &warnings, uint32_t n, const char *what, const char *which,
                      const char *done) {
  if (n) warnings.push_back(format("%u %s%s%s %s %s", n, what, plural(n), which, was_were(n), done));
}

// Turns triangles so that neighbors agree across every edge of two triangles, solid pieces face outward and
// the inner surface of a hollow one into its hole. Returns the number of reoriented triangles; `twisted`
// counts the one-sided pieces (left unchanged).
uint32_t orient_triangles(const Memory &memory, const Array<double> &points, Array<uint32_t> &tris,
                          uint32_t *twisted);

}  // namespace dfm
