// What meshes of several sizes say about a mesh without end, on figures whose limit is known.
#include <gtest/gtest.h>

#include <cmath>

#include <filesystem>
#include <fstream>

#include "cost/richardson.h"

using namespace cli::cost;

namespace {

// sin t + off(t), at times of its own.
template <class Off>
Quantity figure(int records, Off off) {
  Quantity q;
  q.family = "probe";
  for (int i = 0; i <= records; ++i) {
    const double t = double(i) / records;
    q.t.push_back(t);
    q.values.push_back(std::sin(t) + off(t));
  }
  return q;
}

const double kSizes[3] = {0.1, 0.15, 0.25};

double from_truth(const Quantity &q) {
  return error_of(q, figure(200, [](double) { return 0.0; }), 1);
}

}  // namespace

TEST(CostLimit, RunsThatConverge_GiveOrderAndLimit) {
  for (const double order : {1.0, 1.4, 2.0}) {
    const auto on = [&](double h, int records) {
      return figure(records, [=](double t) { return 3 * t * std::pow(h, order); });
    };
    const Quantity fine = on(kSizes[0], 200), middle = on(kSizes[1], 200), coarse = on(kSizes[2], 200);
    Quantity limit;
    const Limit found = find_limit(fine, middle, &coarse, kSizes, 1, limit);
    EXPECT_TRUE(found.used);
    EXPECT_NEAR(found.order, order, 1e-6);
    EXPECT_LT(from_truth(limit), 1e-9);
    EXPECT_EQ(found.basis, Basis::order);
    EXPECT_NEAR(found.error, 0.25 * from_truth(fine), 1e-9) << "both extrapolations meet, in any order";
    EXPECT_EQ(found.bound, found.error);
    EXPECT_GT(from_truth(fine), 0.01);
  }
}

// The error is said of the extrapolated figure, and holds.
TEST(CostLimit, TwoTermsOfError_AreWithinTheStatedBound) {
  const auto on = [&](double h) { return figure(200, [=](double t) { return t * h * h * (3 + 4 * h); }); };
  const Quantity fine = on(kSizes[0]), middle = on(kSizes[1]), coarse = on(kSizes[2]);
  Quantity limit;
  const Limit found = find_limit(fine, middle, &coarse, kSizes, 1, limit);
  EXPECT_TRUE(found.used);
  EXPECT_LT(from_truth(limit), found.error);
  EXPECT_LT(found.error, from_truth(fine));
}

// Where differences do not point the same way, or their lengths have no order, the finest run stands.
TEST(CostLimit, RunsWithoutAnOrder_AreNotTakenOn) {
  const Quantity fine = figure(200, [](double t) { return 0.01 * t; });
  const Quantity middle = figure(200, [](double t) { return -0.01 * t; });
  const Quantity turned = figure(200, [](double t) { return 0.02 * t; });
  const Quantity near = figure(200, [](double t) { return -0.0105 * t; });
  for (const Quantity &coarse : {turned, near}) {
    Quantity limit;
    const Limit found = find_limit(fine, middle, &coarse, kSizes, 1, limit);
    EXPECT_FALSE(found.used);
    EXPECT_EQ(limit.values, fine.values);
    EXPECT_NEAR(found.error, error_of(middle, fine, 1) * 0.1 / 0.05, 1e-12) << "first order";
  }
  Quantity limit;
  EXPECT_FALSE(find_limit(fine, middle, nullptr, kSizes, 1, limit).used);
  const double alike[3] = {1, 1, 0};
  EXPECT_EQ(find_limit(fine, middle, nullptr, alike, 1, limit).error, error_of(middle, fine, 1));
}

// Slower than first order: the finest run stands, and the bound is by the order that the meshes show.
TEST(CostLimit, RunsThatConvergeSlowly_AreBoundedByTheirOwnOrder) {
  const auto on = [&](double h) { return figure(200, [=](double t) { return 0.1 * t * std::pow(h, 0.4); }); };
  const Quantity fine = on(kSizes[0]), middle = on(kSizes[1]), coarse = on(kSizes[2]);
  Quantity limit;
  const Limit found = find_limit(fine, middle, &coarse, kSizes, 1, limit);
  EXPECT_FALSE(found.used);
  EXPECT_EQ(found.basis, Basis::slow_order);
  EXPECT_NEAR(found.order, 0.4, 1e-6);
  EXPECT_EQ(limit.values, fine.values);
  EXPECT_NEAR(found.bound, 1.25 * from_truth(fine), 1e-9);
  EXPECT_GT(found.error, error_of(middle, fine, 1) * 0.1 / 0.05) << "first order would say less than is true";
}

// Steps of one length, or longer ones, on finer and finer meshes have no limit that could be known.
TEST(CostLimit, RunsThatStagnate_BoundNothing) {
  for (const double last : {0.01, 0.02, -0.02}) {
    const Quantity coarse = figure(200, [](double t) { return 0.01 * t; });
    const Quantity middle = figure(200, [](double) { return 0.0; });
    const Quantity fine = figure(200, [=](double t) { return -last * t; });
    Quantity limit;
    const Limit found = find_limit(fine, middle, &coarse, kSizes, 1, limit);
    EXPECT_EQ(found.basis, Basis::no_fall) << last;
    EXPECT_TRUE(std::isinf(found.bound)) << last;
    EXPECT_GE(found.error, error_of(middle, fine, 1) * 2 - 1e-12) << last;
  }
}

