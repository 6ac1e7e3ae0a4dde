// Both models of the plugin model_gpu: the device against the same kernels on the processor, and both against
// the processor's models.
#include "gpu_host.h"

namespace {

using namespace gpu_test;

class Gpu : public testing::TestWithParam<uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Models, Gpu, testing::Range(0u, uint32_t(std::size(kNames))),
                         [](const auto &one) { return kNames[one.param]; });

// Those that have a period.
class Swinging : public Gpu {};
INSTANTIATE_TEST_SUITE_P(Models, Swinging, testing::Values(kSprings, kCells, kAlone, kSofter, kTurned),
                         [](const auto &one) { return kNames[one.param]; });
class Damped : public Gpu {};
INSTANTIATE_TEST_SUITE_P(Models, Damped, testing::Values(kCells, kAlone),
                         [](const auto &one) { return kNames[one.param]; });

// Neither a number of points that fills groups, nor one that does not.
TEST_P(Gpu, OnTheSoftwareDriver_HasTheBitsOfTheReference) {
  for (const double damping : {0.0, 2e-4})
    for (const bool held : {false, true}) {
      const Mesh m = kuhn_bar(6, 3, 3, 0.02, 0.2);
      Bodies b(GetParam(), m, {{"young", 3e5}, {"damping_stiffness", damping}, {"damping_mass", 0.7}},
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
TEST_P(Gpu, OnAnyDevice_ASubStepIsThatOfTheReference) {
  const Mesh m = kuhn_bar(6, 3, 3, 0.02, 0.2);
  Bodies b(GetParam(), m, {{"damping_stiffness", 2e-4}});
  NEEDS_DRIVER(b);
  const double h = b.device->dt = b.processor->dt = 0.9 * fact(*b.device, "longest_step");
  for (Stepper *each : {b.device.get(), b.processor.get()}) {
    each->shake(2e-3, 0.3);
    each->step();
  }
  Plain before(b.host, GetParam(), m, {});
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

TEST_P(Gpu, SameStepsAgain_HaveTheSameBits) {
  const Mesh m = kuhn_bar(5, 4, 3, 0.02, 0.2);
  Bodies b(GetParam(), m), again(GetParam(), m);
  NEEDS_DRIVER(b);
  for (Stepper *each : {b.device.get(), again.device.get()}) {
    each->shake(2e-3, 0.3);
    each->pull({0, 0, -9.81});
    for (int n = 0; n < 20; ++n) each->step();
  }
  expect_same_bits(*b.device, *again.device, "20 steps");
}

// More sub-steps than one submission holds, too.
TEST_P(Gpu, LongStep_IsThatOfItsSubSteps) {
  const Mesh m = kuhn_bar(3, 3, 3, 0.02, 0.2);
  Bodies b(GetParam(), m), parts(GetParam(), m);
  NEEDS_DRIVER(b);
  double longest = 1;
  while (longest > fact(*b.device, "longest_step")) longest /= 2;
  constexpr int kParts = 2048;  // and no rounding in h / n
  for (Stepper *each : {b.device.get(), parts.device.get()}) {
    each->shake(2e-4, 0.3);
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
TEST_P(Gpu, SubStep_IsThatOfTheProcessorsModel) {
  const Mesh m = read_msh(test::mesh_dir() + "/bars/bar_u3.msh");
  const double young = 2e5, damping = 1e-4, drag = 0.5;
  Host host;
  Params own = with(GetParam(), {{"young", young}, {"damping_stiffness", damping}, {"damping_mass", drag}});
  own["device"] = reference;
  Stepper b(host, gpu(GetParam()), m, own);
  Plain plain(host, GetParam(), m,
              {{"young", young}, {"damping_stiffness", damping}, {"damping_mass", drag}});
  ASSERT_EQ(b.status, DFM_OK) << host.logged;
  ASSERT_EQ(plain.status, DFM_OK) << host.logged;
  b.dt = 0.9 * fact(b, "longest_step");
  b.shake(1e-3, 0.2);
  plain.shake(1e-3, 0.2);
  EXPECT_NEAR(b.energy(), plain.energy(), 1e-10 * plain.energy());
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

// In contact the library takes 0.9 of the bound, and an impulse moves its points as the scheme of one
// sub-step does. Dampers rule the bound here, and the lightest points are held.
TEST_P(Gpu, StepOfTheBound_IsOneSubStep) {
  const Mesh m = kuhn_bar(4, 3, 3, 0.02, 0.2);
  for (const double damping : {0.0, 1e-4, 1e-2}) {
    const Params p = {{"young", 3e5}, {"damping_stiffness", damping}};
    Bodies b(GetParam(), m, p, clamp_of(m));
    NEEDS_DRIVER(b);
    Plain plain(b.host, GetParam(), m, p, clamp_of(m));
    const double h = 0.9 * stable_step(*b.device, clamp_of(m));
    plain.shake(1e-5, 0.01);
    plain.sub_step(h);
    for (Stepper *each : {b.device.get(), b.processor.get()}) {
      each->dt = h;
      each->shake(1e-5, 0.01);
      each->step();
      double most = 0, off = 0;
      for (uint32_t i = 0; i < m.npoint(); ++i) {
        most = std::max(most, norm(plain.get(plain.v, i)));
        off = std::max(off, norm(plain.get(plain.v, i) - each->get(each->v, i)));
      }
      EXPECT_LE(off, 1e-6 * most) << damping;
    }
  }
}

TEST_P(Swinging, StretchedBar_HasThePeriodOfTheProcessorsModel) {
  const Mesh m = kuhn_bar(12, 2, 2, 0.02);
  const double young = 1e6;
  Bodies b(GetParam(), m, {{"young", young}}, clamp_of(m));
  NEEDS_DRIVER(b);
  Plain plain(b.host, GetParam(), m, {{"young", young}}, clamp_of(m));
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
  const double processor =
      period([&] { plain.sub_step(h); }, [&] { return plain.get(plain.x, tip)[0] - m.at(tip)[0]; }, h);
  // of a slender rod: 4 l / sqrt(E / rho); a volume term makes this mesh of cubes stiffer
  if (GetParam() == kCells || GetParam() == kAlone) {
    EXPECT_NEAR(processor, 4 * 0.24 / std::sqrt(young / 1000), 0.05 * processor);
  }
  EXPECT_NEAR(device, processor, 1e-6 * processor);
}

// The lag of the dampers allows sub-steps that dampers which see the velocity do not, and takes 2 % of the
// first mode's damping at most.
TEST_P(Damped, StiffDampers_SlowTheFirstModeAsInShortSteps) {
  const Mesh m = kuhn_bar(12, 2, 2, 0.02);
  const double w = 1.5707963267948966 / 0.24 * std::sqrt(1e6 / 1000);  // rad/s
  const Params p = {{"young", 1e6}, {"damping_stiffness", 2 * 0.1 / w}};
  Bodies b(GetParam(), m, p, clamp_of(m));
  NEEDS_DRIVER(b);
  Plain plain(b.host, GetParam(), m, p, clamp_of(m));
  const auto stretch = [&](auto &body) {
    for (uint32_t i = 0; i < m.npoint(); ++i)
      body.set(body.x, i, m.at(i) + Vec{1e-3 * std::sin(1.5707963267948966 * m.at(i)[0] / 0.24), 0, 0});
  };
  const uint32_t tip = m.npoint() - 1;
  const double h = 0.9 * fact(*b.device, "longest_step");
  constexpr int kParts = 40;
  std::vector<double> rows(m.npoint(), 0.0), damping(rows);
  double cell = HUGE_VAL, seeing = HUGE_VAL;  // s, the longest sub-step of dampers without a lag
  const dfm_kin k = plain.kin();
  ASSERT_EQ(plain.ops->bound(plain.self, &k, rows.data(), damping.data(), &cell), DFM_OK);
  for (uint32_t i = 0; i < m.npoint(); ++i) seeing = std::min(seeing, 2 * m.mass[i] / damping[i]);
  EXPECT_GT(h, 1.5 * seeing);
  ASSERT_LT(h / kParts, 0.9 * seeing);
  stretch(*b.device);
  stretch(plain);
  b.device->dt = h;
  double off = 0, most = 0, last = 0;
  for (int n = 0; n * h < 4 * 6.283185307179586 / w; ++n) {
    b.device->step();
    for (int part = 0; part < kParts; ++part) plain.sub_step(h / kParts);
    const double there = b.device->get(b.device->x, tip)[0] - m.at(tip)[0],
                 here = plain.get(plain.x, tip)[0] - m.at(tip)[0];
    off = std::max(off, std::fabs(there - here));
    most = std::max(most, std::fabs(here));
    last = here;
  }
  EXPECT_LT(std::fabs(last), 0.15 * most);  // it has lost most of its motion
  EXPECT_LT(off, 0.03 * most);
}

TEST_P(Swinging, HangingBar_SagsAsTheProcessorsModel) {
  const Mesh m = kuhn_bar(8, 2, 2, 0.02);
  const double young = 5e4, drag = 60;
  Bodies b(GetParam(), m, {{"young", young}, {"damping_mass", drag}}, clamp_of(m));
  NEEDS_DRIVER(b);
  Plain plain(b.host, GetParam(), m, {{"young", young}, {"damping_mass", drag}}, clamp_of(m));
  plain.gravity = {9.81, 0, -1};
  b.device->pull(plain.gravity);
  b.device->dt = 0.05;
  for (int n = 0; n < 120; ++n) b.device->step();
  const double h = 0.9 * fact(*b.device, "longest_step");
  for (int n = 0; n * h < 6; ++n) plain.sub_step(h);
  const uint32_t tip = m.npoint() - 1;
  const Vec device = b.device->get(b.device->x, tip) - m.at(tip), sag = plain.get(plain.x, tip) - m.at(tip);
  EXPECT_GT(norm(sag), 1e-3);
  EXPECT_LE(norm(device - sag), 1e-6 * norm(sag));
  EXPECT_LT(norm(b.device->get(b.device->v, tip)), 1e-8);
}

// What branches have stretched is theirs, not the spring's: after some relaxation times the body has crept,
// by steps of several lengths, as on the processor.
TEST(MsmGpu, HangingBarWithBranches_CreepsAsTheProcessorsModel) {
  const Mesh m = kuhn_bar(6, 2, 2, 0.02);
  for (const Which which : {kMaxwell, kSls}) {
    const Params p = {{"young", 5e5}, {"damping_mass", 60}, {"damping_stiffness", 1e-5}};
    Bodies b(which, m, p, clamp_of(m));
    NEEDS_DRIVER(b);
    Plain plain(b.host, which, m, p, clamp_of(m));
    plain.gravity = {9.81, 0, -1};
    double longest = 1;
    while (longest > fact(*b.device, "longest_step")) longest /= 2;
    for (Stepper *each : {b.device.get(), b.processor.get()}) {
      each->pull(plain.gravity);
      for (int n = 0; n < 40; ++n) {
        each->dt = n % 2 ? longest : 32 * longest;
        each->step();
      }
    }
    const int parts = int(std::ceil(32 * longest / fact(*b.device, "longest_step") - 1e-9));
    for (int n = 0; n < 40; ++n)
      for (int k = 0; k < (n % 2 ? 1 : parts); ++k) plain.sub_step(n % 2 ? longest : 32 * longest / parts);
    expect_same_bits(*b.device, *b.processor, "40 steps");
    const uint32_t tip = m.npoint() - 1;
    const Vec sag = plain.get(plain.x, tip) - m.at(tip);
    EXPECT_GT(norm(sag), 1e-5);
    EXPECT_LE(norm(b.device->get(b.device->x, tip) - plain.get(plain.x, tip)), 1e-6 * norm(sag));
    EXPECT_NEAR(b.device->energy(), plain.energy(), 1e-5 * plain.energy());
    for (size_t e = 0; e < plain.state.size(); ++e)
      EXPECT_NEAR(b.device->state[3 * size_t(m.npoint()) + 1 + e], plain.state[e], 1e-6);
  }
}

// A force has the same bits at both ends of its spring and lies along it.
TEST_P(Gpu, FreeBody_KeepsItsMomenta) {
  const Mesh m = kuhn_bar(5, 3, 3, 0.02, 0.2);
  Bodies b(GetParam(), m, {{"damping_stiffness", 1e-4}});
  NEEDS_DRIVER(b);
  Stepper &body = *b.device;
  body.shake(2e-3, 0.5);
  for (uint32_t i = 0; i < body.size(); ++i)
    body.set(body.v, i, body.get(body.v, i) + cross({3, -2, 5}, body.get(body.x, i)) + Vec{1, 2, 0});
  const Vec momentum = body.momentum(), turning = body.angular_momentum(), middle = axis_sum(body, body.x);
  for (int n = 0; n < 1000; ++n) body.step();
  EXPECT_LE(norm(body.momentum() - momentum), 1e-12 * norm(momentum));
  EXPECT_LE(norm(body.angular_momentum() - turning), 1e-12 * norm(turning));
  EXPECT_LE(norm(axis_sum(body, body.x) - middle - 1000 * body.dt * momentum), 1e-11 * norm(momentum));
}

// A thousand steps of a body without damping; the scheme's own swing is h omega / 2 at most.
TEST_P(Swinging, UndampedBody_KeepsItsEnergy) {
  const Mesh m = kuhn_bar(5, 3, 3, 0.02, 0.2);
  Bodies b(GetParam(), m);
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

// Rows count every shape: torn out to three times its length, sheared, crushed, turned inside out. Springs
// have the same in all of them, cells those of the shape.
TEST(MsmGpu, StepOfTheShape_IsStableThere) {
  const Mesh m = kuhn_bar(4, 3, 3, 0.02, 0.2);
  const std::vector<uint8_t> free(m.npoint(), 0);
  const Params p = {{"poisson", 0.45}};
  for (const Which which : {kAlone, kSprings, kSofter, kStiffer, kTurned}) {
    double highest = 0;
    for (const Vec size :
         {Vec{1, 1, 1}, Vec{3, 3, 3}, Vec{3, 0.3, 1}, Vec{0.5, 0.5, 0.5}, Vec{1, 1, 0}, Vec{1, 1, -1}}) {
      Bodies b(which, m, p);
      Plain plain(b.host, which, m, p);
      for (ModelInstance *each :
           {static_cast<ModelInstance *>(&plain), static_cast<ModelInstance *>(b.processor.get())}) {
        for (uint32_t i = 0; i < m.npoint(); ++i) {
          const Vec x = m.at(i);
          each->set(each->x, i, {size[0] * x[0] + 0.5 * x[1], size[1] * x[1], size[2] * x[2]});
        }
        each->shake(1e-3, 0);
      }
      const double h = stable_step(*b.processor, free), most = 4 / (h * h);
      EXPECT_LE(h, fact(*b.processor, "longest_step") / (which == kAlone ? 1 : 0.9) * (1 + 1e-9));
      const double now = largest_eigenvalue(plain, 4 * most);
      EXPECT_LE(now, most) << kNames[which] << " " << size[0] << " " << size[1] << " " << size[2];
      highest = std::max(highest, now / most);
    }
    // and no step that is much too short: rows count a tilted spring as one that is not
    EXPECT_GT(highest, which == kAlone || which == kSprings ? 0.4 : 0.3) << kNames[which];
  }
}

TEST_P(Gpu, ParametersInRange_MayChangeAndOthersAreRefused) {
  const Mesh m = kuhn_bar(2, 2, 2, 0.02);
  Bodies b(GetParam(), m, {{"young", 1e5}}), stiff(GetParam(), m, {{"young", 4e5}});
  NEEDS_DRIVER(b);
  const double longest = fact(*b.device, "longest_step");
  std::vector<double> row = row_of(gpu(GetParam()), with(GetParam(), {{"young", 4e5}}));
  ASSERT_EQ(b.device->ops->set_params(b.device->self, row.data()), DFM_OK);
  EXPECT_NEAR(fact(*b.device, "longest_step"), longest / 2, 1e-12 * longest);
  for (Stepper *each : {b.device.get(), stiff.device.get()}) {
    each->shake(1e-3, 0.1);
    each->step();
  }
  expect_same_bits(*b.device, *stiff.device, "after a change");
  row[1] = -1;
  EXPECT_EQ(b.device->ops->set_params(b.device->self, row.data()), DFM_E_ARG);
}

// Cells get their terms, springs their tilts, where there were none, and lose them again.
TEST(MsmGpu, TermsThatComeAndGo_AreThoseOfABodyThatHasThem) {
  const Mesh m = kuhn_bar(3, 3, 3, 0.02, 0.2);
  Bodies b(kAlone, m);
  NEEDS_DRIVER(b);
  for (const Params &p : {Params{{"volume", 2}, {"poisson", 0.4}, {"collapse", 0}}, Params{},
                          Params{{"anisotropy_slope", 2}, {"collapse", 5}, {"volume", 0}},
                          Params{{"volume", 0}, {"collapse", 0}}}) {
    const std::vector<double> values = row_of(gpu(kSprings), p);
    Bodies fresh(kSprings, m, p);
    for (Stepper *each : {b.device.get(), b.processor.get()}) {
      ASSERT_EQ(each->ops->set_params(each->self, values.data()), DFM_OK) << b.host.logged;
      for (uint32_t i = 0; i < m.npoint(); ++i) each->set(each->x, i, m.at(i));
      std::fill(each->v, each->v + 4 * size_t(m.npoint()), 0.0);
      std::fill(each->state.begin(), each->state.end(), 0.0);
    }
    for (Stepper *each : {b.device.get(), b.processor.get(), fresh.device.get(), fresh.processor.get()}) {
      each->shake(1e-3, 0.1);
      for (int n = 0; n < 3; ++n) each->step();
    }
    expect_same_bits(*b.device, *fresh.device, "on the device");
    expect_same_bits(*b.processor, *fresh.processor, "on the processor");
  }
}

// What may come by cell does so for the device, too.
TEST(MsmGpu, FieldsByCell_MoveAsTheProcessorsModel) {
  const Mesh m = kuhn_bar(4, 3, 3, 0.02, 0.2);
  Fields fields;
  for (uint32_t c = 0; c < m.ncell(); ++c) {
    fields["young"].push_back(1e5 * (1 + c % 3));
    fields["poisson"].push_back(0.1 * (c % 5));
    fields["volume"].push_back(c % 4);
    fields["collapse"].push_back(c % 3);
    fields["damping_stiffness"].push_back(c % 2 ? 1e-4 : 0);
    fields["damping_mass"].push_back(c % 5);
    fields["anisotropy_slope"].push_back(0.5 * (c % 4));
    for (const double a : {1.0, double(c % 2), -0.5}) fields["anisotropy_axis"].push_back(a);
  }
  Host host;
  ModelInstance own(host, gpu(kSprings), m, row_of(gpu(kSprings), {{"device", reference}}), 4, fields),
      plain(host, cpu(kSprings), m, row_of(cpu(kSprings), {}), 4, fields);
  ASSERT_EQ(own.status, DFM_OK) << host.logged;
  const double h = own.dt = 1e-6;
  for (ModelInstance *each : {&own, &plain}) each->shake(1e-3, 0.2);
  EXPECT_NEAR(own.energy(), plain.energy(), 1e-10 * plain.energy());
  const auto *ops = static_cast<const dfm_stepper *>(own.ops->extension(own.self, "dfm.stepper/1"));
  std::vector<double> u(3 * size_t(m.npoint())), none(u), x(4 * size_t(m.npoint())), v(x);
  dfm_kin k = own.kin();
  k.state_out = own.state_out.data();
  ASSERT_EQ(ops->predict(own.self, &k, own.f, u.data()), DFM_OK) << host.logged;
  ASSERT_EQ(ops->commit(own.self, &k, none.data(), x.data(), v.data()), DFM_OK);
  plain.forces();
  double most = 0, off = 0;
  for (uint32_t i = 0; i < m.npoint(); ++i) {
    const Vec change = (h / m.mass[i]) * plain.get(plain.f, i), before = plain.get(plain.v, i);
    most = std::max(most, norm(change));
    off = std::max(off, norm(own.get(v.data(), i) - (before + change)));
  }
  EXPECT_GT(most, 1e-5);
  EXPECT_LE(off, 1e-6 * most);
}

// Springs across a plane go off and on: so they move as the processor's, and then as if they had stayed on.
TEST(MsmGpu, SpringsThatAreOff_AreThoseOfTheProcessorsModel) {
  const Mesh m = kuhn_bar(6, 3, 3, 0.02, 0.2);
  for (const Which which : {kSprings, kSls}) {
    Bodies b(which, m, {{"damping_stiffness", 1e-5}}), whole(which, m, {{"damping_stiffness", 1e-5}});
    NEEDS_DRIVER(b);
    Plain plain(b.host, which, m, {{"damping_stiffness", 1e-5}});
    std::vector<uint32_t> cut;
    for (uint32_t e = 0; e < m.edges.size() / 2; ++e)
      if ((m.at(m.edges[2 * e])[0] < 0.05) != (m.at(m.edges[2 * e + 1])[0] < 0.05)) cut.push_back(e);
    const auto mask = [&](ModelInstance &of, bool on) {
      const auto *table =
          static_cast<const dfm_spring_mask *>(of.ops->extension(of.self, DFM_EXT_SPRING_MASK));
      ASSERT_EQ(table->set(of.self, uint32_t(cut.size()), cut.data(), on), DFM_OK) << b.host.logged;
      std::vector<uint8_t> all(m.edges.size() / 2, 7);
      ASSERT_EQ(table->get(of.self, all.data()), DFM_OK);
      EXPECT_EQ(std::count(all.begin(), all.end(), 0), on ? 0 : long(cut.size()));
      const uint32_t none[] = {0, uint32_t(all.size())};
      EXPECT_EQ(table->set(of.self, 2, none, 0), DFM_E_ARG);
    };
    const double h = 0.1 * fact(*b.device, "longest_step");
    for (ModelInstance *each :
         {static_cast<ModelInstance *>(b.device.get()), static_cast<ModelInstance *>(b.processor.get()),
          static_cast<ModelInstance *>(&plain)}) {
      mask(*each, false);
      each->shake(1e-3, 0.2);
    }
    EXPECT_NEAR(b.processor->energy(), plain.energy(), 1e-10 * plain.energy());
    const std::vector<double> before(plain.v, plain.v + 4 * size_t(m.npoint()));
    plain.sub_step(h);
    for (Stepper *each : {b.device.get(), b.processor.get()}) {
      each->dt = h;
      each->step();
      double most = 0, off = 0;
      for (uint32_t i = 0; i < m.npoint(); ++i) {
        most = std::max(most, norm(plain.get(plain.v, i) - plain.get(before.data(), i)));
        off = std::max(off, norm(plain.get(plain.v, i) - each->get(each->v, i)));
      }
      EXPECT_GT(most, 1e-5);
      EXPECT_LE(off, 1e-6 * most);
    }
    for (Stepper *each : {b.device.get(), b.processor.get(), whole.device.get(), whole.processor.get()}) {
      mask(*each, true);
      each->ops->state_init(each->self, each->state.data());
      for (uint32_t i = 0; i < m.npoint(); ++i) {
        const double bend = std::sin(100 * m.at(i)[0]);
        each->set(each->x, i, m.at(i) + Vec{0, 1e-3 * bend, 0});
        each->set(each->v, i, {0, 0, bend});
      }
      each->dt = 4 * h;
      for (int n = 0; n < 3; ++n) each->step();
    }
    expect_same_bits(*b.device, *whole.device, "on again");
    expect_same_bits(*b.processor, *whole.processor, "on again");
  }
}

TEST(MsmGpu, EdgesBeyondTheRangeOfAFloat_AreRefused) {
  Host host;
  Stepper none(host, gpu(kSprings), kuhn_bar(2, 2, 2, 1e-7), {{"device", reference}});
  EXPECT_EQ(none.status, DFM_E_ARG);
  EXPECT_NE(host.logged.find("edges of 1e-6 m to 1e4 m are expected"), std::string::npos) << host.logged;
}

TEST_P(Gpu, RefusedMemory_LeavesNothingBehind) {
  const Mesh m = kuhn_bar(2, 2, 2, 0.02);
  refuse_each_allocation([&](Host &host) {
    return Stepper(host, gpu(GetParam()), m, with(GetParam(), {{"device", reference}}));
  });
}

}  // namespace
