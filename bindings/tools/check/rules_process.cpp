// V05, V06, V09, V10: what a plugin does to the process it runs in.
#include <cmath>
#include <cstring>
#include <limits>
#include <thread>

#include "check/environment.h"
#include "check/groups.h"
#include "check/image.h"
#include "check/law.h"
#include "check/runner.h"
#include "check/watch.h"

namespace cli::check {
namespace {

// Lanes of every kind: at rest, sliding, open, pressed; repeated evaluations make their states grow.
void vary(Lanes &b, Random &random, double scale) {
  for (uint32_t i = 0; i < b.n; ++i) {
    const double w = i % 5 == 0 ? 0 : scale * random.logarithmic(1e-6, 10);
    const double heading = random.uniform(0, kTurn);
    if (b.law.needs(DFM_NEED_FN)) b.fn[i] = i % 9 == 0 ? 0 : random.logarithmic(1e-3, 1e5);
    b.slip(i, w * std::cos(heading), w * std::sin(heading));
  }
}

}  // namespace

// ---- V05 --------------------------------------------------------------------------------------------------

std::string spelt(const std::string &name) {
  if (name.rfind("_Zn", 0) == 0) return "operator new";
  if (name.rfind("_Zd", 0) == 0) return "operator delete";
  return name == "__cxa_allocate_exception" ? "throw" : name;
}
void needs_sanitizer() {
  if (!is_sanitized())
    skip(
        "this deform is not built with a sanitizer; build it by `cmake --preset asan` or `tsan`, and the "
        "plugin by the same compiler and -fsanitize");
}

std::string eval_keeps_to_itself(const Subject &subject) {
  const Law law(subject, lively_params(subject));
  Watch watch;
  Random random(subject.seed);
  uint32_t calls = 0;
  // The very first call too: tables that are made at first use are made in a step.
  for (const uint32_t n : {8u, 1u, 1000u})
    for (const double h : {1e-3, 1e-6, 1.0 / 30})
      for (int round = 0; round < 4; ++round) {
        Lanes b(law, n);
        vary(b, random, 1);
        // the way out of trouble counts too
        if (round == 3) b.vt[0] = b.fn[0] = std::numeric_limits<double>::quiet_NaN();
        stage("batch of %u contacts, step %g s", n, h);
        b.in.dt = h;
        const Kept kept("eval");
        const char *name = watch.run([&] { law.ops.eval(&b.in, &b.out); });
        subject.plugin->host().release_scratch();
        if (name)
          broken(
              "eval calls %s; use dfm_host.scratch for memory, make tables in prepare, and do not use files, "
              "environment, clock or random numbers",
              spelt(name).c_str());
        ++calls;
      }
  return text("%u calls, %zu entries watched", calls, watch.entries());
}

// ---- V06 --------------------------------------------------------------------------------------------------

namespace {

// A batch each of whose arrays lies between fences. Filled from ordinary lanes, so that all else is equal.
class FencedBatch {
 public:
  FencedBatch(const Law &law, Lanes &lanes, Fenced::Place place)
      : lanes_(lanes),
        in_("dfm_friction_in", sizeof(dfm_friction_in), place),
        out_("dfm_friction_out", sizeof(dfm_friction_out), place) {
    in() = lanes.in;
    out() = lanes.out;
    in().dt = 1e-3;
    params_ = std::make_unique<Fenced>("params", law.params.size() * sizeof(double), place);
    std::copy(law.params.begin(), law.params.end(), params_->numbers());
    in().params = params_->numbers();
    const struct {
      const char *name;
      const double **column;
      uint32_t width;
    } inputs[] = {{"fn", &in().fn, 1},           {"vt", &in().vt, 2},
                  {"ft_stop", &in().ft_stop, 2}, {"area", &in().area, 1},
                  {"dwell", &in().dwell, 1},     {"state (input)", &in().state, law.nstate}};
    for (const auto &i : inputs) {
      if (!*i.column) continue;
      inputs_.push_back(std::make_unique<Fenced>(i.name, bytes(i.width), place));
      std::copy_n(*i.column, size_t(i.width) * lanes.stride, inputs_.back()->numbers());
      *i.column = inputs_.back()->numbers();
    }
    output(out().ft, "ft", 2, place);
    output(out().state, "state (output)", law.nstate, place);
    output(out().dft_dvt, "dft_dvt", 4, place);
    output(out().dft_dfn, "dft_dfn", 2, place);
    output(out().limit, "limit", 1, place);
    output(out().stored, "stored", 1, place);
    outputs_.push_back(
        {"mode",
         std::make_unique<Fenced>("mode", lanes.stride, lanes.stride % 64 == 0 ? place : Fenced::at_start), 1,
         1});
    out().mode = static_cast<uint8_t *>(outputs_.back().array->data());
    for (auto &o : outputs_) std::memset(o.array->data(), kPaint, o.bytes * o.width * lanes.stride);
    for (auto &i : inputs_) i->lock();
    params_->lock();
    in_.lock();
    out_.lock();
  }
  dfm_friction_in &in() { return *static_cast<dfm_friction_in *>(in_.data()); }
  dfm_friction_out &out() { return *static_cast<dfm_friction_out *>(out_.data()); }
  // Bytes changed outside of what eval may write, around and between columns, and lanes not written.
  void look() const {
    long offset = 0;
    const size_t lanes = (lanes_.n + 7) & ~7u;
    for (const auto &o : outputs_) {
      if (o.array->spoilt(&offset))
        broken("eval writes %s array %s (offset %ld bytes); loop to in->n and step columns by in->stride",
               offset < 0 ? "before the" : "past the end of the", o.name, offset);
      const unsigned char *p = static_cast<const unsigned char *>(o.array->data());
      for (size_t c = 0; c < o.width; ++c)
        for (size_t i = lanes * o.bytes; i < lanes_.stride * o.bytes; ++i)
          if (p[c * lanes_.stride * o.bytes + i] != kPaint)
            broken(
                "eval writes lane %zu of %s, column %zu, in a batch of %u, beyond n rounded up to 8; loop to "
                "in->n",
                i / o.bytes, o.name, c, lanes_.n);
      for (size_t c = 0; c < o.width; ++c)
        for (size_t i = 0; i < lanes_.n; ++i) {
          const unsigned char *const lane = p + (c * lanes_.stride + i) * o.bytes;
          if (std::all_of(lane, lane + o.bytes, [](unsigned char byte) { return byte == kPaint; }))
            broken(
                "eval leaves lane %zu of %s, column %zu, as it was, so the host would read what lies there; "
                "write every output whose pointer is not NULL",
                i, o.name, c);
        }
    }
  }

