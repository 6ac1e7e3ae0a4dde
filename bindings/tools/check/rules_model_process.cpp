// V04 to V08, V10 to V12, V14 for models: what they do to the process that they run in.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <thread>

#include "check/groups.h"
#include "check/model.h"
#include "check/watch.h"

namespace cli::check {
namespace {

// The calls that a step of a world makes for a body, with their arrays: nothing is allocated between calls.
class StepCalls {
 public:
  explicit StepCalls(Body &body)
      : body_(body),
        f(body.x.size(), 0.0),
        x_end(f),
        v_end(f),
        ksum(body.points(), 0.0),
        csum(body.points(), 0.0),
        next(body.state),
        u(3 * size_t(body.solid.nsurfel()), 0.0),
        p(u.size(), 1e-4),
        du(u.size(), 0.0),
        w(3 * u.size(), 0.0),
        surfels(body.surfels()) {
    if (!body.can(DFM_CAP_STIFFNESS)) return;
    uint32_t n = 0;
    body.must("pattern", [&] { return body.ops.pattern(body.self, &n, nullptr); });
    blocks.assign(9 * size_t(n), 0.0);
  }
  // run(name, call) makes each call; its status is what run makes of it.
  template <class F>
  void each(const F &run) {
    dfm_kin k = body_.kin(), end = k;
    end.state_out = next.empty() ? nullptr : next.data();
    const dfm_model &ops = body_.ops;
    void *const self = body_.self;
    if (ops.bound) run("bound", [&] { return ops.bound(self, &k, ksum.data(), csum.data(), &h); });
    if (ops.add_forces) run("add_forces", [&] { return ops.add_forces(self, &end, f.data()); });
    if (body_.can(DFM_CAP_STIFFNESS))
      run("stiffness", [&] { return ops.stiffness(self, &k, 1, 1, blocks.data()); });
    if (body_.can(DFM_CAP_ENERGY)) run("energy", [&] { return ops.energy(self, &k, &joule); });
    if (!body_.stepper) return;
    const dfm_stepper &stepper = *body_.stepper;
    const uint32_t n = static_cast<uint32_t>(surfels.size());
    run("predict", [&] { return stepper.predict(self, &k, f.data(), u.data()); });
    run("respond", [&] { return stepper.respond(self, &k, n, surfels.data(), p.data(), du.data()); });
    run("diagonal", [&] { return stepper.diagonal(self, &k, n, surfels.data(), w.data()); });
    run("commit", [&] { return stepper.commit(self, &end, p.data(), x_end.data(), v_end.data()); });
  }

 private:
  Body &body_;

