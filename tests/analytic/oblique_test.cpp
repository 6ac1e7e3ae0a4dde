// A stiff block slides obliquely on an incline: friction points against the velocity, not against each axis,
// so the path curves downhill. Point mass with mu N against v: reference/contact/tables/oblique_incline.csv.
#include "support.h"
#include "world.h"

namespace {

constexpr double kG = 9.81;
struct Row { double theta_deg, mu, v0, t, across, down, v_across, v_down; };

std::vector<Row> table_rows() {
  std::vector<Row> rows;
  const auto table = test::read_csv(test::reference_dir() + "/contact/tables/oblique_incline.csv");
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

TEST(ObliqueIncline, PathOfABlock_MatchesThePointMass) {
  const std::vector<Row> rows = table_rows();
  ASSERT_EQ(rows.size(), 9u);
  compare(rows);
}
