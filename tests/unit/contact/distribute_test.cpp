// Contact impulses on their way to surfels and points: nothing of impulse, moment or power is lost or made.
//
// x_s = N x_p with rows that sum to one, and the impulses of the points are f_p = N^T f_s. So for any N
//   sum_p f_p = sum_s f_s,
//   sum_p x_p x f_p = sum_s (N x_p) x f_s = sum_s x_s x f_s,
//   sum_p v_p . f_p = sum_s v_s . f_s,
// and the surfels have f_s = sum of the weights of a contact's nodes times its impulse.
#include "contact/distribute.h"

#include <gtest/gtest.h>

#include <random>

#include "body/make_surface.h"

namespace {

using namespace dfm;

constexpr uint32_t kPoints = 6;
constexpr uint32_t kSurfels = 3;
constexpr double kRounding = 1e-14;  // of sums of some ten terms that are near 1

struct Sums {
  Vec3 impulse;
  Vec3 moment;  // about the origin
  double power = 0;
};

// Body a by points of its own or by weights; body b beside it, which steps itself and takes impulses at its
// surfels.
class Pair {
 public:
  std::vector<ContactPoint> contacts;
  std::vector<double> frame;
  std::vector<double> impulse;

  explicit Pair(bool weighted) {
    for (Array<double> *values : {&x_, &v_})
      for (uint32_t i = 0; i < kPoints; ++i) values->insert(values->end(), {any(), any(), any(), 0});
    for (Surface *s : {&a_, &b_}) {
      s->nsurfel = kSurfels;
      s->x.resize(4 * kSurfels);
      s->v.resize(4 * kSurfels);
    }
    if (weighted) {
      a_.row = {0, 3, 5, 9};
      a_.col = {0, 1, 2, 1, 5, 0, 2, 4, 5};
      a_.weight = {0.5, 0.25, 0.25, 1.5, -0.5, 0.125, 0.375, 0.25, 0.25};
    } else {
      a_.point = {4, 0, 3};
    }
    b_.point = {0, 1, 2};
    gather_surface(a_, x_.data(), v_.data());
    for (uint32_t i = 0; i < 4 * kSurfels; ++i) b_.x[i] = i % 4 == 3 ? 0 : any();
    add({0, 3, 4, 5}, {1, -0.25, -0.25, -0.5});
    add({1, 2, 3, 4}, {0.375, 0.625, -0.75, -0.25});
    add({0, 1, 2, 5}, {0.25, 0.25, 0.5, -1});
  }
  void distribute() {
    const ImpulseSink sinks[2] = {{0, kSurfels, kPoints, &a_, surfel_a.data(), point_a.data()},
                                  {kSurfels, kSurfels, kSurfels, &b_, surfel_b.data(), nullptr}};
    dfm::distribute(contacts, frame.data(), impulse.data(), sinks, given);
  }
  Vec3 world_impulse(size_t i) const {
    const double *const f = &frame[9 * i];
    const double *const l = &impulse[3 * i];
    return l[0] * load3(f) + l[1] * load3(f + 3) + l[2] * load3(f + 6);
  }
  // Of the contacts on the body whose nodes begin at `first`.
  Sums at_contacts(uint32_t first, const Surface &surface) const {
    Sums sums;
    for (size_t i = 0; i < contacts.size(); ++i)
      for (uint32_t k = 0; k < contacts[i].nnode; ++k) {
        const uint32_t s = contacts[i].node[k] - first;
        if (s >= kSurfels) continue;
        add_to(sums, contacts[i].weight[k] * world_impulse(i), &surface.x[4 * s], &surface.v[4 * s]);
      }
    return sums;
  }
  Sums at_points() const {
    Sums sums;
    for (uint32_t i = 0; i < kPoints; ++i) add_to(sums, load3(&point_a[4 * i]), &x_[4 * i], &v_[4 * i]);
    return sums;
  }
  Sums at_surfels(const std::vector<double> &surfel, const Surface &surface) const {
    Sums sums;
    for (uint32_t s = 0; s < kSurfels; ++s)
      add_to(sums, load3(&surfel[3 * s]), &surface.x[4 * s], &surface.v[4 * s]);
    return sums;
  }
  const Surface &a() const { return a_; }
  const Surface &b() const { return b_; }

