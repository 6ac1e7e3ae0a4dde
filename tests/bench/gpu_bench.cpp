// Springs and cells times sub-steps per second of the models of model_gpu, beside what the kernel of the
// springs does on points without springs, which is to copy their places and velocities:
//   lattice   points of a cube, each with springs to its 26 neighbors: many sub-steps in one submission; one
//             and its end back; one with points and loads on the way there, too, as in contact
//   cells     tetrahedra of a cube, the same
//   springs   of those tetrahedra; volumes: with the volume terms that msm has by default; tilted, relaxing:
//             with extra coordinates, with branches
//   body      steps of a body of tetrahedra through the model's own functions, arrays of the host included
// The bytes of a sub-step count each array once: what other points' places and velocities cost beyond that is
// up to the cache. `gpu_bench --device software` takes a software driver, --most N bodies of up to N springs
// or cells (2e4 on a software driver), --only cells, --only springs leave out the other ones.
// --csv FILE --commit ID appends the figures.
#include <chrono>
#include <cstdlib>
#include <functional>
#include <map>
#include <random>
#include <vector>

#include "machine.h"
#include "model_gpu/cells.h"
#include "model_gpu/gpu_body.h"
#include "model_gpu/springs.h"
#include "model_gpu/vulkan_stepper.h"

namespace {

using namespace gpu;

dfm_host services() {
  dfm_host h{};
  h.size = sizeof h;
  h.abi = DFM_ABI;
  h.alloc = [](void *, size_t bytes, size_t align) {
    return std::aligned_alloc(align, (bytes + align - 1) / align * align);
  };
  h.release = [](void *, void *p, size_t, size_t) { std::free(p); };
  h.log = [](void *, int32_t level, uint32_t, const char *text) {
    if (level > 1) std::fprintf(stderr, "%s\n", text);
  };
  h.parallel_for = [](void *, uint32_t n, uint32_t, void (*fn)(void *, uint32_t, uint32_t), void *user) {
    fn(user, 0, n);
  };
  return h;
}
const dfm_host host = services();

double seconds(const std::function<void()> &act) {
  const auto begun = std::chrono::steady_clock::now();
  act();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

// s, of one call: the median of seven timings of as many calls as take a tenth of a second.
double time_of(const std::function<void()> &act) {
  act();
  const double once = seconds(act);
  const int n = int(std::max(1.0, std::min(0.1 / once, 1000.0)));
  std::vector<double> each;
  for (int k = 0; k < 7; ++k)
    each.push_back(seconds([&] {
                     for (int i = 0; i < n; ++i) act();
                   }) /
                   n);
  std::nth_element(each.begin(), each.begin() + 3, each.end());
  return each[3];
}

struct Lattice {
  std::vector<double> x, stiffness, square;
  std::vector<uint32_t> edges;
  Springs springs;
  uint32_t npoint() const { return uint32_t(x.size() / 3); }
  size_t nspring() const { return stiffness.size(); }

  explicit Lattice(uint32_t side) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> u(-0.1, 0.1);
    for (uint32_t i = 0; i < side; ++i)
      for (uint32_t j = 0; j < side; ++j)
        for (uint32_t k = 0; k < side; ++k)
          for (const uint32_t a : {i, j, k}) x.push_back(0.01 * (a + u(random)));
    const auto id = [&](int i, int j, int k) { return uint32_t((i * int(side) + j) * int(side) + k); };
    const auto inside = [&](int a) { return a >= 0 && a < int(side); };
    for (int i = 0; i < int(side); ++i)
      for (int j = 0; j < int(side); ++j)
        for (int k = 0; k < int(side); ++k)
          for (int d = 14; d < 27; ++d) {  // half of the 26: those behind the point
            const int to[3] = {i + d / 9 - 1, j + d / 3 % 3 - 1, k + d % 3 - 1};
            if (!inside(to[0]) || !inside(to[1]) || !inside(to[2])) continue;
            const uint32_t a = id(i, j, k), b = id(to[0], to[1], to[2]);
            edges.insert(edges.end(), {a, b});
            double sum = 0;
            for (int c = 0; c < 3; ++c) sum += (x[3 * b + c] - x[3 * a + c]) * (x[3 * b + c] - x[3 * a + c]);
            square.push_back(sum);
            stiffness.push_back(100);
          }
    springs.lay_out(&host, npoint(), uint32_t(nspring()), edges.data());
    springs.put(stiffness.data(), square.data());
  }
};

// A cube of side^3 cubes of six tetrahedra; surfels are the points of its boundary.
struct Block {
  std::vector<double> x, mass, weights;
  std::vector<uint32_t> cells, edges, rows, points;
  dfm_mesh mesh{};
  uint32_t npoint() const { return uint32_t(x.size() / 3); }
  explicit Block(uint32_t side);
};

void start(const Parts &of, const std::vector<double> &x, double inverse_mass, Stepper &s) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> u(-1, 1);
  for (uint32_t i = 0; i < x.size() / 3; ++i) {
    const auto near = [&](int a) { return x[3 * size_t(i) + size_t(a)] + 2e-4 * u(random); };
    s.place[i] = {near(0), near(1), near(2), inverse_mass};
    s.speed[i] = {0.1 * u(random), 0.1 * u(random), 0.1 * u(random), 0};
    s.seen[i] = s.speed[i];
    s.load[i] = {0, 0, -9.81, 0.1};
  }
  std::fill_n(s.stretch, of.branches.room, 0.0);
}

