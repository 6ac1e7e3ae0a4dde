// Readers under attack: cut, mutated and lying files neither crash nor take memory beyond a small
// multiple of the file.
#include <gtest/gtest.h>

#include "mesh/raw_mesh.h"
#include "mesh_support.h"

using namespace dfm;

namespace {

// Text of 2 bytes may stand for 8 or more in memory, and sorted faces take 80 bytes a cell. A corner of a
// polygon, perhaps one byte, stands for a triangle of 16 bytes in an array that grows by doubling, and repair
// sorts them; compressed arrays may unpack to 64 times their file.
constexpr size_t kMultiple = 24, kBase = 4096, kSurfaceMultiple = 64, kSurfaceBase = 16384,
                 kZlibMultiple = 160;

size_t cap_of(const std::string &name, size_t bytes) {
  if (name.find("zlib") != std::string::npos) return kBase + kZlibMultiple * bytes;
  const bool cells = name.find(".msh") != std::string::npos || name.find(".vtk") != std::string::npos ||
                     name.find(".vtu") != std::string::npos;
  return cells ? kBase + kMultiple * bytes : kSurfaceBase + kSurfaceMultiple * bytes;
}

// Reads bytes under a cap; true where they were accepted.
bool read_capped(const std::string &name, const std::string &bytes) {
  test::CountedMemory memory;
  memory.cap = cap_of(name, bytes.size());
  bool accepted = false;
  try {
    RawMesh raw = parse_raw(memory.hooks, name, bytes.data(), bytes.size());
    for (const Array<uint32_t> *corners : {&raw.tets, &raw.tris})
      for (const uint32_t p : *corners) EXPECT_LT(p, raw.npoint()) << name;
    if (raw.tets.empty()) {
      const RestMesh mesh = finish_surface(name, std::move(raw));
      mesh_statistics(mesh);
    } else {
      const RestMesh mesh = finish_mesh(name, std::move(raw));
      mesh_statistics(mesh);
      for (uint32_t t = 0; t < mesh.ntet(); ++t)
        EXPECT_GT(tet_volume(mesh.points.data(), &mesh.tets[4 * size_t(t)]), 0) << name;
    }
    accepted = true;
  } catch (const Error &e) {
    EXPECT_FALSE(e.sentence.empty());
    EXPECT_LT(e.sentence.size(), 1000u);
  } catch (const std::bad_alloc &) {
    ADD_FAILURE() << name << " of " << bytes.size() << " bytes wants more than " << memory.cap;
  }
  EXPECT_EQ(memory.held, 0u) << name;
  return accepted;
}

std::string name_of(const std::string &path) { return std::filesystem::path(path).filename().string(); }

std::vector<std::string> all_files() {
  std::vector<std::string> out = test::own_meshes();
  for (const std::string &file : test::own_surfaces()) out.push_back(file);
  return out;
}

}  // namespace

TEST(MeshBounds, CutAtAnyByte_IsRefusedOrWhole) {
  for (const std::string &file : all_files()) {
    const std::string bytes = test::read_file(file);
    ASSERT_TRUE(read_capped(name_of(file), bytes)) << file;
    // What follows the cells is not needed: node data and periodic sections in MSH must still be complete,
    // VTK attributes not. OBJ and Abaqus have no count and no end, a file of several solids is whole after
    // each, POLYDATA after each section: the surface is open there.
    bool has_end = true;
    for (const char *without : {".obj", ".inp", "stl_ascii", "polydata"})
      has_end = has_end && file.find(without) == std::string::npos;
    for (size_t n = 0; n < bytes.size(); ++n) {
      const bool accepted = read_capped(name_of(file), bytes.substr(0, n));
      if (has_end && n < bytes.size() / 2) {
        EXPECT_FALSE(accepted) << file << " cut at " << n;
      }
    }
  }
}

