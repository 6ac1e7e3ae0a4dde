// M01 to M05, M09, M11, M16, M20, M21: what the forces of a model are at one state.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "check/groups.h"
#include "check/model.h"
#include "check/runner.h"

namespace cli::check {
namespace {

constexpr double kAxis[3] = {2.0 / 7, 3.0 / 7, 6.0 / 7}, kShift[3] = {0.3, -0.2, 0.7};
// Shares of an edge by which points are shaken.
constexpr double kSmall = 1e-3, kMiddle = 0.02, kLarge = 0.15;

void need_forces(const Subject &subject) {
  if (!model_of(subject).add_forces) skip("it steps itself and adds no forces");
}

double norm(const Numbers &f) { return std::sqrt(std::inner_product(f.begin(), f.end(), f.begin(), 0.0)); }

// The largest force when points are a percent of an edge off: what other forces are compared with.
double force_scale(Body &body, Random &random) {
  const Moment before = body;
  body.shake(0.01 * kCube, 0, random);
  const double most = largest(body.forces());
  body.take(before);
  if (!(most > 0) || !std::isfinite(most))
    broken(
        "its largest force is %g N where every point of a body is displaced by 1 %% of an edge; add forces",
        most);
  return most;
}

// A body that steps itself must not depend on where its rest pose lies.
void rests(Body &body, const char *where) {
  const Numbers before = body.x;
  const std::vector<double> u = body.predict(Numbers(body.x.size(), 0.0));
  body.commit(std::vector<double>(u.size(), 0.0));
  const double most = std::max(body.dt * largest(u), most_apart(body.x, before));
  if (!(most <= 1e-9 * kCube))
    broken(
        "a body at rest in its rest shape, %s, moves by %g m in a step without a load; make the rest "
        "shape its goal",
        where, most);
}

}  // namespace

std::string rest_pose_is_free(const Subject &subject) {
  Random random(subject.seed);
  return for_variants(subject, [&](const Variant &variant) {
    Body body(subject, small_block(variant.cell), variant);
    if (body.steps_itself()) return rests(body, "where it was made");
    const double scale = force_scale(body, random), most = largest(body.forces());
    if (!(most <= 1e-9 * scale))
      broken(
          "the rest pose has forces of %g N (%g N where points are displaced by 1 %% of an edge); take "
          "lengths, volumes and frames at rest from dfm_mesh.rest",
          most, scale);
  });
}

std::string rigid_motion_is_free(const Subject &subject) {
  if (!(model_of(subject).caps & DFM_CAP_ROTATION_INVARIANT))
    skip("it does not claim DFM_CAP_ROTATION_INVARIANT");
  Random random(subject.seed);
  return for_variants(subject, [&](const Variant &variant) {
    for (const double angle : {1e-3, 0.7, 3.0}) {
      Body body(subject, small_block(variant.cell), variant);
      if (!body.can(DFM_CAP_ROTATION_INVARIANT)) return;
      const double scale = body.steps_itself() ? 0 : force_scale(body, random);
      if (body.steps_itself()) {
        body.turn(kAxis, angle, kShift);
        rests(body, "turned and shifted");
        continue;
      }
      body.shake(kMiddle * kCube, 0, random);
      const Numbers before = body.forces();
      const double joule = body.can(DFM_CAP_ENERGY) ? body.energy() : 0;
      Body turned(subject, small_block(variant.cell), variant);
      turned.x = before;
      const double nowhere[3] = {};
      turned.turn(kAxis, angle, nowhere);
      body.turn(kAxis, angle, kShift);
      const Numbers after = body.forces();
      const double off = most_apart(after, turned.x);
      if (!(off <= 1e-8 * std::max(scale, largest(before))))
        broken(
            "the forces of a body that is turned by %g rad and shifted are off the forces turned by as "
            "much by %g N of %g N, though it claims DFM_CAP_ROTATION_INVARIANT; measure strain in a frame "
            "that turns with the body, or drop the claim",
            angle, off, largest(before));
      if (!body.can(DFM_CAP_ENERGY)) continue;
      if (const double returned = body.energy(); !(std::fabs(returned - joule) <= 1e-8 * std::fabs(joule)))
        broken(
            "the energy of a deformed shape is %.12g J and, turned by %g rad, %.12g J, though it claims "
            "DFM_CAP_ROTATION_INVARIANT; measure strain in a frame that turns with the body",
            joule, angle, returned);
    }
  });
}

namespace {

struct Sums { double force[3] = {}, torque[3] = {}, size = 0, arm = 0; };

// Sum and moment of vectors at the points, each by its weight; the moment about the center of mass.
Sums sums_of(Body &body, Numbers &vectors, const std::vector<double> &weight) {
  Sums s;
  double mean[3] = {}, total = 0;
  for (const double m : body.solid.mass) total += m;
  for (uint32_t i = 0; i < body.points(); ++i)
    for (int a = 0; a < 3; ++a) mean[a] += body.solid.mass[i] / total * body.at(body.x, i)[a];
  for (uint32_t i = 0; i < body.points(); ++i) {
    const double *const f = body.at(vectors, i), *const x = body.at(body.x, i);
    double r[3], g[3];
    for (int a = 0; a < 3; ++a) {
      r[a] = x[a] - mean[a];
      g[a] = weight[i] * f[a];
      s.force[a] += g[a];
    }
    for (int a = 0; a < 3; ++a)
      s.torque[a] += r[(a + 1) % 3] * g[(a + 2) % 3] - r[(a + 2) % 3] * g[(a + 1) % 3];
    s.size += length(g);
    s.arm += length(g) * length(r);
  }
  return s;
}

double apart(const double *a, const double *b) {
  const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return length(d);
}

void keeps_momentum_of_steps(const Subject &subject, const Variant &variant) {
  Random random(subject.seed);
  Body body(subject, small_block(variant.cell), variant);
  body.shake(kMiddle * kCube, 0.05, random);
  // The first step may take the velocities to what the model can have; from then on nothing may be lost.
  body.advance(1e-3);
  Sums before = sums_of(body, body.v, body.solid.mass);
  for (int step = 0; step < 20; ++step) body.advance(1e-3);
  Sums after = sums_of(body, body.v, body.solid.mass);
  if (!(apart(before.force, after.force) <= 1e-10 * before.size))
    broken(
        "the momentum of a free body changes by %g kg m/s of %g in 20 steps; let inner forces or goals "
        "not move the center of mass",
        apart(before.force, after.force), before.size);
  if (body.can(DFM_CAP_ROTATION_INVARIANT) &&
      !(apart(before.torque, after.torque) <= 1e-9 * std::max(before.arm, after.arm)))
    broken(
        "the angular momentum of a free body changes by %g kg m2/s of %g in 20 steps; let inner forces or "
        "goals have no moment",
        apart(before.torque, after.torque), before.arm);
}

}  // namespace

std::string forces_sum_to_zero(const Subject &subject) {
  Random random(subject.seed);
  return for_variants(subject, [&](const Variant &variant) {
    Body body(subject, small_block(variant.cell), variant);
    if (body.steps_itself()) return keeps_momentum_of_steps(subject, variant);
    for (const double share : {kMiddle, kLarge}) {
      body.shake(share * kCube, 0, random);
      Numbers f = body.forces();
      const Sums s = sums_of(body, f, std::vector<double>(body.points(), 1.0));
      if (!(length(s.force) <= 1e-10 * s.size))
        broken(
            "the forces of a free body sum to %g N (their absolute values to %g N); let the forces of "
            "each cell sum to zero, as those of an energy of differences do",
            length(s.force), s.size);
      if (body.can(DFM_CAP_ROTATION_INVARIANT) && !(length(s.torque) <= 1e-10 * s.arm))
        broken(
            "the forces of a free body have a moment of %g N m (force times distance: %g N m); take "
            "forces from an energy that does not change when the body turns",
            length(s.torque), s.arm);
    }
  });
}

std::string forces_are_the_gradient(const Subject &subject) {
  need_forces(subject);
  if (!(model_of(subject).caps & DFM_CAP_ENERGY)) skip("it does not claim DFM_CAP_ENERGY");
  Random random(subject.seed);
  double worst = 0;
  const std::string summary = for_variants(subject, [&](const Variant &variant) {
    for (const double share : {kMiddle, kLarge}) {
      Body body(subject, small_block(variant.cell), variant);
      if (!body.can(DFM_CAP_ENERGY)) return;
      body.shake(share * kCube, 0, random);
      const Numbers f = body.forces(), x = body.x;
      for (int direction = 0; direction < 6; ++direction) {
        Numbers d(x.size(), 0.0);
        for (uint32_t i = 0; i < body.points(); ++i)
          for (int a = 0; a < 3; ++a) body.at(d, i)[a] = random.uniform(-1, 1);
        const double work = std::inner_product(f.begin(), f.end(), d.begin(), 0.0);
        double best = 1e300, returned = 0;
        for (double step = 1e-2 * kCube; step > 1e-7 * kCube; step /= 10) {
          double e[2];
          for (int side = 0; side < 2; ++side) {
            for (size_t n = 0; n < x.size(); ++n) body.x[n] = x[n] + (side ? -step : step) * d[n];
            e[side] = body.energy();
          }
          const double slope = (e[1] - e[0]) / (2 * step);
          if (const double off = std::fabs(slope - work); off < best) {
            best = off;
            returned = slope;
          }
        }
        body.x = x;
        const double size = norm(f) * norm(d);
        worst = std::max(worst, best / size);
        if (!(best <= 1e-5 * size))
          broken(
              "points shaken by %g of an edge: along a random direction the forces do %.9g J/m of work "
              "and the energy falls by %.9g J/m; let the forces be the negative gradient of the energy, with "
              "every term of both%s",
              share, work, returned,
              body.state.empty() ? "" : " and both of dfm_kin.state, not of state_out");
      }
    }
  });
  return text("%s, %.0e at most", summary.c_str(), worst);
}

namespace {

// d f / d x or d f / d v by central differences, [3n,3n].
std::vector<double> differences(Body &body, Numbers &of, double step) {
  const size_t width = 3 * size_t(body.points());
  std::vector<double> out(width * width, 0.0);
  for (size_t c = 0; c < width; ++c) {
    double &at = body.at(of, static_cast<uint32_t>(c / 3))[c % 3];
    const double keep = at;
    for (const double side : {1.0, -1.0}) {
      at = keep + side * step;
      Numbers f = body.forces();
      for (size_t r = 0; r < width; ++r)
        out[r * width + c] += side * body.at(f, static_cast<uint32_t>(r / 3))[r % 3] / (2 * step);
    }
    at = keep;
  }
  return out;
}

struct Tangent {
  double share;      // of an edge, shaken
  double tolerance;  // of the largest entry; 0: what is left out may be anything
};

void tangent_agrees(Body &body, const Tangent &t, Random &random) {
  const size_t width = 3 * size_t(body.points());
  const std::vector<double> k = body.stiffness(1, 0), c = body.stiffness(0, 1), both = body.stiffness(2, 3);
  const double most = largest(k), damping = largest(c);
  for (size_t i = 0; i < width; ++i)
    for (size_t j = 0; j < i; ++j)
      if (!(std::fabs(k[i * width + j] - k[j * width + i]) <= 1e-9 * most))
        broken("the block of point %zu with itself is not symmetric (%g and %g N/m); give the symmetric part",
               i / 3, k[i * width + j], k[j * width + i]);
  for (size_t n = 0; n < k.size(); ++n)
    if (!(std::fabs(both[n] - (2 * k[n] + 3 * c[n])) <= 1e-9 * (2 * most + 3 * damping)))
      broken(
          "stiffness(2, 3) is not 2 stiffness(1, 0) + 3 stiffness(0, 1) (%g and %g); return a df/dx + b "
          "df/dv",
          both[n], 2 * k[n] + 3 * c[n]);
  if (!below(k, width, 1e-8 * most))
    broken(
        "points shaken by %g of an edge, stiffness has a positive direction; drop the terms that make it "
        "indefinite",
        t.share);
  if (damping > 0 && !below(c, width, 1e-8 * damping))
    broken(
        "points shaken by %g of an edge, the part of stiffness by velocity has a positive direction; "
        "drop the terms that make it indefinite",
        t.share);
  if (t.tolerance > 0) {
    const std::vector<double> d = differences(body, body.x, 1e-5 * kCube);
    if (const double off = most_apart(d, k); !(off <= t.tolerance * largest(d)))
      broken(
          "points shaken by %g of an edge, stiffness is off the differences of the forces by %g of %g "
          "N/m; differentiate the forces, every term",
          t.share, off, largest(d));
  }
  if (!(t.tolerance > 0)) return;
  // the forces of dampers change with positions too, but are small where velocities are
  body.shake(0, 0.1, random);
  const std::vector<double> d = differences(body, body.v, 1e-3);
  if (const double off = most_apart(d, c);
      !(off <= t.tolerance * std::max(largest(d), damping) + 1e-12 * most))
    broken(
        "points shaken by %g of an edge, the part of stiffness by velocity is off the differences of the "
        "forces by %g of %g N s/m; differentiate the dampers too",
        t.share, off, largest(d));
}

}  // namespace

std::string stiffness_is_the_derivative(const Subject &subject) {
  need_forces(subject);
  if (!(model_of(subject).caps & DFM_CAP_STIFFNESS)) skip("it does not claim DFM_CAP_STIFFNESS");
  Random random(subject.seed);
  return for_variants(subject, [&](const Variant &variant) {
    // At rest no part makes it indefinite, so none may be left out; what may is small where strains are.
    for (const Tangent &t : {Tangent{0, 1e-5}, Tangent{kSmall, 0.05}, Tangent{kLarge, 0}}) {
      Body body(subject, small_block(variant.cell), variant);
      if (!body.can(DFM_CAP_STIFFNESS)) return;
      body.shake(t.share * kCube, 0, random);
      tangent_agrees(body, t, random);
    }
  });
}

std::string constant_stiffness_is_constant(const Subject &subject) {
  need_forces(subject);
  if (!(model_of(subject).caps & DFM_CAP_CONSTANT_STIFFNESS))
    skip("it does not claim DFM_CAP_CONSTANT_STIFFNESS");
  Random random(subject.seed);
  return for_variants(subject, [&](const Variant &variant) {
    Body body(subject, small_block(variant.cell), variant);
    if (!body.can(DFM_CAP_CONSTANT_STIFFNESS)) return;
    const std::vector<double> before = body.stiffness(1, 0.1);
    body.shake(kLarge * kCube, 1, random);
    body.dt = 1.0 / 30;
    if (const double off = most_apart(before, body.stiffness(1, 0.1)); off != 0)
      broken(
          "its stiffness at a deformed state is off that at rest by %g of %g N/m, though it claims "
          "DFM_CAP_CONSTANT_STIFFNESS; drop the claim",
          off, largest(before));
  });
}

std::string dampers_take_energy(const Subject &subject) {
  need_forces(subject);
  const bool damps = (model_of(subject).caps & DFM_CAP_DAMPING) != 0;
  Random random(subject.seed);
  return for_variants(subject, [&](const Variant &variant) {
    Body body(subject, small_block(variant.cell), variant);
    body.shake(kLarge * kCube, 0, random);
    const Numbers still = body.forces();
    bool changed = false;
    for (int round = 0; round < 8; ++round) {
      std::ranges::fill(body.v, 0.0);
      body.shake(0, 0.1, random);
      Numbers f = body.forces();
      double power = 0, size = 0;
      for (size_t n = 0; n < f.size(); ++n) {
        power += (f[n] - still[n]) * body.v[n];
        size += std::fabs(f[n] - still[n]) * std::fabs(body.v[n]);
        changed = changed || f[n] != still[n];
        if (!damps && f[n] != still[n])
          broken(
              "its forces change with velocities (%g N and %g N), though it does not claim "
              "DFM_CAP_DAMPING; claim it",
              still[n], f[n]);
      }
      if (!(power <= 1e-10 * size))
        broken(
            "its forces at random velocities, less those at rest, do %g W on the body, as dampers that "
            "push; change the sign of the terms that depend on velocities",
            power);
    }
    // with another row, or with 0, it may have none
    if (damps && !changed && variant.name.find("damping_stiffness") != std::string::npos)
      broken(
          "its forces do not change with velocities, though it claims DFM_CAP_DAMPING; add the terms that "
          "the parameter stands for");
  });
}

std::string numbering_does_not_matter(const Subject &subject) {
  Random random(subject.seed);
  return for_variants(subject, [&](const Variant &variant) {
    const Solid one = with_cells(small_block(variant.cell), variant.cell);
    const size_t nodes = one.nodes();
    Solid other = one;
    std::vector<uint32_t> to(one.npoint()), cell(one.ncell());
    std::iota(to.begin(), to.end(), 0u);
    std::iota(cell.begin(), cell.end(), 0u);
    for (std::vector<uint32_t> *order : {&to, &cell})
      for (size_t n = order->size(); n > 1; --n) std::swap((*order)[n - 1], (*order)[random.next() % n]);
    for (uint32_t i = 0; i < one.npoint(); ++i) {
      std::copy_n(&one.rest[3 * size_t(i)], 3, &other.rest[3 * size_t(to[i])]);
      other.mass[to[i]] = one.mass[i];
    }
    for (uint32_t c = 0; c < one.ncell(); ++c)
      for (size_t k = 0; k < nodes; ++k) other.cells[nodes * cell[c] + k] = to[one.cells[nodes * c + k]];
    for (uint32_t &i : other.col) i = to[i];
    other.find_edges();
    Body a(subject, one, variant), b(subject, other, variant);
    a.shake(kMiddle * kCube, 0, random);
    for (uint32_t i = 0; i < a.points(); ++i) std::copy_n(a.at(a.x, i), 3, b.at(b.x, to[i]));
    Numbers f, g;
    double scale = 0;
    if (a.steps_itself()) {
      f = a.x;
      for (Body *body : {&a, &b}) body->advance(1e-3);
      scale = most_apart(a.x, f);
      f = a.x;
      g = b.x;
    } else {
      f = a.forces();
      g = b.forces();
      scale = largest(f);
    }
    for (uint32_t i = 0; i < a.points(); ++i)
      for (int d = 0; d < 3; ++d)
        if (!(std::fabs(a.at(f, i)[d] - b.at(g, to[i])[d]) <= 1e-7 * scale))
          broken(
              "point %u %s %.12g %s and, with points and cells numbered otherwise, %.12g; let no result "
              "depend on numbers of points",
              i, a.steps_itself() ? "goes to" : "has a force of", a.at(f, i)[d], a.steps_itself() ? "m" : "N",
              b.at(g, to[i])[d]);
  });
}

namespace {

const char *const kCollapses[] = {
    "one cell turned inside out", "all points on a plane", "on a line", "all points at one place", "mirrored",
    "two points at one place"};

void collapse(Body &body, size_t how) {
  double *const p = body.at(body.x, body.solid.cells[0]);
  for (uint32_t i = 0; i < body.points(); ++i) {
    double *const x = body.at(body.x, i);
    if (how == 1 || how == 2 || how == 3) x[2] = 0;
    if (how == 2 || how == 3) x[1] = 0;
    if (how == 3) x[0] = 0;
    if (how == 4) x[0] = -x[0];
  }
  for (int a = 0; a < 3 && how == 0; ++a) {
    double mean = 0;
    for (int k = 1; k < 4; ++k) mean += body.at(body.x, body.solid.cells[size_t(k)])[a] / 3;
    p[a] = 2 * mean - p[a];
  }
  if (how == 5) std::copy_n(body.at(body.x, body.solid.cells[1]), 3, p);
}

}  // namespace

std::string collapsed_cells_stay_finite(const Subject &subject) {
  uint32_t discarded = 0;
  const std::string summary = for_variants(subject, [&](const Variant &variant) {
    for (size_t how = 0; how < std::size(kCollapses); ++how) {
      Body body(subject, small_block(variant.cell), variant);
      collapse(body, how);
      stage("%s, %s", with(variant).c_str(), kCollapses[how]);
      Numbers out(body.x.size(), 0.0), v = out;
      std::vector<double> u(3 * size_t(body.solid.nsurfel()), 0.0), next = body.state;
      const std::vector<double> no_impulse(u.size(), 0.0);
      dfm_kin k = body.kin();
      k.state_out = next.empty() ? nullptr : next.data();
      dfm_status status = DFM_OK;
      if (body.steps_itself()) {
        status =
            body.call("predict", [&] { return body.stepper->predict(body.self, &k, v.data(), u.data()); });
        if (status == DFM_OK)
          status = body.call("commit", [&] {
            return body.stepper->commit(body.self, &k, no_impulse.data(), out.data(), v.data());
          });
      } else {
        status = body.call("add_forces", [&] { return body.ops.add_forces(body.self, &k, out.data()); });
      }
      discarded += status == DFM_DISCARD;
      if (status < 0)
        broken("%s, it returns %s; return a result, or DFM_DISCARD if a shorter step may help",
               kCollapses[how], dfm_status_name(status));
      for (size_t n = 0; n < out.size() && status == DFM_OK; ++n)
        if (!std::isfinite(out[n] + v[n]) || !std::isfinite(u[n % u.size()]))
          broken(
              "%s, it returns %g for point %zu; return finite values for shapes without volume and "
              "lengths of zero",
              kCollapses[how], out[n], n / body.stride);
    }
  });
  return discarded ? text("%s, %u discarded", summary.c_str(), discarded) : summary;
}

std::string cell_energy_sums(const Subject &subject) {
  if (!(model_of(subject).caps & DFM_CAP_ENERGY)) skip("it does not claim DFM_CAP_ENERGY");
  Random random(subject.seed);
  bool offered = false;
  const std::string summary = for_variants(subject, [&](const Variant &variant) {
    Body body(subject, small_block(variant.cell), variant);
    const auto *own = static_cast<const dfm_cell_energy *>(body.extension(DFM_EXT_CELL_ENERGY));
    if (!own || !own->cell_energy || !body.can(DFM_CAP_ENERGY)) return;
    offered = true;
    body.shake(kMiddle * kCube, 0, random);
    std::vector<double> density(body.solid.ncell(), 0.0);
    const dfm_kin k = body.kin();
    body.must("cell_energy", [&] { return own->cell_energy(body.self, &k, density.data()); });
    double sum = 0;
    for (uint32_t c = 0; c < body.solid.ncell(); ++c) sum += density[c] * body.solid.volume(c);
    if (const double whole = body.energy(); !(std::fabs(sum - whole) <= 1e-9 * std::fabs(whole)))
      broken(
          "the energies of the cells sum to %.12g J and the body's is %.12g J; divide every term among "
          "the cells, over their volumes at rest",
          sum, whole);
  });
  if (!offered) skip("it does not offer " DFM_EXT_CELL_ENERGY);
  return summary;
}

}  // namespace cli::check
