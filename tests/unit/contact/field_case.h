// Blocks of points tied by springs, in contact with a floor and with each other, and the same problem seen in
// two ways: by the matrix A of the points, and by the dense response A^-1 between the touched points.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "contact/augmented.h"
#include "dense.h"

namespace test {

using namespace dfm;

// A law of both kinds, asked where the contact alone would come to rest. stiffness: N/m of a bristle without
// stretch; 0: Coulomb's law.
struct TestLaw {
  double mu = 0.5, stiffness = 0;
  // [2n] m, stretch of each bristle at the start; empty: none
  std::vector<double> stretch;

  void ask(const ContactRows &rows, double h, ContactState &s) const {
    for (uint32_t i = 0; i < s.n; ++i) {
      const uint32_t second = s.stride + i;
      const double radius = mu * s.fn[i];
      s.limit[i] = radius;
      s.set_valued[i] = stiffness == 0;
      for (uint32_t k = 0; k < 4; ++k) s.dft_dvt[size_t(k) * s.stride + i] = 0;
      if (stiffness == 0) {
        const double size = std::hypot(s.ft_stop[i], s.ft_stop[second]);
        s.mode[i] = size > radius ? 2 : 1;
        const double share = size > radius ? radius / size : 1;
        for (const uint32_t at : {i, second}) {
          s.ft[at] = share * s.ft_stop[at];
          s.dft_dfn[at] = s.mode[i] == 2 ? mu * s.ft_stop[at] / size : 0;
        }
        continue;
      }
      // f = -k (z + h v), at most `radius`, and v = m (f - f_stop)
      const double m = h * rows.wt[i], k = stiffness;
      const double z[2] = {stretch.empty() ? 0 : stretch[2 * i], stretch.empty() ? 0 : stretch[2 * i + 1]};
      const uint32_t at[2] = {i, second};
      double f[2], v[2], far[2];
      for (int c = 0; c < 2; ++c) {
        far[c] = z[c] - h * m * s.ft_stop[at[c]];
        v[c] = -m * (k * z[c] + s.ft_stop[at[c]]) / (1 + m * k * h);
        f[c] = -k * (z[c] + h * v[c]);
      }
      const double size = std::hypot(far[0], far[1]);
      s.mode[i] = std::hypot(f[0], f[1]) > radius ? 2 : 1;
      const double e[2] = {far[0] / size, far[1] / size};
      for (int c = 0; c < 2; ++c) {
        if (s.mode[i] == 2) {
          f[c] = -radius * e[c];
          v[c] = m * (f[c] - s.ft_stop[at[c]]);
        }
        s.ft[at[c]] = f[c];
        s.vt[at[c]] = v[c];
        s.dft_dfn[at[c]] = s.mode[i] == 2 ? -mu * e[c] : 0;
      }
      const double stretched = std::hypot(z[0] + h * v[0], z[1] + h * v[1]);
      for (uint32_t a = 0; a < 2; ++a)
        for (uint32_t b = 0; b < 2; ++b)
          s.dft_dvt[size_t(2 * a + b) * s.stride + i] =
              s.mode[i] == 2 ? -h * radius / stretched * ((a == b) - e[a] * e[b])
              : a == b       ? -k * h
                             : 0;
    }
  }
};

// Blocks of side * side * high points; the first stands on the floor, each further one on the one below it.
struct FieldSetup {
  uint32_t side = 4, high = 3, blocks = 2;
  double spring = 1e4;       // N/m, of the lowest block
  double stiffer = 1;        // each further block by this factor
  double point_mass = 1e-3;  // kg
  double heavier = 1;
  double step = 1e-3;         // s
  double push = 0.5;          // m/s, speed along x without contact
  double fall = 0.3;          // m/s, downward
  bool held = false;          // the points of one edge of the lowest block are held
  uint32_t doubled = 0;       // so many contacts stand twice
  bool explicit_top = false;  // the topmost block has no springs: its points answer alone
  bool rigid_floor = false;   // the floor is a rigid body that feels the contacts
  uint32_t seed = 7;
};

class FieldCase : public MatrixPoints {
 public:
  FieldSetup set;
  std::vector<double> start;  // [n,4] m/s, the velocity before
  std::vector<double> free;   // [n,4] m/s, without contact
  mutable uint64_t products = 0;

  explicit FieldCase(const FieldSetup &s) : set(s), random_(s.seed) {
    make_points();
    make_matrix();
    make_contacts();
    // of a body of 20 g, about as large as a block
    floor_ = any_positive(6, random_);
    for (size_t r = 0; r < 6; ++r)
      for (size_t c = 0; c < 6; ++c) floor_(r, c) *= 50 * (r < 3 ? 1 : 30) * (c < 3 ? 1 : 30);
  }
  uint32_t total() const { return uint32_t(mass_.size()); }