constexpr double kOfSpring = sizeof(uvec4), kOfPoint = sizeof(uvec2) + 5 * sizeof(dvec4);  // bytes
// A cell's corners, shape, and forces there and back; its points are read once more.
constexpr double kOfCell = 3 * sizeof(uvec4) + (3 + 2 * 4) * sizeof(dvec4);
constexpr double kMoreOfPoint = sizeof(double) + sizeof(dvec4);
constexpr double kOfVolume = 3 * sizeof(uvec4) + (1 + 2 * 4) * sizeof(dvec4);

double gigabytes(const Springs &of, float) {
  const double end = kOfSpring + (of.edge_tilt.empty() ? 0 : sizeof(uvec2)) +
                     (of.branches.n ? 2 * sizeof(double) : 0),
               cells = of.cells_on ? kOfVolume * of.ncell + (kMoreOfPoint + sizeof(uvec2)) * of.npoint : 0;
  return 1e-9 * (2 * end * of.count() + kOfPoint * of.npoint + cells);
}
double gigabytes(const Cells &of, float damping) {
  const double speeds = damping > 0 ? sizeof(dvec4) : 0;
  return 1e-9 * (kOfCell * of.count() + (kOfPoint + kMoreOfPoint + speeds) * of.npoint);
}

// The defaults of a model, and what is not.
template <class Of>
std::vector<double> values_of(std::initializer_list<std::pair<uint32_t, double>> own) {
  std::vector<double> out;
  for (const dfm_param &row : Of::kRows.of) out.insert(out.end(), row.width, row.def);
  for (const auto &[at, value] : own) out[at] = value;
  return out;
}
constexpr double kDamping = 1e-4;  // s

constexpr double kStep = 1e-4;  // s, stable on the lattice and in the cells

Dampers dampers_of(const Parts &of, float damping) {
  return {damping, 0, of.branches.part, of.branches.time};
}

// m, how far a point of the device is from that of the reference after some sub-steps, at most.
template <class Of>
double difference(const Of &parts, const std::vector<double> &x, double inverse_mass, VulkanStepper &device,
                  float damping) {
  Reference processor(&host, parts.npoint);
  processor.take(parts.work());
  const uint32_t n = parts.count() > 500000 ? 4 : 100;
  double most = 0;
  for (Stepper *s : {static_cast<Stepper *>(&device), static_cast<Stepper *>(&processor)}) {
    start(parts, x, inverse_mass, *s);
    if (const char *why = s->run(n, kStep, dampers_of(parts, damping), true, true)) std::printf("%s\n", why);
    if (s->highest() * kStep > 1) std::printf("%g 1/s: too long a step\n", double(s->highest()));
  }
  for (uint32_t i = 0; i < parts.npoint; ++i) {
    const dvec4 &a = device.place[i], &b = processor.place[i];
    const double off = std::max({std::fabs(a.x - b.x), std::fabs(a.y - b.y), std::fabs(a.z - b.z)});
    most = off >= most ? off : off == off ? most : HUGE_VAL;
  }
  return most;
}

// GB/s, read and written.
double bandwidth(const std::shared_ptr<Vulkan> &vulkan, uint32_t points) {
  points = uint32_t(std::min<size_t>(points, vulkan->limits.maxStorageBufferRange / sizeof(dvec4)));
  Springs none;
  none.lay_out(&host, points, 0, nullptr);
  VulkanStepper s(vulkan, points);
  s.take(none.work());
  for (uint32_t i = 0; i < points; ++i) {
    s.place[i] = {0.1 * i, 0.2, 0.3, 1};
    s.speed[i] = {1, 2, 3 + 0.1 * i, 0};
    s.load[i] = {0, 0, -9.81, 0};
  }
  s.run(1, kStep, {}, true, true);
  // the difference of two lengths leaves out the copy back
  const double few = time_of([&] { s.run(100, kStep, {}, false, false); });
  const double many = time_of([&] { s.run(300, kStep, {}, false, false); });
  return gigabytes(none, 0) * 200 / (many - few);
}

