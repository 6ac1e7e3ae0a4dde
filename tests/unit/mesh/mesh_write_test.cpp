// Writers: what is written reads back to the bit, and a failed write leaves nothing behind.
#include <gtest/gtest.h>

#include <sys/resource.h>

#include <csignal>
#include <cstring>
#include <map>
#include <set>

#include "mesh_support.h"

using namespace dfm;

namespace {

std::string folder() { return test::scratch("mesh_write"); }

// Coordinates that need all 17 digits, cells of alternating groups.
RestMesh sample() {
  RestMesh m = make_ball(Memory::standard(), 1.0 / 3, 500);
  m.groups.push_back({"skin", 2, 3, {0, 1}});
  m.groups.push_back({"inner part", 3, 4, {}});
  m.groups.push_back({"outer", 3, 9, {}});
  for (uint32_t t = 0; t < m.ntet(); ++t) m.tet_group[t] = t % 7 < 3 ? 1 : t % 7 == 5 ? kNoGroup : 2;
  return m;
}

void expect_same_bits(const RestMesh &a, const RestMesh &b) {
  ASSERT_EQ(a.points.size(), b.points.size());
  EXPECT_EQ(std::memcmp(a.points.data(), b.points.data(), a.points.size() * sizeof(double)), 0);
  EXPECT_EQ(a.tets, b.tets);
}

size_t files_in(const std::string &path) {
  return size_t(std::distance(std::filesystem::directory_iterator(path), {}));
}

}  // namespace

TEST(MeshWrite, MshBinary_ReadsBackToTheBitWithGroups) {
  const RestMesh m = sample();
  for (const char *name : {"/a.msh", "/a.msh2", "/UPPER.MSH"}) {
    SCOPED_TRACE(name);
    write_mesh(m, folder() + name);
    const RestMesh back = read_mesh(Memory::standard(), folder() + name, DFM_MESH_CELLS);
    expect_same_bits(m, back);
    ASSERT_EQ(back.groups.size(), 2u);
    EXPECT_EQ(back.groups[0].name, "inner part");
    EXPECT_EQ(back.groups[0].tag, 4);
    EXPECT_EQ(back.groups[1].name, "outer");
    for (uint32_t t = 0; t < m.ntet(); ++t)
      ASSERT_EQ(back.tet_group[t], m.tet_group[t] == kNoGroup ? kNoGroup : m.tet_group[t] - 1);
    EXPECT_TRUE(back.warnings.empty());
  }
}

TEST(MeshWrite, VtkBinary_ReadsBackToTheBit) {
  const RestMesh m = sample();
  write_mesh(m, folder() + "/a.vtk");
  expect_same_bits(m, read_mesh(Memory::standard(), folder() + "/a.vtk", DFM_MESH_CELLS));
}

namespace {

// A beam whose ends are named: groups of cells, of triangles, of points, and of lines, of which only the
// points are known.
RestMesh grouped() {
  RestMesh m = make_beam(Memory::standard(), 2, 1, 1, 100);
  m.groups.push_back({"corner", 0, 4, {0, 1}});
  m.groups.push_back({"edge", 1, 5, {0, 1}});
  m.groups.push_back({"left end", 2, 8, {}});
  m.groups.push_back({"right", 2, 9, {}});
  m.groups.push_back({"soft", 3, 2, {}});
  m.groups.push_back({"hard", 3, -7, {}});
  for (uint32_t t = 0; t < m.ntet(); ++t) m.tet_group[t] = t % 3 == 0 ? kNoGroup : 3 + t % 3;
  const Array<uint32_t> boundary = boundary_triangles(m.tets);
  for (size_t t = 0; t < boundary.size(); t += 3)
    for (const double end : {0.0, 2.0}) {
      bool there = true;
      for (size_t k = 0; k < 3; ++k) there = there && m.points[3 * size_t(boundary[t + k])] == end;
      if (!there) continue;
      m.tris.insert(m.tris.end(), &boundary[t], &boundary[t] + 3);
      m.tri_group.push_back(end == 0.0 ? 2 : 3);
    }
  return m;
}

using Named = std::map<std::pair<int32_t, std::string>, std::set<uint32_t>>;

// By dimension and name (number where the format keeps no names): the elements.
Named named(const RestMesh &m, bool by_number) {
  Named out;
  const auto key = [&](uint32_t g) {
    return std::pair(m.groups[g].dimension, by_number ? std::to_string(m.groups[g].tag) : m.groups[g].name);
  };
  for (uint32_t t = 0; t < m.ntet(); ++t)
    if (m.tet_group[t] != kNoGroup) out[key(m.tet_group[t])].insert(t);
  for (size_t t = 0; t < m.tri_group.size(); ++t) {
    out[key(m.tri_group[t])].insert(m.tris[3 * t]);
    out[key(m.tri_group[t])].insert(m.tris[3 * t + 1]);
    out[key(m.tri_group[t])].insert(m.tris[3 * t + 2]);
  }
  return out;
}

}  // namespace

