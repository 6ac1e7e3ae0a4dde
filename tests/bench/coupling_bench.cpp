// What N and its transpose cost: a sphere of 4,098 or 16,386 surfels on a ball of 1,500 cells. Counters: ns
// per weight and surfel, weights per row.
#include <benchmark/benchmark.h>

#include "../unit/narrow/detect_scene.h"
#include "contact/distribute.h"
#include "mesh/mesh.h"

namespace {

using namespace dfm;

enum Kind { kBarycentric, kMls, kThesis };

struct Coupled {
  RestMesh cells = make_ball(Memory::standard(), 1, 1500);
  Surface surface;
  Array<double> x, v, f;
  std::vector<double> load;
  Coupled(int kind, double support, int level) {
    const test::Mesh fine = test::sphere_mesh(0.97, level);
    make_surface(Memory::standard(), fine.npoint(), fine.x.data(), fine.tri.data(), fine.ntri(), surface);
    CouplingInput in;
    in.npoint = cells.npoint();
    in.ntet = cells.ntet();
    in.nsurfel = fine.npoint();
    in.point = cells.points.data();
    in.tet = cells.tets.data();
    in.surfel = fine.x.data();
    in.support = support;
    const Memory &m = Memory::standard();
    wear_coupling(kind == kMls      ? couple_mls(m, in)
                  : kind == kThesis ? couple_thesis(m, in)
                                    : couple_barycentric(m, in),
                  surface);
    x.resize(size_t{4} * in.npoint);
    v.resize(x.size());
    f.resize(x.size());
    for (uint32_t i = 0; i < in.npoint; ++i) {
      store3(&x[4 * i], load3(&cells.points[3 * i]));
      store3(&v[4 * i], {double(i), 1, -1});
    }
    load.assign(size_t{3} * in.nsurfel, 1.0);
  }
};

// args: coupling, ten times the support, level of the sphere
Coupled make(const benchmark::State &s) {
  return Coupled(int(s.range(0)), 0.1 * double(s.range(1)), int(s.range(2)));
}

void count(benchmark::State &state, const Coupled &c) {
  const double weights = double(c.surface.weight.size());
  state.counters["weights_per_row"] = weights / c.surface.nsurfel;
  state.counters["ns_per_weight"] = benchmark::Counter(
      1e-9 * weights, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["ns_per_surfel"] = benchmark::Counter(
      1e-9 * c.surface.nsurfel, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

// Positions and velocities, as a sub-step does: two products per weight.
void gather(benchmark::State &state) {
  Coupled c = make(state);
  for (auto _ : state) {
    gather_surface(c.surface, c.x.data(), c.v.data());
    benchmark::ClobberMemory();
  }
  count(state, c);
}
// Every surfel loaded: the most that distribute can meet.
void scatter(benchmark::State &state) {
  Coupled c = make(state);
  for (auto _ : state) {
    scatter_surface(c.surface, c.load.data(), c.cells.npoint(), c.f.data());
    benchmark::ClobberMemory();
  }
  count(state, c);
}
void build(benchmark::State &state) {
  for (auto _ : state) {
    const Coupled c = make(state);
    benchmark::DoNotOptimize(c.surface.weight.data());
  }
  const Coupled c = make(state);
  count(state, c);
}

#define COUPLINGS                   \
  Args({kBarycentric, 30, 5})       \
      ->Args({kBarycentric, 30, 6}) \
      ->Args({kMls, 15, 5})         \
      ->Args({kMls, 30, 5})         \
      ->Args({kThesis, 30, 5})
BENCHMARK(gather)->COUPLINGS;
BENCHMARK(scatter)->COUPLINGS;
BENCHMARK(build)->COUPLINGS->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
