// A made-up sub-step in which contacts see every kind of unknown, and the same operator as a dense matrix.
//
//   body a      3 surfels on points of their own (in another order), one of them held along y
//   body b      3 surfels that hang on 4 points each
//   body c      3 surfels of a body that steps itself: their response is a full matrix
//   rigid       2 bodies whose responses are tied
//
// The dense operator: y holds all unknowns (3 per point of a and b, 3 per surfel of c, 6 per rigid body),
// M^-1 their response, and J the rows of all contacts in their frames. An impulse p at the contacts changes y
// by M^-1 J^T p, and what contacts see of it is W = J M^-1 J^T.
#pragma once
#include <gtest/gtest.h>

#include "contact/rows.h"
#include "dense.h"

namespace test {

using namespace dfm;

class RowsCase {
 public:
  static constexpr uint32_t kContacts = 7;
  static constexpr double kStep = 1e-3, kOffset = 1e-4;  // s, m
  ContactRows rows{Memory::standard()};
  std::vector<ContactPoint> contacts;

  // The contacts with these numbers, in this order.
  explicit RowsCase(std::initializer_list<uint32_t> which = {0, 1, 2, 3, 4, 5, 6}) {
    make_bodies();
    const std::vector<ContactPoint> all = make_contacts();
    for (const uint32_t i : which) contacts.push_back(all[i]);
    build();
  }

