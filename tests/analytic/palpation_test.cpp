// A sphere that slides over a block feels a stiff ball in it. Source: tests/data/palpation_reference.csv,
// made by tests/bench/palpation_reference.py on elements of 27 nodes (doc/reference/palpation.md).
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <numeric>

#include "support.h"

namespace {

const std::string kSource = DEFORM_SOURCE_DIR;

// N, upward force on the sphere at each place of the reference; half of the block is computed.
std::vector<double> forces(const std::string &folder, const std::vector<std::string> &set) {
  std::vector<std::string> args = {"run", folder + "/palpation.json", "--quiet", "--out", folder + "/run"};
  for (const std::string &s : set) args.insert(args.end(), {"--set", s});
  const auto run = test::deform(args);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const auto rows = test::read_csv(folder + "/run/bodies.csv");
  const size_t column = size_t(std::find(rows[0].begin(), rows[0].end(), "force_z") - rows[0].begin());
  std::vector<double> out;
  for (size_t r = 3; r < rows.size(); ++r) out.push_back(-2 * std::stod(rows[r][column]));  // from 0.2 s on
  return out;
}

// The finest mesh of the reference, which stands last.
std::vector<double> reference() {
  const auto rows = test::read_csv(kSource + "/tests/data/palpation_reference.csv");
  std::vector<double> out;
  for (const auto &row : rows)
    if (row[0] == rows.back()[0]) out.push_back(std::stod(row[3]));
  return out;
}

double mean(const std::vector<double> &x) {
  return std::accumulate(x.begin(), x.end(), 0.0) / double(x.size());
}

}  // namespace

// 6,912 tetrahedra are too stiff, here by a tenth; the page has the errors of finer meshes. The shape of the
// profile is closer.
TEST(Palpation, StiffBall_IsFeltAsTheReferenceSays) {
  const std::string folder = test::scratch("palpation");
  std::filesystem::create_directories(folder);
  const auto made = test::run({DEFORM_TEST_PYTHON, "-B", kSource + "/tests/bench/palpation_mesh.py", "24",
                               "6", "8", folder + "/block.msh"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  std::filesystem::copy_file(kSource + "/tests/bench/palpation.json", folder + "/palpation.json",
                             std::filesystem::copy_options::overwrite_existing);
  const std::vector<double> truth = reference(), felt = forces(folder, {});
  ASSERT_EQ(truth.size(), 11u);
  ASSERT_EQ(felt.size(), truth.size());
  for (size_t i = 0; i < felt.size(); ++i) {
    EXPECT_GT(felt[i] / truth[i], 1.05) << "place " << i;
    EXPECT_LT(felt[i] / truth[i], 1.17) << "place " << i;
    EXPECT_NEAR(felt[i] / mean(felt) / (truth[i] / mean(truth)), 1, 0.05) << "place " << i;
  }
  // without the ball there is nothing to feel but the end of the block beside the first place
  const std::vector<double> soft = forces(folder, {"/materials/nodule/young=1e4"});
  EXPECT_GT(felt.back() / felt.front(), 1.5);
  EXPECT_LT(soft.back() / soft.front(), 1.2);
}