 private:
  struct Output {
    const char *name;
    std::unique_ptr<Fenced> array;
    size_t width, bytes;
  };
  static constexpr unsigned char kPaint = 0x5c;
  size_t bytes(uint32_t width) const { return size_t(width) * lanes_.stride * sizeof(double); }
  void output(double *&column, const char *name, uint32_t width, Fenced::Place place) {
    if (!column) return;
    outputs_.push_back({name, std::make_unique<Fenced>(name, bytes(width), place), width, sizeof(double)});
    column = outputs_.back().array->numbers();
  }
  Lanes &lanes_;
  Fenced in_, out_;
  std::unique_ptr<Fenced> params_;
  std::vector<std::unique_ptr<Fenced>> inputs_;
  std::vector<Output> outputs_;
};

void evaluate_fenced(const Law &law, Lanes &lanes, Fenced::Place place) {
  FencedBatch batch(law, lanes, place);
  dfm_status status = DFM_OK;
  stage("batch of %u contacts, stride %u", lanes.n, lanes.stride);
  const Kept kept("eval");
  const std::string trouble = Fenced::guard([&] { status = law.ops.eval(&batch.in(), &batch.out()); });
  law.subject.plugin->host().release_scratch();
  if (!trouble.empty())
    broken(
        "in a batch of %u contacts (stride %u) eval %s; loop to in->n, step columns by in->stride, and "
        "declare the inputs (needs), parameters and state slots that it uses",
        lanes.n, lanes.stride, trouble.c_str());
  if (status != DFM_OK)
    broken("eval returns %s for finite input; return finite values for every finite input",
           dfm_status_name(status));
  batch.look();
}

// Every output may be NULL: alone, or all but one. An output must not depend on which others are requested.
void evaluate_with_nulls(const Law &law, Lanes &whole) {
  const char *names[] = {"ft", "state", "dft_dvt", "dft_dfn", "limit", "mode", "stored"};
  for (int k = 0; k < 14; ++k) {
    const int one = k % 7;
    const bool alone = k >= 7;
    Lanes b(law, whole.n);
    for (uint32_t i = 0; i < b.n; ++i) b.take(i, whole, i);
    const auto wanted = [&](int which) { return alone ? which == one : which != one; };
    dfm_friction_out &out = b.out;
    if (!wanted(0)) out.ft = nullptr;
    if (!wanted(1)) out.state = nullptr;
    if (!wanted(2)) out.dft_dvt = nullptr;
    if (!wanted(3)) out.dft_dfn = nullptr;
    if (!wanted(4)) out.limit = nullptr;
    if (!wanted(5)) out.mode = nullptr;
    if (!wanted(6)) out.stored = nullptr;
    b.in.dt = 1e-3;
    stage("%s %s", alone ? "nothing is wanted but" : "not wanted:", names[one]);
    dfm_status status = DFM_OK;
    const Kept kept("eval");
    const std::string trouble = Fenced::guard([&] { status = law.ops.eval(&b.in, &out); });
    law.subject.plugin->host().release_scratch();
    if (!trouble.empty() || status != DFM_OK)
      broken("with %s%s eval %s; check each pointer for NULL before writing",
             alone ? "every output NULL but " : "the output NULL: ", names[one],
             trouble.empty() ? dfm_status_name(status) : trouble.c_str());
    for (uint32_t i = 0; i < b.n; ++i)
      if (!b.same(i, whole, i))
        broken(
            "with %s%s the outputs of lane %u differ from those where all are wanted; let no output "
            "depend on which others are requested",
            alone ? "nothing wanted but " : "no ", names[one], i);
  }
}

}  // namespace

std::string stays_in_its_arrays(const Subject &subject) {
  const Law law(subject, lively_params(subject));
  Random random(subject.seed);
  for (const uint32_t n : {64u, 61u, 1u, 8u, 13u})
    for (const uint32_t gap : {0u, 64u})
      for (const Fenced::Place place : {Fenced::at_end, Fenced::at_start}) {
        Lanes lanes(law, n, gap);
        vary(lanes, random, 1e-3);
        evaluate_fenced(law, lanes, place);
      }
  Lanes whole(law, 13);
  vary(whole, random, 1e-3);
  whole.must(1e-3);
  evaluate_with_nulls(law, whole);
  return "";
}

// ---- V09 --------------------------------------------------------------------------------------------------

namespace {

void load_and_unload(const Subject &subject) {
  Plugin plugin(subject.file);
  for (const dfm_type *type : plugin.types()) {
    if (type->kind == DFM_KIND_SOLVER) continue;
    Subject one = subject;
    one.plugin = &plugin;
    one.type = type;
    if (type->kind == DFM_KIND_MODEL) {
      use_model(one);
      continue;
    }
    const Law law(one, default_params(*type));
    Lanes b(law, 8);
    for (uint32_t i = 0; i < b.n && law.needs(DFM_NEED_FN); ++i) b.fn[i] = 1;
    for (uint32_t i = 0; i < b.n; ++i) b.slip(i, 1e-3 * i, 0);
    b.must(1e-3);
    b.commit();
    b.must(1e-3);
  }
  plugin.close();
  if (const size_t n = plugin.host().pieces())
    broken(
        "after it was unloaded %zu piece%s of the host's memory %s still allocated; free them in release() "
        "or shutdown()",
        n, n == 1 ? "" : "s", n == 1 ? "is" : "are");
  if (plugin.host().not_lent())
    broken(
        "it gave dfm_host.release a piece that it had released before, or that is not the host's; release "
        "each piece once");
}

}  // namespace

std::string unloads_without_leak(const Subject &subject) {
  if (!subject.plugin) skip("it does not load (V02)");
  // the one opened to look at it would keep it in memory
  subject.plugin->close();
  constexpr int kCycles = 100;
  // bytes: less than one piece in each cycle is the C library's own housekeeping
  constexpr long kSmallestPiece = 24;
  // What is allocated once (caches of libc, the linker) is no leak: both halves after warm-up must grow.
  Use at[3] = {};
  for (int i = 0, mark = 0; i <= kCycles; ++i) {
    if (i == 20 || i == 60 || i == 100) at[mark++] = in_use();
    if (i == kCycles) break;
    stage("load-unload cycle %d", i + 1);
    load_and_unload(subject);
  }
  const auto each = [&](long Use::*what) {
    return std::min(at[1].*what - at[0].*what, at[2].*what - at[1].*what) / 40;
  };
  if (const long left = each(&Use::heap); left >= kSmallestPiece)
    broken(
        "each load-unload cycle leaves %ld bytes on the heap; free in shutdown() what the entry or prepare() "
        "allocated",
        left);
  if (const long left = each(&Use::pages); left > 0)
    broken("each load-unload cycle leaves %ld pages mapped; unmap in shutdown()", left);
  if (each(&Use::files) > 0) broken("each load-unload cycle leaves a file open; close in shutdown()");
  if (image_stays(subject.file))
    broken(
        "it stays in memory after it was unloaded; build it with deform_add_plugin (unique C++ symbols and "
        "-z nodelete keep a library)");
  return text("%d cycles", kCycles);
}

// ---- V10 --------------------------------------------------------------------------------------------------

std::string sanitizer_finds_nothing(const Subject &subject) {
  needs_sanitizer();
  const Law law(subject, lively_params(subject));
  constexpr int kThreads = 4;
  constexpr int kRounds = 20;
  // Each thread has batches of its own; params and data are shared, as in a world.
  std::vector<std::vector<double>> returned(kThreads), alone(kThreads);
  const auto work = [&](int t, std::vector<double> &out) {
    Random random(subject.seed + static_cast<uint64_t>(t));
    Lanes b(law, 97);
    for (int k = 0; k < kRounds; ++k) {
      vary(b, random, 1e-2);
      b.in.dt = 1e-3;
      {
        const Kept kept("eval");
        law.ops.eval(&b.in, &b.out);
      }
      b.commit();
      for (uint32_t i = 0; i < b.n; ++i) out.push_back(b.out_ft[i]);
    }
  };
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) threads.emplace_back(work, t, std::ref(returned[t]));
  for (std::thread &t : threads) t.join();
  for (int t = 0; t < kThreads; ++t) {
    work(t, alone[t]);
    if (std::memcmp(returned[t].data(), alone[t].data(), returned[t].size() * sizeof(double)) != 0)
      broken(
          "evaluated on %d threads at once it gives other forces than on one, so batches share data; keep it "
          "in state slots, or in what prepare() makes and eval only reads",
          kThreads);
  }
  return text("%d threads", kThreads);
}