TEST(MeshWrite, Groups_SurviveEveryFormat) {
  const RestMesh m = grouped();
  ASSERT_GT(m.tri_group.size(), 4u);
  for (const char *name : {"/g.msh", "/g.msh2", "/g.vtk", "/g.vtu", "/g.mesh"}) {
    SCOPED_TRACE(name);
    write_mesh(m, folder() + name);
    const RestMesh back = read_mesh(Memory::standard(), folder() + name, DFM_MESH_CELLS);
    expect_same_bits(m, back);
    const bool by_number = std::strcmp(name, "/g.mesh") == 0;
    EXPECT_EQ(named(back, by_number), named(m, by_number));
    const auto corner = std::find_if(back.groups.begin(), back.groups.end(),
                                     [](const MeshGroup &g) { return g.dimension == 0; });
    ASSERT_EQ(corner != back.groups.end(), std::strstr(name, ".msh") != nullptr);
    if (corner != back.groups.end()) {
      EXPECT_EQ(corner->points, (Array<uint32_t>{0, 1}));
    }
    EXPECT_TRUE(back.warnings.empty());
  }
}

TEST(MeshWrite, Vtu_HasTheShareOfFilledCells) {
  RestMesh m = grouped();
  for (uint32_t t = 0; t < m.ntet(); ++t) m.share.push_back(1.0 / (t + 1));
  write_mesh(m, folder() + "/share.vtu");
  const std::string text = test::read_file(folder() + "/share.vtu");
  const size_t at = text.find("Name=\"share\"");
  ASSERT_NE(at, std::string::npos);
  const size_t data =
      text.find("<AppendedData encoding=\"raw\">\n_") + std::strlen("<AppendedData encoding=\"raw\">\n_");
  const size_t start = data + std::stoul(text.substr(text.find("offset=\"", at) + 8));
  uint64_t bytes = 0;
  std::memcpy(&bytes, &text[start], 8);
  EXPECT_EQ(bytes, 8 * (m.ntet() + m.tri_group.size()));
  EXPECT_EQ(std::memcmp(&text[start + 8], m.share.data(), 8 * m.share.size()), 0);
  expect_same_bits(m, read_mesh(Memory::standard(), folder() + "/share.vtu", DFM_MESH_CELLS));
  write_mesh(m, folder() + "/share.vtk");
  expect_same_bits(m, read_mesh(Memory::standard(), folder() + "/share.vtk", DFM_MESH_CELLS));
}

// A program that mirrors points leaves cells with negative volume, and the weights of their material.
TEST(MeshWrite, MirroredLattice_HasItsMaterialWhereItWas) {
  RestMesh m = make_lattice(make_ball_surface(Memory::standard(), 0.1, 320), 60, 0);
  ASSERT_FALSE(m.inside.empty());
  for (size_t k = 0; k < m.points.size(); k += 3) m.points[k] *= -1;
  write_mesh(m, folder() + "/mirrored.vtu");
  const RestMesh back = read_mesh(Memory::standard(), folder() + "/mirrored.vtu", DFM_MESH_CELLS);
  ASSERT_EQ(back.turned, m.cells.size() / 8);
  ASSERT_EQ(back.inside.size(), m.inside.size());
  for (size_t c = 0; c < back.turned; ++c) {
    Vec3 was, is;
    const auto moment = [&](const RestMesh &of, Vec3 &sum) {
      each_inside(of.points.data(), 3, &of.cells[8 * c], &of.inside[kInsidePoints * c],
                  [&](double volume, Vec3 place) { sum += volume * place; });
    };
    moment(m, was);
    moment(back, is);
    EXPECT_LT(norm(is + was), 1e-15) << "cell " << c;  // of negative volume before
  }
}

TEST(MeshWrite, GroupName_EndsWithItsLine) {
  RestMesh m = grouped();
  m.groups[0].name = "two\nlines";
  for (const char *name : {"/n.msh", "/n.msh2"}) {
    write_mesh(m, folder() + name);
    EXPECT_EQ(read_mesh(Memory::standard(), folder() + name, DFM_MESH_CELLS).groups[0].name, "two_lines");
  }
}

TEST(MeshWrite, FailedWrite_LeavesOldFileAndNothingElse) {
  const std::string home = test::scratch("mesh_write_failed");
  std::filesystem::remove_all(home);
  std::filesystem::create_directories(home + "/taken.msh/inside");
  // a folder stands there: renaming fails
  EXPECT_THROW(write_mesh(sample(), home + "/taken.msh"), Error);
  EXPECT_EQ(files_in(home), 1u);
  EXPECT_THROW(write_mesh(sample(), home + "/none/a.msh"), Error);
  test::write_file(home + "/old.obj", "old");
  try {
    write_mesh(sample(), home + "/old.obj");
    ADD_FAILURE();
  } catch (const Error &e) {
    EXPECT_EQ(e.status, DFM_E_UNSUPPORTED);
    EXPECT_NE(e.sentence.find(".vtk"), std::string::npos);
  }
  EXPECT_EQ(test::read_file(home + "/old.obj"), "old");
  EXPECT_EQ(files_in(home), 2u);
}

