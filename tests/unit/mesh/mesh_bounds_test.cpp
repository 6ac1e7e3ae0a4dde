// Readers under attack: cut, mutated and lying files neither crash nor take memory beyond a small multiple of the file.
#include <gtest/gtest.h>

#include "mesh_support.h"

using namespace dfm;

namespace {

// Text of 2 bytes may stand for 8 or more in memory, and sorted faces take 80 bytes a cell.
constexpr size_t kMultiple = 24, kBase = 4096;

// Reads bytes under a cap; true where they were accepted.
bool read_capped(const std::string &name, const std::string &bytes) {
  test::CountedMemory memory;
  memory.cap = kBase + kMultiple * bytes.size();
  bool accepted = false;
  try {
    const TetMesh mesh = parse_tet_mesh(memory.hooks, name, bytes.data(), bytes.size());
    mesh_statistics(mesh);
    for (uint32_t t = 0; t < mesh.ntet(); ++t) EXPECT_GT(tet_volume(mesh.points.data(), &mesh.tets[4 * size_t(t)]), 0) << name;
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

}  // namespace

TEST(MeshBounds, CutAtAnyByte_IsRefusedOrWhole) {
  for (const std::string &file : test::own_meshes()) {
    const std::string bytes = test::read_file(file);
    ASSERT_TRUE(read_capped(name_of(file), bytes)) << file;
    // What follows the cells is not needed: node data and periodic sections in MSH must still be complete, VTK attributes not.
    for (size_t n = 0; n < bytes.size(); ++n) {
      const bool accepted = read_capped(name_of(file), bytes.substr(0, n));
      if (n < bytes.size() / 2) { EXPECT_FALSE(accepted) << file << " cut at " << n; }
    }
  }
}

TEST(MeshBounds, MutatedBytes_NeitherCrashNorEatMemory) {
  uint64_t random = 88172645463325252ull;  // xorshift64
  const auto next = [&] { return random ^= random << 13, random ^= random >> 7, random ^= random << 17; };
  uint32_t accepted = 0, tried = 0;
  for (const std::string &file : test::own_meshes()) {
    const std::string bytes = test::read_file(file);
    for (int round = 0; round < 2000; ++round, ++tried) {
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
  EXPECT_GT(accepted, tried / 100);  // some mutations only move a point: else nothing beyond the head was tried
  EXPECT_LT(accepted, tried);
}

TEST(MeshBounds, PromiseOfTenGigabytes_IsRefusedWithLittleMemory) {
  const std::string v = "# vtk DataFile Version 3.0\nt\n", grid = "DATASET UNSTRUCTURED_GRID\n";
  const std::string four = "POINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
  const std::string m22 = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n", m41 = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
  const std::string nodes22 = "$Nodes\n1\n1 0 0 0\n$EndNodes\n", nodes41 = "$Nodes\n1 1 1 1\n3 1 0 1\n1\n0 0 0\n$EndNodes\n";
  const std::string one("\1\0\0\0", 4), huge("\0\xe4\x0b\x54\x02\0\0\0", 8), eight(8, '\0');
  const std::string endless("\0\xff\xff\xff\xff\xff\xff\xff", 8), run("\4\0\0\0\xff\xff\xff\x7f\0\0\0\0", 12);
  const std::string b22 = "$MeshFormat\n2.2 1 8\n" + one + "\n$EndMeshFormat\n",
      b41 = "$MeshFormat\n4.1 1 8\n" + one + "\n$EndMeshFormat\n";
  const std::pair<const char *, std::string> lies[] = {
      {"points.vtk", v + "ASCII\n" + grid + "POINTS 10000000000 double\n0 0 0\n"},
      {"points64.vtk", v + "ASCII\n" + grid + "POINTS 9223372036854775807 double\n0 0 0\n"},
      {"points_bin.vtk", v + "BINARY\n" + grid + "POINTS 10000000000 double\n" + eight},
      {"cells.vtk", v + "ASCII\n" + grid + four + "CELLS 2000000000 10000000000\n4 0 1 2 3\n"},
      {"cells_only.vtk", v + "ASCII\n" + grid + four + "CELLS 10000000000 5\n4 0 1 2 3\n"},
      {"offsets.vtk", v + "ASCII\n" + grid + four + "CELLS 10000000000 4\nOFFSETS int\n0 4\nCONNECTIVITY int\n0 1 2 3\n"},
      {"connectivity.vtk", v + "ASCII\n" + grid + four + "CELLS 2 10000000000\nOFFSETS vtktypeint64\n0 10000000000\nCONNECTIVITY int\n0 1 2 3\n"},
      {"field.vtk", v + "ASCII\n" + grid + "FIELD f 10000000000\n"},
      {"field_bin.vtk", v + "BINARY\n" + grid + "FIELD f 1\na 100000 1000000 double\n" + eight},
      {"field_string.vtk", v + "BINARY\n" + grid + "FIELD f 1\na 1 10000000000 string\n" + endless},
      {"nodes22.msh", m22 + "$Nodes\n10000000000\n1 0 0 0\n"},
      {"elements22.msh", m22 + nodes22 + "$Elements\n10000000000\n1 4 0 1 1 1 1\n"},
      {"tags22.msh", m22 + nodes22 + "$Elements\n1\n1 4 10000000000 1 1 1 1\n$EndElements\n"},
      {"names22.msh", m22 + "$PhysicalNames\n10000000000\n3 1 \"a\"\n"},
      {"nodes22_bin.msh", b22 + "$Nodes\n10000000000\n" + eight},
      {"run22_bin.msh", b22 + "$Nodes\n0\n$EndNodes\n$Elements\n2000000000\n" + run + eight},
      {"nodes41.msh", m41 + "$Nodes\n1 10000000000 1 1\n3 1 0 10000000000\n1\n"},
      {"blocks41.msh", m41 + "$Nodes\n10000000000 1 1 1\n3 1 0 1\n1\n0 0 0\n"},
      {"empty_blocks41.msh", m41 + "$Nodes\n9223372036854775807 1 1 1\n3 1 0 0\n3 1 0 0\n"},
      {"elements41.msh", m41 + nodes41 + "$Elements\n1 10000000000 1 1\n3 1 4 10000000000\n1 1 1 1 1\n"},
      {"entities41.msh", m41 + "$Entities\n0 0 0 10000000000\n1 0 0 0 1 1 1 0 0\n"},
      {"physical41.msh", m41 + "$Entities\n0 0 0 1\n1 0 0 0 1 1 1 10000000000 1\n"},
      {"nodes41_bin.msh", b41 + "$Nodes\n" + eight + huge + eight + eight},
      {"entities41_bin.msh", b41 + "$Entities\n" + huge + huge + huge + huge}};
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
    const TetMesh mesh = read_tet_mesh(memory.hooks, path);
    EXPECT_LT(memory.peak, 5 * bytes);
    EXPECT_LT(memory.held, 2 * bytes);
  }
  EXPECT_EQ(memory.held, 0u);
}

TEST(MeshBounds, EveryFailingAllocation_IsOutOfMemory) {
  for (const std::string &file : {test::own_meshes().front(), test::own_meshes().back()}) {
    bool whole = false;
    for (size_t n = 0; !whole; ++n) {
      ASSERT_LT(n, 10000u);
      test::CountedMemory memory;
      memory.refuse_from = n;
      try {
        const TetMesh mesh = read_tet_mesh(memory.hooks, file);
        whole = memory.calls <= n;
        EXPECT_TRUE(whole) << "allocation " << n << " failed unnoticed";
      } catch (const std::bad_alloc &) {
      }
      EXPECT_EQ(memory.held, 0u);
    }
  }
}