  // [3n, unknowns]
  Dense jacobian() const {
    Dense out(3 * contacts.size(), kUnknowns);
    for (size_t i = 0; i < contacts.size(); ++i) {
      Dense seen(3, kUnknowns);  // the relative velocity in the world's axes
      const ContactPoint &c = contacts[i];
      Vec3 place;
      for (uint32_t k = 0; k < c.nnode; ++k) {
        each_unknown(c.node[k], [&](size_t first, double weight) {
          for (size_t x = 0; x < 3; ++x) seen(x, first + x) += c.weight[k] * weight;
        });
        place += c.weight[k] * position(c.node[k]);
      }
      if (c.obstacle && places_[c.slot_b].group != kNone) {
        // The rigid body moves with v + w x r where it is touched, so u has -v and -w x r = r x w.
        const Vec3 r = place - places_[c.slot_b].center;
        const size_t first = kRigid + 6 * places_[c.slot_b].place;
        const double turn[3][3] = {{0, -r.z, r.y}, {r.z, 0, -r.x}, {-r.y, r.x, 0}};
        for (size_t x = 0; x < 3; ++x) {
          seen(x, first + x) -= 1;
          for (size_t w = 0; w < 3; ++w) seen(x, first + 3 + w) += turn[x][w];
        }
      }
      for (size_t axis = 0; axis < 3; ++axis)
        for (size_t column = 0; column < kUnknowns; ++column)
          for (size_t x = 0; x < 3; ++x)
            out(3 * i + axis, column) += frame(i, int(axis))[int(x)] * seen(x, column);
    }
    return out;
  }
  Dense delassus() const {
    const Dense j = jacobian();
    return j * (response_ * transposed(j));
  }
  // [3n] m/s, relative velocities without impulses.
  std::vector<double> free_velocity() const {
    std::vector<double> out = jacobian() * free_;
    for (size_t i = 0; i < contacts.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        out[3 * i + size_t(axis)] -= dot(frame(i, axis), load3(contacts[i].velocity));
    return out;
  }
  Vec3 frame(size_t i, int axis) const {
    const Vec3 normal = load3(contacts[i].normal);
    const Vec3 tangent = any_tangent(normal);
    return axis == 0 ? normal : axis == 1 ? tangent : cross(normal, tangent);
  }

 private:
  static constexpr uint32_t kPoints = 5, kSurfels = 3, kRigids = 2;
  static constexpr size_t kB = 3 * kPoints, kC = 6 * kPoints, kRigid = kC + 3 * kSurfels;
  static constexpr size_t kUnknowns = kRigid + 6 * kRigids;

  std::mt19937 random_{5};
  Surface a_, b_, c_;
  Array<double> inv_mass_[2], velocity_[2];  // of bodies a and b, [kPoints,4]
  std::vector<double> free_ = std::vector<double>(kUnknowns);
  Dense response_{kUnknowns, kUnknowns};
  std::vector<RigidPlace> places_;

  double any() { return std::normal_distribution<double>()(random_); }
  Vec3 any_vector() {
    const double x = any();
    const double y = any();
    return {x, y, any()};
  }

  void make_bodies() {
    for (Surface *s : {&a_, &b_, &c_}) {
      s->nsurfel = kSurfels;
      s->x.resize(4 * kSurfels);
      s->v.resize(4 * kSurfels);
      for (uint32_t i = 0; i < kSurfels; ++i) store3(&s->x[4 * i], any_vector());
    }
    a_.point = {3, 0, 4};
    b_.row = {0, 4, 8, 12};
    b_.col = {0, 1, 2, 3, 1, 2, 3, 4, 0, 1, 3, 4};
    b_.weight = {0.5, 0.25, 0.375, -0.125, 0.125, 0.25, 0.5, 0.125, 0.75, 0.5, -0.5, 0.25};
    c_.point = {0, 1, 2};
    for (size_t body = 0; body < 2; ++body) {
      inv_mass_[body].resize(4 * kPoints);
      velocity_[body].resize(4 * kPoints);
      for (size_t i = 0; i < kPoints; ++i) {
        const double w = 1 + double(i) / 4;
        for (size_t x = 0; x < 3; ++x) {
          const bool held = body == 0 && i == 0 && x == 1;
          const size_t unknown = 3 * kPoints * body + 3 * i + x;
          response_(unknown, unknown) = held ? 0 : w;
          free_[unknown] = held ? 0 : any();
          inv_mass_[body][4 * i + x] = response_(unknown, unknown);
          velocity_[body][4 * i + x] = free_[unknown];
        }
      }
    }
    put_response(kC, any_positive(3 * kSurfels, random_));
    for (size_t i = 0; i < kSurfels; ++i)
      for (size_t x = 0; x < 3; ++x) {
        free_[kC + 3 * i + x] = any();
        c_.v[4 * i + x] = free_[kC + 3 * i + x];
      }
    put_response(kRigid, any_positive(6 * kRigids, random_));  // free: nothing, rows see the change alone
    for (uint32_t i = 0; i < kRigids; ++i) places_.push_back({0, i, any_vector()});
    places_.push_back({kNone, 0, {}});
  }
  void put_response(size_t first, const Dense &r) {
    for (size_t i = 0; i < r.rows; ++i)
      for (size_t j = 0; j < r.columns; ++j) response_(first + i, first + j) = r(i, j);
  }

  std::vector<ContactPoint> make_contacts() {
    // Surfels: a has 0 to 2, b 3 to 5, c 6 to 8. Obstacles: two rigid bodies, one that is moved.
    struct Row {
      std::vector<uint32_t> node;
      std::vector<double> weight;
      uint32_t obstacle;
    };
    const Row row[kContacts] = {
        {{0, 3, 4, 5}, {1, -0.25, -0.25, -0.5}, kNone},  // surfel of a on triangle of b
        {{1, 2, 6, 7}, {0.375, 0.625, -0.75, -0.25}, kNone},
        {{8}, {1}, 0},
        {{3, 4, 5}, {0.125, 0.25, 0.625}, 1},
        {{0}, {1}, 2},
        {{2, 6, 7, 8}, {1, -0.25, -0.25, -0.5}, kNone},
        {{3, 4, 5}, {1, -0.5, -0.5}, kNone},  // body b on itself: points that come twice
    };
    std::vector<ContactPoint> out;
    for (const Row &r : row) {
      ContactPoint c{};
      c.key = out.size();
      c.nnode = uint8_t(r.node.size());
      for (size_t k = 0; k < r.node.size(); ++k) {
        c.node[k] = r.node[k];
        c.weight[k] = r.weight[k];
      }
      c.obstacle = r.obstacle != kNone;
      c.slot_b = c.obstacle ? r.obstacle : 1;
      if (c.obstacle) store3(c.velocity, any_vector());
      store3(c.normal, normalized(any_vector()));
      c.distance = kOffset;
      out.push_back(c);
    }
    return out;
  }

  void build() {
    const DofSource sources[3] = {
        {0, kSurfels, 0, kPoints, &a_, inv_mass_[0].data(), velocity_[0].data()},
        {kSurfels, kSurfels, kPoints, kPoints, &b_, inv_mass_[1].data(), velocity_[1].data()},
        {2 * kSurfels, kSurfels, 2 * kPoints, kSurfels, &c_, nullptr, c_.v.data()}};
    const uint32_t group_size[1] = {kRigids};
    rows.build(contacts, sources, {places_, group_size});
    for (const ContactRows::Block &block : rows.blocks) {
      const auto by_rows = [&](double *matrix) {
        for (size_t r = 0; r < 3 * block.count; ++r)
          for (size_t c = 0; c < 3 * block.count; ++c)
            *matrix++ = response_(unknown_of(block, r), unknown_of(block, c));
      };
      const auto by_columns = [&](double *results) {
        for (size_t c = 0; c < 3 * block.count; ++c)
          for (size_t r = 0; r < 3 * block.count; ++r)
            *results++ = response_(unknown_of(block, r), unknown_of(block, c));
      };
      if (block.group == kNone) rows.set_response(block, true, by_columns);
      else rows.set_response(block, false, by_rows);
    }
    std::vector<double> tangents(3 * contacts.size());
    for (size_t i = 0; i < contacts.size(); ++i) store3(&tangents[3 * i], frame(i, 1));
    rows.finish(contacts, tangents.data(), kStep, kStep, kOffset);
    rows.y_free.assign(rows.y.begin(), rows.y.end());
  }
  size_t unknown_of(const ContactRows::Block &block, size_t k) const {
    if (block.group != kNone) return kRigid + k;
    return kC + 3 * rows.point[block.first + k / 3] + k % 3;
  }

  // f(first of three unknowns, weight) for all that a surfel hangs on.
  template <class F>
  void each_unknown(uint32_t node, F &&f) const {
    const uint32_t s = node % kSurfels;
    if (node < kSurfels) return f(3 * size_t{a_.point[s]}, 1.0);
    if (node >= 2 * kSurfels) return f(kC + 3 * size_t{s}, 1.0);
    for (uint32_t j = b_.row[s]; j < b_.row[s + 1]; ++j) f(kB + 3 * size_t{b_.col[j]}, b_.weight[j]);
  }
  Vec3 position(uint32_t node) const {
    const Surface &s = node < kSurfels ? a_ : node < 2 * kSurfels ? b_ : c_;
    return load3(&s.x[4 * (node % kSurfels)]);
  }
};

}  // namespace test
