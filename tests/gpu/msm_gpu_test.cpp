// The model msm_gpu by its plugin's tables: the device against the same kernel on the processor, and both
// against the model msm.
#include <filesystem>

#include "../plugin/stepper_host.h"

namespace {

using namespace stepper_test;

enum Device { automatic, hardware, software, reference };
const dfm_type &gpu() { return type_of("model_gpu"); }

// A body on the device and on the processor. Without a driver the test is skipped; where Mesa's software
// driver is installed, it fails.
struct Bodies {
  Host host;
  Mesh mesh;
  std::unique_ptr<Stepper> device, processor;
  Bodies(const Mesh &m, Params p = {}, const std::vector<uint8_t> &fixed = {}, Device which = automatic)
      : mesh(m) {
    p["device"] = which;
    device = std::make_unique<Stepper>(host, gpu(), mesh, p, fixed);
    p["device"] = reference;
    processor = std::make_unique<Stepper>(host, gpu(), mesh, p, fixed);
    EXPECT_EQ(processor->status, DFM_OK) << host.logged;
  }
  bool both() const { return device->status == DFM_OK; }
};

bool mesa_is_installed() {
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

void expect_same_bits(const Stepper &a, const Stepper &b, const std::string &when) {
  const size_t bytes = 4 * size_t(a.size()) * sizeof(double);
  EXPECT_EQ(std::memcmp(a.x, b.x, bytes), 0) << when;
  EXPECT_EQ(std::memcmp(a.v, b.v, bytes), 0) << when;
}

Vec axis_sum(const Stepper &b, const double *a) {
  Vec sum{};
  for (uint32_t i = 0; i < b.size(); ++i) sum = sum + b.mesh.mass[i] * b.get(a, i);
  return sum;
}

std::vector<double> msm_row(double young, double damping, double drag) {
  return row_of(type_of("model_msm"), {{"young", young},
                                       {"damping_stiffness", damping},
                                       {"damping_mass", drag},
                                       {"volume", 0},
                                       {"collapse", 0}});
}

// The model msm in the same explicit sub-steps.
struct Plain : ModelInstance {
  Vec gravity{};
  std::vector<uint8_t> held;
  Plain(Host &h, const Mesh &m, double young, double damping, double drag, std::vector<uint8_t> fixed = {})
      : ModelInstance(h, type_of("model_msm"), m, msm_row_padded(young, damping, drag), 4, {}, fixed),
        held(std::move(fixed)) {
    held.resize(m.npoint());
  }
  static std::vector<double> msm_row_padded(double young, double damping, double drag) {
    std::vector<double> row = msm_row(young, damping, drag);
    row.resize(row.size() + 2, 1.0);  // the axis, which is three wide
    return row;
  }
  void sub_step(double h) {
    forces();
    for (uint32_t i = 0; i < size(); ++i) {
      if (!held[i]) set(v, i, get(v, i) + h * ((1 / mesh.mass[i]) * get(f, i) + gravity));
      set(x, i, get(x, i) + h * get(v, i));
    }
  }
};

double fact(const Stepper &b, const std::string &key) {
  uint32_t n = 0;
  const auto *facts = static_cast<const dfm_facts *>(b.ops->extension(b.self, DFM_EXT_FACTS));
  const dfm_fact *row = facts->list(b.self, &n);
  for (uint32_t k = 0; k < n; ++k)
    if (row[k].key == key) return row[k].value;
  ADD_FAILURE() << key;
  return 0;
}

// Neither a number of points that fills groups, nor one that does not.
TEST(MsmGpu, OnTheSoftwareDriver_HasTheBitsOfTheReference) {
  for (const double damping : {0.0, 2e-4})
    for (const bool held : {false, true}) {
      const Mesh m = kuhn_bar(6, 3, 3, 0.02, 0.2);
      Bodies b(m, {{"young", 3e5}, {"damping_stiffness", damping}, {"damping_mass", 0.7}},
               held ? clamp_of(m) : std::vector<uint8_t>{}, software);
      NEEDS_DRIVER(b);
      for (Stepper *each : {b.device.get(), b.processor.get()}) {
        each->shake(2e-3, 0.3);
        for (uint32_t i = 0; held && i < each->size(); ++i)
          if (m.at(i)[0] < 1e-9) each->set(each->v, i, {0, 0.01, 0});
      }
      for (int n = 0; n < 12; ++n) {
        for (Stepper *each : {b.device.get(), b.processor.get()}) {
          each->pull({0.1 * n, 0, -9.81});
          each->p_s[5] = n % 3 == 1 ? 1e-4 : 0;
          each->dt = n % 2 ? 1e-3 : 1e-4;
          each->step();
        }
        expect_same_bits(*b.device, *b.processor, "step " + std::to_string(n));
      }
    }
}

// A card may round the square root and the quotient of a spring otherwise, by 2.5 units in the 24th bit each.
TEST(MsmGpu, OnAnyDevice_ASubStepIsThatOfTheReference) {
  const Mesh m = kuhn_bar(6, 3, 3, 0.02, 0.2);
  Bodies b(m, {{"damping_stiffness", 2e-4}});
  NEEDS_DRIVER(b);
  const double h = b.device->dt = b.processor->dt = 0.9 * fact(*b.device, "longest_step");
  for (Stepper *each : {b.device.get(), b.processor.get()}) {
    each->shake(2e-3, 0.3);
    each->step();
  }
  Plain before(b.host, m, 1e5, 0, 0);
  before.shake(2e-3, 0.3);
  double most = 0, off = 0;
  for (uint32_t i = 0; i < m.npoint(); ++i) {
    const Vec now = b.processor->get(b.processor->v, i);
    most = std::max(most, norm(now - before.get(before.v, i)));
    off = std::max(off, norm(now - b.device->get(b.device->v, i)));
  }
  EXPECT_GT(most, 100 * h);
  EXPECT_LE(off, 1e-6 * most);
}

TEST(MsmGpu, SameStepsAgain_HaveTheSameBits) {
  const Mesh m = kuhn_bar(5, 4, 3, 0.02, 0.2);
  Bodies b(m), again(m);
  NEEDS_DRIVER(b);
  for (Stepper *each : {b.device.get(), again.device.get()}) {
    each->shake(2e-3, 0.3);
    each->pull({0, 0, -9.81});
    for (int n = 0; n < 20; ++n) each->step();
  }
  expect_same_bits(*b.device, *again.device, "20 steps");
}

// More sub-steps than one submission holds, too.
TEST(MsmGpu, LongStep_IsThatOfItsSubSteps) {
  const Mesh m = kuhn_bar(3, 3, 3, 0.02, 0.2);
  Bodies b(m), parts(m);
  NEEDS_DRIVER(b);
  double longest = 1;
  while (longest > fact(*b.device, "longest_step")) longest /= 2;
  constexpr int kParts = 2048;  // and no rounding in h / n
  for (Stepper *each : {b.device.get(), parts.device.get()}) {
    each->shake(2e-3, 0.3);
    each->pull({0, 0, -9.81});
  }
  b.device->dt = longest * kParts;
  b.device->step();
  parts.device->dt = longest;
  // the long step takes the fewest sub-steps that are stable, no more
  ASSERT_GT(2 * longest, fact(*b.device, "longest_step"));
  const int n = int(std::ceil(b.device->dt / fact(*b.device, "longest_step") - 1e-9));
  parts.device->dt = b.device->dt / n;
  for (int k = 0; k < n; ++k) parts.device->step();
  EXPECT_GT(n, 1024);
  expect_same_bits(*b.device, *parts.device, "2,048 sub-steps");
}

// Forces of a spring are those of msm up to some units in the 24th bit of each.
TEST(MsmGpu, SubStep_IsThatOfMsmInSinglePrecision) {
  const Mesh m = read_msh(test::mesh_dir() + "/bars/bar_u3.msh");
  const double young = 2e5, damping = 1e-4, drag = 0.5;
  Host host;
  Stepper b(
      host, gpu(), m,
      {{"young", young}, {"damping_stiffness", damping}, {"damping_mass", drag}, {"device", reference}});
  Plain plain(host, m, young, damping, drag);
  ASSERT_EQ(b.status, DFM_OK) << host.logged;
  ASSERT_EQ(plain.status, DFM_OK) << host.logged;
  b.dt = 0.9 * fact(b, "longest_step");
  b.shake(1e-3, 0.2);
  plain.shake(1e-3, 0.2);
  b.step();
  const std::vector<double> before(plain.v, plain.v + 4 * size_t(m.npoint()));
  plain.sub_step(b.dt);
  double most = 0, off = 0;
  for (uint32_t i = 0; i < m.npoint(); ++i) {
    most = std::max(most, norm(plain.get(plain.v, i) - plain.get(before.data(), i)));
    off = std::max(off, norm(plain.get(plain.v, i) - b.get(b.v, i)));
  }
  EXPECT_GT(most, 1e-3);
  EXPECT_LE(off, 1e-6 * most);
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

TEST(MsmGpu, StretchedBar_HasThePeriodOfMsm) {
  const Mesh m = kuhn_bar(12, 2, 2, 0.02);
  const double young = 1e6;
  Bodies b(m, {{"young", young}}, clamp_of(m));
  NEEDS_DRIVER(b);
  Plain plain(b.host, m, young, 0, 0, clamp_of(m));
  const double h = 0.9 * fact(*b.device, "longest_step");
  const auto stretch = [&](auto &body) {
    for (uint32_t i = 0; i < m.npoint(); ++i)
      body.set(body.x, i, m.at(i) + Vec{1e-3 * std::sin(1.5707963267948966 * m.at(i)[0] / 0.24), 0, 0});
  };
  const uint32_t tip = m.npoint() - 1;
  stretch(*b.device);
  stretch(plain);
  b.device->dt = h;
  const double device =
      period([&] { b.device->step(); }, [&] { return b.device->get(b.device->x, tip)[0] - m.at(tip)[0]; }, h);
  const double msm =
      period([&] { plain.sub_step(h); }, [&] { return plain.get(plain.x, tip)[0] - m.at(tip)[0]; }, h);
  // of a slender rod: 4 l / sqrt(E / rho)
  EXPECT_NEAR(msm, 4 * 0.24 / std::sqrt(young / 1000), 0.05 * msm);
  EXPECT_NEAR(device, msm, 1e-6 * msm);
}

TEST(MsmGpu, HangingBar_SagsAsMsm) {
  const Mesh m = kuhn_bar(8, 2, 2, 0.02);
  const double young = 5e4, drag = 60;
  Bodies b(m, {{"young", young}, {"damping_mass", drag}}, clamp_of(m));
  NEEDS_DRIVER(b);
  Plain plain(b.host, m, young, 0, drag, clamp_of(m));
  plain.gravity = {9.81, 0, -1};
  b.device->pull(plain.gravity);
  b.device->dt = 0.05;
  for (int n = 0; n < 120; ++n) b.device->step();
  const double h = 0.9 * fact(*b.device, "longest_step");
  for (int n = 0; n * h < 6; ++n) plain.sub_step(h);
  const uint32_t tip = m.npoint() - 1;
  const Vec device = b.device->get(b.device->x, tip) - m.at(tip), msm = plain.get(plain.x, tip) - m.at(tip);
  EXPECT_GT(norm(msm), 1e-3);
  EXPECT_LE(norm(device - msm), 1e-6 * norm(msm));
  EXPECT_LT(norm(b.device->get(b.device->v, tip)), 1e-8);
}

// A force has the same bits at both ends of its spring and lies along it.
TEST(MsmGpu, FreeBody_KeepsItsMomenta) {
  const Mesh m = kuhn_bar(5, 3, 3, 0.02, 0.2);
  Bodies b(m, {{"damping_stiffness", 1e-4}});
  NEEDS_DRIVER(b);
  Stepper &body = *b.device;
  body.shake(2e-3, 0.5);
  for (uint32_t i = 0; i < body.size(); ++i)
    body.set(body.v, i, body.get(body.v, i) + cross({3, -2, 5}, body.get(body.x, i)) + Vec{1, 2, 0});
  const Vec momentum = body.momentum(), turning = body.angular_momentum(), middle = axis_sum(body, body.x);
  for (int n = 0; n < 1000; ++n) body.step();
  EXPECT_LE(norm(body.momentum() - momentum), 1e-12 * norm(momentum));
  EXPECT_LE(norm(body.angular_momentum() - turning), 1e-11 * norm(turning));
  EXPECT_LE(norm(axis_sum(body, body.x) - middle - 1000 * body.dt * momentum), 1e-11 * norm(momentum));
}

// A thousand steps of a body without damping; the scheme's own swing is h omega / 2 at most.
TEST(MsmGpu, UndampedBody_KeepsItsEnergy) {
  const Mesh m = kuhn_bar(5, 3, 3, 0.02, 0.2);
  Bodies b(m);
  Stepper &body = *b.processor;
  body.shake(5e-4, 0);
  const auto total = [&] { return body.kinetic() + body.energy(); };
  body.dt = 0.2 * fact(body, "longest_step");
  const double first = total();
  double least = first, most = first;
  for (int n = 0; n < 5000; ++n) {
    body.step();
    least = std::min(least, total());
    most = std::max(most, total());
  }
  EXPECT_GT(first, 0);
  EXPECT_GT(least, 0.9 * first);
  EXPECT_LT(most, 1.1 * first);
}

// 1/s2, the largest eigenvalue of the stiffness of msm over the masses, in its present shape: of the sum with
// `shift`, which leaves what is below zero in a crushed body out of the way.
double largest_eigenvalue(Plain &b, double shift) {
  const std::vector<double> rest(b.x, b.x + 4 * size_t(b.size()));
  std::vector<double> u(rest.size()), less(rest.size());
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1, 1);
  for (double &a : u) a = any(random);
  double found = 0;
  for (int round = 0; round < 400; ++round) {
    double square = 0, product = 0;
    for (uint32_t i = 0; i < b.size(); ++i)
      square += b.mesh.mass[i] * dot(b.get(u.data(), i), b.get(u.data(), i));
    const double size = 1e-8 / std::sqrt(square);
    const auto forces = [&](double side) {
      for (uint32_t i = 0; i < b.size(); ++i)
        b.set(b.x, i, b.get(rest.data(), i) + (side * size) * b.get(u.data(), i));
      b.forces();
    };
    forces(-1);
    std::copy(b.f, b.f + less.size(), less.begin());
    forces(1);
    for (uint32_t i = 0; i < b.size(); ++i) {
      const Vec own = b.get(u.data(), i);
      const Vec next = (0.5 / size / b.mesh.mass[i]) * (b.get(less.data(), i) - b.get(b.f, i)) + shift * own;
      product += b.mesh.mass[i] * dot(own, next);
      b.set(u.data(), i, next);
    }
    found = product / square;
    const double scale = 1 / std::sqrt(square);
    for (double &a : u) a *= scale / found;
  }
  std::copy(rest.begin(), rest.end(), b.x);
  return found - shift;
}

// Rows count every shape: torn out to three times its length, sheared, crushed.
TEST(MsmGpu, LongestStep_IsStableInEveryShape) {
  const Mesh m = kuhn_bar(4, 3, 3, 0.02, 0.2);
  Bodies b(m);
  const double h = fact(*b.processor, "longest_step"), most = 4 / (h * h);
  double highest = 0;
  for (const Vec size : {Vec{1, 1, 1}, Vec{3, 3, 3}, Vec{3, 0.3, 1}, Vec{0.5, 0.5, 0.5}, Vec{1, 1, 0}}) {
    Plain plain(b.host, m, 1e5, 0, 0);
    for (uint32_t i = 0; i < m.npoint(); ++i) {
      const Vec x = m.at(i);
      plain.set(plain.x, i, {size[0] * x[0] + 0.5 * x[1], size[1] * x[1], size[2] * x[2]});
    }
    plain.shake(1e-3, 0);
    const double now = largest_eigenvalue(plain, 4 * most);
    EXPECT_LE(now, most) << size[0] << " " << size[1] << " " << size[2];
    highest = std::max(highest, now);
  }
  EXPECT_GT(highest, 0.4 * most);  // and no step that is much too short
}

TEST(MsmGpu, ParametersInRange_MayChangeAndOthersAreRefused) {
  const Mesh m = kuhn_bar(2, 2, 2, 0.02);
  Bodies b(m, {{"young", 1e5}}), stiff(m, {{"young", 4e5}});
  NEEDS_DRIVER(b);
  const double longest = fact(*b.device, "longest_step");
  std::vector<double> row = row_of(gpu(), {{"young", 4e5}});
  ASSERT_EQ(b.device->ops->set_params(b.device->self, row.data()), DFM_OK);
  EXPECT_NEAR(fact(*b.device, "longest_step"), longest / 2, 1e-12 * longest);
  for (Stepper *each : {b.device.get(), stiff.device.get()}) {
    each->shake(1e-3, 0.1);
    each->step();
  }
  expect_same_bits(*b.device, *stiff.device, "after a change");
  row[1] = -1;
  EXPECT_EQ(b.device->ops->set_params(b.device->self, row.data()), DFM_E_ARG);
  Mesh tiny = kuhn_bar(2, 2, 2, 1e-7);
  Stepper none(b.host, gpu(), tiny, {{"device", reference}});
  EXPECT_EQ(none.status, DFM_E_ARG);
  EXPECT_NE(b.host.logged.find("edges of 1e-6 m to 1e4 m are expected"), std::string::npos) << b.host.logged;
}

TEST(MsmGpu, FailingAllocator_LeavesNothingBehind) {
  const Mesh m = kuhn_bar(2, 2, 2, 0.02);
  size_t calls = 0;
  {
    Host counting;
    Stepper body(counting, gpu(), m, {{"device", reference}});
    calls = counting.calls;
  }
  for (size_t n = 0; n < calls; ++n) {
    Host host;
    host.fail_at = n;
    {
      Stepper body(host, gpu(), m, {{"device", reference}});
      EXPECT_EQ(body.status, DFM_E_NOMEM) << n;
      body.self = nullptr;
    }
    EXPECT_EQ(host.live, 0u) << n;
  }
}

}  // namespace
