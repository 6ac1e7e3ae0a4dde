// Same bits for every instruction set, cut and order of parallel_for; nothing depends on an
// effect that is off.
#include "msm_host.h"

namespace msm_test {
namespace {

const Mesh &large_bar() {  // above the size from which blocks are handed to parallel_for
  static const Mesh mesh = kuhn_bar(30, 9, 8, 0.05, 0.2);
  return mesh;
}

std::vector<double> results(Host &host, const char *simd, const Mesh &mesh, const Params &p,
                            uint32_t stride = 4, const Fields &fields = {}) {
  if (simd) setenv("DEFORM_SIMD", simd, 1);
  Instance b(host, mesh, p, stride, fields);
  unsetenv("DEFORM_SIMD");
  b.shake(0.004, 2);
  // some inverted cells
  for (uint32_t i = 0; i < b.size(); i += 7) b.set(b.x, i, b.get(b.x, i) + Vec{0.03, -0.02, 0.05});
  b.forces();
  std::vector<double> all, ksum, csum;
  for (uint32_t i = 0; i < b.size(); ++i)
    for (double f : b.get(b.f, i)) all.push_back(f);
  all.push_back(b.energy());
  all.push_back(b.bound(&ksum, &csum));
  all.insert(all.end(), ksum.begin(), ksum.end());
  all.insert(all.end(), csum.begin(), csum.end());
  return all;
}

Params at_defaults(double poisson) {
  Params p = {2e5, poisson, 0.003, 0, -1};
  p.collapse = 3;
  return p;
}

TEST(MsmDeterminism, Compiler_NeverShowsInAResult) {
  Host host;  // one value for gcc and clang, -O0 and -O2, with and without sanitizers
  const std::vector<double> all = results(host, nullptr, large_bar(), {2e5, 0.4, 0.003, 0.5, 1.5});
  EXPECT_GT(*std::max_element(all.begin(), all.begin() + 3 * large_bar().npoint()), 1);
  EXPECT_EQ(fnv(all), 8838069770950015090ull);
  EXPECT_EQ(fnv(results(host, nullptr, large_bar(), at_defaults(0.3))), 5494957397701420985ull);
}

TEST(MsmDeterminism, InstructionSet_NeverShowsInAResult) {
  for (const Mesh &mesh : {irregular_tet(), kuhn_bar(4, 3, 2, 0.1, 0.2), large_bar()})
    for (const Params &p : {Params{2e5, 0.4, 0.003, 0.5, 1.5}, Params{2e5, 0.4, 0, 0, 1.5},
                            Params{2e5, 0.4, 0.003, 0, 0}, Params{}, at_defaults(0.3), at_defaults(0)}) {
      Host host;
      const std::vector<double> baseline = results(host, "sse2", mesh, p);
      for (const char *simd : {"avx2", "avx512"}) {
        Host other;
        EXPECT_TRUE(same_bits(baseline, results(other, simd, mesh, p))) << simd;
        // Where the processor lacks the set the plugin says so and this comparison is void.
        if (!other.logged.empty()) std::printf("%s: %s", simd, other.logged.c_str());
      }
    }
}

Params tilted(double damping, bool form_a) {
  Params p = {2e5, 0.4, damping, 0.5, 1.5};
  p.slope = 1.3;
  p.axis = {1, 2, -1};
  p.form_a = form_a;
  return p;
}

// unsanitized: too slow there; shorter tests run the same code
TEST(MsmDeterminism, InstructionSetAndCut_NeverShowInAnyOption) {
  Fields uneven;
  for (uint32_t c = 0; c < large_bar().ncell(); ++c) {
    uneven["damping_stiffness"].push_back(1e-3 * (c % 3));
    uneven["poisson"].push_back(0.1 * (c % 4));
    uneven["volume"].push_back(c % 2);
    uneven["anisotropy_slope"].push_back(c % 5);
  }
  for (const Fields &fields : {Fields{}, uneven})
    for (double damping : {0.0, 0.003})
      for (bool form_a : {false, true}) {
        Host plain;
        const std::vector<double> baseline =
            results(plain, "sse2", large_bar(), tilted(damping, form_a), 4, fields);
        for (const char *simd : {"avx2", "avx512", ""}) {
          Host other;
          other.shuffle = *simd ? 0 : 11;
          EXPECT_TRUE(
              same_bits(baseline, results(other, simd, large_bar(), tilted(damping, form_a), 4, fields)))
              << simd << damping << form_a;
        }
      }
}

TEST(MsmDeterminism, Compiler_NeverShowsInAnyOption) {
  Host host;
  std::vector<double> all = results(host, nullptr, large_bar(), tilted(0.003, false));
  for (double a : results(host, nullptr, large_bar(), tilted(0.003, true))) all.push_back(a);
  Params sls = tilted(0.003, false);
  sls.damper = 2;
  sls.time = 1e-3;
  Instance b(host, large_bar(), sls);
  b.shake(0.004, 2);
  b.forces_and_step();
  b.forces_and_step();
  all.insert(all.end(), b.state.begin(), b.state.end());
  all.insert(all.end(), b.f, b.f + 4 * b.size());
  EXPECT_EQ(fnv(all), 3791657580899702830ull);
}

TEST(MsmDeterminism, ForcedInstructionSet_IsUsedOrTheLogGivesTheReason) {
  Host host;
  results(host, "sse2", irregular_tet(), {});
  EXPECT_TRUE(host.logged.empty());
  results(host, "mmx", irregular_tet(), {});
  EXPECT_NE(host.logged.find("DEFORM_SIMD"), std::string::npos);
}

TEST(MsmDeterminism, CutAndOrderOfParallelFor_NeverShow) {
  const Params p = {2e5, 0.4, 0.003, 0.5, 1.5};
  Host plain;
  const std::vector<double> baseline = results(plain, nullptr, large_bar(), p);
  for (unsigned seed = 1; seed < 20; ++seed) {
    Host host;
    host.shuffle = seed;
    EXPECT_TRUE(same_bits(baseline, results(host, nullptr, large_bar(), p))) << seed;
  }
}

// 105,456 cells: adding up the blocks is cut as well, several blocks per piece
// unsanitized: too slow there; shorter tests run the same code
TEST(MsmDeterminism, CutOfAVeryLargeBody_NeverShows) {
  const Params p = {2e5, 0.4, 0.003, 0.5, 1.5};
  const Mesh mesh = kuhn_bar(26, 26, 26, 0.05, 0.2);
  Host plain, shuffled;
  shuffled.shuffle = 5;
  EXPECT_TRUE(same_bits(results(plain, nullptr, mesh, p), results(shuffled, nullptr, mesh, p)));
}

TEST(MsmDeterminism, Stride_NeverShows) {
  Host host;
  const Params p = {2e5, 0.4, 0.003, 0.5, 1.5};
  EXPECT_TRUE(
      same_bits(results(host, nullptr, large_bar(), p, 3), results(host, nullptr, large_bar(), p, 4)));
  EXPECT_TRUE(
      same_bits(results(host, nullptr, large_bar(), p, 7), results(host, nullptr, large_bar(), p, 4)));
}

TEST(MsmDeterminism, SecondCall_GivesTheSameBits) {
  Host host;
  Instance b(host, large_bar(), {2e5, 0.4, 0.003, 0.5, 1.5});
  b.shake(0.004, 2);
  b.forces();
  const std::vector<double> first(b.f, b.f + 4 * b.size());
  b.bound();
  b.energy();
  const size_t calls = host.calls;
  b.forces();
  EXPECT_TRUE(same_bits(first, std::vector<double>(b.f, b.f + 4 * b.size())));
  EXPECT_EQ(host.calls, calls) << "a step allocated";
}

TEST(MsmDeterminism, VolumeOff_IsThePlainModel) {
  // nothing of the volume term is left, whatever Poisson's ratio asks for; and switching it off brings the
  // plain model back
  Host host;
  const std::vector<double> plain = results(host, nullptr, large_bar(), {2e5, 0.25, 0.003, 0, 0});
  EXPECT_TRUE(same_bits(plain, results(host, nullptr, large_bar(), {2e5, 0.49, 0.003, 0, 0})));
  Instance a(host, large_bar(), {2e5, 0.3, 0.003, 0, 0}), b(host, large_bar(), {3e5, 0.4, 0.001, 2, 5});
  const std::vector<double> values = Instance::row({2e5, 0.3, 0.003, 0, 0});
  ASSERT_EQ(b.ops->set_params(b.self, values.data()), DFM_OK);
  a.shake(0.004, 2);
  b.shake(0.004, 2);
  a.forces();
  b.forces();
  EXPECT_EQ(std::memcmp(a.f, b.f, 4 * a.size() * sizeof(double)), 0);
}

TEST(MsmDeterminism, RenumberedMesh_MovesTheSameToRounding) {
  Host host;
  const Mesh &mesh = large_bar();
  std::vector<uint32_t> to(mesh.npoint());
  for (uint32_t i = 0; i < mesh.npoint(); ++i) to[i] = i;
  std::shuffle(to.begin(), to.end(), std::mt19937(3));
  Mesh other = mesh;
  for (uint32_t i = 0; i < mesh.npoint(); ++i) std::copy_n(&mesh.rest[3 * i], 3, &other.rest[3 * to[i]]);
  for (uint32_t &i : other.cells) i = to[i];
  other.finish();
  const Params p = {2e5, 0.4, 0.003, 0.5, 1.5};
  Instance a(host, mesh, p), b(host, other, p);
  a.shake(0.004, 2);
  for (uint32_t i = 0; i < a.size(); ++i) {
    b.set(b.x, to[i], a.get(a.x, i));
    b.set(b.v, to[i], a.get(a.v, i));
  }
  a.forces();
  b.forces();
  for (uint32_t i = 0; i < a.size(); ++i)
    EXPECT_LT(norm(a.get(a.f, i) - b.get(b.f, to[i])), 1e-12 * a.largest_force());
}

TEST(MsmDeterminism, RefusedMemory_LeavesNothingBehind) {
  Params p = tilted(0.003, false);
  p.damper = 2;
  const Fields fields = {{"damping_stiffness", {0.1}}, {"damping_mass", {1}}, {"anisotropy_axis", {1, 0, 0}}};
  EXPECT_GT(refuse_each_allocation([&](Host &host) { return Instance(host, irregular_tet(), p, 4, fields); }),
            40u);
}

TEST(MsmDeterminism, WrongInput_IsRefusedWithASentence) {
  Host host;
  for (const Params &p : {Params{-1}, Params{1e5, 0.5}, Params{1e5, 0.3, -1}, Params{std::nan("")},
                          Params{1e5, 0.3, 0, 0, 1e9}}) {
    host.logged.clear();
    Instance b(host, irregular_tet(), p);
    EXPECT_EQ(b.status, DFM_E_ARG);
    EXPECT_NE(host.logged.find("parameter"), std::string::npos);
  }
  Mesh cut = irregular_tet();
  cut.edges.resize(cut.edges.size() - 2);
  host.logged.clear();
  Instance b(host, cut, {});
  EXPECT_EQ(b.status, DFM_E_ARG);
  EXPECT_NE(host.logged.find("edge"), std::string::npos);
}

TEST(MsmDeterminism, TypeRow_IsComplete) {
  const dfm_type &type = plugin_type();
  EXPECT_STREQ(type.id, "org.deform.msm");
  EXPECT_EQ(type.kind, uint32_t(DFM_KIND_MODEL));
  for (uint32_t n = 0; n < type.nparam; ++n) {
    const dfm_param &p = type.params[n];
    EXPECT_TRUE(p.min <= p.def && p.def <= p.max && p.unit && p.label) << p.key;
  }
  const auto *ops = static_cast<const dfm_model *>(type.ops);
  EXPECT_EQ(ops->nslot, 0u);  // state comes by instance: dfm.slots/1
  EXPECT_EQ(ops->cells, uint32_t(DFM_CELL_TET));
}

}  // namespace
}  // namespace msm_test
