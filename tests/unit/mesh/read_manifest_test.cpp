// Every packed mesh: the manifest says how many points, tetrahedra and triangles other programs see, the
// folders' EXPECTED.csv what must become of a file (read, report, reject, error).
// Formats that are not ours are refused with the way to convert them.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <sstream>

#include "mesh/raw_mesh.h"
#include "mesh_support.h"

using namespace dfm;

namespace {

struct Row {
  std::string file, note, must = "read";
  uint32_t points = 0, tets = 0, tris = 0;  // 0: not told
  double quality = 0, volume = 0;
  std::string name() const { return std::filesystem::path(file).filename().string(); }
};

std::string trimmed(const std::string &text) {
  const size_t from = text.find_first_not_of(' ');
  return from == std::string::npos ? "" : text.substr(from, text.find_last_not_of(' ') - from + 1);
}
uint32_t count_in(const std::string &text) {
  return text.empty() ? 0 : static_cast<uint32_t>(std::stoul(text));
}

// Rows of a table without its head; the last column is a note that may hold commas.
std::vector<std::vector<std::string>> rows_of(const std::string &path, size_t columns) {
  auto rows = test::read_csv(path);
  rows.erase(rows.begin());
  for (auto &row : rows) {
    row.resize(std::max(row.size(), columns));
    for (size_t k = columns; k < row.size(); ++k) row[columns - 1] += "," + row[k];
  }
  return rows;
}

// | file | points | tets | tris | min q | note |, with what EXPECTED.csv of the folder adds.
std::vector<Row> manifest(const std::string &folder) {
  std::map<std::string, Row> expected;
  for (const auto &r : rows_of(folder + "formats/EXPECTED.csv", 8)) {
    Row row{"formats/" + r[0], r[7], r[6]};
    row.points = count_in(r[2]);
    row.tets = count_in(r[3]);
    row.tris = count_in(r[4]);
    row.volume = r[5].empty() ? 0 : std::stod(r[5]);
    expected[row.file] = row;
  }
  for (const auto &r : rows_of(folder + "nasty/EXPECTED.csv", 5)) {
    Row row{"nasty/" + r[0], r[4], r[3]};
    row.points = count_in(r[1]);
    row.tets = count_in(r[2]);
    expected[row.file] = row;
  }
  std::vector<Row> out;
  std::istringstream lines(test::read_file(folder + "MANIFEST.md"));
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> cell;
    std::istringstream cells(line);
    for (std::string c; std::getline(cells, c, '|');) cell.push_back(trimmed(c));
    if (cell.size() < 7 || cell[1].find('/') == std::string::npos) continue;
    Row row{cell[1], cell[6]};
    row.points = count_in(cell[2]);
    row.tets = count_in(cell[3]);
    row.tris = count_in(cell[4]);
    std::filesystem::path listed = row.file;  // TetGen's files by that of their points
    if (listed.extension() == ".ele" || listed.extension() == ".face") listed.replace_extension(".node");
    const auto more = expected.find(listed.string());
    if (more != expected.end()) row = more->second;
    row.file = cell[1];
    row.quality = cell[5].empty() ? 0 : std::stod(cell[5]);
    out.push_back(row);
  }
  return out;
}

// Formats that are not ours, whatever their note says.
bool is_foreign(const Row &row) { return row.name() == "vol_msh10_ascii.msh"; }

class PackedMeshes : public testing::Test {
 protected:
  const std::string folder = test::mesh_dir() + "/";

  // Memory for reading and repair of a file, as tests/unit/mesh/mesh_bounds_test.cpp bounds it.
  size_t cap_of(const std::string &path) const { return 16384 + 64 * std::filesystem::file_size(path); }