TEST(MeshBounds, MutatedBytes_NeitherCrashNorEatMemory) {
  uint64_t random = 88172645463325252ull;  // xorshift64
  const auto next = [&] {
    random ^= random << 13;
    random ^= random >> 7;
    return random ^= random << 17;
  };
  uint32_t accepted = 0, tried = 0;
  for (const std::string &file : all_files()) {
    const std::string bytes = test::read_file(file);
    for (int round = 0; round < 1000; ++round, ++tried) {
      std::string mutated = bytes;
      for (uint64_t k = 0, n = 1 + next() % 4; k < n; ++k) {
        const size_t at = next() % mutated.size();
        switch (next() % 4) {
          case 0: mutated[at] = char(next()); break;
          case 1: mutated[at] = "0123456789 -e.$\n"[next() % 16]; break;
          case 2: mutated.erase(at, 1 + next() % 8); break;
          default: mutated.insert(at, mutated.substr(next() % mutated.size(), 1 + next() % 8)); break;
        }
        if (mutated.empty()) break;
      }
      accepted += read_capped(name_of(file), mutated);
    }
  }
  // some mutations only move a point: else nothing beyond the head was tried
  EXPECT_GT(accepted, tried / 100);
  EXPECT_LT(accepted, tried);
}

TEST(MeshBounds, PromiseOfTenGigabytes_IsRefusedWithLittleMemory) {
  const std::string v = "# vtk DataFile Version 3.0\nt\n", grid = "DATASET UNSTRUCTURED_GRID\n";
  const std::string four = "POINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
  const std::string m22 = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
  const std::string m40 = "$MeshFormat\n4 0 8\n$EndMeshFormat\n";
  const std::string m41 = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
  const std::string nodes22 = "$Nodes\n1\n1 0 0 0\n$EndNodes\n";
  const std::string nodes40 = "$Nodes\n1 1\n1 3 0 1\n1 0 0 0\n$EndNodes\n";
  const std::string nodes41 = "$Nodes\n1 1 1 1\n3 1 0 1\n1\n0 0 0\n$EndNodes\n";
  const std::string one("\1\0\0\0", 4), huge("\0\xe4\x0b\x54\x02\0\0\0", 8), eight(8, '\0');
  const std::string endless("\0\xff\xff\xff\xff\xff\xff\xff", 8), run("\4\0\0\0\xff\xff\xff\x7f\0\0\0\0", 12);
  const std::string b22 = "$MeshFormat\n2.2 1 8\n" + one + "\n$EndMeshFormat\n";
  const std::string b40 = "$MeshFormat\n4 1 8\n" + one + "\n$EndMeshFormat\n";
  const std::string b41 = "$MeshFormat\n4.1 1 8\n" + one + "\n$EndMeshFormat\n";
  const std::string medit = "MeshVersionFormatted 2\nDimension 3\n";
  const auto vtu = [](uint64_t points, uint64_t cells, const std::string &form, const std::string &data,
                      bool packed = false) {
    const std::string array =
        "<DataArray type=\"Int64\" " + (form.empty() ? "format=\"ascii\"" : form) + " Name=\"";
    const std::string compressor = packed ? " compressor=\"vtkZLibDataCompressor\"" : "";
    const std::string end = "</DataArray>";
    return "<VTKFile type=\"UnstructuredGrid\"" + compressor + "><UnstructuredGrid><Piece NumberOfPoints=\"" +
           std::to_string(points) + "\" NumberOfCells=\"" + std::to_string(cells) +
           "\"><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0" + end +
           "</Points><Cells>" + array + "connectivity\">" + data + end + array + "offsets\">" + data + end +
           array + "types\">" + data + end + "</Cells></Piece></UnstructuredGrid></VTKFile>";
  };
  const std::pair<const char *, std::string> lies[] = {
      {"points.vtk", v + "ASCII\n" + grid + "POINTS 10000000000 double\n0 0 0\n"},
      {"points64.vtk", v + "ASCII\n" + grid + "POINTS 9223372036854775807 double\n0 0 0\n"},
      {"points_bin.vtk", v + "BINARY\n" + grid + "POINTS 10000000000 double\n" + eight},
      {"cells.vtk", v + "ASCII\n" + grid + four + "CELLS 2000000000 10000000000\n4 0 1 2 3\n"},
      {"cells_only.vtk", v + "ASCII\n" + grid + four + "CELLS 10000000000 5\n4 0 1 2 3\n"},
      {"offsets.vtk",
       v + "ASCII\n" + grid + four + "CELLS 10000000000 4\nOFFSETS int\n0 4\nCONNECTIVITY int\n0 1 2 3\n"},
      {"connectivity.vtk",
       v + "ASCII\n" + grid + four +
           "CELLS 2 10000000000\nOFFSETS vtktypeint64\n0 10000000000\nCONNECTIVITY int\n0 1 2 3\n"},
      {"field.vtk", v + "ASCII\n" + grid + "FIELD f 10000000000\n"},
      {"field_bin.vtk", v + "BINARY\n" + grid + "FIELD f 1\na 100000 1000000 double\n" + eight},
      {"field_string.vtk", v + "BINARY\n" + grid + "FIELD f 1\na 1 10000000000 string\n" + endless},
      {"nodes22.msh", m22 + "$Nodes\n10000000000\n1 0 0 0\n"},
      {"elements22.msh", m22 + nodes22 + "$Elements\n10000000000\n1 4 0 1 1 1 1\n"},
      {"tags22.msh", m22 + nodes22 + "$Elements\n1\n1 4 10000000000 1 1 1 1\n$EndElements\n"},
      {"names22.msh", m22 + "$PhysicalNames\n10000000000\n3 1 \"a\"\n"},
      {"nodes22_bin.msh", b22 + "$Nodes\n10000000000\n" + eight},
      {"run22_bin.msh", b22 + "$Nodes\n0\n$EndNodes\n$Elements\n2000000000\n" + run + eight},
      {"nodes40.msh", m40 + "$Nodes\n1 10000000000\n1 3 0 10000000000\n1 0 0 0\n"},
      {"empty_blocks40.msh", m40 + "$Nodes\n9223372036854775807 1\n1 3 0 0\n1 3 0 0\n"},
      {"elements40.msh", m40 + nodes40 + "$Elements\n1 10000000000\n1 3 4 10000000000\n1 1 1 1 1\n"},
      {"entities40.msh", m40 + "$Entities\n10000000000 0 0 0\n1 0 0 0 1 1 1 0\n"},
      {"nodes40_bin.msh", b40 + "$Nodes\n" + eight + huge + eight + eight},
      {"entities40_bin.msh", b40 + "$Entities\n" + huge + huge + huge + huge},
      {"nodes41.msh", m41 + "$Nodes\n1 10000000000 1 1\n3 1 0 10000000000\n1\n"},
      {"blocks41.msh", m41 + "$Nodes\n10000000000 1 1 1\n3 1 0 1\n1\n0 0 0\n"},
      {"empty_blocks41.msh", m41 + "$Nodes\n9223372036854775807 1 1 1\n3 1 0 0\n3 1 0 0\n"},
      {"elements41.msh", m41 + nodes41 + "$Elements\n1 10000000000 1 1\n3 1 4 10000000000\n1 1 1 1 1\n"},
      {"entities41.msh", m41 + "$Entities\n0 0 0 10000000000\n1 0 0 0 1 1 1 0 0\n"},
      {"physical41.msh", m41 + "$Entities\n0 0 0 1\n1 0 0 0 1 1 1 10000000000 1\n"},
      {"nodes41_bin.msh", b41 + "$Nodes\n" + eight + huge + eight + eight},
      {"entities41_bin.msh", b41 + "$Entities\n" + huge + huge + huge + huge},
      {"polygons.vtk", v + "ASCII\nDATASET POLYDATA\n" + four + "POLYGONS 2000000000 10000000000\n3 0 1 2\n"},
      {"scalars.vtk", v + "BINARY\n" + grid +
                          "POINTS 0 float\n\nCELLS 0 0\n\nCELL_TYPES 0\n\nCELL_DATA 10000000000\nSCALARS "
                          "group int\nLOOKUP_TABLE default\n" +
                          eight},
      {"vertices.mesh", medit + "Vertices\n10000000000\n0 0 0 0\n"},
      {"tets.mesh", medit + "Vertices\n1\n0 0 0 0\nTetrahedra\n10000000000\n1 1 1 1 0\n"},
      {"points.ply",
       "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float "
       "z\nend_header\n0 0 0\n"},
      {"points_bin.ply",
       "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float "
       "y\nproperty float z\nend_header\n" +
           eight + eight},
      {"empty_properties.ply",
       "ply\nformat ascii 1.0\nelement vertex 4000000000\nelement nothing 9000000000000000000\nend_header\n"},
      {"list.ply",
       "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint double "
       "vertex_indices\nend_header\n" +
           run.substr(4, 4) + eight},
      {"faces.off", "OFF\n1 10000000000 0\n0 0 0\n3 0 0 0\n"},
      {"points.off", "OFF\n4000000000 1 0\n0 0 0\n3 0 0 0\n"},
      {"corners.off", "OFF\n1 1 0\n0 0 0\n4000000000 0 0 0\n"},
      {"count.stl", std::string(80, 'x') + run.substr(4, 4) + eight},
      {"points.vtu", vtu(4000000000, 1, "", "")},
      {"cells.vtu", vtu(1, 1000000000, "format=\"ascii\"", "0")},
      {"length.vtu", vtu(1, 1, "format=\"binary\"", "////fwAAAAA=")},
      {"blocks.vtu", vtu(1, 1, "format=\"binary\"", "////fwAAAAA=", true)},
      {"block_size.vtu", vtu(1, 1, "format=\"binary\"", "AQAAAP///38AAAAACAAAAA==AAAAAAAAAAA=", true)}};
  for (const auto &[name, bytes] : lies) EXPECT_FALSE(read_capped(name, bytes)) << name;
}