  // Surfels have an older sub-step's values. Points do where they are weighted; others stay zero from the
  // start.
  std::vector<double> surfel_a = std::vector<double>(3 * kSurfels, 7.0);
  std::vector<double> surfel_b = std::vector<double>(3 * kSurfels, 7.0);
  Array<double> point_a = Array<double>(4 * kPoints, 0.0);
  WrittenNodes given;

 private:
  std::mt19937 random_{3};
  Array<double> x_;
  Array<double> v_;
  Surface a_;
  Surface b_;

  double any() { return std::uniform_real_distribution<double>(-1, 1)(random_); }
  static void add_to(Sums &sums, Vec3 f, const double *x, const double *v) {
    sums.impulse += f;
    sums.moment += cross(load3(x), f);
    sums.power += dot(load3(v), f);
  }
  void add(std::array<uint32_t, 4> node, std::array<double, 4> weight) {
    ContactPoint c{};
    c.nnode = 4;
    std::copy(node.begin(), node.end(), c.node);
    std::copy(weight.begin(), weight.end(), c.weight);
    contacts.push_back(c);
    const Vec3 normal = normalized({any(), any(), any()});
    const Vec3 tangent = any_tangent(normal);
    for (const Vec3 &axis : {normal, tangent, cross(normal, tangent)})
      frame.insert(frame.end(), {axis.x, axis.y, axis.z});
    for (int k = 0; k < 3; ++k) impulse.push_back(k == 0 ? 1.5 : any());
  }
};

void expect_same(const Sums &a, const Sums &b) {
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(a.impulse[k], b.impulse[k], kRounding) << k;
    EXPECT_NEAR(a.moment[k], b.moment[k], kRounding) << k;
  }
  EXPECT_NEAR(a.power, b.power, kRounding);
}

class Distribute : public testing::TestWithParam<bool> {};

}  // namespace

TEST_P(Distribute, PointImpulses_HaveTheImpulseMomentAndPowerOfTheContacts) {
  Pair pair(GetParam());
  pair.distribute();
  const Sums contacts = pair.at_contacts(0, pair.a());
  expect_same(pair.at_surfels(pair.surfel_a, pair.a()), contacts);
  expect_same(pair.at_points(), contacts);
  EXPECT_GT(norm(contacts.impulse), 0.1);
}

// The weights of side a sum to one and those of side b to minus one: what one body gains the other one loses.
TEST_P(Distribute, TwoBodies_GetOppositeImpulses) {
  Pair pair(GetParam());
  pair.distribute();
  const Sums a = pair.at_points();
  const Sums b = pair.at_surfels(pair.surfel_b, pair.b());
  Vec3 sum;
  for (size_t i = 0; i < pair.contacts.size(); ++i) sum += pair.world_impulse(i);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(a.impulse[k], sum[k], kRounding) << k;
    EXPECT_NEAR(b.impulse[k], -sum[k], kRounding) << k;
  }
  expect_same(b, pair.at_contacts(kSurfels, pair.b()));
}

// What an older sub-step has left is gone.
TEST_P(Distribute, WithoutImpulses_LeavesNothing) {
  Pair pair(GetParam());
  pair.distribute();
  pair.impulse.assign(pair.impulse.size(), 0.0);
  pair.distribute();
  for (const double f : pair.surfel_a) EXPECT_EQ(f, 0);
  for (const double f : pair.surfel_b) EXPECT_EQ(f, 0);
  for (const double f : pair.point_a) EXPECT_EQ(f, 0);
}

INSTANTIATE_TEST_SUITE_P(All, Distribute, testing::Bool(),
                         [](const auto &p) { return std::string(p.param ? "Weighted" : "PointByPoint"); });
