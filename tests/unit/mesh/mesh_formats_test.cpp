// The shared mesh collection: every .msh and .vtk against its table.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "mesh_support.h"

using namespace dfm;

namespace {

// Dialects that a later delivery reads; until then they are refused with the way to convert them.
bool is_later(const std::string &file) { return file == "vol_msh10_ascii.msh" || file == "vol_msh40_ascii.msh"; }
bool is_ours(const std::string &file) {
  return file.size() > 4 && (file.compare(file.size() - 4, 4, ".msh") == 0 || file.compare(file.size() - 4, 4, ".vtk") == 0);
}

class SharedMeshes : public testing::Test {
 protected:
  void SetUp() override {
    if (test::shared_dir().empty()) GTEST_SKIP() << "the shared mesh collection is not beside the repository";
    folder = test::shared_dir() + "/meshes/";
  }
  std::string folder;
};

}  // namespace

TEST_F(SharedMeshes, Formats_MatchTheirTable) {
  uint32_t read = 0;
  for (const auto &row : test::read_csv(folder + "formats/EXPECTED.csv")) {
    if (!is_ours(row[0])) continue;
    SCOPED_TRACE(row[0]);
    const std::string path = folder + "formats/" + row[0];
    if (is_later(row[0]) || row[6] == "read or clear error") {
      const auto error = test::refusal(path);
      ASSERT_TRUE(error);
      EXPECT_EQ(error->status, DFM_E_UNSUPPORTED);
      EXPECT_NE(error->sentence.find("gmsh -3"), std::string::npos) << error->sentence;
      continue;
    }
    const TetMesh mesh = read_tet_mesh(Memory::standard(), path);
    const MeshStatistics s = mesh_statistics(mesh);
    EXPECT_EQ(s.npoint + mesh.dropped_points, std::stoul(row[2]));
    EXPECT_EQ(s.ntet, std::stoul(row[3]));
    EXPECT_EQ(s.ntriangle, std::stoul(row[4]));
    const double volume = std::stod(row[5]), tolerance = row[0].find("_f32") != std::string::npos ? 1e-6 : 1e-9;
    EXPECT_NEAR(s.volume / volume, 1, tolerance);
    EXPECT_EQ(mesh.turned, row[0] == "vol_mixed_orientation.vtk" ? 154u : 0u);
    EXPECT_EQ(mesh.overlapping, 0u);
    ++read;
  }
  EXPECT_EQ(read, 16u);
}

TEST_F(SharedMeshes, Nasty_ReactAsTheirTableDemands) {
  uint32_t read = 0, refused = 0;
  for (const auto &row : test::read_csv(folder + "nasty/EXPECTED.csv")) {
    if (!is_ours(row[0])) continue;
    SCOPED_TRACE(row[0]);
    const std::string path = folder + "nasty/" + row[0], must = row[3];
    test::CountedMemory memory;
    memory.cap = 4096 + 24 * std::filesystem::file_size(path);
    const auto error = test::refusal(path, memory.hooks);
    if (must == "error" || must == "reject") {
      ASSERT_TRUE(error);
      EXPECT_NE(error->sentence.find(row[0]), std::string::npos) << error->sentence;
      ++refused;
    } else if (!error) {
      const TetMesh mesh = read_tet_mesh(Memory::standard(), path);
      const MeshStatistics s = mesh_statistics(mesh);
      EXPECT_EQ(s.npoint, std::stoul(row[1]));
      EXPECT_EQ(s.ntet + mesh.dropped_cells, std::stoul(row[2]));
      EXPECT_GT(s.quality_min, 0);
      ++read;
    } else {
      EXPECT_NE(must, "read") << error->sentence;
      ++refused;
    }
  }
  EXPECT_EQ(read, 9u);
  EXPECT_EQ(refused, 19u);
}

