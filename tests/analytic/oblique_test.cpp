// A stiff block slides obliquely on an incline: friction points against the velocity, not against each axis,
// so the path curves downhill. Point mass with mu N against v; own copies of
// ../shared/reference/contact/tables/oblique_incline.csv, all of it where it is present.
#include "support.h"
#include "world.h"

namespace {

constexpr double kG = 9.81;
struct Row { double theta_deg, mu, v0, t, across, down, v_across, v_down; };

std::vector<Row> own_rows() {
  return {{20, 0.363970234, 1, 0.1, 0.0834124652, 0.0147618123, 0.672306225, 0.27400217},
          {20, 0.363970234, 1, 0.2, 0.136252376, 0.0504858651, 0.39800489, 0.420796054},
          {20, 0.363970234, 1, 0.3, 0.166134159, 0.0958818358, 0.215179715, 0.476848845},
          {30, 0.3, 1, 0.1, 0.0875335494, 0.0223842997, 0.75622112, 0.42653973},
          {30, 0.3, 1, 0.2, 0.153172914, 0.0817463544, 0.568036708, 0.7477895},
          {30, 0.3, 1, 0.3, 0.203242187, 0.170258192, 0.442110519, 1.01739786}};
}

std::vector<Row> shared_rows() {
  std::vector<Row> rows;
  if (test::shared_dir().empty()) return rows;
  const auto table = test::read_csv(test::shared_dir() + "/reference/contact/tables/oblique_incline.csv");
  for (size_t i = 1; i < table.size(); ++i) {
    std::vector<double> v;
    for (const auto &cell : table[i]) v.push_back(std::stod(cell));
    if (v.size() == 8) rows.push_back({v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7]});
  }
  return rows;
}

// Rows of one case follow one another in time. 1 % of the distance and of the start speed.
void compare(const std::vector<Row> &rows) {
  for (size_t i = 0; i < rows.size();) {
    const Row &c = rows[i];
    const double theta = c.theta_deg * 3.14159265358979323846 / 180;
    test::Context context;
    const dfm_world world = test::make_world(context, {kG * std::sin(theta), 0, -kG * std::cos(theta)});
    test::BodyOptions o;
    o.young = 1e6;
    o.damping_stiffness = 5e-4;
    o.velocity = {0, c.v0, 0};
    o.position = {-0.05, -0.05, 2e-5};
    const dfm_body body = test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 200, o);
    test::add_plane(world, "incline");
    test::set_friction(world, c.mu);
    const dfm_body_measure start = test::measure(body);
    double t = 0;
    for (; i < rows.size() && rows[i].theta_deg == c.theta_deg && rows[i].mu == c.mu && rows[i].t > t; ++i) {
      test::run(world, rows[i].t - t, 1e-3);
      t = rows[i].t;
      const dfm_body_measure m = test::measure(body);
      const std::string where = "theta " + std::to_string(c.theta_deg) + ", mu " + std::to_string(c.mu) +
                                ", t " + std::to_string(t);
      const double path = std::hypot(rows[i].across, rows[i].down);
      EXPECT_NEAR(m.com[1] - start.com[1], rows[i].across, 0.01 * path) << where;
      EXPECT_NEAR(m.com[0] - start.com[0], rows[i].down, 0.01 * path) << where;
      EXPECT_NEAR(m.velocity[1], rows[i].v_across, 0.01 * c.v0) << where;
      EXPECT_NEAR(m.velocity[0], rows[i].v_down, 0.01 * c.v0) << where;
    }
  }
}

}  // namespace

TEST(ObliqueIncline, PathOfABlock_MatchesThePointMass) { compare(own_rows()); }

TEST(ObliqueIncline, PathOfABlock_MatchesTheSharedTable) {
  const std::vector<Row> rows = shared_rows();
  if (rows.empty()) GTEST_SKIP() << "../shared/reference is absent";
  compare(rows);
}
