// What cells of the plugin model_gpu have: forces in every shape, and a bound that depends on it.
#include "gpu_host.h"

namespace {

using namespace gpu_test;

Mesh bar() { return kuhn_bar(4, 3, 3, 0.02, 0.2); }

// Linear maps, some of which turn cells over or leave two stretches that nearly cancel.
const std::vector<std::array<Vec, 3>> &shapes() {
  static const std::vector<std::array<Vec, 3>> all = {
      {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},         {{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}},
      {{{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}}},       {{{3, 0.4, 0}, {0, 0.5, 0}, {0, 0.2, 0.5}}},
      {{{2, 0, 0}, {0, 2, 0}, {0.3, 0, 1.5}}},     {{{0.2, 0, 0}, {0, 0.2, 0.1}, {0, 0, 0.2}}},
      {{{1, 0, 0}, {0, 1, 0}, {0, 0, 0}}},         {{{1, 0, 0}, {0, 1.1, 0}, {0.1, 0, -0.6}}},
      {{{1.3, 0, 0.1}, {0, 1, 0}, {0, 0, -0.97}}}, {{{-1.2, 0, 0}, {0, -1, 0}, {0, 0.1, -0.8}}},
      {{{4, 0, 0}, {0, 1e-3, 0}, {0, 0, 2e-3}}},   {{{1e-5, 0, 0}, {0, 1e-5, 0}, {0, 0, 1e-5}}},
  };
  return all;
}

template <class Body>
void take_shape(Body &b, const std::array<Vec, 3> &to) {
  for (uint32_t i = 0; i < b.size(); ++i) {
    const Vec x = b.mesh.at(i);
    b.set(b.x, i, {dot(to[0], x), dot(to[1], x), dot(to[2], x)});
  }
}

// s, of the worst shape of the last step, as the state has it.
double stable_at_last(const Stepper &b) { return b.state[3 * size_t(b.size())]; }

class Drawn : public testing::TestWithParam<uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Models, Drawn,
                         testing::Values(kSprings, kCells, kSofter, kStiffer, kTurned, kMaxwell, kSls, kAll),
                         [](const auto &one) { return kNames[one.param]; });

// Forces and dampers of one sub-step, also where the kernel finds the frame in its second way.
TEST_P(Drawn, InEveryShape_MovesAsTheProcessorsModel) {
  for (const auto &shape : shapes()) {
    const Params p = {{"young", 2e5}, {"poisson", 0.4}, {"damping_stiffness", 1e-4}, {"damping_mass", 0.5}};
    Bodies b(GetParam(), bar(), p);
    NEEDS_DRIVER(b);
    Plain plain(b.host, GetParam(), bar(), p);
    ASSERT_EQ(plain.status, DFM_OK) << b.host.logged;
    take_shape(plain, shape);
    plain.shake(1e-5, 0.2);
    const std::vector<double> before(plain.v, plain.v + 4 * size_t(plain.size()));
    const double h = 1e-3 * fact(*b.device, "longest_step");
    for (Stepper *each : {b.device.get(), b.processor.get()}) {
      take_shape(*each, shape);
      each->shake(1e-5, 0.2);
      each->dt = h;
      each->step();
    }
    plain.sub_step(h);
    double most = 0, off = 0;
    for (uint32_t i = 0; i < plain.size(); ++i) {
      const Vec now = plain.get(plain.v, i);
      most = std::max(most, norm(now - plain.get(before.data(), i)));
      off = std::max(
          {off, norm(now - b.device->get(b.device->v, i)), norm(now - b.processor->get(b.processor->v, i))});
    }
    EXPECT_GT(most, 1e-5) << shape[0][0] << " " << shape[2][2];
    EXPECT_LE(off, 1e-6 * most) << shape[0][0] << " " << shape[2][2];
  }
}

