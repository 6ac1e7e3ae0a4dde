// Shared by tests of bristle laws: one-dimensional histories, quasi-static loads, the reference files.
#pragma once
#include "law_rules.h"

namespace rig {

using rules::evaluate;
using rules::In;
using rules::Law;
using rules::Out;

// One contact that keeps its state: fn = 1 N on 1 m2 unless the test says otherwise.
struct Contact {
  Law law;
  In in;
  Out last{};
  double x = 0;
  explicit Contact(Law l, double fn = 1) : law(std::move(l)) { in.fn = fn; }
  const Out &move(double vx, double vy, double h) {
    in.v[0] = vx;
    in.v[1] = vy;
    in.h = h;
    last = evaluate(law, in);
    std::memcpy(in.state, last.state, sizeof in.state);
    x += h * vx;
    return last;
  }
  // The displacement dx in n steps of equal length at the speed `speed`.
  double path(double dx, int n, double speed) {
    for (int i = 0; i < n; ++i) move(dx < 0 ? -speed : speed, 0, std::fabs(dx) / n / speed);
    return last.f[0];
  }
  // The slip of this step under which the contact carries `load`: Newton on the law's own derivative.
  void carry(double load, double h) {
    in.h = h;
    double v = 0;
    for (int pass = 0; pass < 60; ++pass) {
      in.v[0] = v;
      in.v[1] = 0;
      const Out o = evaluate(law, in);
      const double next = v - (o.f[0] - load) / o.dv[0];
      if (std::fabs(next - v) <= 1e-15 * std::fabs(v) || next == v) break;
      v = next;
    }
    move(v, 0, h);
  }
};

struct Table {
  std::vector<std::vector<std::string>> rows;
  size_t column(const std::string &name) const {
    for (size_t i = 0; i < rows[0].size(); ++i)
      if (rows[0][i] == name) return i;
    ADD_FAILURE() << "no column " << name;
    return 0;
  }
  double at(size_t row, const std::string &name) const { return std::stod(rows[row][column(name)]); }
  size_t size() const { return rows.size(); }  // row 0 holds the names
};

// A table of reference/friction.
inline Table read(const std::string &file) {
  Table table{test::read_csv(test::reference_dir() + "/friction/" + file)};
  EXPECT_GT(table.size(), 2u) << file;
  return table;
}

// At 9.8 N, for each speed of the reference's curve; z: the column of the deflection, where the law has one.
inline void expect_steady_curve(const Law &law, const char *force, const char *z = nullptr) {
  const Table t = read("curves_steady.csv");
  for (size_t i = 1; i < t.size(); ++i) {
    const double v = t.at(i, "v");
    if (v == 0) continue;
    Contact k(law, 9.8);
    for (int n = 0; n < 100; ++n) k.move(v, 0, 1e-2 / std::fabs(v));
    EXPECT_NEAR(k.last.f[0], t.at(i, force), 2e-12);
    if (z) {
      EXPECT_NEAR(k.last.state[0], t.at(i, z), 1e-15);
    }
  }
}

// A contact that slid at 9.8 N and is left with 1 N: the force is at once mu of that.
inline Contact expect_cut_by_falling_force(const Law &law, double mu) {
  Contact k(law, 9.8);
  k.path(1e-2, 100, 1e-4);
  k.in.fn = 1;
  k.move(0, 0, 1e-3);
  EXPECT_NEAR(k.last.f[0], mu, 1e-15);
  return k;
}

// As the normal force vanishes the force goes with it, as mu(w) fn v^, and the derivative stays that of a
// cone: nothing divides by fn. For mu_C 0.15, mu_S 0.2, v_s 0.01 m/s, delta 2, no sigma2.
inline void expect_cone_at_vanishing_force(const Law &law) {
  for (double w : {1e-4, 0.01, 1.0})
    for (double fn : {1e-9, 1e-30, 1e-100, 1e-139}) {
      In in;
      in.fn = fn;
      in.v[0] = 0.6 * w;
      in.v[1] = -0.8 * w;
      in.state[0] = 3e-5;
      in.state[1] = 1e-5;
      const Out o = evaluate(law, in);
      const double mu = 0.15 + 0.05 * std::exp(-w * w / 1e-4);
      EXPECT_NEAR(o.f[0] / fn, 0.6 * mu, 1e-4 * mu) << w << " " << fn;
      EXPECT_NEAR(o.f[1] / fn, -0.8 * mu, 1e-4 * mu);
      EXPECT_NEAR(o.dn[0], 0.6 * mu, 1e-4 * mu);
      EXPECT_NEAR(o.dn[1], -0.8 * mu, 1e-4 * mu);
    }
}

}  // namespace rig