TEST(MeshBounds, ManyTinyGroups_AreCapped) {
  std::string text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n70000\n";
  for (int k = 1; k <= 70000; ++k) text += "3 " + std::to_string(k) + " \"\"\n";
  const auto error = test::refusal_of_text("groups.msh", text + "$EndPhysicalNames\n");
  ASSERT_TRUE(error);
  EXPECT_NE(error->sentence.find("65536 groups"), std::string::npos) << error->sentence;
}

TEST(MeshBounds, RealMesh_TakesASmallMultipleOfItsFile) {
  const std::string path = test::scratch("mesh_bounds") + "/ball.msh";
  write_msh41(make_ball(Memory::standard(), 0.1, 4000), path);
  const size_t bytes = std::filesystem::file_size(path);
  test::CountedMemory memory;
  {
    const RestMesh mesh = read_mesh(memory.hooks, path, DFM_MESH_CELLS);
    EXPECT_LT(memory.peak, 5 * bytes);
    EXPECT_LT(memory.held, 2 * bytes);
  }
  EXPECT_EQ(memory.held, 0u);
}

// What a large mesh may take: 600 bytes per tetrahedron while it is read, 400 once settled, whatever its
// format (1e6: tests/bench/mesh_read_bench.cpp).
TEST(MeshBounds, LargeMesh_TakesSixHundredBytesPerTetrahedronWhileRead) {
  const RestMesh beam = make_beam(Memory::standard(), 2, 1, 1, 100000);
  for (const char *name : {"/large.msh", "/large.msh2", "/large.vtk", "/large.vtu", "/large.mesh"}) {
    SCOPED_TRACE(name);
    const std::string path = test::scratch("mesh_bounds") + name;
    write_mesh(beam, path);
    test::CountedMemory memory;
    {
      const RestMesh mesh = read_mesh(memory.hooks, path, DFM_MESH_CELLS);
      ASSERT_EQ(mesh.ntet(), beam.ntet());
      EXPECT_LT(memory.peak, 600ull * mesh.ntet());
      EXPECT_LT(memory.held, 400ull * mesh.ntet());
    }
    EXPECT_EQ(memory.held, 0u);
    std::filesystem::remove(path);
  }
}

TEST(MeshBounds, EveryFailingAllocation_IsOutOfMemory) {
  for (const std::string &file : {test::own_meshes().front(), test::own_meshes().back()}) {
    bool whole = false;
    for (size_t n = 0; !whole; ++n) {
      ASSERT_LT(n, 10000u);
      test::CountedMemory memory;
      memory.refuse_from = n;
      try {
        const RestMesh mesh = read_mesh(memory.hooks, file, DFM_MESH_CELLS);
        whole = memory.calls <= n;
        EXPECT_TRUE(whole) << "allocation " << n << " failed unnoticed";
      } catch (const std::bad_alloc &) {}
      EXPECT_EQ(memory.held, 0u);
    }
  }
}
