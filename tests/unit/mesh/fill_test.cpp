// Filled surfaces: volumes against closed forms, the surface within the cells, dirt, sizes and
// places, refusals.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <random>
#include <set>

#include "fill_support.h"
#include "mesh/fill_lattice.h"
#include "mesh_support.h"

namespace {

using dfm::fill_surface;
using dfm::RestMesh;
using dfm::RestMesh;
using dfm::Vec3;

double material(const RestMesh &m) {
  double v = 0;
  for (uint32_t t = 0; t < m.ntet(); ++t)
    v += m.share[t] * dfm::tet_volume(m.points.data(), &m.tets[4 * size_t(t)]);
  return v;
}

Vec3 corner(const RestMesh &m, uint32_t t, int k) {
  return dfm::load3(&m.points[3 * size_t(m.tets[4 * size_t(t) + size_t(k)])]);
}

// Points spread over the triangles that lie in no cell, beyond `tolerance` lengths of the box.
uint32_t uncovered(const RestMesh &m, const RestMesh &s, uint32_t samples, double tolerance) {
  const dfm_mesh_info stat = dfm::mesh_statistics(m);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  uint32_t out = 0;
  for (uint32_t i = 0; i < samples; ++i) {
    const size_t t = size_t(random() % s.ntri());
    double u = unit(random), v = unit(random);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    if (i % 4 == 0) u = v = 0;  // corners, too
    const auto p = [&](size_t k) { return dfm::load3(&s.points[3 * size_t(s.tris[3 * t + k])]); };
    const Vec3 x = p(0) + (u * (p(1) - p(0)) + v * (p(2) - p(0)));
    bool found = false;
    for (uint32_t c = 0; c < m.ntet() && !found; ++c) {
      const Vec3 a = corner(m, c, 0);
      bool near = norm2(x - a) <= 1.21 * stat.edge_max * stat.edge_max;
      for (int f = 0; f < 4 && near; ++f) {
        const Vec3 o = corner(m, c, int(dfm::kTetFace[f][0]));
        const Vec3 n =
            cross(corner(m, c, int(dfm::kTetFace[f][1])) - o, corner(m, c, int(dfm::kTetFace[f][2])) - o);
        near = dot(n, x - o) <= tolerance * norm(n);
      }
      found = near;
    }
    out += !found;
  }
  return out;
}

void expect_valid(const RestMesh &m) {
  ASSERT_EQ(m.share.size(), m.ntet());
  ASSERT_EQ(m.tet_group.size(), m.ntet());
  ASSERT_EQ(m.file_point.size(), m.npoint());
  for (uint32_t t = 0; t < m.ntet(); ++t) {
    ASSERT_GT(dfm::tet_volume(m.points.data(), &m.tets[4 * size_t(t)]), 0) << "cell " << t;
    ASSERT_GT(m.share[t], 0) << "cell " << t;
    ASSERT_LE(m.share[t], 1) << "cell " << t;
  }
  EXPECT_GT(dfm::mesh_statistics(m).quality_min, 0.9);
}

// volume by closed form of the smooth shape, 0: of the triangles
struct Case {
  const char *name;
  RestMesh surface;
  double volume;
};

std::vector<Case> clean() {
  std::vector<Case> out;
  out.push_back({"ball", test::sphere_surface(0.5, 5), 4 * M_PI / 3 * 0.125});
  out.push_back({"box", test::box_surface({0, 0, 0}, {1, 0.4, 0.3}), 0.12});
  out.push_back({"torus", test::torus_surface(0.5, 0.15, 160, 80), 2 * M_PI * M_PI * 0.5 * 0.15 * 0.15});
  out.push_back({"plate", test::box_surface({0, 0, 0}, {1, 1, 0.002}), 0.002});
  out.push_back({"rod", test::box_surface({-1, 0, 0}, {1, 0.03, 0.04}), 0.0024});
  return out;
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Fill, CleanSurface_SharesSumUpToTheEnclosedVolume) {
  for (const Case &c : clean()) {
    SCOPED_TRACE(c.name);
    const RestMesh m = fill_surface(c.surface, 5000);
    expect_valid(m);
    EXPECT_NEAR(material(m), c.volume, 2e-3 * c.volume);
    EXPECT_NEAR(material(m), test::enclosed(c.surface), 1e-10 * c.volume);
    EXPECT_EQ(dfm::mesh_statistics(m).npiece, 1u);
    // what is thinner than its cells is named by PartsThinnerThanHalfACell_AreNamed
    EXPECT_TRUE(m.warnings.empty() || c.name == std::string("plate")) << m.warnings[0];
  }
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Fill, PartsThinnerThanHalfACell_AreNamed) {
  const auto thin = [](const RestMesh &surface, uint32_t cells) {
    for (const std::string &w : fill_surface(surface, cells).warnings)
      if (w.find(" % of the material is in parts thinner than half a cell") != std::string::npos)
        return std::stoi(w);
    return 0;
  };
  const RestMesh sheet = test::box_surface({0, 0, 0}, {1, 1, 0.004});
  EXPECT_EQ(thin(sheet, 1000), 100);
  EXPECT_EQ(thin(test::box_surface({0, 0, 0}, {1, 0.02, 0.02}), 200), 100);  // a rope
  EXPECT_EQ(thin(test::box_surface({0, 0, 0}, {1, 0.02, 0.02}), 2000), 0);
  EXPECT_EQ(thin(test::sphere_surface(0.5, 4), 50), 0);  // coarse, not thin
  EXPECT_EQ(thin(test::box_surface({0, 0, 0}, {1, 1, 1}), 50), 0);
  RestMesh lollipop = test::sphere_surface(0.1, 4);
  test::append(lollipop, test::box_surface({-0.5, 1, -0.002}, {0.5, 2, 0.002}));
  const int part = thin(lollipop, 2000);
  EXPECT_GT(part, 30);
  EXPECT_LT(part, 70);
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Fill, SampledShares_AgreeWithTheVolumeBeforeTheyAreMadeTo) {
  for (const Case &c : clean()) {
    SCOPED_TRACE(c.name);
    const dfm::FillSurface s(c.surface);
    dfm::Lattice lattice;
    lattice.half_pitch = 0.03;
    const dfm::FillCover cover = dfm::cover(s, lattice, UINT32_MAX);
    const dfm::FillShares shares = dfm::sample_shares(s, cover, lattice);
    double sum = 0, loose = 0;
    for (uint32_t i = 0; i < cover.cells.size(); ++i) {
      sum += shares.share[i];
      loose += shares.loose[i];
    }
    const double unit = dfm::kLatticeCell * 0.03 * 0.03 * 0.03;
    const double deviation = 0.5 * std::sqrt(shares.piece * loose) * unit;
    EXPECT_GT(loose, 0);
    EXPECT_NEAR(sum * unit, s.volume, 4 * deviation);
    EXPECT_LT(deviation, 0.02 * (s.volume + s.area * 0.03));
  }
}

// One face of a big box through the lattice: the share of a cell is what a plane leaves of it, known by
// clipping at finer and finer cuts.
TEST(Fill, ShareOfACellCutByAPlane_WithinItsStatedError) {
  const RestMesh box = test::box_surface({-1, -1, -1}, {1, 1, 0.0123});
  const dfm::FillSurface s(box);
  dfm::Lattice lattice;
  lattice.half_pitch = 0.05;
  const dfm::FillCover cover = dfm::cover(s, lattice, UINT32_MAX);
  const dfm::FillShares shares = dfm::sample_shares(s, cover, lattice);
  const double height = lattice.from_box((1 / s.size) * (Vec3{0, 0, 0.0123} - s.middle)).z;
  double worst = 0, sum2 = 0;
  uint32_t n = 0;
  for (uint32_t i = 0; i < cover.cells.size(); ++i) {
    dfm::Site site[4];
    dfm::corners_of(dfm::unpack(cover.cells[i]), site);
    double z[4], lo = 1e9, hi = -1e9;
    bool middle = cover.kind[i] == dfm::LatticeCell::crossed;
    for (int k = 0; k < 4; ++k) {
      z[k] = site[k].z;
      lo = std::min(lo, z[k]);
      hi = std::max(hi, z[k]);
      middle &= std::abs(site[k].x) < 6 && std::abs(site[k].y) < 6;
    }
    if (!middle || lo >= height || hi <= height) continue;
    // The part of a tetrahedron below a height: a divided difference of (height - z)^3 over its corners;
    // equal heights are set apart a little.
    for (int k = 0; k < 4; ++k) z[k] += 1e-4 * (k - 1.5);
    double below = 0;
    for (int k = 0; k < 4; ++k) {
      double term = height > z[k] ? std::pow(height - z[k], 3) : 0;
      for (int j = 0; j < 4; ++j) term /= j == k ? 1 : z[j] - z[k];
      below += term;
    }
    const double error = shares.share[i] - below;
    worst = std::max(worst, std::fabs(error));
    sum2 += error * error;
    ++n;
  }
  ASSERT_GT(n, 100u);
  EXPECT_LT(std::sqrt(sum2 / n), 0.01);
  EXPECT_LT(worst, 0.04);
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Fill, CleanSurface_LiesWithinTheCells) {
  for (const Case &c : clean()) {
    SCOPED_TRACE(c.name);
    EXPECT_EQ(uncovered(fill_surface(c.surface, 2000), c.surface, 500, 1e-8), 0u);
  }
}

TEST(Fill, AlignedBox_KeepsNoCellsThatItOnlyTouches) {
  // At this pitch the walls of the cube lie in planes of the lattice: the cells outside them hold nothing and
  // are not needed.
  const RestMesh cube = test::box_surface({0, 0, 0}, {1, 1, 1});
  const dfm::FillSurface s(cube);
  dfm::Lattice lattice;
  lattice.half_pitch = 0.125 / s.size;
  const dfm::FillCover cover = dfm::cover(s, lattice, UINT32_MAX);
  const dfm::FillShares shares = dfm::sample_shares(s, cover, lattice);
  double sum = 0;
  for (uint32_t i = 0; i < cover.cells.size(); ++i)
    if (cover.kind[i] != dfm::LatticeCell::outside) sum += shares.share[i];
  // 4^3 cubes of 12 cells; walls cut the cells across them in half
  EXPECT_NEAR(sum, 64 * 12, 1.5);
  // 4 cells around each of the 144 inner faces, and around each of the 96 in the walls
  EXPECT_EQ(cover.kept, 9u * 64 + 6u * 4 * 16);
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Fill, WantedNumber_IsMetWithinTenPercent) {
  for (const Case &c : clean())
    for (const uint32_t wanted : {300u, 2000u}) {
      const RestMesh m = fill_surface(c.surface, wanted);
      EXPECT_NEAR(m.ntet(), wanted, 0.1 * wanted) << c.name;
    }
  EXPECT_GE(fill_surface(test::sphere_surface(1, 3), 1).ntet(), 1u);
}

// A cut cell carries its material as if it filled it evenly, so a body is a little too wide: by 0.6 % of its
// inertia at 20,000 cells.
// unsanitized: too slow there; shorter tests run the same code
TEST(Fill, Ball_MassCenterAndInertiaWithinOnePercent) {
  const double r = 0.5;
  const RestMesh s = test::sphere_surface(r, 6, {0.3, -0.2, 0.1});
  const RestMesh m = fill_surface(s, 20000);
  double mass = 0, inertia = 0;
  Vec3 center;
  for (uint32_t t = 0; t < m.ntet(); ++t) {
    const double v = m.share[t] * dfm::tet_volume(m.points.data(), &m.tets[4 * size_t(t)]);
    Vec3 sum;
    double squares = 0;
    for (int k = 0; k < 4; ++k) {
      const Vec3 x = corner(m, t, k) - Vec3{0.3, -0.2, 0.1};
      sum += x;
      squares += x.x * x.x + x.y * x.y;
    }
    mass += v;
    center += (v / 4) * sum;
    // of a tetrahedron of even density, about z
    inertia += v / 20 * (squares + sum.x * sum.x + sum.y * sum.y);
  }
  const double truth = 4 * M_PI / 3 * r * r * r;
  EXPECT_NEAR(mass, truth, 0.01 * truth);
  EXPECT_LT(norm((1 / mass) * center), 0.01 * r);
  EXPECT_NEAR(inertia, 0.4 * truth * r * r, 0.01 * 0.4 * truth * r * r);
}

TEST(Fill, Shares_NeverBelowTheFloorOfTheirNeighborhood) {
  const RestMesh m = fill_surface(test::sphere_surface(0.5, 5), 5000);
  std::vector<double> fullest(m.npoint(), 0.0);
  for (size_t i = 0; i < m.tets.size(); ++i)
    fullest[m.tets[i]] = std::max(fullest[m.tets[i]], m.share[i / 4]);
  for (uint32_t t = 0; t < m.ntet(); ++t) {
    double most = 0;
    for (int k = 0; k < 4; ++k) most = std::max(most, fullest[m.tets[4 * size_t(t) + size_t(k)]]);
    EXPECT_GE(m.share[t], 0.08 * most) << t;
  }
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Fill, HolesAndFlippedTriangles_ChangeTheVolumeByLittle) {
  const RestMesh clean = test::sphere_surface(0.5, 4);
  const double volume = test::enclosed(clean);
  RestMesh holes = clean, flips = clean;
  for (uint32_t t = 40; t-- > 0;) test::remove(holes, 51 * t);
  for (uint32_t t = 0; t < 40; ++t) test::flip(flips, 51 * t);
  for (const RestMesh *s : {&holes, &flips}) {
    const RestMesh m = fill_surface(*s, 1500);
    expect_valid(m);
    EXPECT_NEAR(material(m), volume, 0.02 * volume);
    EXPECT_EQ(dfm::mesh_statistics(m).npiece, 1u);
    ASSERT_EQ(m.warnings.size(), 1u);
    EXPECT_NE(m.warnings[0].find("openings"), std::string::npos) << m.warnings[0];
  }
}

TEST(Fill, ShellsThroughEachOther_CountWhatIsInsideOnce) {
  RestMesh two = test::sphere_surface(0.5, 5);
  test::append(two, test::sphere_surface(0.5, 5, {0.5, 0, 0}));
  const RestMesh m = fill_surface(two, 5000);
  // of two balls of radius r at distance r: 5 pi r^3 / 12
  const double ball = 4 * M_PI / 3 * 0.125, lens = 5 * M_PI / 12 * 0.125;
  EXPECT_NEAR(material(m), 2 * ball - lens, 0.005 * ball);
  ASSERT_EQ(m.warnings.size(), 1u);
  EXPECT_NE(m.warnings[0].find("crosses itself"), std::string::npos);
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Fill, CavityAndSecondPiece_AreSeen) {
  RestMesh hollow = test::sphere_surface(0.5, 5), inner = test::sphere_surface(0.3, 5);
  for (uint32_t t = 0; t < inner.ntri(); ++t) test::flip(inner, t);
  test::append(hollow, inner);
  EXPECT_NEAR(material(fill_surface(hollow, 5000)), 4 * M_PI / 3 * (0.125 - 0.027), 0.005);
  RestMesh two = test::sphere_surface(0.5, 4);
  test::append(two, test::sphere_surface(0.5, 4, {1.5, 0, 0}));
  EXPECT_EQ(dfm::mesh_statistics(fill_surface(two, 5000)).npiece, 2u);
}

TEST(Fill, HangingTriangles_AreLeftOutAndReported) {
  RestMesh m = test::sphere_surface(0.5, 4);
  test::append(m, test::surface_of({{2, 0, 0}, {2.1, 0, 0}, {2, 0.1, 0}}, {{0, 1, 2}}));
  const RestMesh filled = fill_surface(m, 1000);
  const dfm_mesh_info s = dfm::mesh_statistics(filled);
  EXPECT_EQ(s.npiece, 1u);
  EXPECT_LT(s.hi[0], 1);
  ASSERT_GE(filled.warnings.size(), 2u);
  EXPECT_NE(filled.warnings[1].find("enclose nothing"), std::string::npos) << filled.warnings[1];
}

TEST(Fill, NanometersKilometersAndFarAway_GiveTheSameCells) {
  const RestMesh unit = fill_surface(test::sphere_surface(1, 4), 1000);
  for (const double size : {1e-9, 1e5}) {
    const RestMesh m = fill_surface(test::sphere_surface(size, 4), 1000);
    ASSERT_EQ(m.ntet(), unit.ntet());
    EXPECT_TRUE(std::equal(m.tets.begin(), m.tets.end(), unit.tets.begin()));
    EXPECT_NEAR(material(m) / (size * size * size), material(unit), 1e-9);
  }
  const RestMesh away = test::sphere_surface(0.1, 4, {1e7, -1e7, 1e7});
  const RestMesh far = fill_surface(away, 1000);
  expect_valid(far);
  EXPECT_NEAR(far.ntet(), 1000, 100);
  EXPECT_EQ(uncovered(far, away, 300, 1e-8), 0u);
  const double volume = material(unit) * 1e-3;
  EXPECT_NEAR(material(far), volume, 1e-5 * volume);
}

TEST(Fill, SameSurface_SameBits) {
  const RestMesh s = test::torus_surface(0.5, 0.2, 40, 20);
  const RestMesh a = fill_surface(s, 2000), b = fill_surface(s, 2000);
  ASSERT_EQ(a.points.size(), b.points.size());
  EXPECT_EQ(std::memcmp(a.points.data(), b.points.data(), a.points.size() * sizeof(double)), 0);
  EXPECT_EQ(std::memcmp(a.share.data(), b.share.data(), a.share.size() * sizeof(double)), 0);
  EXPECT_TRUE(a.tets == b.tets);
}

std::string refusal(const RestMesh &s, uint32_t cells) {
  try {
    fill_surface(s, cells);
  } catch (const dfm::Error &e) {
    return e.sentence;
  }
  return "";
}

TEST(Fill, HugeOpening_IsRefusedWithItsSize) {
  RestMesh half = test::sphere_surface(1, 4);
  for (uint32_t t = half.ntri(); t-- > 0;) {
    double z = 0;
    for (size_t k = 0; k < 3; ++k) z += half.points[3 * size_t(half.tris[3 * size_t(t) + k]) + 2];
    if (z > 0) test::remove(half, t);
  }
  const std::string text = refusal(half, 1000);
  EXPECT_NE(text.find("1 opening of 3.14 m2"), std::string::npos) << text;
  EXPECT_NE(text.find("a diagonal of 2.83 m"), std::string::npos) << text;
  RestMesh cube = test::box_surface({0, 0, 0}, {1, 1, 1});
  test::remove(cube, 0);
  test::remove(cube, 0);
  EXPECT_NE(refusal(cube, 1000).find("1 opening of 1 m2"), std::string::npos);
}

TEST(Fill, NothingToFill_IsRefused) {
  EXPECT_NE(refusal(test::surface_of({}, {}), 100).find("no triangles"), std::string::npos);
  EXPECT_NE(refusal(test::surface_of({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, {{0, 1, 2}}), 100).find("no area"),
            std::string::npos);
  EXPECT_NE(refusal(test::sphere_surface(1, 2), 0).find("cells is 0"), std::string::npos);
  RestMesh inside_out = test::sphere_surface(1, 2);
  for (uint32_t t = 0; t < inside_out.ntri(); ++t) test::flip(inside_out, t);
  EXPECT_NE(refusal(inside_out, 100).find("nothing lies inside"), std::string::npos)
      << refusal(inside_out, 100);
}

void expect_fills(const RestMesh &s, uint32_t cells) {
  const RestMesh m = fill_surface(s, cells);
  expect_valid(m);
  EXPECT_NEAR(m.ntet(), cells, 0.1 * cells);
  EXPECT_NEAR(material(m), test::enclosed(s), 0.02 * test::enclosed(s));
  EXPECT_EQ(uncovered(m, s, 50, 1e-7 * std::cbrt(material(m))), 0u);
}

// A flat region of triangles, drawn out along z: its outline, inner ones too, becomes walls.
RestMesh prism(const std::vector<std::array<double, 2>> &region,
               const std::vector<std::array<uint32_t, 3>> &tris, double depth) {
  const uint32_t n = uint32_t(region.size());
  std::vector<Vec3> p;
  for (const double z : {0.0, depth})
    for (const auto &x : region) p.push_back({x[0], x[1], z});
  std::set<std::pair<uint32_t, uint32_t>> edges;
  std::vector<std::array<uint32_t, 3>> t;
  for (const auto &[a, b, c] : tris) {
    t.push_back({a, c, b});
    t.push_back({n + a, n + b, n + c});
    edges.insert({{a, b}, {b, c}, {c, a}});
  }
  for (const auto &[a, b] : edges) {
    if (edges.count({b, a})) continue;
    t.push_back({a, b, n + b});
    t.push_back({a, n + b, n + a});
  }
  return test::surface_of(p, t);
}

TEST(Fill, SharpShapes_AreFilled) {
  const struct {
    const char *name;
    RestMesh surface;
    double volume;
  } shapes[] = {
      {"spike",
       test::surface_of({{-.5, -.5, 0}, {.5, -.5, 0}, {.5, .5, 0}, {-.5, .5, 0}, {0, 0, 3}},
                        {{0, 2, 1}, {0, 3, 2}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}),
       1},
      {"wedge", prism({{-.5, 0}, {.5, 0}, {0, 3}}, {{0, 1, 2}}, 2), 3},
      {"cliff", prism({{-.75, 0}, {.75, 0}, {.5, 1}, {-.5, 1}}, {{0, 1, 2}, {0, 2, 3}}, 1.5), 1.875},
      {"crack",
       prism({{-1, -.5}, {0, -.5}, {1, -.5}, {1, .5}, {.4, .5}, {0, 0}, {-.4, .5}, {-1, .5}},
             {{0, 1, 5}, {0, 5, 6}, {0, 6, 7}, {1, 2, 5}, {2, 4, 5}, {2, 3, 4}}, 4),
       7.2},
      {"hole",
       prism({{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {-.5, -.5}, {.5, -.5}, {.5, .5}, {-.5, .5}},
             {{0, 1, 5}, {0, 5, 4}, {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}}, 1),
       3},
      {"edges within a plane",
       prism({{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {.2, .1}}, {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}, 1),
       4}};
  for (const auto &shape : shapes) {
    SCOPED_TRACE(shape.name);
    ASSERT_NEAR(test::enclosed(shape.surface), shape.volume, 1e-12);
    expect_fills(shape.surface, 1000);
  }
}

// Every surface that closes, as read.
void expect_files_fill(const std::vector<std::string> &files, uint32_t cells, size_t number) {
  EXPECT_EQ(files.size(), number);
  for (const std::string &path : files) {
    SCOPED_TRACE(path);
    expect_fills(dfm::read_mesh(dfm::Memory::standard(), path, DFM_MESH_SURFACE), cells);
  }
}
std::vector<std::string> surfaces_of(const std::string &folder) {
  return test::files_of(test::mesh_dir() + "/" + folder, {".obj", ".ply", ".stl", ".off"});
}

// unsanitized: too slow there; shorter tests run the same code
TEST(FillFiles, ThesisOrgansAndCylinders_Fill) { expect_files_fill(surfaces_of("thesis"), 5000, 4); }
TEST(FillFiles, OrganAndRabbit_Fill) {
  const std::string data = DEFORM_SOURCE_DIR "/examples/data/";
  expect_files_fill({data + "organ.obj", data + "rabbit.obj"}, 3000, 2);
}
TEST(FillFiles, EveryDialect_Fills) { expect_files_fill(surfaces_of("formats"), 300, 18); }

}  // namespace