  void multiply(const double *v, double *out) const override {
    ++products;
    std::fill(out, out + size_t(4) * n, 0.0);
    for (const Block &b : entries_) {
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
          out[4 * b.i + size_t(r)] += b.m[3 * r + c] * v[4 * b.j + size_t(c)];
          if (b.i != b.j) out[4 * b.j + size_t(r)] += b.m[3 * c + r] * v[4 * b.i + size_t(c)];
        }
    }
  }

  // Rows of all contacts. dense: unknowns are the touched surfels of each block, which answer by A^-1; else
  // the points, with `alone` by the blocks of A.
  void build(bool dense, ContactRows &rows) const {
    std::vector<Surface> surfaces(set.blocks);
    std::vector<DofSource> sources;
    const uint32_t each = total() / set.blocks;
    std::vector<double> velocity = free;
    if (!dense) std::copy(start.begin(), start.begin() + 4 * ptrdiff_t(n), velocity.begin());
    for (uint32_t b = 0; b < set.blocks; ++b) {
      surfaces[b].nsurfel = each;
      surfaces[b].x.assign(x_.begin() + ptrdiff_t(4 * each * b), x_.begin() + ptrdiff_t(4 * each * (b + 1)));
      for (uint32_t i = 0; i < each; ++i) surfaces[b].point.push_back(i);
      const bool block = dense && b * each < n;
      sources.push_back({b * each, each, b * each, each, &surfaces[b],
                         block ? nullptr : &alone_[size_t(4) * b * each], &velocity[size_t(4) * b * each]});
    }
    const RigidPlace floor{0, 0, {0.01, 0.02, -0.03}};
    const uint32_t group[1] = {1};
    if (set.rigid_floor) rows.build(contacts_, sources, {{&floor, 1}, group});
    else rows.build(contacts_, sources);
    for (const ContactRows::Block &b : rows.blocks) {
      if (b.group == kNone) fill(b, each, rows);
      else std::copy(floor_.value.begin(), floor_.value.end(), rows.response.begin() + ptrdiff_t(b.response));
    }
    std::vector<double> tangents(3 * contacts_.size());
    for (size_t i = 0; i < contacts_.size(); ++i)
      store3(&tangents[3 * i], any_tangent(load3(contacts_[i].normal)));
    rows.finish(contacts_, tangents.data(), set.step, set.step, 1e-4);
    rows.impulse.assign(3 * contacts_.size(), 0.0);
    rows.y_free.assign(rows.y.begin(), rows.y.end());
  }
  // The point of each dof among those of the matrix.
  std::vector<uint32_t> place(const ContactRows &rows) const {
    const uint32_t each = total() / set.blocks;
    std::vector<uint32_t> out;
    for (uint32_t d = 0; d < rows.ndof; ++d) {
      const uint32_t point = rows.source[d] == kNone ? n : rows.source[d] * each + rows.point[d];
      out.push_back(point < n ? point : kNone);
    }
    return out;
  }
  // [n,4] N s, A v - load - J^T l.
  std::vector<double> remainder(const ContactRows &rows, const std::vector<double> &v) const {
    std::vector<double> out(size_t(4) * n), given(size_t(4) * rows.ndof);
    multiply(v.data(), out.data());
    for (uint32_t i = 0; i < rows.n; ++i) rows.spread(i, load3(&rows.impulse[3 * size_t{i}]), given.data());
    for (size_t k = 0; k < out.size(); ++k) out[k] -= load_[k];
    const std::vector<uint32_t> at = place(rows);
    for (uint32_t d = 0; d < rows.ndof; ++d)
      for (size_t c = 0; at[d] != kNone && c < 3; ++c) out[4 * at[d] + c] -= given[4 * size_t{d} + c];
    for (size_t k = 0; k < out.size(); ++k) out[k] *= moves_[k];
    return out;
  }
  const std::vector<ContactPoint> &contacts() const { return contacts_; }
  void set_free(const std::vector<double> &v) {
    free = v;
    multiply(free.data(), load_.data());
  }

 private:
  struct Block {
    uint32_t i, j;
    double m[9];
  };
  mutable std::mt19937 random_;
  std::vector<Block> entries_;
  std::vector<double> mass_, x_, moves_, blocks_, load_, alone_;
  std::vector<Loose> loose_;
  std::vector<ContactPoint> contacts_;
  Dense inverse_{0, 0}, floor_{6, 6};