  void expect_tets(const Row &row, const RestMesh &mesh) {
    const dfm_mesh_info s = mesh_statistics(mesh);
    EXPECT_GT(s.quality_min, 0);
    if (!mesh.cells.empty()) {  // gmsh's; the table counts corners
      EXPECT_EQ(mesh.turned, 0u);
      EXPECT_TRUE(mesh.warnings.empty());
      if (row.tets) {
        EXPECT_EQ(s.ntet, 8 * row.tets);
        EXPECT_EQ(s.ntriangle, 4 * row.tris);
      }
      EXPECT_NEAR(s.volume / (row.tets ? row.volume : 1), 1, 1e-9);  // a unit cube of hexahedra
      return;
    }
    EXPECT_EQ(s.npoint + mesh.dropped_points, row.points);
    EXPECT_EQ(s.ntet + mesh.dropped_cells, row.tets);
    if (row.tris) {
      EXPECT_EQ(s.ntriangle, row.tris);
    }
    if (row.volume > 0) {
      EXPECT_NEAR(s.volume / row.volume, 1, row.file.find("_f32") != std::string::npos ? 1e-6 : 1e-9);
    }
    if (row.quality > 0 && mesh.turned == 0) {
      EXPECT_NEAR(s.quality_min, row.quality, 0.006 * row.quality);
    }
  }

  void expect_surface(const Row &row, uint32_t raw_points, uint32_t raw_tris, const RestMesh &mesh) {
    EXPECT_GT(mesh.ntri(), 0u);
    for (const uint32_t p : mesh.tris) ASSERT_LT(p, mesh.npoint());
    if (row.volume > 0) {  // formats/: points joined, volume known
      const dfm_mesh_info s = mesh_statistics(mesh);
      EXPECT_EQ(s.npoint, row.points);
      EXPECT_EQ(s.ntriangle, row.tris);
      EXPECT_NEAR(s.volume / row.volume, 1, 1e-5);  // some are written with 7 digits
      EXPECT_TRUE(s.closed);
    } else if (row.tris) {  // as they stand in the file, STL corners apart
      // others drop unused points of OBJ
      const uint32_t points = raw_points == row.points ? raw_points : raw_points - mesh.dropped_points;
      EXPECT_EQ(points, row.points);
      EXPECT_EQ(raw_tris, row.tris);
    }
    if (row.must.find("report") != std::string::npos) {
      EXPECT_FALSE(mesh.warnings.empty());
    }
  }
};

}  // namespace

TEST_F(PackedMeshes, EveryFileOfTheManifest_IsReadRepairedOrRefusedAsItSays) {
  std::map<std::string, uint32_t> done;
  for (const Row &row : manifest(folder)) {
    SCOPED_TRACE(row.file + ": " + row.must + ", " + row.note);
    if (!test::is_readable(row.file)) {
      ++done["compressed"];
      continue;
    }
    const std::string path = folder + row.file;
    test::CountedMemory memory;
    memory.cap = cap_of(path);
    try {
      RawMesh raw = read_raw(memory.hooks, path);
      const uint32_t points = raw.npoint(), tris = raw.ntri();
      EXPECT_FALSE(is_foreign(row)) << "a format that is not ours was read";
      if (!raw.tets.empty()) {
        const RestMesh mesh = finish_mesh(path, std::move(raw));
        expect_tets(row, mesh);
        ++done["tets"];
      } else {
        EXPECT_EQ(row.tets, 0u);
        const RestMesh mesh = finish_surface(path, std::move(raw));
        expect_surface(row, points, tris, mesh);
        ++done["surface"];
      }
      EXPECT_TRUE(row.must != "error" && row.must != "reject") << "was read";
    } catch (const Error &e) {
      EXPECT_NE(e.sentence.find(row.name()), std::string::npos) << e.sentence;
      if (is_foreign(row)) {
        EXPECT_EQ(e.status, DFM_E_UNSUPPORTED) << e.sentence;
        const bool converts = e.sentence.find("gmsh -3") != std::string::npos ||
                              e.sentence.find("meshio convert") != std::string::npos;
        EXPECT_TRUE(converts) << e.sentence;
        ++done["foreign"];
      } else {
        const bool may = row.must == "error" || row.must.find("reject") != std::string::npos;
        EXPECT_TRUE(may) << e.sentence;
        ++done["refused"];
      }
    }
  }
  uint32_t all = 0;
  for (const auto &[what, n] : done) all += n;
  EXPECT_EQ(all, 147u);
  EXPECT_EQ(done["foreign"], 1u);
}