// The two finest may agree by accident: the coarse mesh says how far off they can be.
TEST(CostLimit, RunsThatOscillate_AreBoundedByTheirLargestDistance) {
  const Quantity coarse = figure(200, [](double t) { return 0.3 * t; });
  const Quantity middle = figure(200, [](double) { return 0.0; });
  const Quantity fine = figure(200, [](double t) { return 0.01 * t; });
  Quantity limit;
  const Limit found = find_limit(fine, middle, &coarse, kSizes, 1, limit);
  EXPECT_EQ(found.basis, Basis::no_order);
  EXPECT_EQ(limit.values, fine.values);
  EXPECT_NEAR(found.error, error_of(coarse, fine, 1) / 1.5, 1e-12) << "first order from the coarse mesh";
  EXPECT_NEAR(found.bound, 3 * error_of(coarse, middle, 1), 1e-12);
}

// Force of a block at nearly constant volume that slides: 72, 288 and 600 cells; 4,860 cells give 66.8 N.
TEST(CostLimit, BlockWhoseTwoFinestAgreeByAccident_IsWithinTheStatedError) {
  const double h[3] = {std::cbrt(1. / 600), std::cbrt(1. / 288), std::cbrt(1. / 72)};
  const auto force = [](double newton) {
    Quantity q;
    q.family = "force";
    for (int i = 0; i <= 10; ++i) {
      q.t.push_back(0.1 * i);
      q.values.push_back(newton * 0.1 * i);
    }
    return q;
  };
  const Quantity fine = force(78.7), middle = force(78.2), coarse = force(102.3), finer = force(66.8);
  Quantity limit;
  const Limit found = find_limit(fine, middle, &coarse, h, 78.7, limit);
  EXPECT_FALSE(found.used);
  EXPECT_GT(found.error, error_of(finer, fine, 78.7));
  EXPECT_GT(found.bound, 0.3) << "no target of 5 % is proven by that";
}

TEST(CostLimit, TwoMeshes_BoundNothing) {
  const Quantity fine = figure(200, [](double t) { return 0.01 * t; });
  const Quantity middle = figure(200, [](double t) { return 0.02 * t; });
  Quantity limit;
  const Limit found = find_limit(fine, middle, nullptr, kSizes, 1, limit);
  EXPECT_EQ(found.basis, Basis::two_meshes);
  EXPECT_TRUE(std::isinf(found.bound));
  const double alike[3] = {1, 1, 0};
  EXPECT_EQ(find_limit(fine, middle, nullptr, alike, 1, limit).bound, error_of(middle, fine, 1));
}

TEST(CostLimit, Events_AreNotTakenOn) {
  Quantity early, late, never;
  for (Quantity *q : {&early, &late, &never}) q->event = true;
  early.values = {0.4};
  late.values = {0.42};
  never.values = {NAN};
  Quantity limit;
  const Limit found = find_limit(early, late, &late, kSizes, 1, limit);
  EXPECT_FALSE(found.used);
  EXPECT_NEAR(found.error, 0.04, 1e-12);
  EXPECT_EQ(find_limit(early, never, nullptr, kSizes, 1, limit).error, 1);
}

namespace {

// Tables of a run of a second with one body `b` and probes whose cell a cut takes after the record `last`.
std::string tables(const std::string &name, double off, int last) {
  const std::filesystem::path to = testing::TempDir() + "deform_cost_" + name;
  std::filesystem::create_directories(to);
  std::ofstream probes(to / "probes.csv"), bodies(to / "bodies.csv"), contacts(to / "contacts.csv");
  probes << "t,probe,x,y,z,vx,vy,vz\n";
  bodies << "t,body,com_x,com_y,com_z,vel_x,vel_y,vel_z,kinetic_J,elastic_J,volume\n";
  contacts << "t,body_a,body_b,contacts,sticking,normal_N,friction_N\n";
  for (int i = 0; i <= 10; ++i) {
    const double t = 0.1 * i;
    const std::string x = i <= last ? std::to_string(t + off) + ",0,0,1,0,0" : "nan,nan,nan,nan,nan,nan";
    for (const char *probe : {"tip", "com.b", "com.left", "force"})
      probes << t << "," << probe << "," << x << "\n";
    bodies << t << ",b,0,0,0,0,0,0,0,0,1\n";
  }
  return to.string();
}

}  // namespace

// The two runs lose it at different records.
TEST(CostQuantities, ProbeThatACutTakes_IsComparedUntilThen) {
  const Quantities truth = read_quantities(tables("truth", 0, 6));
  const Quantities other = read_quantities(tables("other", 0.02, 4));
  const Quantity &of = truth.at("tip");
  EXPECT_DOUBLE_EQ(of.t.back(), 0.6);
  EXPECT_NEAR(error_of(other.at("tip"), of, 1), 0.02, 1e-6);
  EXPECT_NEAR(error_of(of, other.at("tip"), 1), 0.02, 1e-6) << "the later records of the other side";
}

// The center of a body is called com.b, and force is the word for the forces of all pairs.
TEST(CostQuantities, ProbeWithAFiguresName_IsRenamed) {
  const Quantities all = read_quantities(tables("names", 0, 10));
  const std::vector<double> &of = all.at("tip").values;
  EXPECT_EQ(all.at("com.left").values, of);
  EXPECT_EQ(all.at("com.b").family, "com");
  EXPECT_EQ(all.at("probe.com.b").values, of);
  EXPECT_EQ(all.at("probe.force").values, of);
  EXPECT_EQ(all.count("force"), 0u);
}
