// Single tetrahedra thrown at each shape of obstacle, turned at random, in one large step: no point of their
// surface ends nearer than d_c, and those that would have gone through end near it.
#include <functional>

#include "obstacle.h"
#include "rollback_cases.h"

namespace {

using test::rollback::Vector;

constexpr double kOffset = 1e-3, kSize = 0.5;

double length(Vector a) { return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }
double box_distance(Vector p, Vector half) {  // of a point outside
  Vector d{};
  for (size_t k = 0; k < 3; ++k) d[k] = std::max(0.0, std::fabs(p[k]) - half[k]);
  return length(d);
}

struct Case {
  const char *name;
  std::function<void(dfm_world)> add;
  std::function<double(Vector)> distance;  // 0 inside
};

void add(dfm_world w, uint32_t shape, double radius, Vector half) {
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.shape = shape;
  d.radius = radius;
  d.half_length = half[2];
  std::copy(half.begin(), half.end(), d.half_size);
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(w, &d, &o));
}

const Vector kHalf = {0.3, 0.15, 0.1};

std::vector<Case> cases() {
  return {
      {"sphere", [](dfm_world w) { add(w, DFM_SHAPE_SPHERE, 0.2, {}); },
       [](Vector p) { return std::max(0.0, length(p) - 0.2); }},
      {"capsule", [](dfm_world w) { add(w, DFM_SHAPE_CAPSULE, 0.05, {0, 0, 0.3}); },
       [](Vector p) {
         return std::max(0.0, length({p[0], p[1], p[2] - std::clamp(p[2], -0.3, 0.3)}) - 0.05);
       }},
      {"box", [](dfm_world w) { add(w, DFM_SHAPE_BOX, 1, kHalf); },
       [](Vector p) { return box_distance(p, kHalf); }},
      {"mesh",
       [](dfm_world w) { test::add_mesh(w, "mesh", test::box_surface({kHalf[0], kHalf[1], kHalf[2]}, 2)); },
       [](Vector p) { return box_distance(p, kHalf); }}};
}

struct Random {
  uint64_t seed;
  double operator()() {
    seed = seed * 6364136223846793005ull + 1442695040888963407ull;
    return 2 * double(seed >> 11) / 9007199254740992.0 - 1;
  }
  Vector direction() {
    for (;;)
      if (const Vector v{(*this)(), (*this)(), (*this)()}; length(v) <= 1 && length(v) > 0.1)
        return {v[0] / length(v), v[1] / length(v), v[2] / length(v)};
  }
};

// Nearest of a grid of points on all four faces.
double nearest(const double x[12], const std::function<double(Vector)> &distance) {
  constexpr int kSteps = 12;
  double least = 1e300;
  for (int face = 0; face < 4; ++face) {
    const double *const a = x + 3 * ((face + 1) % 4);
    const double *const b = x + 3 * ((face + 2) % 4);
    const double *const c = x + 3 * ((face + 3) % 4);
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; i + j <= kSteps; ++j) {
        const double u = double(i) / kSteps, v = double(j) / kSteps;
        Vector p{};
        for (size_t k = 0; k < 3; ++k) p[k] = (1 - u - v) * a[k] + u * b[k] + v * c[k];
        least = std::min(least, distance(p));
      }
  }
  return least;
}

}  // namespace

TEST(Rollback, BodiesThrownAtEveryShape_StayOutside) {
  for (const Case &shape : cases()) {
    test::Context context;
    dfm_world_def wd = dfm_world_def_default();
    wd.contact_offset = kOffset;
    wd.gravity[2] = 0;
    dfm_world w = 0;
    test::ok(dfm_world_create(context, &wd, &w));
    dfm::rollback::Scheme scheme;
    test::set_friction(w, 0, "none");  // of the last throw would act on the next
    shape.add(w);
    const double rest[] = {kSize,  kSize, kSize,  kSize,  -kSize, -kSize,
                           -kSize, kSize, -kSize, -kSize, -kSize, kSize};
    const uint32_t cell[] = {0, 1, 3, 2};
    dfm_material_def md = dfm_material_def_default();
    md.density = 1e6;
    md.young = 1e-3;
    dfm_material material = 0;
    test::ok(dfm_material_create(w, &md, &material));
    dfm_body_def d = dfm_body_def_default();
    d.npoint = 4;
    d.ntet = 1;
    d.points = rest;
    d.tets = cell;
    d.material = material;
    d.pose.position[0] = 10;
    dfm_body body = 0;
    test::ok(dfm_body_create(w, &d, &body));

    Random random{11};
    int through = 0, met = 0;
    for (int i = 0; i < 150; ++i) {
      // a turned tetrahedron at 1.5 m, on its way past the middle
      const Vector from = random.direction(), e = random.direction(), r = random.direction();
      Vector f{e[1] * r[2] - e[2] * r[1], e[2] * r[0] - e[0] * r[2], e[0] * r[1] - e[1] * r[0]};
      const double lf = length(f);
      if (lf < 0.1) continue;
      for (double &v : f) v /= lf;
      const Vector g{e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]};
      double x[12], v[12];
      for (size_t p = 0; p < 4; ++p)
        for (size_t k = 0; k < 3; ++k) {
          x[3 * p + k] = 1.5 * from[k] + rest[3 * p] * e[k] + rest[3 * p + 1] * f[k] + rest[3 * p + 2] * g[k];
          v[3 * p + k] = -1.2 * from[k] + 0.1 * random();
        }
      if (nearest(x, shape.distance) < 2 * kOffset) continue;
      test::ok(dfm_body_set_state(body, 4, x, v));
      test::ok(scheme.step(w, 1, nullptr));
      double end[12];
      for (int k = 0; k < 12; ++k) end[k] = x[k] + v[k];
      const bool would = nearest(end, shape.distance) == 0;
      uint32_t n = 0;
      test::ok(dfm_body_get_state(body, 4, x, nullptr, &n));
      ASSERT_GE(nearest(x, shape.distance), kOffset * (1 - 1e-9)) << shape.name << ", throw " << i;
      through += would;
      met += !test::contacts(w).empty();
    }
    EXPECT_GT(through, 30) << shape.name;
    EXPECT_GE(met, through) << shape.name;
  }
}