TEST_F(SharedMeshes, Nasty_RepairsAndReportsAreTold) {
  const auto read = [&](const char *file) { return read_tet_mesh(Memory::standard(), folder + "nasty/" + file); };
  const auto told = [](const TetMesh &m, const char *word) {
    return std::any_of(m.warnings.begin(), m.warnings.end(), [&](const std::string &w) { return w.find(word) != std::string::npos; });
  };
  EXPECT_EQ(mesh_statistics(read("two_pieces.msh")).npiece, 2u);
  EXPECT_TRUE(told(read("two_pieces.msh"), "2 pieces that share no point"));
  EXPECT_EQ(mesh_statistics(read("duplicate_vertices.vtk")).npiece, 2u);
  EXPECT_EQ(mesh_statistics(read("duplicate_vertices.vtk")).duplicate_points, 4u);
  EXPECT_TRUE(told(read("duplicate_vertices.vtk"), "4 points"));
  EXPECT_EQ(read("duplicate_tets.vtk").dropped_cells, 2u);
  EXPECT_TRUE(told(read("duplicate_tets.vtk"), "2 duplicate cells"));
  EXPECT_EQ(mesh_statistics(read("nonmanifold_contacts.vtk")).nonmanifold_edges, 1u);
  EXPECT_TRUE(told(read("slivers.vtk"), "nearly flat"));
  EXPECT_NEAR(mesh_statistics(read("slivers.vtk")).quality_min, 0.0027, 5e-5);
  EXPECT_TRUE(told(read("huge_offset.vtk"), "from the origin"));
  EXPECT_TRUE(told(read("inverted_rest.vtk"), "tangled"));
  EXPECT_TRUE(told(read("inverted_rest.vtk"), "39 of 324 cells"));
  EXPECT_TRUE(read("tiny_units.vtk").warnings.empty());
  EXPECT_TRUE(read("large_units.vtk").warnings.empty());
}

TEST_F(SharedMeshes, ThesisCylinders_HaveTheirPublishedCounts) {
  const struct { const char *file; uint32_t points, tets, triangles, edges; } rows[] = {
      {"cyl_222.msh", 222, 561, 412, 988}, {"cyl_222.vtk", 222, 561, 412, 988},
      {"cyl_coarse.msh", 554, 2729, 906, 3735}, {"cyl_fine.msh", 2579, 15092, 2386, 18863}};
  for (const auto &row : rows) {
    SCOPED_TRACE(row.file);
    const MeshStatistics s = mesh_statistics(read_tet_mesh(Memory::standard(), folder + "thesis/" + row.file));
    EXPECT_EQ(s.npoint, row.points);
    EXPECT_EQ(s.ntet, row.tets);
    EXPECT_EQ(s.ntriangle, row.triangles);
    EXPECT_EQ(s.nedge, row.edges);
  }
}

// | file | points | tets | tris | min q | bytes | ... as other programs read them.
TEST_F(SharedMeshes, Manifest_AgreesWithOtherReaders) {
  std::istringstream manifest(test::read_file(folder + "MANIFEST.md"));
  uint32_t read = 0;
  for (std::string line; std::getline(manifest, line);) {
    std::vector<std::string> cell;
    std::istringstream cells(line);
    for (std::string c; std::getline(cells, c, '|');) {
      const size_t from = c.find_first_not_of(' ');
      cell.push_back(from == std::string::npos ? "" : c.substr(from, c.find_last_not_of(' ') - from + 1));
    }
    if (cell.size() < 6 || !is_ours(cell[1]) || cell[1].rfind("nasty/", 0) == 0) continue;
    SCOPED_TRACE(cell[1]);
    const auto error = test::refusal(folder + cell[1]);
    if (error && error->status == DFM_E_UNSUPPORTED) continue;  // MSH 1.0, 4.0, other cells, XML: refused with the way to convert
    if (cell[3].empty() || cell[3] == "0") {
      ASSERT_TRUE(error);
      EXPECT_NE(error->sentence.find("no tetrahedra"), std::string::npos) << error->sentence;
      continue;
    }
    ASSERT_FALSE(error) << error->sentence;
    if (cell[1] == "external/sofa/6_tetra_bad.msh") continue;  // all its elements carry one number, of which other readers keep the last
    const TetMesh mesh = read_tet_mesh(Memory::standard(), folder + cell[1]);
    const MeshStatistics s = mesh_statistics(mesh);
    EXPECT_EQ(s.npoint + mesh.dropped_points, std::stoul(cell[2]));
    EXPECT_EQ(s.ntet, std::stoul(cell[3]));
    EXPECT_EQ(s.ntriangle, std::stoul(cell[4]));
    const double q = std::stod(cell[5]);
    if (q > 0) { EXPECT_NEAR(s.quality_min, q, 0.006 * q); }
    ++read;
  }
  EXPECT_GT(read, 60u);
}

TEST_F(SharedMeshes, External_AreReadOrRefusedWithReason) {
  for (const char *part : {"external/sofa", "external/ipc", "external/derived"})
    for (const std::string &file : test::files_of(folder + part, {".msh", ".vtk"})) {
      const auto error = test::refusal(file);
      const bool with_reason = !error || error->status == DFM_E_UNSUPPORTED || error->sentence.find("no tetrahedra") != std::string::npos;
      EXPECT_TRUE(with_reason) << error->sentence;
    }
  const TetMesh bad = read_tet_mesh(Memory::standard(), folder + "external/sofa/6_tetra_bad.msh");
  EXPECT_EQ(bad.ntet(), 6u);
  EXPECT_EQ(bad.turned, 1u);
}