template <class Of>
void passes(const char *kind, const Of &parts, const std::vector<double> &x, double inverse_mass,
            const std::shared_ptr<Vulkan> &vulkan, double copy, bench::Csv &out) {
  VulkanStepper s(vulkan, parts.npoint);
  s.take(parts.work());
  for (const float damping : {0.0f, 1e-4f}) {
    const double off = difference(parts, x, inverse_mass, s, damping);
    const auto row = [&](const char *what, uint32_t n, bool moved, bool loaded) {
      start(parts, x, inverse_mass, s);
      const Dampers dampers = dampers_of(parts, damping);
      s.run(1, kStep, dampers, true, true);
      const double step = time_of([&] { s.run(n, kStep, dampers, moved, loaded); }) / n;
      const double rate = parts.count() / step, speed = gigabytes(parts, damping) / step;
      std::printf(
          "%s: %-15s %8u %7u points %s %9.3f us a sub-step, %8.3g/s, %6.1f GB/s, %3.0f %% of a copy, %.2g m "
          "off\n",
          kind, what, parts.count(), parts.npoint, damping > 0 ? "damped" : "      ", 1e6 * step, rate, speed,
          100 * speed / copy, off);
      if (out.csv)
        std::fprintf(out.csv, "%s,%s,%s: %s,%u,%u,%g,%u,%.4f,%.4g,%.1f,%.1f,%.3g\n", out.head.c_str(),
                     bench::quoted(vulkan->name).c_str(), kind, what, parts.count(), parts.npoint,
                     double(damping), n, 1e6 * step, rate, speed, copy, off);
    };
    row("many sub-steps", parts.count() > 500000 ? 100 : 1000, false, false);
    row("back", 1, false, false);
    row("there and back", 1, true, true);
  }
}

void lattice(uint32_t side, const std::shared_ptr<Vulkan> &vulkan, double copy, bench::Csv &out) {
  const Lattice l(side);
  passes("lattice", l.springs, l.x, 1000, vulkan, copy, out);
}

Block::Block(uint32_t side) {
  const auto id = [&](uint32_t i, uint32_t j, uint32_t k) { return (i * (side + 1) + j) * (side + 1) + k; };
  for (uint32_t i = 0; i <= side; ++i)
    for (uint32_t j = 0; j <= side; ++j)
      for (uint32_t k = 0; k <= side; ++k)
        for (const uint32_t a : {i, j, k}) x.push_back(0.01 * a);
  const uint32_t n = npoint();
  mass.assign(n, 0);
  std::vector<uint64_t> pairs;
  for (uint32_t i = 0; i < side; ++i)
    for (uint32_t j = 0; j < side; ++j)
      for (uint32_t k = 0; k < side; ++k) {
        int axes[3] = {0, 1, 2};
        do {
          uint32_t q[3] = {i, j, k}, four[4] = {id(i, j, k)};
          for (int c = 0; c < 3; ++c) {
            ++q[axes[c]];
            four[c + 1] = id(q[0], q[1], q[2]);
          }
          cells.insert(cells.end(), four, four + 4);
          for (int a = 0; a < 4; ++a) {
            mass[four[a]] += 1000 * 1e-6 / 24;
            for (int b = a + 1; b < 4; ++b) pairs.push_back(uint64_t{four[a]} << 32 | four[b]);
          }
        } while (std::next_permutation(axes, axes + 3));
      }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  for (const uint64_t p : pairs) edges.insert(edges.end(), {uint32_t(p >> 32), uint32_t(p)});
  for (uint32_t i = 0; i < n; ++i) {  // surfels: the points of the boundary
    bool outside = false;
    for (int a = 0; a < 3; ++a) outside |= x[3 * i + a] < 1e-9 || x[3 * i + a] > 0.01 * side - 1e-9;
    if (outside) points.push_back(i);
  }
  for (uint32_t s = 0; s <= points.size(); ++s) rows.push_back(s);
  weights.assign(points.size(), 1.0);
  mesh.size = sizeof mesh;
  mesh.npoint = n;
  mesh.ncell = uint32_t(cells.size() / 4);
  mesh.cell = DFM_CELL_TET;
  mesh.rest = x.data();
  mesh.cells = cells.data();
  mesh.mass = mass.data();
  mesh.nedge = uint32_t(pairs.size());
  mesh.edges = edges.data();
  mesh.nsurfel = uint32_t(points.size());
  mesh.row = rows.data();
  mesh.col = points.data();
  mesh.weight = weights.data();
}

template <class Of>
void passes_of(const char *kind, Block &block, const std::vector<double> &values,
               const std::shared_ptr<Vulkan> &vulkan, double copy, bench::Csv &out) {
  block.mesh.params = values.data();
  Of parts;
  parts.create(&host, block.mesh);
  parts.fill(values.data());
  passes(kind, parts, block.x, 1000, vulkan, copy, out);
}

