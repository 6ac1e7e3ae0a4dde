// Detection of two crossed fine cylinders (meshes/thesis/cyl_fine.msh), pressed flat against each other: at
// rest, and with the upper one rolling at 50 mm/s. Step 0.25 ms; time per step, one core.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>

#include "../unit/narrow/detect_scene.h"
#include "body/obstacle_mesh.h"
#include "geometry/voxel_grid.h"
#include "mesh/mesh.h"
#include "support.h"

namespace {

using namespace dfm;
using test::Scene;

constexpr double kStep = 0.25e-3, kRadius = 0.02, kSqueeze = 0.4e-3;

// Axis along y through the origin, radius kRadius.
test::Mesh fine_cylinder() {
  const RestMesh tets =
      read_mesh(Memory::standard(), test::mesh_dir() + "/thesis/cyl_fine.msh", DFM_MESH_CELLS);
  const Array<uint32_t> tri = boundary_triangles(tets.tets);
  test::Mesh m;
  m.x.assign(tets.points.begin(), tets.points.end());
  m.tri.assign(tri.begin(), tri.end());
  Vec3 lo{1e9, 1e9, 1e9}, hi{-1e9, -1e9, -1e9};
  for (uint32_t i = 0; i < m.npoint(); ++i)
    for (int k = 0; k < 3; ++k) {
      lo[k] = std::min(lo[k], m.at(i)[k]);
      hi[k] = std::max(hi[k], m.at(i)[k]);
    }
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (hi[k] - lo[k] > hi[axis] - lo[axis]) axis = k;
  const double scale = 2 * kRadius / (hi[(axis + 1) % 3] - lo[(axis + 1) % 3]);
  for (uint32_t i = 0; i < m.npoint(); ++i) {
    const Vec3 p = m.at(i) - 0.5 * (lo + hi);
    store3(&m.x[3 * i], scale * Vec3{p[(axis + 2) % 3], p[axis], p[(axis + 1) % 3]});
  }
  return m;
}

struct Pair {
  Scene scene;
  test::Mesh rest;
  double angle = 0, x = 0;
  explicit Pair(bool parallel) : rest(fine_cylinder()) {
    scene.h = kStep;
    scene.add(test::moved(rest, parallel ? Quat{} : test::turn({0, 0, 1}, M_PI / 2), {0, 0, -kRadius}));
    scene.add(test::moved(rest, {}, {0, 0, kRadius}));
    scene.offset = 1e-3 * scene.surfaces[0]->median_edge;
    Surface &lower = *scene.surfaces[0];
    for (uint32_t i = 0; i < lower.nsurfel; ++i) flatten(lower.x[4 * i + 2], -1);
    roll(0);
  }
  // Pressed into the plane z = 0, half the rest distance away from it.
  void flatten(double &z, double side) const { z = side * std::max(side * z - kSqueeze, 0.5 * scene.offset); }
  void roll(double speed) {
    x += speed * kStep;
    angle += speed * kStep / kRadius;
    Surface &upper = *scene.surfaces[1];
    for (uint32_t i = 0; i < upper.nsurfel; ++i) {
      const Vec3 r = rotate(test::turn({0, 1, 0}, angle), rest.at(upper.point[i]));
      const Vec3 p = r + Vec3{x, 0, kRadius};
      store3(&upper.x[4 * i], p);
      store3(&upper.v[4 * i], (speed / kRadius) * Vec3{p.z, 0, x - p.x});
      flatten(upper.x[4 * i + 2], 1);
    }
  }
};

void pair_step(benchmark::State &state, bool parallel, double speed) {
  Pair pair(parallel);
  Scene &s = pair.scene;
  BroadPhase broad(Memory::standard());
  Array<ContactPoint> contacts;
  Array<uint8_t> lent;
  double n = 0, candidates = 0, steps = 0;
  for (auto _ : state) {
    if (speed > 0) {
      state.PauseTiming();
      pair.roll(std::fmod(steps, 800) < 400 ? speed : -speed);  // to and fro by 5 mm
      state.ResumeTiming();
    }
    broad.update(s.bodies, s.obstacles, s.filter, s.h, s.offset);
    find_contacts(s.bodies, s.obstacles, broad.candidates(), s.h, s.offset, {}, lent, contacts);
    n += double(contacts.size());
    candidates += double(broad.candidates().size());
    steps += 1;
  }
  state.counters["contacts"] = n / steps;
  state.counters["candidates"] = candidates / steps;
  state.counters["renewals_per_step"] = double(broad.stats().renewals) / steps;
}
BENCHMARK_CAPTURE(pair_step, crossed_rest, false, 0.0);
BENCHMARK_CAPTURE(pair_step, crossed_rolling, false, 0.05)->Iterations(4000);
BENCHMARK_CAPTURE(pair_step, parallel_rest, true, 0.0);
BENCHMARK_CAPTURE(pair_step, parallel_rolling, true, 0.05)->Iterations(4000);

void idle_check(benchmark::State &state) {
  Pair pair(false);
  BroadPhase broad(Memory::standard());
  Scene &s = pair.scene;
  for (auto _ : state) broad.update(s.bodies, s.obstacles, s.filter, s.h, s.offset);
}
BENCHMARK(idle_check);

void renew_lists(benchmark::State &state) {
  Pair pair(state.range(0));
  BroadPhase broad(Memory::standard());
  Scene &s = pair.scene;
  broad.update(s.bodies, s.obstacles, s.filter, s.h, s.offset);
  double shift = 0.01;
  for (auto _ : state) {
    state.PauseTiming();
    for (auto &surface : s.surfaces)
      for (uint32_t i = 0; i < surface->nsurfel; ++i) surface->x[4 * i] += shift;
    shift = -shift;
    state.ResumeTiming();
    broad.update(s.bodies, s.obstacles, s.filter, s.h, s.offset);
  }
}
BENCHMARK(renew_lists)->Arg(0)->Arg(1)->Iterations(1000);

void tree_rebuild(benchmark::State &state) {
  Pair pair(false);
  BoxTree tree(Memory::standard());
  const Surface &s = *pair.scene.surfaces[0];
  for (auto _ : state) tree.build(s.tri, s.x.data());
}
BENCHMARK(tree_rebuild);

void tree_refit(benchmark::State &state) {
  Pair pair(false);
  BoxTree tree(Memory::standard());
  const Surface &s = *pair.scene.surfaces[0];
  tree.build(s.tri, s.x.data());
  for (auto _ : state) tree.refit(s.tri, s.x.data());
}
BENCHMARK(tree_refit);

// How many times cheaper renewing boxes is than building the tree; issue: at least 10. Medians, interleaved,
// so that a busy machine hits both.
void tree_refit_share(benchmark::State &state) {
  Pair pair(false);
  BoxTree tree(Memory::standard());
  const Surface &s = *pair.scene.surfaces[0];
  const auto clock = [] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  };
  std::vector<double> build, refit;
  for (auto _ : state) {
    const double t0 = clock();
    tree.build(s.tri, s.x.data());
    const double t1 = clock();
    for (int k = 0; k < 10; ++k) tree.refit(s.tri, s.x.data());
    const double t2 = clock();
    build.push_back(t1 - t0);
    refit.push_back((t2 - t1) / 10);
  }
  std::nth_element(build.begin(), build.begin() + long(build.size() / 2), build.end());
  std::nth_element(refit.begin(), refit.begin() + long(refit.size() / 2), refit.end());
  state.counters["build_us"] = 1e6 * build[build.size() / 2];
  state.counters["refit_us"] = 1e6 * refit[refit.size() / 2];
  state.counters["times_cheaper"] = build[build.size() / 2] / refit[refit.size() / 2];
}
BENCHMARK(tree_refit_share)->Iterations(400);