 public:
  Numbers f, x_end, v_end, blocks;
  std::vector<double> ksum, csum, next, u, p, du, w;
  std::vector<uint32_t> surfels;
  double h = 1e300, joule = 0;
};

void must_be_good(const char *name, dfm_status status) {
  if (status != DFM_OK)
    broken("%s returns %s at a state of a body that moves; return finite values for every finite state", name,
           dfm_status_name(status));
}

}  // namespace

// ---- V04 --------------------------------------------------------------------------------------------------

std::string model_parameters_sane(const Subject &subject) {
  const std::string rows = parameters_sane(subject);
  const dfm_type &type = *subject.type;
  const Variant defaults = variants(subject).front();
  const Solid solid = small_block();
  uint32_t refused = 0;
  size_t at = 0;
  for (uint32_t i = 0; i < type.nparam; at += type.params[i].width, ++i)
    for (const double end : {type.params[i].min, type.params[i].max}) {
      Variant one = defaults;
      std::fill_n(one.params.begin() + static_cast<std::ptrdiff_t>(at), type.params[i].width, end);
      stage("parameter \"%s\" at %g", type.params[i].key, end);
      Body body(subject, solid, one, 4, Body::Refusal::is_reported);
      if (!body.made()) {
        if (body.why().empty())
          broken("create refuses \"%s\" = %g without a reason; log it through dfm_host.log",
                 type.params[i].key, end);
        ++refused;
        continue;
      }
      Random random(subject.seed);
      body.shake(0.01 * kCube, 0, random);
      Numbers output;
      if (body.steps_itself()) {
        body.advance(1e-3);
        output = body.x;
      } else {
        output = body.forces();
      }
      for (const double a : output)
        if (!std::isfinite(a))
          broken(
              "with \"%s\" = %g, the end of its range, a body returns %g at a small strain; narrow the "
              "range, or let create refuse it",
              type.params[i].key, end, a);
    }
  return text("%s, %u ends of ranges refused by create", rows.c_str(), refused);
}

// ---- V05, V14 ---------------------------------------------------------------------------------------------

std::string step_keeps_to_itself(const Subject &subject) {
  Host &host = subject.plugin->host();
  Watch watch;
  uint32_t calls = 0;
  for_variants(subject, [&](const Variant &variant) {
    Random random(subject.seed);
    Body body(subject, small_block(variant.cell), variant);
    body.shake(0.01 * kCube, 0.01, random);
    StepCalls step(body);
    const auto returned = [&](const char *name, dfm_status status) { must_be_good(name, status); };
    // room that grows in the first steps may: a step allocates nothing once capacities have settled
    for (int round = 0; round < 2; ++round)
      step.each([&](const char *name, const auto &call) { returned(name, body.call(name, call)); });
    step.each([&](const char *name, const auto &call) {
      dfm_status status = DFM_OK;
      const char *found = nullptr;
      {
        const Kept kept(name);
        host.parallel_in_watch = true;
        found = watch.run([&] { status = call(); });
        host.parallel_in_watch = false;
      }
      host.release_scratch();
      ++calls;
      if (found)
        broken(
            "%s calls %s, in its third step; allocate in create, and do not use files, environment, clock "
            "or random numbers",
            name, spelt(found).c_str());
      returned(name, status);
    });
  });
  return text("%u calls, %zu entries watched", calls, watch.entries());
}

std::string step_writes_no_static(const Subject &subject) {
  return for_variants(subject, [&](const Variant &variant) {
    Random random(subject.seed);
    Body body(subject, small_block(variant.cell), variant);
    body.shake(0.01 * kCube, 0.01, random);
    StepCalls step(body);
    step.each([&](const char *name, const auto &call) { must_be_good(name, body.call(name, call)); });
    step.each([&](const char *name, const auto &call) {
      stage("%s %s, static variables read only", with(variant).c_str(), name);
      keeps_statics(subject, name, reinterpret_cast<const void *>(body.ops.create),
                    "which instances share; keep it in the instance, or in a state slot", call);
    });
  });
}

// ---- V06 --------------------------------------------------------------------------------------------------

namespace {

constexpr double kPadding = 7.25;  // what a lane beyond the third holds: to be left alone, and of no effect

// Calls with every array between fences; the answers, three numbers for each point.
class FencedBody {
 public:
  FencedBody(Body &body, Fenced::Place place)
      : body_(body), place_(place), kin_("dfm_kin", sizeof(dfm_kin), place) {
    kin() = body.kin();
    kin().x = points("x", body.x, true);
    kin().v = points("v", body.v, true);
    if (!body.state.empty()) kin().state = numbers("state (input)", body.state, true);
  }
  dfm_kin &kin() { return *static_cast<dfm_kin *>(kin_.data()); }
  const std::vector<double> &returned() const { return recorded_; }

