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

}  // namespace rig