TEST_F(PackedMeshes, DefectiveMeshes_AreRepairedAndReported) {
  const auto read = [&](const char *file) {
    return read_mesh(Memory::standard(), folder + "nasty/" + file, DFM_MESH_CELLS);
  };
  const auto reported = [](const RestMesh &m, const char *word) {
    return std::any_of(m.warnings.begin(), m.warnings.end(),
                       [&](const std::string &w) { return w.find(word) != std::string::npos; });
  };
  EXPECT_EQ(mesh_statistics(read("two_pieces.msh")).npiece, 2u);
  EXPECT_TRUE(reported(read("two_pieces.msh"), "2 pieces that share no point"));
  EXPECT_EQ(mesh_statistics(read("duplicate_vertices.vtk")).npiece, 2u);
  EXPECT_EQ(mesh_statistics(read("duplicate_vertices.vtk")).duplicate_points, 4u);
  EXPECT_TRUE(reported(read("duplicate_vertices.vtk"), "4 points"));
  EXPECT_EQ(read("duplicate_tets.vtk").dropped_cells, 2u);
  EXPECT_TRUE(reported(read("duplicate_tets.vtk"), "2 duplicate cells"));
  EXPECT_EQ(mesh_statistics(read("nonmanifold_contacts.vtk")).nonmanifold_edges, 1u);
  EXPECT_TRUE(reported(read("slivers.vtk"), "nearly flat"));
  EXPECT_NEAR(mesh_statistics(read("slivers.vtk")).quality_min, 0.0027, 5e-5);
  EXPECT_TRUE(reported(read("huge_offset.vtk"), "from the origin"));
  EXPECT_TRUE(reported(read("inverted_rest.vtk"), "tangled"));
  EXPECT_TRUE(reported(read("inverted_rest.vtk"), "39 of 324 cells"));
  EXPECT_TRUE(read("tiny_units.vtk").warnings.empty());
  EXPECT_TRUE(read("large_units.vtk").warnings.empty());
}

TEST_F(PackedMeshes, ThesisCylinders_HaveTheirPublishedCounts) {
  const struct {
    const char *file;
    uint32_t points, tets, triangles, edges;
  } rows[] = {{"cyl_222.msh", 222, 561, 412, 988},
              {"cyl_222.vtk", 222, 561, 412, 988},
              {"cyl_coarse.msh", 554, 2729, 906, 3735},
              {"cyl_fine.msh", 2579, 15092, 2386, 18863}};
  for (const auto &row : rows) {
    SCOPED_TRACE(row.file);
    const dfm_mesh_info s =
        mesh_statistics(read_mesh(Memory::standard(), folder + "thesis/" + row.file, DFM_MESH_CELLS));
    EXPECT_EQ(s.npoint, row.points);
    EXPECT_EQ(s.ntet, row.tets);
    EXPECT_EQ(s.ntriangle, row.triangles);
    EXPECT_EQ(s.nedge, row.edges);
  }
}

TEST_F(PackedMeshes, DefectiveSurfaces_AreRepairedAndReported) {
  const auto read = [&](const char *file) {
    return read_mesh(Memory::standard(), folder + "nasty/" + file, DFM_MESH_SURFACE);
  };
  EXPECT_GT(mesh_statistics(read("open_surface.obj")).open_edges, 0u);
  EXPECT_GT(read("mixed_winding.obj").turned, 0u);
  EXPECT_TRUE(mesh_statistics(read("mixed_winding.obj")).closed);
  EXPECT_EQ(mesh_statistics(read("nonmanifold_edge.ply")).nonmanifold_edges, 1u);
  EXPECT_GT(read("degenerate_triangles.off").dropped_cells, 0u);
  EXPECT_EQ(mesh_statistics(read("self_intersecting.stl")).npiece, 2u);
}