template <class Of>
void body(const char *kind, Block &block, std::vector<double> values, Choice choice, const std::string &name,
          double copy, bench::Csv &out) {
  values[Of::kDevice] = choice;
  block.mesh.params = values.data();
  const uint32_t n = block.npoint();
  Body<Of> b;
  const double made = seconds([&] { b.create(&host, block.mesh); });
  std::vector<double> at(4 * size_t(n)), v(at), f(at), x_end(at), v_end(at), u(3 * block.points.size()), p(u);
  std::vector<double> state(3 * size_t(n) + 1), state_out(state);
  for (uint32_t i = 0; i < n; ++i) {
    std::copy_n(&block.x[3 * size_t(i)], 3, &at[4 * size_t(i)]);
    f[4 * size_t(i) + 2] = -9.81 * block.mass[i];
  }
  const double longest = b.facts()[0].value, count = b.facts()[1].value;
  for (const uint32_t steps : {1u, 10u, 100u}) {
    dfm_kin k{};
    k.size = sizeof k;
    k.stride = 4;
    k.state = state.data();
    k.state_out = state_out.data();
    k.dt = longest * steps;
    const double step = time_of([&] {
      k.x = at.data();
      k.v = v.data();
      b.predict(k, f.data(), u.data());
      b.commit(k, p.data(), x_end.data(), v_end.data());
      at.swap(x_end);
      v.swap(v_end);
      state.swap(state_out);
    });
    const double rate = count * steps / step;
    std::printf("%s: %4u sub-steps %8.0f %7u points %9.1f us a step, %.3g sub-steps/s, created in %.2g s\n",
                kind, steps, count, n, 1e6 * step, steps / step, made);
    if (out.csv)
      std::fprintf(out.csv, "%s,%s,%s,%.0f,%u,%g,%u,%.4f,%.4g,,%.1f,\n", out.head.c_str(),
                   bench::quoted(name).c_str(), kind, count, n, kDamping, steps, 1e6 * step / steps, rate,
                   copy);
  }
}

}  // namespace

int main(int argc, char **argv) {
  bench::Csv out(argc, argv,
                 "device,what,springs_or_cells,points,damping,substeps,us_per_substep,per_s,gb_per_s,"
                 "copy_gb_per_s,off_m");
  double most = 0;
  bool springs = true, cells = true;
  Choice choice = kAuto;
  for (int n = 1; n + 1 < argc; n += 2) {
    if (!std::strcmp(argv[n], "--most")) most = std::atof(argv[n + 1]);
    if (!std::strcmp(argv[n], "--only")) (std::strcmp(argv[n + 1], "cells") ? cells : springs) = false;
    if (!std::strcmp(argv[n], "--device") && !std::strcmp(argv[n + 1], "software")) choice = kSoftware;
  }
  try {
    const auto vulkan = std::make_shared<Vulkan>(Wanted(choice));
    if (!(most > 0)) most = vulkan->software ? 2e4 : 1.1e7;
    const double copy = bandwidth(vulkan, most > 1e6 ? 8000000 : 100000);
    std::printf("%s: points without springs move %.1f GB/s, read and written\n", vulkan->name.c_str(), copy);
    for (const uint32_t side : {10u, 21u, 23u, 43u, 92u})
      if (springs && 13.0 * side * side * side < most) lattice(side, vulkan, copy, out);
    for (const uint32_t side : {12u, 26u, 55u}) {
      if (6.0 * side * side * side > most) continue;
      Block block(side);
      if (cells) {
        const auto values = values_of<Cells>({{Cells::kDampingStiffness, kDamping}});
        passes_of<Cells>("cells", block, values, vulkan, copy, out);
        body<Cells>("body of cells", block, values, choice, vulkan->name, copy, out);
      }
      if (springs) {
        const std::pair<uint32_t, double> damped{msm::kDampingStiffness, kDamping},
            no_volume{msm::kVolume, 0}, no_collapse{msm::kCollapse, 0};
        const auto alone = values_of<Springs>({damped, no_volume, no_collapse}),
                   whole = values_of<Springs>({damped});
        passes_of<Springs>("springs", block, alone, vulkan, copy, out);
        passes_of<Springs>("volumes", block, whole, vulkan, copy, out);
        passes_of<Springs>("tilted", block, values_of<Springs>({no_volume, no_collapse, {msm::kSlope, 1}}),
                           vulkan, copy, out);
        passes_of<Springs>("relaxing", block,
                           values_of<Springs>({no_volume, no_collapse, {msm::kDamper, msm::kStandardLinear}}),
                           vulkan, copy, out);
        body<Springs>("body", block, alone, choice, vulkan->name, copy, out);
        body<Springs>("body with volumes", block, whole, choice, vulkan->name, copy, out);
      }
    }
  } catch (const std::string &why) {
    std::printf("no figures: %s\n", why.c_str());
  }
  return 0;
}
