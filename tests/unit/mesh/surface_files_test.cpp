// Surfaces of the packed meshes: each meets the fate that its note foretells, and the boundary of a body
// encloses the body's volume.
#include <gtest/gtest.h>

#include <cmath>

#include "mesh/mesh.h"
#include "mesh_support.h"

using namespace dfm;

namespace {

std::string meshes() { return test::mesh_dir() + "/"; }

struct Fate {
  const char *file;
  uint32_t npoint, ntri, npiece, open_edges, holes, nonmanifold;
  double volume;
  const char *warning;
};

}  // namespace

TEST(SurfaceFiles, DefectiveFiles_GiveTheExpectedResults) {
  for (const Fate &f :
       {Fate{"nasty/degenerate_triangles.off", 92, 180, 1, 0, 0, 0, 0.002,
             "2 triangles without area were dropped"},
        {"nasty/mixed_winding.obj", 92, 180, 1, 0, 0, 0, 0.002, "45 of 180 triangles faced the wrong way"},
        {"nasty/nonmanifold_edge.ply", 92, 181, 1, 2, 1, 1, 0, "1 edge is used by more than two triangles"},
        {"nasty/open_surface.obj", 91, 173, 1, 7, 1, 0, 0, "the surface is open: 7 edges"},
        {"nasty/self_intersecting.stl", 184, 360, 2, 0, 0, 0, 0.004, ""},
        {"formats/surf_ngon.obj", 12, 20, 1, 0, 0, 0, 1.5 * std::sqrt(3.0), ""},
        {"formats/surf_ascii_two_solids.stl", 121, 238, 1, 0, 0, 0, -1, ""},
        {"formats/surf_bin.stl", 121, 238, 1, 0, 0, 0, -1, ""},
        {"thesis/liverlike1.stl", 2401, 4798, 1, 0, 0, 0, -1, ""}}) {
    const RestMesh m = read_mesh(Memory::standard(), meshes() + f.file, DFM_MESH_SURFACE);
    const dfm_mesh_info s = mesh_statistics(m);
    EXPECT_EQ(s.npoint, f.npoint) << f.file;
    EXPECT_EQ(s.ntriangle, f.ntri) << f.file;
    EXPECT_EQ(s.npiece, f.npiece) << f.file;
    EXPECT_EQ(s.open_edges, f.open_edges) << f.file;
    EXPECT_EQ(s.holes, f.holes) << f.file;
    EXPECT_EQ(s.nonmanifold_edges, f.nonmanifold) << f.file;
    EXPECT_EQ(s.closed, f.open_edges + f.nonmanifold == 0) << f.file;
    if (f.volume > 0) {
      EXPECT_NEAR(s.volume / f.volume, 1, 1e-7) << f.file;
    }
    std::string reported;
    for (const std::string &w : m.warnings) reported += w + "\n";
    EXPECT_NE(reported.find(f.warning), std::string::npos) << f.file << ": " << reported;
    if (std::string(f.file).ends_with(".stl")) {
      EXPECT_EQ(reported, "") << f.file << ": every STL repeats the corners of its triangles";
    }
  }
}

// The same surface in every format: those of one precision give the same box and volume.
TEST(SurfaceFiles, OneSurfaceInManyFormats_IsOneSurface) {
  const double volume =
      mesh_statistics(read_mesh(Memory::standard(), meshes() + "formats/surf_plain.obj", DFM_MESH_SURFACE))
          .volume;
  EXPECT_GT(volume, 0);
  uint32_t n = 0;
  for (const std::string &file : test::files_of(meshes() + "formats", {".obj", ".ply", ".stl", ".off"})) {
    if (file.find("ngon") != std::string::npos) continue;
    const dfm_mesh_info s = mesh_statistics(read_mesh(Memory::standard(), file, DFM_MESH_SURFACE));
    EXPECT_TRUE(s.closed) << file;
    EXPECT_EQ(s.npoint, 121u) << file;
    EXPECT_NEAR(s.volume / volume, 1, 1e-6) << file;
    ++n;
  }
  EXPECT_GE(n, 16u);
}

// unsanitized: too slow there; shorter tests run the same code
TEST(SurfaceFiles, BoundaryOfABody_EnclosesItsVolume) {
  uint32_t n = 0;
  for (const char *folder : {"bars", "misc", "spheres", "formats", "nasty", "bench"})
    for (const std::string &file : test::files_of(meshes() + folder, {".msh", ".vtk", ".vtu", ".mesh"})) {
      if (test::refusal(file)) continue;
      const RestMesh body = read_mesh(Memory::standard(), file, DFM_MESH_CELLS);
      const dfm_mesh_info b = mesh_statistics(body);
      // tangled: no surface encloses it; the large ones say nothing new
      if (body.overlapping || b.ntet > 6000) continue;
      const dfm_mesh_info s = mesh_statistics(read_mesh(Memory::standard(), file, DFM_MESH_SURFACE));
      EXPECT_NEAR(s.volume / b.volume, 1, 1e-12) << file;
      EXPECT_EQ(s.closed, b.nonmanifold_edges == 0) << file;
      if (b.duplicate_points == 0) {
        EXPECT_EQ(s.ntriangle, b.ntriangle) << file;
      }
      ++n;
    }
  EXPECT_GE(n, 50u);
}

// The wall of the hole is a piece of its own and faces into the hole: 4/3 pi (0.05^3 - 0.035^3) less what
// polyhedra cut off.
TEST(SurfaceFiles, HollowBall_HasTwoPiecesAndItsShellsVolume) {
  const RestMesh m = read_mesh(Memory::standard(), meshes() + "misc/shell_sphere.msh", DFM_MESH_SURFACE);
  const dfm_mesh_info s = mesh_statistics(m);
  EXPECT_EQ(s.npiece, 2u);
  EXPECT_NEAR(s.volume, 3.44e-4, 0.12e-4);
  EXPECT_EQ(m.turned, 0u) << "cells already say which side is outside";
}