  double any(double width) const { return std::normal_distribution<double>(0, width)(random_); }
  uint32_t number(uint32_t b, uint32_t i, uint32_t j, uint32_t k) const {
    return ((b * set.high + k) * set.side + j) * set.side + i;
  }
  double scale(uint32_t b, double factor) const {
    double s = 1;
    for (uint32_t k = 0; k < b; ++k) s *= factor;
    return s;
  }

  void make_points() {
    const uint32_t all = set.blocks * set.high * set.side * set.side;
    n = set.explicit_top ? all - set.high * set.side * set.side : all;
    mass_.resize(all);
    x_.resize(4 * size_t{all});
    free.assign(4 * size_t{all}, 0);
    start.assign(4 * size_t{all}, 0);
    moves_.assign(4 * size_t{all}, 1);
    for (uint32_t b = 0; b < set.blocks; ++b)
      for (uint32_t k = 0; k < set.high; ++k)
        for (uint32_t j = 0; j < set.side; ++j)
          for (uint32_t i = 0; i < set.side; ++i) {
            const uint32_t p = number(b, i, j, k);
            mass_[p] = set.point_mass * scale(b, set.heavier) * (1 + 0.2 * std::fabs(any(1)));
            store3(&x_[4 * size_t{p}], 0.01 * Vec3{i + 0.4 * b, j + 0.3 * b, double(b * set.high + k)});
            const bool fixed = set.held && b == 0 && i == 0 && k == set.high - 1;
            for (size_t c = 0; c < 3; ++c) moves_[4 * size_t{p} + c] = !fixed;
            if (fixed) continue;
            store3(&free[4 * size_t{p}], {set.push + any(0.1), any(0.1), -set.fall + any(0.1)});
            store3(&start[4 * size_t{p}], {set.push, 0, -set.fall});
          }
  }
  void add(uint32_t i, uint32_t j, const double *m, double s) {
    const double big = scale(i / (set.high * set.side * set.side), set.stiffer);
    auto put = [&](uint32_t a, uint32_t b, double sign) {
      Block block{a, b, {}};
      for (int k = 0; k < 9; ++k) block.m[k] = sign * big * s * m[k];
      entries_.push_back(block);
    };
    put(i, i, 1);
    put(j, j, 1);
    put(i, j, -1);
  }
  void make_matrix() {
    for (uint32_t p = 0; p < n; ++p) {
      const double m = mass_[p];
      entries_.push_back({p, p, {m, 0, 0, 0, m, 0, 0, 0, m}});
    }
    const int far[13][3] = {{1, 0, 0}, {0, 1, 0},  {0, 0, 1}, {1, 1, 0},  {1, -1, 0}, {1, 0, 1},  {1, 0, -1},
                            {0, 1, 1}, {0, 1, -1}, {1, 1, 1}, {1, -1, 1}, {1, 1, -1}, {1, -1, -1}};
    for (uint32_t b = 0; b * set.high * set.side * set.side < n; ++b)
      for (uint32_t k = 0; k < set.high; ++k)
        for (uint32_t j = 0; j < set.side; ++j)
          for (uint32_t i = 0; i < set.side; ++i)
            for (const auto &f : far) {
              const int to[3] = {int(i) + f[0], int(j) + f[1], int(k) + f[2]};
              if (to[0] < 0 || to[1] < 0 || to[2] < 0 || to[0] >= int(set.side) || to[1] >= int(set.side) ||
                  to[2] >= int(set.high))
                continue;
              const Vec3 e = normalized(Vec3{double(f[0]), double(f[1]), double(f[2])});
              double m[9];
              for (int r = 0; r < 3; ++r)
                for (int c = 0; c < 3; ++c) m[3 * r + c] = e[r] * e[c];
              add(number(b, i, j, k), number(b, uint32_t(to[0]), uint32_t(to[1]), uint32_t(to[2])), m,
                  set.step * set.step * set.spring * (1 + 0.3 * std::fabs(any(1))));
            }
    const uint32_t all = total();
    blocks_.assign(9 * size_t{n}, 0);
    for (const Block &b : entries_)
      for (size_t k = 0; k < 9 && b.i == b.j; ++k) blocks_[9 * size_t{b.i} + k] += b.m[k];
    alone_.assign(4 * size_t{all}, 0);
    for (uint32_t p = 0; p < all; ++p)
      for (size_t c = 0; c < 3; ++c)
        alone_[4 * size_t{p} + c] =
            moves_[4 * size_t{p} + c] / (p < n ? blocks_[9 * size_t{p} + 4 * c] : mass_[p]);
    load_.resize(4 * size_t{n});
    multiply(free.data(), load_.data());
    blocks = blocks_.data();
    load = load_.data();
    moves = moves_.data();
    mass = mass_.data();
    x = x_.data();
    const uint32_t each = all / set.blocks;
    for (uint32_t b = 0; b * each < n; ++b)
      if (!set.held || b > 0) loose_.push_back({b * each, each});
    loose = loose_;
    AugmentedSolve{Memory::standard()}.respond(*this, alone_.data());
  }

