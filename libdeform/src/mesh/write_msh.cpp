// MSH 2.2 and 4.1, binary. Cells keep their order; groups of points and of triangles are written before them,
// as elements of their own.
#include <algorithm>

#include "core/error.h"
#include "core/file.h"
#include "core/names.h"
#include "math/extent.h"
#include "deform/plugin.h"
#include "mesh/cells.h"

namespace dfm {
namespace {

void put_head(AtomicFile &out, const char *version) {
  out.write(std::string("$MeshFormat\n") + version + " 1 8\n");
  out.put<int32_t>(1);
  out.write("\n$EndMeshFormat\n");
}

// Consecutive elements of one group: one block of MSH 4.1. Type 15 is a point, 2 a triangle.
struct Run {
  int32_t dimension, type;
  uint32_t group, corners;
  const uint32_t *points;
  uint64_t n;
  const uint8_t *in_msh;  // mesh/cells.h
  // Corner k of element t, in the file's order.
  uint32_t point(uint64_t t, uint32_t k) const { return points[corners * t + (in_msh ? in_msh[k] : k)]; }
};

void add_runs(std::vector<Run> &runs, int32_t dimension, int32_t type, uint32_t corners,
              const Array<uint32_t> &points, const Array<uint32_t> &group, const uint8_t *in_msh = nullptr) {
  for (size_t t = 0; t < group.size();) {
    size_t end = t + 1;
    while (end < group.size() && group[end] == group[t]) ++end;
    runs.push_back({dimension, type, group[t], corners, &points[corners * t], end - t, in_msh});
    t = end;
  }
}

// Everything that is written, lowest dimension first. Of lines only the points are known, so their
// groups are left out.
std::vector<Run> runs_of(const RestMesh &mesh, const Array<uint32_t> &cell_groups) {
  std::vector<Run> runs;
  for (uint32_t g = 0; g < mesh.groups.size(); ++g) {
    const Array<uint32_t> &points = mesh.groups[g].points;
    if (mesh.groups[g].dimension == 0 && !points.empty())
      runs.push_back({0, 15, g, 1, points.data(), points.size(), nullptr});
  }
  add_runs(runs, 2, 2, 3, mesh.tris, mesh.tri_group);
  const CellKind &kind = cell_kind(mesh.cell);
  add_runs(runs, 3, kind.msh, kind.nodes, mesh.nodes(), cell_groups, kind.in_msh);
  return runs;
}

uint64_t elements(const std::vector<Run> &runs) {
  uint64_t n = 0;
  for (const Run &r : runs) n += r.n;
  return n;
}

// Groups of cells, and of what the runs hold.
std::vector<uint32_t> written_groups(const RestMesh &mesh, const std::vector<Run> &runs) {
  std::vector<uint8_t> written(mesh.groups.size());
  for (uint32_t g = 0; g < written.size(); ++g) written[g] = mesh.groups[g].dimension == 3;
  for (const Run &r : runs)
    if (r.group != kNoGroup) written[r.group] = 1;
  std::vector<uint32_t> out;
  for (uint32_t g = 0; g < written.size(); ++g)
    if (written[g]) out.push_back(g);
  return out;
}

void put_names(AtomicFile &out, const RestMesh &mesh, const std::vector<uint32_t> &groups) {
  if (groups.empty()) return;
  out.write("$PhysicalNames\n" + std::to_string(groups.size()) + "\n");
  for (const uint32_t g : groups)
    out.write(std::to_string(mesh.groups[g].dimension) + " " + std::to_string(mesh.groups[g].tag) + " \"" +
              one_line(mesh.groups[g].name) + "\"\n");
  out.write("$EndPhysicalNames\n");
}

int32_t entity_of(const RestMesh &mesh, uint32_t group) {  // one entity per group, the last for cells without
  return static_cast<int32_t>(group == kNoGroup ? mesh.groups.size() + 1 : group + 1);
}

void put_entities(AtomicFile &out, const RestMesh &mesh, std::vector<uint32_t> groups) {
  const Extent box = extent_of(mesh.points);
  groups.push_back(kNoGroup);
  const auto dimension = [&](uint32_t g) { return g == kNoGroup ? 3 : mesh.groups[g].dimension; };
  out.write("$Entities\n");
  for (int32_t d = 0; d < 4; ++d) {
    const auto n = std::count_if(groups.begin(), groups.end(), [&](uint32_t g) { return dimension(g) == d; });
    out.put(static_cast<uint64_t>(n));
  }
  for (int32_t d = 0; d < 4; ++d)
    for (const uint32_t g : groups) {
      if (dimension(g) != d) continue;
      out.put(entity_of(mesh, g));
      out.write(&box, d == 0 ? sizeof box / 2 : sizeof box);  // of a point once
      out.put<uint64_t>(g != kNoGroup);
      if (g != kNoGroup) out.put(mesh.groups[g].tag);
      if (d > 0) out.put<uint64_t>(0);
    }
  out.write("\n$EndEntities\n");
}

}  // namespace

void write_msh41(const RestMesh &mesh, const std::string &path) {
  AtomicFile out(path);
  const Array<uint32_t> cell_groups = mesh.cell_groups();
  const std::vector<Run> runs = runs_of(mesh, cell_groups);
  const std::vector<uint32_t> groups = written_groups(mesh, runs);
  put_head(out, "4.1");
  put_names(out, mesh, groups);
  put_entities(out, mesh, groups);
  const uint64_t npoint = mesh.npoint(), nelement = elements(runs);
  out.write("$Nodes\n");
  for (const uint64_t n : {uint64_t(1), npoint, uint64_t(1), npoint}) out.put(n);
  out.put<int32_t>(3);
  out.put(entity_of(mesh, mesh.ntet() ? mesh.tet_group[0] : kNoGroup));
  out.put<int32_t>(0);
  out.put(npoint);
  for (uint64_t i = 1; i <= npoint; ++i) out.put(i);
  out.write(mesh.points.data(), mesh.points.size() * sizeof(double));
  out.write("\n$EndNodes\n$Elements\n");
  for (const uint64_t n : {uint64_t(runs.size()), nelement, uint64_t(1), nelement}) out.put(n);
  uint64_t number = 0;
  for (const Run &r : runs) {
    out.put(r.dimension);
    out.put(entity_of(mesh, r.group));
    out.put(r.type);
    out.put(r.n);
    for (uint64_t t = 0; t < r.n; ++t) {
      out.put(++number);
      for (uint32_t k = 0; k < r.corners; ++k) out.put<uint64_t>(uint64_t(r.point(t, k)) + 1);
    }
  }
  out.write("\n$EndElements\n");
  out.commit();
}

void write_msh22(const RestMesh &mesh, const std::string &path) {
  if (mesh.npoint() > INT32_MAX)
    fail(DFM_E_UNSUPPORTED, "%s: MSH 2.2 holds up to %d nodes, the mesh has %u; write MSH 4.1", path.c_str(),
         INT32_MAX, mesh.npoint());
  AtomicFile out(path);
  const Array<uint32_t> cell_groups = mesh.cell_groups();
  const std::vector<Run> runs = runs_of(mesh, cell_groups);
  put_head(out, "2.2");
  put_names(out, mesh, written_groups(mesh, runs));
  out.write("$Nodes\n" + std::to_string(mesh.npoint()) + "\n");
  for (uint32_t i = 0; i < mesh.npoint(); ++i) {
    out.put(int32_t(i + 1));
    out.write(&mesh.points[3 * size_t(i)], 3 * sizeof(double));
  }
  out.write("\n$EndNodes\n$Elements\n" + std::to_string(elements(runs)) + "\n");
  int32_t number = 0;
  for (const Run &r : runs) {
    out.put(r.type);
    out.put(static_cast<int32_t>(r.n));
    out.put<int32_t>(2);
    for (uint64_t t = 0; t < r.n; ++t) {
      out.put(++number);
      out.put(r.group == kNoGroup ? 0 : mesh.groups[r.group].tag);
      out.put(entity_of(mesh, r.group));
      for (uint32_t k = 0; k < r.corners; ++k) out.put(static_cast<int32_t>(r.point(t, k) + 1));
    }
  }
  out.write("\n$EndElements\n");
  out.commit();
}

}  // namespace dfm