TEST(MeshWrite, DiskThatFills_LeavesNothing) {
  const std::string home = test::scratch("mesh_write_full");
  std::filesystem::remove_all(home);
  std::filesystem::create_directories(home);
  std::signal(SIGXFSZ, SIG_IGN);  // so that the limit shows as a failing write, as a full disk does
  rlimit before{}, small{};
  getrlimit(RLIMIT_FSIZE, &before);
  small.rlim_cur = 4096;
  small.rlim_max = before.rlim_max;
  setrlimit(RLIMIT_FSIZE, &small);
  for (const char *name : {"/a.msh", "/a.msh2", "/a.vtk", "/a.vtu", "/a.mesh"}) {
    try {
      write_mesh(sample(), home + name);
      ADD_FAILURE() << name;
    } catch (const Error &e) {
      EXPECT_EQ(e.status, DFM_E_IO);
      EXPECT_NE(e.sentence.find("cannot be written"), std::string::npos) << e.sentence;
    }
  }
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(files_in(home), 0u);
}

TEST(MeshWrite, Vtu_OffsetsLeadToItsArrays) {
  const RestMesh m = make_beam(Memory::standard(), 2, 1, 1, 24);
  std::vector<double> u(m.points.size(), 0.25), energy(m.ntet(), 7);
  std::vector<uint32_t> part(m.ntet(), 3);
  VtuGrid grid;
  grid.npoint = m.npoint();
  grid.ncell = m.ntet();
  grid.points = m.points.data();
  grid.cells = m.tets.data();
  grid.point_data = {{"u", 3, u.data(), nullptr}};
  grid.cell_data = {{"energy \"density\" <J>", 1, energy.data(), nullptr}, {"part", 1, nullptr, part.data()}};
  write_vtu(folder() + "/a.vtu", grid);
  const std::string text = test::read_file(folder() + "/a.vtu");
  EXPECT_NE(text.find("NumberOfPoints=\"" + std::to_string(m.npoint()) + "\" NumberOfCells=\"" +
                      std::to_string(m.ntet()) + "\""),
            std::string::npos);
  const size_t data =
      text.find("<AppendedData encoding=\"raw\">\n_") + std::strlen("<AppendedData encoding=\"raw\">\n_");
  size_t end = data;
  const auto block = [&](const std::string &name) {
    const size_t at = text.find("Name=\"" + name + "\""), offset = text.find("offset=\"", at);
    EXPECT_NE(at, std::string::npos) << name;
    const size_t start = data + std::stoul(text.substr(offset + 8));
    uint64_t bytes = 0;
    std::memcpy(&bytes, &text[start], 8);
    end = std::max(end, start + 8 + bytes);
    return text.substr(start + 8, bytes);
  };
  const auto same = [](const std::string &bytes, const void *values, size_t size) {
    return bytes.size() == size && std::memcmp(bytes.data(), values, size) == 0;
  };
  EXPECT_TRUE(same(block("Points"), m.points.data(), m.points.size() * 8));
  EXPECT_TRUE(same(block("u"), u.data(), u.size() * 8));
  EXPECT_TRUE(same(block("energy &quot;density&quot; &lt;J>"), energy.data(), energy.size() * 8));
  EXPECT_TRUE(same(block("part"), part.data(), part.size() * 4));
  EXPECT_TRUE(same(block("connectivity"), m.tets.data(), m.tets.size() * 4));
  const std::string offsets = block("offsets");
  uint32_t last = 0;
  std::memcpy(&last, &offsets[offsets.size() - 4], 4);
  EXPECT_EQ(last, 4 * m.ntet());
  EXPECT_EQ(block("types"), std::string(m.ntet(), '\12'));
  EXPECT_EQ(text.substr(end), "\n  </AppendedData>\n</VTKFile>\n");
}

TEST(MeshWrite, VtuOfTriangles_HasTriangleCells) {
  const RestMesh m = make_beam(Memory::standard(), 1, 1, 1, 12);
  const Array<uint32_t> tri = boundary_triangles(m.tets);
  VtuGrid grid;
  grid.npoint = m.npoint();
  grid.ncell = uint32_t(tri.size() / 3);
  grid.corners = 3;
  grid.points = m.points.data();
  grid.cells = tri.data();
  write_vtu(folder() + "/t.vtu", grid);
  const std::string text = test::read_file(folder() + "/t.vtu"), end = "\n  </AppendedData>\n</VTKFile>\n";
  EXPECT_EQ(text.substr(text.size() - end.size() - grid.ncell, grid.ncell), std::string(grid.ncell, '\5'));
}