// The fine cylinder upright on one of its ends, over a flat floor of 20,000 irregular triangles of its own
// size, a plane, or a grid.
void floor_step(benchmark::State &state, Shape shape) {
  Scene scene;
  scene.h = kStep;
  scene.add(test::moved(fine_cylinder(), test::turn({1, 0, 0}, M_PI / 2), {0, 0, 0}));
  Surface &s = *scene.surfaces[0];
  double low = 1;
  for (uint32_t i = 0; i < s.nsurfel; ++i) low = std::min(low, s.x[4 * i + 2]);
  scene.offset = 1e-3 * s.median_edge;
  test::Mesh floor;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(-0.3, 0.3);
  constexpr int n = 100;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i)
      floor.add({0.003 * (i - n / 2 + u(random)), 0.003 * (j - n / 2 + u(random)), 0});
  for (uint32_t j = 0; j < n; ++j)
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t a = j * (n + 1) + i;
      floor.tri.insert(floor.tri.end(), {a, a + 1, a + n + 2, a, a + n + 2, a + n + 1});
    }
  const test::Mesh slab = test::moved(test::box_mesh({0.3, 0.3, 0.1}, 1, 1, 1), {}, {0, 0, -0.05});
  ObstacleMesh mesh(Memory::standard(), floor.npoint(), floor.x.data(), floor.ntri(), floor.tri.data());
  const VoxelGrid grid(Memory::standard(), slab.x.data(), slab.ntri(), slab.tri.data(), 262144);
  ObstacleView &o = scene.add(shape, {0, 0, low - scene.offset});
  if (shape == Shape::mesh) {
    o.surface = &mesh.surface;
    o.extent = mesh.extent;
    mesh.place(o.position, o.rotation, {}, {});
  }
  if (shape == Shape::voxels) {
    o.grid = &grid;
    o.extent = grid.extent();
  }
  BroadPhase broad(Memory::standard());
  Array<ContactPoint> contacts;
  Array<uint8_t> lent;
  for (auto _ : state) {
    broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
    find_contacts(scene.bodies, scene.obstacles, broad.candidates(), scene.h, scene.offset, {}, lent,
                  contacts);
  }
  state.counters["contacts"] = double(contacts.size());
  state.counters["candidates"] = double(broad.candidates().size());
}
BENCHMARK_CAPTURE(floor_step, plane, Shape::plane);
BENCHMARK_CAPTURE(floor_step, mesh, Shape::mesh);
BENCHMARK_CAPTURE(floor_step, voxels, Shape::voxels);

