// The plugin model_gpu by its tables: bodies on a device, on the processor, and as the processor's models.
#pragma once
#include <filesystem>

#include "../plugin/stepper_host.h"

namespace gpu_test {

using namespace stepper_test;

enum Device { automatic, hardware, software, reference };
// Models of the plugin, and what they are models of: springs as msm has them by default, by themselves, with
// extra coordinates, which turn forces or do not, with branches, with both; cells.
enum Which : uint32_t { kSprings, kCells, kAlone, kSofter, kStiffer, kTurned, kMaxwell, kSls, kAll };
constexpr const char *kNames[] = {"springs", "cells",   "alone", "softer", "stiffer",
                                  "turned",  "maxwell", "sls",   "all"};
inline const dfm_type &gpu(uint32_t which) { return type_of("model_gpu", which == kCells); }
inline const dfm_type &cpu(uint32_t which) {
  return type_of(which == kCells ? "model_corotational_fem" : "model_msm");
}
inline Params with(uint32_t which, Params p) {
  if (which == kAlone) p["volume"] = p["collapse"] = 0;
  if (which == kSofter || which == kStiffer || which == kTurned || which == kAll) p["anisotropy_slope"] = 2;
  if (which == kStiffer) p["anisotropy_kind"] = 1;
  if (which == kTurned) p["anisotropy_form"] = 1;
  if (which == kMaxwell || which == kSls || which == kAll) {
    p["damper"] = which == kMaxwell ? 1 : 2;
    p["relaxation_time"] = 0.02;
  }
  return p;
}

// A body on the device and on the processor. Without a driver the test is skipped; where Mesa's software
// driver is installed, it fails.
struct Bodies {
  Host host;
  Mesh mesh;
  std::unique_ptr<Stepper> device, processor;
  Bodies(uint32_t which, const Mesh &m, Params p = {}, const std::vector<uint8_t> &fixed = {},
         Device on = automatic)
      : mesh(m) {
    p = with(which, p);
    p["device"] = on;
    device = std::make_unique<Stepper>(host, gpu(which), mesh, p, fixed);
    p["device"] = reference;
    processor = std::make_unique<Stepper>(host, gpu(which), mesh, p, fixed);
    EXPECT_EQ(processor->status, DFM_OK) << host.logged;
  }
  bool both() const { return device->status == DFM_OK; }
};

inline bool mesa_is_installed() {
  for (const char *folder : {"/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d"}) {
    std::error_code none;
    for (const auto &file : std::filesystem::directory_iterator(folder, none))
      if (file.path().filename().string().starts_with("lvp_icd")) return true;
  }
  return false;
}
#define NEEDS_DRIVER(bodies)                                                          \
  if (!(bodies).both() && !mesa_is_installed()) GTEST_SKIP() << (bodies).host.logged; \
  ASSERT_TRUE((bodies).both()) << (bodies).host.logged

inline void expect_same_bits(const Stepper &a, const Stepper &b, const std::string &when) {
  const size_t bytes = 4 * size_t(a.size()) * sizeof(double);
  EXPECT_EQ(std::memcmp(a.x, b.x, bytes), 0) << when;
  EXPECT_EQ(std::memcmp(a.v, b.v, bytes), 0) << when;
}

inline Vec axis_sum(const Stepper &b, const double *a) {
  Vec sum{};
  for (uint32_t i = 0; i < b.size(); ++i) sum = sum + b.mesh.mass[i] * b.get(a, i);
  return sum;
}

// The processor's model in the same explicit sub-steps.
struct Plain : ModelInstance {
  Vec gravity{};
  std::vector<uint8_t> held;
  Plain(Host &h, uint32_t which, const Mesh &m, const Params &p, std::vector<uint8_t> fixed = {})
      : ModelInstance(h, cpu(which), m, row_of(cpu(which), with(which, p)), 4, {}, fixed),
        held(std::move(fixed)) {
    held.resize(m.npoint());
  }
  void sub_step(double h) {
    dt = h;
    forces_and_step();
    for (uint32_t i = 0; i < size(); ++i) {
      if (!held[i]) set(v, i, get(v, i) + h * ((1 / mesh.mass[i]) * get(f, i) + gravity));
      set(x, i, get(x, i) + h * get(v, i));
    }
  }
};

inline double fact(const Stepper &b, const std::string &key) {
  uint32_t n = 0;
  const auto *facts = static_cast<const dfm_facts *>(b.ops->extension(b.self, DFM_EXT_FACTS));
  const dfm_fact *row = facts->list(b.self, &n);
  for (uint32_t k = 0; k < n; ++k)
    if (row[k].key == key) return row[k].value;
  ADD_FAILURE() << key;
  return 0;
}

// s, by the rows of the model's bound, held points left out.
inline double stable_step(Stepper &b, const std::vector<uint8_t> &fixed) {
  std::vector<double> stiff(b.size(), 0.0), damper(b.size(), 0.0);
  double cell = HUGE_VAL;
  const dfm_kin k = b.kin();
  EXPECT_EQ(b.ops->bound(b.self, &k, stiff.data(), damper.data(), &cell), DFM_OK);
  for (uint32_t i = 0; i < b.size(); ++i) {
    if (fixed[i] == 7) continue;
    const double mass = b.mesh.mass[i], c = damper[i];
    cell = std::min(cell, 4 * mass / (c + std::sqrt(c * c + 4 * mass * stiff[i])));
  }
  return cell;
}

// s, of the first period of the middle's motion along x, by the zeros between samples.
template <class Move, class Place>
double period(const Move &move, const Place &place, double h) {
  double last = place(), first = 0, found = 0;
  int zeros = 0;
  for (int n = 1; zeros < 9 && n < 200000; ++n) {
    move();
    const double now = place();
    if (last < 0 && now >= 0) {
      found = h * (n - now / (now - last));
      if (zeros++ == 0) first = found;
    }
    last = now;
  }
  return (found - first) / 8;
}

}  // namespace gpu_test