  void run() {
    const dfm_model &ops = body_.ops;
    void *const self = body_.self;
    const uint32_t n = body_.points(), s = body_.solid.nsurfel();
    const std::vector<double> per_point(n, 0.0), per_surfel(3 * size_t(s), 0.0), w_of(9 * size_t(s), 0.0);
    const Numbers zero(body_.x.size(), 0.0);
    double *const end = body_.state.empty() ? nullptr : numbers("state_out", body_.state, false);
    double *const scalar = numbers("a result", {0.0}, false);
    double *const ksum = numbers("ksum", per_point, false), *const csum = numbers("csum", per_point, false);
    double *const f = points("f", zero, false);
    dfm_kin last = kin();
    last.state_out = end;
    kin_.lock();
    Fenced end_kin("dfm_kin", sizeof(dfm_kin), place_);
    *static_cast<dfm_kin *>(end_kin.data()) = last;
    end_kin.lock();
    const auto *const at_end = static_cast<const dfm_kin *>(end_kin.data());
    *scalar = 1e300;
    if (ops.bound) checked_call("bound", [&] { return ops.bound(self, &kin(), ksum, csum, scalar); });
    if (ops.add_forces) checked_call("add_forces", [&] { return ops.add_forces(self, at_end, f); });
    if (body_.can(DFM_CAP_ENERGY)) checked_call("energy", [&] { return ops.energy(self, &kin(), scalar); });
    record(scalar, 1);
    record_points(f);
    if (body_.can(DFM_CAP_STIFFNESS)) {
      uint32_t nb = 0;
      checked_call("pattern", [&] { return ops.pattern(self, &nb, nullptr); });
      Fenced pairs("the pattern", 2 * sizeof(uint32_t) * nb, place_);
      checked_call("pattern", [&] { return ops.pattern(self, &nb, static_cast<uint32_t *>(pairs.data())); });
      double *const blocks = numbers("blk", std::vector<double>(9 * size_t(nb), 0.0), false);
      checked_call("stiffness", [&] { return ops.stiffness(self, &kin(), 1, 1, blocks); });
      record(blocks, 9 * size_t(nb));
      spoilt("pattern", pairs, "the pattern");
    }
    if (body_.stepper) {
      const dfm_stepper &stepper = *body_.stepper;
      Fenced list("surfel", sizeof(uint32_t) * s, place_);
      std::memcpy(list.data(), body_.surfels().data(), sizeof(uint32_t) * s);
      list.lock();
      const auto *const which = static_cast<const uint32_t *>(list.data());
      const double *const load = points("f_ext", zero, true);
      const double *const p = numbers("p", std::vector<double>(3 * size_t(s), 1e-4), true);
      double *const u = numbers("u_s", per_surfel, false), *const du = numbers("du_s", per_surfel, false);
      double *const w = numbers("w", w_of, false);
      double *const x = points("x (output)", zero, false), *const v = points("v (output)", zero, false);
      checked_call("predict", [&] { return stepper.predict(self, &kin(), load, u); });
      checked_call("respond", [&] { return stepper.respond(self, &kin(), s, which, p, du); });
      checked_call("diagonal", [&] { return stepper.diagonal(self, &kin(), s, which, w); });
      checked_call("commit", [&] { return stepper.commit(self, at_end, p, x, v); });
      record(u, 3 * size_t(s));
      record(du, 3 * size_t(s));
      record_points(x);
      record_points(v);
    }
    look(f);
  }