void voxel_query(benchmark::State &state) {
  const test::Mesh ball = test::sphere_mesh(0.5, 5);
  const VoxelGrid grid(Memory::standard(), ball.x.data(), ball.ntri(), ball.tri.data(), 262144);
  std::mt19937 random(1);
  std::normal_distribution<double> g;
  std::vector<Vec3> places;
  for (int i = 0; i < 4096; ++i)
    places.push_back((0.5 + 0.01 * g(random)) * normalized(Vec3{g(random), g(random), g(random)}));
  size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(grid.at(places[i++ & 4095]).distance);
  state.counters["MB"] = 1e-6 * double(grid.bytes());
}
BENCHMARK(voxel_query);

void voxel_build(benchmark::State &state) {
  const test::Mesh ball = test::sphere_mesh(0.5, 5);
  for (auto _ : state)
    benchmark::DoNotOptimize(
        VoxelGrid(Memory::standard(), ball.x.data(), ball.ntri(), ball.tri.data(), uint32_t(state.range(0)))
            .cell());
}
BENCHMARK(voxel_build)->Arg(32768)->Arg(262144)->Iterations(2)->Unit(benchmark::kMillisecond);

// Error of the grid at 100,000 places of the folded basin's surface, where the true distance is zero; time is
// that of building.
void voxel_error(benchmark::State &state) {
  const RestMesh m = read_mesh(Memory::standard(),
                               std::string(DEFORM_SOURCE_DIR) + "/examples/data/basin.obj", DFM_MESH_SURFACE);
  const auto corner = [&](uint32_t t, int k) {
    return load3(&m.points[3 * size_t{m.tris[3 * size_t{t} + size_t(k)]}]);
  };
  std::unique_ptr<VoxelGrid> grid;
  for (auto _ : state)
    grid = std::make_unique<VoxelGrid>(Memory::standard(), m.points.data(), m.ntri(), m.tris.data(),
                                       uint32_t(state.range(0)));
  std::vector<double> area, errors;
  for (uint32_t t = 0; t < m.ntri(); ++t)
    area.push_back(norm(cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0))));
  std::mt19937 random(1);
  std::discrete_distribution<uint32_t> pick(area.begin(), area.end());
  std::uniform_real_distribution<double> u(0, 1);
  for (int i = 0; i < 100000; ++i) {
    const uint32_t t = pick(random);
    const double r = std::sqrt(u(random)), q = u(random);
    errors.push_back(std::fabs(
        grid->at((1 - r) * corner(t, 0) + r * (1 - q) * corner(t, 1) + r * q * corner(t, 2)).distance));
  }
  std::sort(errors.begin(), errors.end());
  state.counters["cell_mm"] = 1e3 * grid->cell();
  state.counters["median_um"] = 1e6 * errors[errors.size() / 2];
  state.counters["p99_um"] = 1e6 * errors[errors.size() * 99 / 100];
  state.counters["max_um"] = 1e6 * errors.back();
  state.counters["MB"] = 1e-6 * double(grid->bytes());
}
BENCHMARK(voxel_error)
    ->RangeMultiplier(8)
    ->Range(4096, 2097152)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
