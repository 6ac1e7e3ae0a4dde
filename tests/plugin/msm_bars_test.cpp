// Static response of bars [0,1] x [0,0.1]^2: Young's modulus along and across, shear and sag, under
// refinement, over regular and free meshes.
#include "msm_host.h"

namespace msm_test {
namespace {

using Vector = std::vector<double>;

// The body at rest as a linear system. K u by central differences of the forces: the model is smooth, so 1e-7
// of a bar leaves 1e-9.
class Bar {
 public:
  Bar(const Mesh &mesh, const Params &p)
      : b_(host_, mesh, p), low_{1e300, 1e300, 1e300}, high_{-1e300, -1e300, -1e300} {
    for (uint32_t i = 0; i < b_.size(); ++i)
      for (int a = 0; a < 3; ++a) {
        low_[a] = std::min(low_[a], rest(i, a));
        high_[a] = std::max(high_[a], rest(i, a));
      }
    for (uint32_t c = 0; c < mesh.ncell(); ++c) volume_ += std::abs(mesh.volume(c));
  }

  struct Pull { double young, poisson; };

  // Stretch by 1 along an axis between plates without friction: modulus and lateral contraction.
  Pull pull(int axis) {
    Vector u(b_.mesh.rest.size(), 0);
    std::vector<char> held(u.size(), 0);
    for (uint32_t i = 0; i < b_.size(); ++i) {
      u[3 * i + axis] = rest(i, axis);
      held[3 * i + axis] = at(i, axis, low_) || at(i, axis, high_);
    }
    solve(u, held, Vector(u.size(), 0));
    double lateral = 0, square = 0;
    for (uint32_t i = 0; i < b_.size(); ++i)
      for (int a = 0; a < 3; ++a) {
        const double y = a == axis ? 0 : rest(i, a) - 0.5 * (low_[a] + high_[a]);
        lateral += y * u[3 * i + a];
        square += y * y;
      }
    return {twice_energy(u) / volume_, -lateral / square};
  }

  // The surface moves as u_a = x_c: shear modulus.
  double shear(int a, int c) {
    Vector u(b_.mesh.rest.size(), 0);
    std::vector<char> held(u.size(), 0);
    for (uint32_t i = 0; i < b_.size(); ++i) {
      bool surface = false;
      for (int d = 0; d < 3; ++d) surface = surface || at(i, d, low_) || at(i, d, high_);
      u[3 * i + a] = rest(i, c);
      for (int d = 0; d < 3; ++d) held[3 * i + d] = surface;
    }
    solve(u, held, Vector(u.size(), 0));
    return twice_energy(u) / volume_;
  }

  // Tip deflection of the cantilever under its own weight (density 1000, g = 1) over rho A L^4 / (8 E I).
  double sag(double young) {
    Vector u(b_.mesh.rest.size(), 0), load = u;
    std::vector<char> held(u.size(), 0);
    for (uint32_t i = 0; i < b_.size(); ++i) {
      for (int d = 0; d < 3; ++d) held[3 * i + d] = at(i, 0, low_);
      load[3 * i + 2] = -b_.mesh.mass[i];
    }
    solve(u, held, load);
    double tip = 0, n = 0;
    for (uint32_t i = 0; i < b_.size(); ++i)
      if (at(i, 0, high_)) {
        tip -= u[3 * i + 2];
        n += 1;
      }
    return tip / n / (1000 * 0.01 / (8 * young * (1e-4 / 12)));
  }

 private:
  double rest(uint32_t i, int a) const { return b_.mesh.rest[3 * i + a]; }
  bool at(uint32_t i, int a, const Vec &side) const { return std::abs(rest(i, a) - side[a]) < 1e-9; }