TEST(CorotationalFemGpu, Bound_IsThatOfTheProcessorsModelInEveryShape) {
  for (const auto &shape : shapes()) {
    const Params p = {{"poisson", 0.45}, {"damping_stiffness", 1e-4}, {"damping_mass", 0.5}};
    Host host;
    Params own = p;
    own["device"] = reference;
    Stepper b(host, gpu(kCells), bar(), own);
    Plain plain(host, kCells, bar(), p);
    std::vector<double> rows[2][2];
    int n = 0;
    for (ModelInstance *each : {static_cast<ModelInstance *>(&b), static_cast<ModelInstance *>(&plain)}) {
      take_shape(*each, shape);
      each->shake(1e-5, 0);
      for (auto &row : rows[n]) row.assign(each->size(), 0.0);
      double cell = 0;
      const dfm_kin k = each->kin();
      ASSERT_EQ(each->ops->bound(each->self, &k, rows[n][0].data(), rows[n][1].data(), &cell), DFM_OK);
      ++n;
    }
    for (int kind = 0; kind < 2; ++kind)
      for (uint32_t i = 0; i < b.size(); ++i)
        EXPECT_NEAR(rows[0][kind][i], rows[1][kind][i], 1e-6 * rows[1][kind][i]) << shape[0][0];
  }
}

// A sheet that is drawn to twice its size is stiffer than at rest: a step is taken again in shorter parts,
// and nothing tells it from those.
TEST_P(Drawn, DrawnFar_TakesShorterSubSteps) {
  Bodies b(GetParam(), bar(), {{"poisson", 0.45}}), parts(GetParam(), bar(), {{"poisson", 0.45}});
  NEEDS_DRIVER(b);
  const auto wide = shapes()[4];
  const double h = fact(*b.device, "longest_step");
  for (Stepper *each : {b.device.get(), b.processor.get(), parts.device.get()}) {
    take_shape(*each, wide);
    each->shake(1e-4, 0.1);
    each->dt = h;
  }
  b.device->step();
  int n = 2;
  const std::vector<double> initial = parts.device->state;
  for (bool same = false; !same && n < 20; n += !same) {
    Stepper &part = *parts.device;
    part.state = initial;
    take_shape(part, wide);
    std::fill(part.v, part.v + 4 * size_t(part.size()), 0.0);
    part.shake(1e-4, 0.1);
    part.dt = h / n;
    for (int k = 0; k < n; ++k) part.step();
    same = std::memcmp(part.x, b.device->x, 4 * size_t(part.size()) * sizeof(double)) == 0;
  }
  EXPECT_LT(n, 20);
}

// Between two walls that hold it at 2.5 times its length: in steps that are not taken again the energy is
// 40 times as high after 2,000 of them, and not finite soon after.
TEST_P(Drawn, HeldFarDrawn_StaysStable) {
  const Mesh m = bar();
  std::vector<uint8_t> ends(m.npoint(), 0);
  for (uint32_t i = 0; i < m.npoint(); ++i) ends[i] = m.at(i)[0] < 1e-9 || m.at(i)[0] > 0.08 - 1e-9 ? 7 : 0;
  Bodies b(GetParam(), m, {{"poisson", 0.45}}, ends);
  Stepper &body = *b.processor;
  take_shape(body, {{{2.5, 0, 0}, {0, 0.75, 0}, {0, 0, 0.75}}});
  body.dt = fact(body, "longest_step");
  const double first = body.energy();
  double most = 0;
  for (int k = 0; k < 2000; ++k) {
    body.step();
    most = std::max(most, body.kinetic() + body.energy());
  }
  EXPECT_LT(most, 1.3 * first);
}