 private:
  void spoilt(const char *name, const Fenced &array, const char *what) const {
    long offset = 0;
    if (array.spoilt(&offset))
      broken("%s writes %s %s (offset %ld bytes); loop to the number of points, and step by dfm_kin.stride",
             name, offset < 0 ? "before" : "past the end of", what, offset);
  }
  template <class F>
  void checked_call(const char *name, const F &call) {
    dfm_status status = DFM_OK;
    stage("%s at stride %u", name, body_.stride);
    const Kept kept(name);
    const std::string trouble = Fenced::guard([&] { status = call(); });
    body_.subject.plugin->host().release_scratch();
    if (!trouble.empty())
      broken(
          "at stride %u %s %s; loop to the number of points, step by dfm_kin.stride, write only outputs, and "
          "copy what it needs of the mesh in create",
          body_.stride, name, trouble.c_str());
    must_be_good(name, status);
    for (const auto &[what, array] : outputs_) spoilt(name, *array, what);
  }
  double *numbers(const char *name, const std::vector<double> &from, bool input) {
    auto array = std::make_unique<Fenced>(name, from.size() * sizeof(double), place_);
    double *const at = array->numbers();
    std::copy(from.begin(), from.end(), at);
    if (input) {
      array->lock();
      inputs_.push_back(std::move(array));
    } else {
      outputs_.emplace_back(name, std::move(array));
    }
    return at;
  }
  double *points(const char *name, const Numbers &from, bool input) {
    std::vector<double> padded(from.begin(), from.end());
    for (size_t i = 0; i < padded.size(); ++i)
      if (i % body_.stride > 2) padded[i] = kPadding;
    return numbers(name, padded, input);
  }
  void record(const double *from, size_t n) { recorded_.insert(recorded_.end(), from, from + n); }
  void record_points(const double *from) {
    for (uint32_t i = 0; i < body_.points(); ++i) record(from + size_t(body_.stride) * i, 3);
  }
  // Lanes beyond the third of the forces; those of new positions may be anything.
  void look(const double *f) const {
    for (uint32_t i = 0; i < body_.points(); ++i)
      for (uint32_t a = 3; a < body_.stride; ++a)
        if (f[size_t(body_.stride) * i + a] != kPadding)
          broken(
              "at stride %u add_forces writes number %u of point %u, which lies between two points; add "
              "three numbers for each point",
              body_.stride, a, i);
  }
  Body &body_;
  Fenced::Place place_;
  Fenced kin_;
  std::vector<std::unique_ptr<Fenced>> inputs_;
  std::vector<std::pair<const char *, std::unique_ptr<Fenced>>> outputs_;
  std::vector<double> recorded_;
};

// Arrays that a function adds to hold what others have added: that must still be in them.
template <class F>
void must_add(const Body &body, const char *name, const char *array, size_t n, const F &call) {
  Numbers alone(n, 0.0);
  body.must(name, [&] { return call(alone.data()); });
  const double most = largest(alone), there = most > 0 ? most : 1;
  Numbers sum(n, there);
  body.must(name, [&] { return call(sum.data()); });
  for (size_t i = 0; i < n; ++i)
    if (!(std::fabs(sum[i] - there - alone[i]) <= 1e-9 * there))
      broken(
          "number %zu of %s is %g after %s, and was %g before, where %s adds %g; add to what %s holds and do "
          "not replace it",
          i, array, sum[i], name, there, name, alone[i], array);
}

void keeps_what_others_added(Body &body) {
  const dfm_model &ops = body.ops;
  void *const self = body.self;
  const dfm_kin k = body.kin();
  const size_t n = body.points();
  if (ops.add_forces)
    must_add(body, "add_forces", "f", body.x.size(), [&](double *f) { return ops.add_forces(self, &k, f); });
  if (body.can(DFM_CAP_STIFFNESS)) {
    uint32_t nb = 0;
    body.must("pattern", [&] { return ops.pattern(self, &nb, nullptr); });
    must_add(body, "stiffness", "blk", 9 * size_t(nb),
             [&](double *blk) { return ops.stiffness(self, &k, 1, 1, blk); });
  }
  if (!ops.bound) return;
  double dt = 1e300;
  std::vector<double> other(n, 0.0);
  must_add(body, "bound", "ksum", n,
           [&](double *ksum) { return ops.bound(self, &k, ksum, other.data(), &dt); });
  must_add(body, "bound", "csum", n,
           [&](double *csum) { return ops.bound(self, &k, other.data(), csum, &dt); });
  const double least = 1e-30;
  dt = least;
  body.must("bound", [&] { return ops.bound(self, &k, other.data(), other.data(), &dt); });
  if (!(dt <= least))
    broken("bound sets *dt, which was %g s, to %g s; let it only fall: *dt = min(*dt, own limit)", least, dt);
}

}  // namespace

std::string model_stays_in_its_arrays(const Subject &subject) {
  return for_variants(subject, [&](const Variant &variant) {
    std::vector<double> first;
    for (const uint32_t stride : {4u, 3u, 5u, 8u})
      for (const Fenced::Place place : {Fenced::at_end, Fenced::at_start}) {
        Random random(subject.seed);
        Body body(subject, small_block(variant.cell), variant, stride);
        body.shake(0.01 * kCube, 0.01, random);
        FencedBody fenced(body, place);
        fenced.run();
        if (first.empty()) first = fenced.returned();
        if (std::memcmp(first.data(), fenced.returned().data(), first.size() * sizeof(double)) != 0)
          broken(
              "its results have other bits at stride %u than at stride 4; step by dfm_kin.stride, and "
              "read three numbers for each point",
              stride);
      }
    Random random(subject.seed);
    Body body(subject, small_block(variant.cell), variant);
    body.shake(0.01 * kCube, 0.01, random);
    keeps_what_others_added(body);
  });
}

// ---- V07, V08, V10 ----------------------------------------------------------------------------------------

std::string model_same_bits(const Subject &subject) {
  for_variants(subject, [&](const Variant &variant) {
    Random random(subject.seed);
    Body body(subject, small_block(variant.cell), variant),
        other(subject, small_block(variant.cell), variant);
    body.shake(0.01 * kCube, 0.01, random);
    other.x = body.x;
    other.v = body.v;
    StepCalls first(body), again(body), elsewhere(other);
    const auto checked_call = [](Body &of, StepCalls &calls) {
      calls.each([&](const char *name, const auto &call) { must_be_good(name, of.call(name, call)); });
    };
    checked_call(body, first);
    checked_call(body, again);
    checked_call(other, elsewhere);
    const auto compare = [&](StepCalls &with_that, const char *what, const char *remedy) {
      const auto equal = [](const auto &a, const auto &b) {
        return a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
      };
      if (!equal(first.f, with_that.f) || !equal(first.ksum, with_that.ksum) ||
          !equal(first.csum, with_that.csum) || !equal(first.u, with_that.u) ||
          !equal(first.blocks, with_that.blocks) || first.joule != with_that.joule ||
          !equal(first.x_end, with_that.x_end) || !equal(first.v_end, with_that.v_end) ||
          !equal(first.next, with_that.next) || !equal(first.du, with_that.du) ||
          !equal(first.w, with_that.w))
        broken("the same state gives other bits %s; %s", what, remedy);
    };
    compare(again, "the second time", "keep nothing between calls but state slots");
    compare(elsewhere, "in another instance of the same body", "set everything in create, and share nothing");
  });
  stage("a second process is asked for the same steps");
  return same_elsewhere(subject, digest_of_model(subject), "model", "steps");
}

std::string bad_point_returns(const Subject &subject) {
  return for_variants(subject, [&](const Variant &variant) {
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e200})
      for (const bool place : {true, false}) {
        Body body(subject, small_block(variant.cell), variant);
        StepCalls step(body);
        (place ? body.x : body.v)[size_t(body.stride) * 7 + 1] = bad;
        stage("%s, point 7 has %s %g", with(variant).c_str(), place ? "position" : "velocity", bad);
        bool finite = true, refused = false;
        step.each([&](const char *name, const auto &call) { refused |= body.call(name, call) != DFM_OK; });
        for (const Numbers *out : {&step.f, &step.x_end, &step.v_end})
          for (const double a : *out) finite = finite && std::isfinite(a);
        if (std::isnan(bad) && place && finite && !refused)
          broken("a position that is NaN gives finite results; return a NaN, or DFM_DISCARD");
      }
  });
}

