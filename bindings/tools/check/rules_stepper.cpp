// M10, M12 to M14, M17 to M19: steps of a model, and the response of self-stepping bodies to impulses.
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "check/groups.h"
#include "check/model.h"
#include "check/runner.h"

namespace cli::check {
namespace {

// A step that is safe for a force model; bodies that step themselves take any.
double safe_step(const Body &body) {
  if (body.steps_itself() || !body.ops.bound) return 1e-4;
  return std::min(1e-3, 0.3 * body.longest_step());
}

bool same_bits(const Moment &a, const Moment &b) {
  const auto equal = [](const double *p, const double *q, size_t n) {
    return n == 0 || std::memcmp(p, q, n * sizeof(double)) == 0;
  };
  return equal(a.x.data(), b.x.data(), a.x.size()) && equal(a.v.data(), b.v.data(), a.v.size()) &&
         equal(a.state.data(), b.state.data(), a.state.size());
}

uint64_t mix(uint64_t hash, const double *data, size_t n) {
  const unsigned char *const p = reinterpret_cast<const unsigned char *>(data);
  for (size_t i = 0; i < n * sizeof(double); ++i) hash = (hash ^ p[i]) * 0x100000001b3ull;
  return hash;
}

void run(Body &body, int steps, double h) {
  for (int i = 0; i < steps; ++i) body.advance(h);
}

// Touched now and then, so that what a touch leaves is there too.
void poke(Body &body) {
  if (!body.steps_itself()) return;
  std::vector<double> p(3 * size_t(body.solid.nsurfel()), 0.0);
  p[4] = 1e-4;
  body.predict(Numbers(body.x.size(), 0.0));
  body.commit(p);
}

}  // namespace

uint64_t digest_of_model(const Subject &subject) {
  uint64_t hash = 0xcbf29ce484222325ull;
  for (const Variant &variant : variants(subject)) {
    Random random(subject.seed);
    Body body(subject, small_block(variant.cell), variant);
    const double h = safe_step(body);
    body.shake(0.01 * kCube, 0.01, random);
    run(body, 4, h);
    poke(body);
    hash = mix(hash, body.x.data(), body.x.size());
    hash = mix(hash, body.v.data(), body.v.size());
    hash = mix(hash, body.state.data(), body.state.size());
  }
  return hash;
}

std::string state_is_the_hosts(const Subject &subject) {
  return for_variants(subject, [&](const Variant &variant) {
    Random random(subject.seed);
    Body one(subject, small_block(variant.cell), variant);
    const double h = safe_step(one);
    one.shake(0.01 * kCube, 0.01, random);
    run(one, 5, h);
    poke(one);
    run(one, 2, h);
    // What the host has of it goes to an instance that never was anywhere else.
    Body other(subject, small_block(variant.cell), variant);
    const Moment saved = one;
    other.take(saved);
    for (Body *body : {&one, &other}) {
      run(*body, 6, h);
      poke(*body);
      run(*body, 3, h);
    }
    if (!same_bits(one, other))
      broken(
          "a body that is saved after 8 steps and continues in a new instance differs 10 steps later from "
          "one that was never saved (%g m), so it keeps data that the host cannot save; declare it as state "
          "slots, or compute it from positions and velocities",
          most_apart(one.x, other.x));
    // The same instance is taken back, as by rollback, with another one's steps in between.
    Body &again = one;
    again.take(saved);
    Body between(subject, small_block(variant.cell, Held::one_side), variant, 4, Body::Refusal::is_reported);
    if (between.made()) {
      between.shake(0.05 * kCube, 0.1, random);
      run(between, 2, h);
    }
    run(again, 6, h);
    poke(again);
    run(again, 3, h);
    if (!same_bits(again, other))
      broken(
          "a body that is taken back 10 steps then moves differently; declare what it keeps as state "
          "slots, and share nothing between instances");
  });
}

// ---- M12 --------------------------------------------------------------------------------------------------

namespace {

double processor_time() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// s per cell and evaluation, the best of some rounds; each is long against the steps of the clock.
double cost_per_cell(const Subject &subject, uint32_t cubes, const Variant &variant) {
  Random random(subject.seed);
  Body body(subject, block(cubes, cubes, cubes), variant);
  body.shake(0.01 * kCube, 0.01, random);
  body.forces();
  double best = 1e300;
  for (int round = 0; round < 3; ++round) {
    const double begun = processor_time();
    double used = 0;
    int calls = 0;
    for (; used < 0.02; ++calls, used = processor_time() - begun) body.forces();
    best = std::min(best, used / calls);
  }
  return best / body.solid.ncell();
}

}  // namespace

std::string cost_grows_with_cells(const Subject &subject) {
  if (!model_of(subject).add_forces) skip("it steps itself and adds no forces");
  const Variant defaults = variants(subject).front();
  const double few = cost_per_cell(subject, 4, defaults), many = cost_per_cell(subject, 12, defaults);
  // 27 times as many cells: what grows with their square costs 27 times as much for each
  if (!(many <= 6 * few))
    broken(
        "a cell costs %.3g us in a small body and %.3g us in one of 27 times the cells, so the cost grows "
        "faster "
        "than the body; visit each cell and its points once",
        1e6 * few, 1e6 * many);
  return text("%.3g us for each cell", 1e6 * many);
}

// ---- M13 --------------------------------------------------------------------------------------------------

namespace {

// A lower bound of the largest eigenvalue of h^2 K + 2 h C over 4 M, by the power method.
double quotient(Body &body, double h, Random &random) {
  const Numbers x = body.x, v = body.v;
  const uint32_t n = body.points();
  Numbers q(x.size(), 0.0);
  for (uint32_t i = 0; i < n; ++i)
    for (int a = 0; a < 3; ++a) body.at(q, i)[a] = random.uniform(-1, 1);
  double most = 0;
  for (int round = 0; round < 150; ++round) {
    double size = 0;
    for (uint32_t i = 0; i < n; ++i)
      for (int a = 0; a < 3; ++a) size = std::max(size, std::fabs(body.at(q, i)[a]));
    const double step = 1e-5 * kCube / size, rate = 1e-2 / size;
    Numbers g(x.size(), 0.0);
    for (const double side : {1.0, -1.0}) {
      for (size_t k = 0; k < x.size(); ++k) body.x[k] = x[k] + side * step * q[k];
      const Numbers f = body.forces();
      body.x = x;
      for (size_t k = 0; k < x.size(); ++k) g[k] -= side * h * h / (2 * step) * f[k];
      if (!body.can(DFM_CAP_DAMPING)) continue;
      for (size_t k = 0; k < x.size(); ++k) body.v[k] = v[k] + side * rate * q[k];
      const Numbers d = body.forces();
      body.v = v;
      for (size_t k = 0; k < x.size(); ++k) g[k] -= side * 2 * h / (2 * rate) * d[k];
    }
    double work = 0, inertia = 0;
    for (uint32_t i = 0; i < n; ++i)
      for (int a = 0; a < 3; ++a) {
        const double m = body.solid.mass[i], p = body.at(q, i)[a];
        work += p * body.at(g, i)[a];
        inertia += 4 * m * p * p;
        body.at(q, i)[a] = body.at(g, i)[a] / (4 * m);
      }
    most = std::max(most, work / inertia);
  }
  return most;
}

}  // namespace

std::string bound_is_honest(const Subject &subject) {
  if (!model_of(subject).add_forces) skip("it steps itself and adds no forces");
  if (!model_of(subject).bound) skip("it names no bound; explicit steps take what the scene says");
  double wide = 1, narrow = 0;
  const std::string summary = for_variants(subject, [&](const Variant &variant) {
    Random random(subject.seed);
    for (const double share : {0.0, 0.05}) {
      Body body(subject, small_block(variant.cell), variant);
      body.shake(share * kCube, 0, random);
      const double h = body.longest_step();
      if (!(h > 0) || h > 1e6)
        broken(
            "bound allows explicit steps of %g s for a free body, which is no bound; add row sums of the "
            "stiffness",
            h);
      body.dt = h;
      const double over = quotient(body, h, random);
      if (!(over <= 1 + 1e-6))
        broken(
            "points shaken by %g of an edge, bound allows explicit steps of %g s, which is %.3g of the "
            "stable step, so bodies would explode; let row sums cover the stiffness and twice the dampers",
            share, h, std::sqrt(over));
      if (share == 0 && !(over >= 1.0 / 16))
        broken(
            "bound allows explicit steps of %g s where %g s are stable, so a run needs %.0f times as many "
            "steps; sum only the rows of the stiffness of each point",
            h, h / std::sqrt(over), 1 / std::sqrt(over));
      narrow = std::max(narrow, 1 / std::sqrt(over));
      wide = std::min(wide, 1 / std::sqrt(over));
    }
  });
  return text("%s, %.2f to %.2f below the limit", summary.c_str(), wide, narrow);
}

// ---- M14, M18, M19 ----------------------------------------------------------------------------------------

namespace {

Body &ready(Body &body, Random &random) {
  body.shake(0.005 * kCube, 0.01, random);
  body.dt = 1e-3;
  body.predict(Numbers(body.x.size(), 0.0));
  return body;
}

// [3n,3n] 1/kg: column c is the answer to a unit impulse.
std::vector<double> response_of(const Body &body) {
  const std::vector<uint32_t> surfels = body.surfels();
  const size_t width = 3 * surfels.size();
  std::vector<double> out(width * width);
  for (size_t c = 0; c < width; ++c) {
    std::vector<double> p(width, 0.0);
    p[c] = 1;
    const std::vector<double> du = body.respond(surfels, p);
    for (size_t r = 0; r < width; ++r) out[r * width + c] = du[r];
  }
  return out;
}

void only_steppers(const Body &body) {
  if (!body.steps_itself()) skip("it adds forces and does not step itself");
}

template <class F>
std::string for_steppers(const Subject &subject, const F &rule) {
  return for_variants(subject, [&](const Variant &variant) {
    for (const Held held : {Held::nothing, Held::one_side}) {
      Random random(subject.seed);
      Body body(subject, small_block(variant.cell, held), variant, 4, Body::Refusal::is_reported);
      if (!body.made()) continue;  // held bodies may be none of its
      only_steppers(body);
      stage("%s, %s", with(variant).c_str(), held == Held::nothing ? "free" : "one side held");
      rule(ready(body, random), random);
    }
  });
}

}  // namespace

std::string commit_is_predict_and_respond(const Subject &subject) {
  double worst = 0;
  const std::string summary = for_steppers(subject, [&](Body &body, Random &random) {
    Numbers load(body.x.size(), 0.0);
    for (uint32_t i = 0; i < body.points(); ++i) body.at(load, i)[2] = -9.81 * body.solid.mass[i];
    const std::vector<uint32_t> surfels = body.surfels();
    const std::vector<double> u = body.predict(load);
    std::vector<double> p(3 * surfels.size());
    for (double &a : p) a = 1e-4 * random.uniform(-1, 1);
    const std::vector<double> du = body.respond(surfels, p);
    const Numbers before = body.x;
    body.commit(p);
    double most = 0, speed = 0, way = 0;
    for (const uint32_t s : surfels)
      for (size_t a = 0; a < 3; ++a) {
        double mean = 0;
        for (uint32_t e = body.solid.row[s]; e < body.solid.row[s + 1]; ++e) {
          const size_t at = size_t(body.stride) * body.solid.col[e] + a;
          mean += body.solid.weight[e] * (body.x[at] - before[at]) / body.dt;
          way = std::max(way, std::fabs(before[at]));
        }
        const double returned = u[3 * size_t(s) + a] + du[3 * size_t(s) + a];
        most = std::max(most, std::fabs(mean - returned));
        speed = std::max(speed, std::fabs(u[3 * size_t(s) + a]) + std::fabs(du[3 * size_t(s) + a]));
      }
    worst = std::max(worst, most / speed);
    // positions are rounded, and mean velocities are their differences
    if (!(most <= 1e-10 * speed + 1e-14 * way / body.dt))
      broken(
          "commit moves a surfel by a mean velocity that is off predict plus respond by %g of %g m/s; "
          "make commit use the velocities of predict and respond",
          most, speed);
  });
  return text("%s, %.0e at most", summary.c_str(), worst);
}

std::string response_is_an_operator(const Subject &subject) {
  return for_steppers(subject, [&](Body &body, Random &random) {
    const std::vector<uint32_t> surfels = body.surfels();
    const size_t width = 3 * surfels.size();
    const std::vector<double> r = response_of(body);
    const double most = largest(r);
    if (!(most > 0)) broken("respond always returns 0; return the response to impulses");
    for (size_t i = 0; i < width; ++i)
      for (size_t j = 0; j < i; ++j)
        if (!(std::fabs(r[i * width + j] - r[j * width + i]) <= 1e-10 * most))
          broken(
              "respond is not symmetric: an impulse at surfel %zu moves surfel %zu by %.12g 1/kg, and the "
              "reverse gives %.12g; apply the same coupling on both sides",
              j / 3, i / 3, r[i * width + j], r[j * width + i]);
    std::vector<double> p(width), sum(width, 0.0);
    for (double &a : p) a = random.uniform(-1, 1);
    for (size_t i = 0; i < width; ++i)
      for (size_t j = 0; j < width; ++j) sum[i] += r[i * width + j] * p[j];
    const std::vector<double> whole = body.respond(surfels, p);
    double work = 0;
    for (size_t i = 0; i < width; ++i) {
      work += p[i] * whole[i];
      if (!(std::fabs(whole[i] - sum[i]) <= 1e-10 * most * std::sqrt(double(width)) * 10))
        broken(
            "respond is not linear: all impulses at once give %.12g m/s, and one by one %.12g m/s; "
            "compute what depends on the state in predict",
            whole[i], sum[i]);
    }
    std::vector<double> against = r;
    for (double &a : against) a = -a;
    if (!(work >= 0) || !below(against, width, 1e-10 * most))
      broken("there are impulses p with p . respond(p) < 0; make respond positive semidefinite");
    if (body.stepper->size < offsetof(dfm_stepper, respond_many) + sizeof(void *) ||
        !body.stepper->respond_many)
      return;
    std::vector<double> unit(width * width, 0.0), many(width * width, 0.0);
    for (size_t c = 0; c < width; ++c) unit[c * width + c] = 1;
    const dfm_kin k = body.kin();
    body.must("respond_many", [&] {
      return body.stepper->respond_many(body.self, &k, static_cast<uint32_t>(surfels.size()), surfels.data(),
                                        static_cast<uint32_t>(width), unit.data(), many.data());
    });
    for (size_t i = 0; i < width; ++i)
      for (size_t c = 0; c < width; ++c)
        if (!(std::fabs(many[c * width + i] - r[i * width + c]) <= 1e-12 * most))
          broken("respond_many gives %.12g 1/kg where respond gives %.12g; let one call the other",
                 many[c * width + i], r[i * width + c]);
  });
}

std::string diagonal_bounds_response(const Subject &subject) {
  return for_steppers(subject, [&](Body &body, Random &) {
    const std::vector<uint32_t> surfels = body.surfels();
    const size_t width = 3 * surfels.size();
    const std::vector<double> r = response_of(body);
    std::vector<double> w(9 * surfels.size(), 0.0);
    const dfm_kin k = body.kin();
    body.must("diagonal", [&] {
      return body.stepper->diagonal(body.self, &k, static_cast<uint32_t>(surfels.size()), surfels.data(),
                                    w.data());
    });
    const double most = largest(r);
    for (size_t s = 0; s < surfels.size(); ++s) {
      std::vector<double> over(9);  // R - w
      for (size_t a = 0; a < 9; ++a) over[a] = r[(3 * s + a / 3) * width + 3 * s + a % 3] - w[9 * s + a];
      if (!below(over, 3, 1e-10 * most))
        broken(
            "the diagonal of surfel %zu (%.6g %.6g %.6g 1/kg) is below what respond answers there (%.6g "
            "%.6g %.6g 1/kg); return the block itself, or more",
            s, w[9 * s], w[9 * s + 4], w[9 * s + 8], r[(3 * s) * width + 3 * s],
            r[(3 * s + 1) * width + 3 * s + 1], r[(3 * s + 2) * width + 3 * s + 2]);
    }
  });
}

// ---- M17 --------------------------------------------------------------------------------------------------

std::string cut_does_not_matter(const Subject &subject) {
  Host &host = subject.plugin->host();
  const Variant defaults = variants(subject).front();
  const bool forces = model_of(subject).add_forces != nullptr;
  // large enough that threads get work
  const Solid solid = forces ? block(12, 12, 12) : small_block();
  const auto results = [&](Host::Cut cut) {
    host.cut = cut;
    Random random(subject.seed);
    Body body(subject, solid, defaults);
    body.shake(0.01 * kCube, 0.01, random);
    const double h = safe_step(body);
    std::vector<double> out;
    if (forces && body.ops.bound) {
      std::vector<double> sums(2 * size_t(body.points()), 0.0);
      double dt = 1e300;
      const dfm_kin k = body.kin();
      body.must("bound",
                [&] { return body.ops.bound(body.self, &k, sums.data(), &sums[body.points()], &dt); });
      out = sums;
    }
    if (body.can(DFM_CAP_ENERGY)) out.push_back(body.energy());
    run(body, 2, h);
    out.insert(out.end(), body.x.begin(), body.x.end());
    out.insert(out.end(), body.v.begin(), body.v.end());
    host.cut = Host::Cut::grains;
    return out;
  };
  const std::vector<double> returned = results(Host::Cut::whole);
  const uint64_t calls = host.parallel_calls;
  for (const Host::Cut cut : {Host::Cut::grains, Host::Cut::shuffled}) {
    if (const std::vector<double> again = results(cut);
        std::memcmp(returned.data(), again.data(), returned.size() * sizeof(double)) != 0)
      broken(
          "two steps of a body of %u cells have other bits when parallel_for divides its work otherwise; put "
          "partial sums into slot begin/grain, add them in the order of slots, and let no two pieces write "
          "one place",
          solid.ncell());
  }
  return calls ? text("%u cells", solid.ncell()) : text("%u cells, no work handed out", solid.ncell());
}

}  // namespace cli::check