  void apply(const Vector &u, Vector &out) {
    double most = 1e-300;
    for (double a : u) most = std::max(most, std::abs(a));
    const double step = 1e-7 / most;
    Vector forces[2];
    for (int side = 0; side < 2; ++side) {
      forces[side].reserve(u.size());
      for (uint32_t i = 0; i < b_.size(); ++i)
        for (int a = 0; a < 3; ++a) b_.x[4 * i + a] = rest(i, a) + (side ? -step : step) * u[3 * i + a];
      b_.forces();
      for (uint32_t i = 0; i < b_.size(); ++i)
        for (int a = 0; a < 3; ++a) forces[side].push_back(b_.f[4 * i + a]);
    }
    out.resize(u.size());
    for (size_t n = 0; n < u.size(); ++n) out[n] = -(forces[0][n] - forces[1][n]) / (2 * step);
  }
  double twice_energy(const Vector &u) {
    Vector q;
    apply(u, q);
    double sum = 0;
    for (size_t n = 0; n < u.size(); ++n) sum += u[n] * q[n];
    return sum;
  }
  // Conjugate gradients for K u = load with the held components of u kept.
  void solve(Vector &u, const std::vector<char> &held, const Vector &load) {
    const size_t n = u.size();
    Vector r, p(n), q;
    apply(u, r);
    double rr = 0;
    for (size_t k = 0; k < n; ++k) {
      r[k] = held[k] ? 0 : load[k] - r[k];
      p[k] = r[k];
      rr += r[k] * r[k];
    }
    const double start = rr;
    for (int it = 0; it < 6000 && rr > 1e-10 * start; ++it) {
      apply(p, q);
      double pq = 0, next = 0;
      for (size_t k = 0; k < n; ++k) {
        q[k] = held[k] ? 0 : q[k];
        pq += p[k] * q[k];
      }
      for (size_t k = 0; k < n; ++k) {
        u[k] += rr / pq * p[k];
        r[k] -= rr / pq * q[k];
        next += r[k] * r[k];
      }
      for (size_t k = 0; k < n; ++k) p[k] = r[k] + next / rr * p[k];
      rr = next;
    }
    EXPECT_LE(rr, 1e-10 * start);
  }