void use_model(const Subject &subject) {
  if (!takes_solids(subject)) return;
  Random random(subject.seed);
  Body body(subject, block(1, 1, 1), defaults_of(subject), 4, Body::Refusal::is_reported);
  if (!body.made()) return;
  body.shake(0.01 * kCube, 0.01, random);
  StepCalls step(body);
  for (int round = 0; round < 2; ++round) {
    if (round == 1) body.x[9] = std::numeric_limits<double>::quiet_NaN();
    step.each([&](const char *name, const auto &call) { body.call(name, call); });
  }
}

std::string instances_share_nothing(const Subject &subject) {
  needs_sanitizer();
  constexpr size_t kThreads = 4;
  std::vector<std::unique_ptr<Body>> bodies, alone;
  const Variant defaults = variants(subject).front();
  for (size_t t = 0; t < kThreads; ++t)
    for (auto *to : {&bodies, &alone}) {
      Random random(subject.seed + t);
      to->push_back(std::make_unique<Body>(subject, small_block(), defaults));
      to->back()->shake(0.01 * kCube, 0.01, random);
    }
  const auto work = [](Body &body) {
    for (int i = 0; i < 5; ++i) body.advance(1e-4);
  };
  std::vector<std::thread> threads;
  for (const auto &body : bodies) threads.emplace_back(work, std::ref(*body));
  for (std::thread &t : threads) t.join();
  for (const auto &body : alone) work(*body);
  for (size_t t = 0; t < kThreads; ++t)
    if (std::memcmp(bodies[t]->x.data(), alone[t]->x.data(), alone[t]->x.size() * sizeof(double)) != 0)
      broken(
          "%zu bodies stepped at the same time give other results than one after the other, so they share "
          "data; keep it in the instance, or in state slots",
          kThreads);
  return text("%zu instances at once", kThreads);
}

}  // namespace cli::check