  void touch(std::initializer_list<uint32_t> node, std::initializer_list<double> weight, bool floor) {
    ContactPoint c{};
    c.key = contacts_.size();
    c.nnode = uint8_t(node.size());
    std::copy(node.begin(), node.end(), c.node);
    std::copy(weight.begin(), weight.end(), c.weight);
    c.obstacle = floor;
    c.slot_a = node.begin()[0] / (total() / set.blocks);
    c.slot_b = floor ? 0 : c.slot_a - 1;
    if (floor) store3(c.velocity, {0.05, 0, 0});
    store3(c.normal, normalized(Vec3{any(0.05), any(0.05), 1}));
    c.distance = 1e-4 * (1 + 0.3 * std::fabs(any(1)));
    store3(c.point, load3(&x_[4 * size_t{node.begin()[0]}]));
    contacts_.push_back(c);
  }
  void make_contacts() {
    for (uint32_t b = 0; b < set.blocks; ++b)
      for (uint32_t j = 0; j < set.side; ++j)
        for (uint32_t i = 0; i < set.side; ++i) {
          const uint32_t own = number(b, i, j, 0);
          if (b == 0) {
            touch({own}, {1}, true);
            continue;
          }
          if (i + 1 == set.side || j + 1 == set.side) continue;
          const uint32_t top = set.high - 1;
          touch(
              {own, number(b - 1, i, j, top), number(b - 1, i + 1, j, top), number(b - 1, i + 1, j + 1, top)},
              {1, -0.6, -0.1, -0.3}, false);
        }
    const std::vector<ContactPoint> once = contacts_;
    for (uint32_t k = 0; k < set.doubled && k < once.size(); ++k) contacts_.push_back(once[k]);
  }

  // A^-1 by Gaussian elimination, held components left out.
  const Dense &inverse() const {
    Dense &out = const_cast<Dense &>(inverse_);
    if (out.rows) return out;
    const size_t size = 3 * size_t{n};
    Dense a(size, 2 * size);
    for (const Block &b : entries_)
      for (size_t r = 0; r < 3; ++r)
        for (size_t c = 0; c < 3; ++c) {
          a(3 * b.i + r, 3 * b.j + c) += b.m[3 * r + c];
          if (b.i != b.j) a(3 * b.j + c, 3 * b.i + r) += b.m[3 * r + c];
        }
    for (size_t k = 0; k < size; ++k) {
      if (moves_[4 * (k / 3) + k % 3] > 0) continue;
      for (size_t c = 0; c < size; ++c) a(k, c) = a(c, k) = 0;
      a(k, k) = 1;
    }
    for (size_t k = 0; k < size; ++k) a(k, size + k) = moves_[4 * (k / 3) + k % 3];
    for (size_t k = 0; k < size; ++k) {  // positive definite: no pivots
      const double inv = 1 / a(k, k);
      for (size_t c = k; c < 2 * size; ++c) a(k, c) *= inv;
      for (size_t r = 0; r < size; ++r) {
        const double f = a(r, k);
        if (r == k || f == 0) continue;
        for (size_t c = k; c < 2 * size; ++c) a(r, c) -= f * a(k, c);
      }
    }
    out = Dense(size, size);
    for (size_t r = 0; r < size; ++r)
      for (size_t c = 0; c < size; ++c) out(r, c) = a(r, size + c);
    return out;
  }
  void fill(const ContactRows::Block &b, uint32_t each, ContactRows &rows) const {
    const Dense &inv = inverse();
    for (size_t r = 0; r < 3 * size_t{b.count}; ++r)
      for (size_t c = 0; c < 3 * size_t{b.count}; ++c) {
        const size_t i = 3 * (b.source * each + rows.point[b.first + r / 3]) + r % 3;
        const size_t j = 3 * (b.source * each + rows.point[b.first + c / 3]) + c % 3;
        rows.response[b.response + r * 3 * b.count + c] = inv(i, j);
      }
  }
};

}  // namespace test
