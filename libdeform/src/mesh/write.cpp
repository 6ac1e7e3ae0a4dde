#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>

#include "core/error.h"
#include "mesh/file.h"
#include "mesh/mesh.h"

namespace dfm {
namespace {

template <class T>
T big_endian(T value) {
  if constexpr (std::endian::native == std::endian::little) {
    auto *bytes = reinterpret_cast<unsigned char *>(&value);
    std::reverse(bytes, bytes + sizeof value);
  }
  return value;
}

std::string text(uint64_t n) { return std::to_string(n); }

void put_head(AtomicFile &out, const char *version) {
  out.write(std::string("$MeshFormat\n") + version + " 1 8\n");
  out.put<int32_t>(1);
  out.write("\n$EndMeshFormat\n");
}

// Only groups of cells are written: the points of surface groups have no elements here to stand on.
void put_names(AtomicFile &out, const TetMesh &mesh) {
  const auto of_cells = [](const MeshGroup &g) { return g.dimension == 3; };
  const auto n = std::count_if(mesh.groups.begin(), mesh.groups.end(), of_cells);
  if (n == 0) return;
  out.write("$PhysicalNames\n" + text(static_cast<uint64_t>(n)) + "\n");
  for (const MeshGroup &g : mesh.groups)
    if (of_cells(g)) out.write("3 " + std::to_string(g.tag) + " \"" + g.name + "\"\n");
  out.write("$EndPhysicalNames\n");
}

int32_t entity_of(const TetMesh &mesh, uint32_t group) {  // one volume per group of cells, the last for cells without
  return static_cast<int32_t>(group == kNoGroup ? mesh.groups.size() + 1 : group + 1);
}

void put_entities(AtomicFile &out, const TetMesh &mesh) {
  double box[6] = {HUGE_VAL, HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (size_t i = 0; i < mesh.points.size(); ++i) {
    box[i % 3] = std::min(box[i % 3], mesh.points[i]);
    box[3 + i % 3] = std::max(box[3 + i % 3], mesh.points[i]);
  }
  std::vector<uint32_t> groups;
  for (uint32_t g = 0; g < mesh.groups.size(); ++g)
    if (mesh.groups[g].dimension == 3) groups.push_back(g);
  groups.push_back(kNoGroup);
  out.write("$Entities\n");
  for (const uint64_t n : {uint64_t(0), uint64_t(0), uint64_t(0), uint64_t(groups.size())}) out.put(n);
  for (const uint32_t g : groups) {
    out.put(entity_of(mesh, g)), out.write(box, sizeof box);
    out.put<uint64_t>(g != kNoGroup);
    if (g != kNoGroup) out.put(mesh.groups[g].tag);
    out.put<uint64_t>(0);
  }
  out.write("\n$EndEntities\n");
}

}  // namespace

void write_msh41(const TetMesh &mesh, const std::string &path) {
  AtomicFile out(path);
  put_head(out, "4.1"), put_names(out, mesh), put_entities(out, mesh);
  const uint64_t npoint = mesh.npoint(), ntet = mesh.ntet();
  out.write("$Nodes\n");
  for (const uint64_t n : {uint64_t(1), npoint, uint64_t(1), npoint}) out.put(n);
  out.put<int32_t>(3), out.put(entity_of(mesh, ntet ? mesh.tet_group[0] : kNoGroup)), out.put<int32_t>(0), out.put(npoint);
  for (uint64_t i = 1; i <= npoint; ++i) out.put(i);
  out.write(mesh.points.data(), mesh.points.size() * sizeof(double));
  out.write("\n$EndNodes\n$Elements\n");
  // A new block wherever the group changes, so that the cells keep their order.
  uint64_t blocks = ntet > 0;
  for (uint64_t t = 1; t < ntet; ++t) blocks += mesh.tet_group[t] != mesh.tet_group[t - 1];
  for (const uint64_t n : {blocks, ntet, uint64_t(1), ntet}) out.put(n);
  for (uint64_t t = 0; t < ntet;) {
    uint64_t end = t + 1;
    while (end < ntet && mesh.tet_group[end] == mesh.tet_group[t]) ++end;
    out.put<int32_t>(3), out.put(entity_of(mesh, mesh.tet_group[t])), out.put<int32_t>(4), out.put(end - t);
    for (; t < end; ++t) {
      out.put(t + 1);
      for (int k = 0; k < 4; ++k) out.put<uint64_t>(uint64_t(mesh.tets[4 * t + k]) + 1);
    }
  }
  out.write("\n$EndElements\n");
  out.commit();
}

void write_msh22(const TetMesh &mesh, const std::string &path) {
  if (mesh.npoint() > INT32_MAX)
    fail(DFM_E_UNSUPPORTED, "%s: MSH 2.2 holds up to %d nodes, the mesh has %u; write MSH 4.1", path.c_str(), INT32_MAX, mesh.npoint());
  AtomicFile out(path);
  put_head(out, "2.2"), put_names(out, mesh);
  out.write("$Nodes\n" + text(mesh.npoint()) + "\n");
  for (uint32_t i = 0; i < mesh.npoint(); ++i) out.put(int32_t(i + 1)), out.write(&mesh.points[3 * size_t(i)], 3 * sizeof(double));
  out.write("\n$EndNodes\n$Elements\n" + text(mesh.ntet()) + "\n");
  if (mesh.ntet()) out.put<int32_t>(4), out.put(static_cast<int32_t>(mesh.ntet())), out.put<int32_t>(2);
  for (uint32_t t = 0; t < mesh.ntet(); ++t) {
    const uint32_t g = mesh.tet_group[t];
    out.put(int32_t(t + 1)), out.put(g == kNoGroup ? 0 : mesh.groups[g].tag), out.put(entity_of(mesh, g));
    for (int k = 0; k < 4; ++k) out.put(static_cast<int32_t>(mesh.tets[4 * size_t(t) + k] + 1));
  }
  out.write("\n$EndElements\n");
  out.commit();
}

void write_vtk(const TetMesh &mesh, const std::string &path) {
  AtomicFile out(path);
  out.write("# vtk DataFile Version 3.0\ntetrahedra\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS " + text(mesh.npoint()) + " double\n");
  for (const double x : mesh.points) out.put(big_endian(x));
  out.write("\nCELLS " + text(mesh.ntet()) + " " + text(5 * uint64_t(mesh.ntet())) + "\n");
  for (size_t i = 0; i < mesh.tets.size(); ++i) {
    if (i % 4 == 0) out.put(big_endian(int32_t(4)));
    out.put(big_endian(mesh.tets[i]));
  }
  out.write("\nCELL_TYPES " + text(mesh.ntet()) + "\n");
  for (uint32_t t = 0; t < mesh.ntet(); ++t) out.put(big_endian(int32_t(10)));
  out.write("\n");
  out.commit();
}

void write_tet_mesh(const TetMesh &mesh, const std::string &path) {
  const auto ends = [&](const char *ending) {
    const std::string e(ending);
    const auto same = [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); };
    return path.size() > e.size() && std::equal(e.rbegin(), e.rend(), path.rbegin(), same);
  };
  if (ends(".msh")) write_msh41(mesh, path);
  else if (ends(".msh2")) write_msh22(mesh, path);
  else if (ends(".vtk")) write_vtk(mesh, path);
  else fail(DFM_E_UNSUPPORTED, "%s: writing to this file name ending is not available yet; expected .msh (MSH 4.1), .msh2 (MSH 2.2) or .vtk (legacy VTK)", path.c_str());
}

}  // namespace dfm