// ---- V14 --------------------------------------------------------------------------------------------------

void keeps_statics(const Subject &subject, const char *name, const void *inside, const char *remedy,
                   const std::function<void()> &call) {
  const void *at = nullptr;
  uintptr_t base = 0;
  bool ours = false;
  std::string trouble;
  {
    const Kept kept(name);
    const StaticsLocked statics(inside);
    base = statics.base;
    trouble = Fenced::guard(call, &at);
    ours = statics.hold(at);
  }
  subject.plugin->host().release_scratch();
  if (trouble.empty()) return;
  if (!ours) broken("%s %s; touch only the arrays that are given", name, trouble.c_str());
  const uintptr_t offset = reinterpret_cast<uintptr_t>(at) - base;
  const std::string variable = variable_at(subject.file, offset);
  broken("%s writes the static variable %s, %s", name,
         variable.empty() ? text("at %#zx of the file", offset).c_str() : ("\"" + variable + "\"").c_str(),
         remedy);
}

// Tables made at the first call are there by then; what is written after that is memory between calls, or
// between threads. Thread-local variables are not seen.
std::string writes_no_static(const Subject &subject) {
  const Law law(subject, lively_params(subject));
  Random random(subject.seed);
  const auto once = [&](uint32_t n, bool locked) {
    Lanes b(law, n);
    vary(b, random, 1e-2);
    b.in.dt = 1e-3;
    if (!locked) return static_cast<void>(b.must(1e-3));
    stage("batch of %u contacts, static variables read only", n);
    keeps_statics(subject, "eval", reinterpret_cast<const void *>(law.ops.eval),
                  "which threads and worlds share; keep it in a state slot, or on the stack",
                  [&] { law.ops.eval(&b.in, &b.out); });
  };
  for (const bool locked : {false, true})
    for (const uint32_t n : {8u, 1u, 1000u}) once(n, locked);
  return "";
}

}  // namespace cli::check