// The step bound of the shape, as the kernel finds it and as the rows of bound() give it.
TEST_P(Drawn, State_IsTheStepOfTheRowsInEveryShape) {
  for (const auto &shape : shapes()) {
    const Mesh m = bar();
    Bodies b(GetParam(), m, {{"poisson", 0.45}, {"damping_stiffness", 1e-4}, {"damping_mass", 0.5}},
             clamp_of(m));
    NEEDS_DRIVER(b);
    for (Stepper *each : {b.device.get(), b.processor.get()}) {
      take_shape(*each, shape);
      const double stable = stable_step(*each, clamp_of(m));
      each->dt = 1e-4 * stable;
      each->step();
      EXPECT_NEAR(stable_at_last(*each), stable, 1e-5 * stable) << shape[0][0] << " " << shape[2][2];
      EXPECT_NEAR(stable_step(*each, clamp_of(m)), stable_at_last(*each), 1e-9 * stable);
    }
  }
}

// The first step finds that the shape asks for shorter sub-steps, and those after it begin with them.
class Held : public Drawn {};
INSTANTIATE_TEST_SUITE_P(Models, Held, testing::Values(kSprings, kCells),
                         [](const auto &one) { return kNames[one.param]; });
TEST_P(Held, StaysFarDrawn_TakesNoOtherStepTwice) {
  const Mesh m = bar();
  std::vector<uint8_t> ends(m.npoint(), 0);
  for (uint32_t i = 0; i < m.npoint(); ++i) ends[i] = m.at(i)[0] < 1e-9 || m.at(i)[0] > 0.08 - 1e-9 ? 7 : 0;
  Bodies b(GetParam(), m, {{"poisson", 0.45}, {"damping_stiffness", 1e-4}}, ends);
  Stepper &body = *b.processor;
  take_shape(body, {{{2.5, 0, 0}, {0, 0.75, 0}, {0, 0, 0.75}}});
  body.dt = 40 * fact(body, "longest_step");
  static uint32_t passes = 0;
  b.host.table.parallel_for = [](void *, uint32_t n, uint32_t, void (*fn)(void *, uint32_t, uint32_t),
                                 void *user) {
    ++passes;
    fn(user, 0, n);
  };
  int again = 0;
  for (int n = 0; n < 50; ++n) {
    const double stable = std::min(stable_at_last(body) > 0 ? stable_at_last(body) : HUGE_VAL,
                                   fact(body, "longest_step") / 0.9);
    const uint32_t once = 2 * uint32_t(std::ceil(body.dt / (0.9 * stable) - 1e-6)) + 3;
    passes = 0;
    body.step();
    again += passes > once;
    EXPECT_GE(passes, once);
  }
  EXPECT_EQ(again, 1);
}

// The device says when a step was too long as the processor does.
TEST_P(Drawn, DrawnFarOnTheSoftwareDriver_HasTheBitsOfTheReference) {
  Bodies b(GetParam(), bar(), {{"poisson", 0.45}, {"damping_stiffness", 1e-5}}, {}, software);
  NEEDS_DRIVER(b);
  for (Stepper *each : {b.device.get(), b.processor.get()}) {
    take_shape(*each, shapes()[4]);
    each->shake(1e-4, 0.1);
    each->dt = 20 * fact(*each, "longest_step");
    for (int n = 0; n < 3; ++n) each->step();
  }
  expect_same_bits(*b.device, *b.processor, "three long steps");
}

TEST(CorotationalFemGpu, FieldsByCell_AreThoseOfTheProcessorsModel) {
  const Mesh m = bar();
  Fields fields;
  for (uint32_t c = 0; c < m.ncell(); ++c) {
    fields["young"].push_back(1e5 * (1 + c % 3));
    fields["poisson"].push_back(0.1 * (c % 5));
  }
  Host host;
  const std::vector<double> row = row_of(gpu(kCells), {{"device", reference}}),
                            none = row_of(cpu(kCells), {});
  ModelInstance own(host, gpu(kCells), m, row, 4, fields), plain(host, cpu(kCells), m, none, 4, fields);
  ASSERT_EQ(own.status, DFM_OK) << host.logged;
  for (ModelInstance *each : {&own, &plain}) each->shake(1e-3, 0);
  EXPECT_NEAR(own.energy(), plain.energy(), 1e-10 * plain.energy());
}

}  // namespace