  Host host_;
  Instance b_;
  Vec low_, high_;
  double volume_ = 0;
};

// The structured and the free meshes of the bar, coarse to fine.
std::vector<Mesh> family(char letter) {
  std::vector<Mesh> all;
  for (int n = 1; n <= 4; ++n)
    all.push_back(read_msh(test::mesh_dir() + "/bars/bar_" + letter + std::to_string(n) + ".msh"));
  return all;
}

constexpr double kYoung = 2e4;

// unsanitized: too slow there; shorter tests run the same code
TEST(MsmBars, RegularLattice_HasYoungsModulusWhateverItsSize) {
  for (uint32_t n : {1, 2, 4}) {
    const Mesh mesh = kuhn_bar(10 * n, n, n, 0.1 / n);
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(Bar(mesh, {kYoung, 0.3, 0, 0, 0}).pull(axis).young / kYoung, 1, 1e-3) << n << " " << axis;
  }
}

// Three materials: springs alone, and the volume term that makes the Poisson ratio 0.3 and 0.45.
// unsanitized: too slow there; shorter tests run the same code
TEST(MsmBars, HangingBar_StretchesWithinTenPercentOfTheFinest) {
  for (char letter : {'s', 'u'}) {
    const std::vector<Mesh> meshes = family(letter);
    for (Params p : {Params{kYoung, 0.3, 0, 0, 0}, Params{kYoung, 0.3, 0, 0, 0.231},
                     Params{kYoung, 0.45, 0, 0, 0.828}}) {
      double young[4], poisson[4];
      for (int n = 0; n < 4; ++n) {
        const Bar::Pull pull = Bar(meshes[n], p).pull(0);
        young[n] = pull.young / kYoung;
        poisson[n] = pull.poisson;
      }
      std::printf("%c  volume %-5.3f  E/young %.3f %.3f %.3f %.3f  nu %.3f %.3f %.3f %.3f\n", letter,
                  p.volume, young[0], young[1], young[2], young[3], poisson[0], poisson[1], poisson[2],
                  poisson[3]);
      for (double e : young) EXPECT_NEAR(e / young[3], 1, letter == 's' ? 0.001 : 0.1);
      if (p.volume == 0) {
        EXPECT_NEAR(young[3], 1, 0.05);
      }
      if (letter == 'u') {
        EXPECT_NEAR(poisson[3], p.volume > 0 ? p.poisson : 0.25, 0.01);
      }
    }
  }
}

// u1 has most of its edges in its surface, along the bar: across it stays a quarter too soft (a third with
// Van Gelder's factor alone).
// unsanitized: too slow there; shorter tests run the same code
TEST(MsmBars, FreeMesh_IsOneMaterialInEveryDirection) {
  const std::vector<Mesh> meshes = family('u');
  for (int n = 0; n < 4; ++n) {
    Bar bar(meshes[n], {kYoung, 0.3, 0, 0, 0});
    const double along = bar.pull(0).young / kYoung;
    const double y = bar.pull(1).young / kYoung;
    const double z = bar.pull(2).young / kYoung;
    const double yz = bar.shear(1, 2) / (0.4 * kYoung);
    const double xz = bar.shear(0, 2) / (0.4 * kYoung);
    const double xy = bar.shear(0, 1) / (0.4 * kYoung);
    std::printf("u%d  E/young %.3f %.3f %.3f  G/(0.4 young) %.3f %.3f %.3f\n", n + 1, along, y, z, yz, xz,
                xy);
    for (double e : {along, y, z}) EXPECT_NEAR(e, 1, n == 0 ? 0.3 : 0.06);
    for (double g : {yz, xz, xy}) EXPECT_NEAR(g, 1, 0.11);
  }
}

// Printed for doc/models/msm.md; linear tetrahedra sag -78, -49, -21, -6 % of the slender beam on s1..s4.
// Finer is softer.
// soak: a convergence series; HangingBar has the same meshes
TEST(MsmBars, Cantilever_SagGrowsTowardsTheBeamUnderRefinement) {
  for (char letter : {'s', 'u'}) {
    double last = 0;
    for (const Mesh &mesh : family(letter)) {
      const double sag = Bar(mesh, {kYoung, 0.3, 0, 0, 0}).sag(kYoung);
      std::printf("%c  sag %+.1f %%\n", letter, 100 * (sag - 1));
      EXPECT_GT(sag, last);
      EXPECT_LT(sag, 1.03);
      last = sag;
    }
  }
  const double coarse = Bar(kuhn_bar(10, 1, 1, 0.1), {kYoung, 0.3, 0, 0, 0}).sag(kYoung);
  const double fine = Bar(kuhn_bar(20, 2, 2, 0.05), {kYoung, 0.3, 0, 0, 0}).sag(kYoung);
  EXPECT_LT(coarse, 0.8 * fine);
}

// Along and across the axis of springs whose extra coordinates have slope g (doc/models/msm.md, affine
// network), over Young's modulus.
Bar::Pull affine(double g, bool form_a) {
  // means of t, t c^2, t c^4 over directions, t the softening of a spring at cosine c to the axis
  double m0 = 0, m2 = 0, m4 = 0;
  const int n = 20000;
  for (int k = 0; k < n; ++k) {
    const double c = (k + 0.5) / n, s = 1 / (1 + g * g * c * c), t = (form_a ? std::sqrt(s) : s) / n;
    m0 += t;
    m2 += t * c * c;
    m4 += t * c * c * c * c;
  }
  const double c33 = 6 * m4, c11 = 6 * 3.0 / 8 * (m0 - 2 * m2 + m4), c12 = c11 / 3, c13 = 3 * (m2 - m4);
  const double sum = (c11 + c12) * c33 - 2 * c13 * c13;
  return {sum / (c11 + c12), (c11 - c12) * sum / (c11 * c33 - c13 * c13)};  // here: along, across
}

// unsanitized: too slow there; shorter tests run the same code
TEST(MsmBars, SlopeAlongOneAxis_SoftensAsTheAffineNetworkOnAFreeMesh) {
  const Mesh mesh = read_msh(test::mesh_dir() + "/bars/bar_u3.msh");
  for (bool form_a : {false, true}) {
    double last = 1e300, last_ratio = 0;
    for (double g : {0.0, 1.0, 2.0, 4.0, 12.0}) {
      Params p = {kYoung, 0.3, 0, 0, 0};
      p.slope = g;
      p.form_a = form_a;
      Bar bar(mesh, p);
      const double along = bar.pull(0).young / kYoung, across = bar.pull(1).young / kYoung;
      const Bar::Pull expected = affine(g, form_a);
      std::printf("form %c  slope %4.1f  along %.3f (affine %.3f)  across %.3f (%.3f)  ratio %.2f (%.2f)\n",
                  form_a ? 'A' : 'B', g, along, expected.young, across, expected.poisson, across / along,
                  expected.poisson / expected.young);
      EXPECT_LT(along, last);
      EXPECT_GT(across / along, last_ratio);
      // Points move less evenly the more springs differ.
      if (g <= 2) {
        EXPECT_NEAR(across / along / (expected.poisson / expected.young), 1, 0.05);
      }
      last = along;
      last_ratio = across / along;
    }
  }
}

// kV 1 x 1 on top of springs scaled by s: by the Sherman-Morrison formula a lattice whose axes are alike
// answers to a unit stress along one of them with the strains 1/s - q and -nu/s - q, in 1/E, where b = 1 - 2
// nu and q = (b/s)^2 / (1/r + 3 b/s).
// unsanitized: too slow there; shorter tests run the same code
TEST(MsmBars, VolumeTerm_AddsItsModulusToTheLatticeInClosedForm) {
  const Mesh mesh = kuhn_bar(20, 2, 2, 0.05);
  const Bar::Pull springs = Bar(mesh, {kYoung, 0.45, 0, 0, 0}).pull(0);
  const double b = 1 - 2 * springs.poisson;
  double last = springs.poisson;
  for (double volume : {0.1, 1.0, 10.0}) {
    const Bar::Pull p = Bar(mesh, {kYoung, 0.45, 0, 0, volume}).pull(0);
    const double r = volume / (3 * (1 - 2 * 0.45));
    const double s = (std::sqrt((3 * r - 2) * (3 * r - 2) + 20 * r) - (3 * r - 2)) / 4;
    const double q = b * b / (s * s) / (1 / r + 3 * b / s);
    EXPECT_NEAR(p.young / springs.young, 1 / (1 / s - q), 2e-3) << volume;
    EXPECT_NEAR(p.poisson, (springs.poisson / s + q) / (1 / s - q), 2e-3) << volume;
    EXPECT_GT(p.poisson, last) << volume;
    last = p.poisson;
  }
  EXPECT_NEAR(last, 0.5, 0.01);
}

// One cell already has the largest det C that its six edges can have: its springs are Van Gelder's, k = young
// V / L0^2, to rounding.
// unsanitized: too slow there; shorter tests run the same code
TEST(MsmBars, SingleCell_HasVanGeldersStiffness) {
  const Mesh mesh = irregular_tet();
  Host host;
  Instance b(host, mesh, {kYoung, 0.3, 0, 0, 0});
  for (size_t e = 0; e < mesh.edges.size(); e += 2) {
    const uint32_t i = mesh.edges[e], j = mesh.edges[e + 1];
    double force[3][3];
    for (int a = 0; a < 3; ++a) {  // derivative of the force on i by the place of j: k n n^T
      for (int side : {1, -1}) {
        Vec x = mesh.at(j);
        x[a] += side * 1e-6;
        b.set(b.x, j, x);
        b.forces();
        for (int c = 0; c < 3; ++c)
          force[a][c] = (side == 1 ? 0 : force[a][c]) + side * b.get(b.f, i)[c] / 2e-6;
      }
      b.set(b.x, j, mesh.at(j));
    }
    const double l = norm(mesh.at(j) - mesh.at(i));
    EXPECT_NEAR(force[0][0] + force[1][1] + force[2][2], kYoung * mesh.volume(0) / (l * l), 1e-6 * kYoung)
        << i << " " << j;
  }
}

// A mesh with many edges one way, turned: the springs follow.
// unsanitized: too slow there; shorter tests run the same code
TEST(MsmBars, TurnedMesh_HasTheSameForcesTurned) {
  Mesh mesh = kuhn_bar(6, 2, 2, 0.1, 0.2), turned = mesh;
  const Vec axis = (1 / std::sqrt(14.0)) * Vec{1, 2, 3};
  const auto turn = [&](Vec x) { return rotate(x, axis, 0.7); };
  for (uint32_t i = 0; i < mesh.npoint(); ++i) {
    const Vec x = turn(mesh.at(i));
    std::copy(x.begin(), x.end(), &turned.rest[3 * i]);
  }
  Host host;
  Instance a(host, mesh, {kYoung, 0.3, 0, 0, 0}), b(host, turned, {kYoung, 0.3, 0, 0, 0});
  a.shake(0.02, 0);
  for (uint32_t i = 0; i < mesh.npoint(); ++i) b.set(b.x, i, turn(a.get(a.x, i)));
  a.forces();
  b.forces();
  for (uint32_t i = 0; i < mesh.npoint(); ++i)
    EXPECT_LT(norm(turn(a.get(a.f, i)) - b.get(b.f, i)), 1e-12 * a.largest_force()) << i;
}

}  // namespace
}  // namespace msm_test
