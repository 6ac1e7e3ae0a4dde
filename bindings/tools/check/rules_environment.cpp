// V11, V12: what a plugin leaves changed in the thread that calls it and in the process.
#include <chrono>
#include <limits>
#include <thread>

#include "check/environment.h"
#include "check/groups.h"
#include "check/law.h"
#include "check/runner.h"

namespace cli::check {
namespace {

// All calls of a law that a world makes, a NaN included: the way out of trouble counts too.
void use(const Subject &subject) {
  refusal(law_of(subject), default_params(*subject.type));
  const Law law(subject, lively_params(subject));
  for (const uint32_t n : {8u, 1u, 100u})
    for (int round = 0; round < 3; ++round) {
      Lanes b(law, n);
      for (uint32_t i = 0; i < n; ++i) {
        if (law.needs(DFM_NEED_FN)) b.fn[i] = i % 4;
        b.slip(i, round * 1e-3 * i, 1e-4 * i);
      }
      if (round == 2) b.fn[0] = b.vt[0] = std::numeric_limits<double>::quiet_NaN();
      b.evaluate(1e-3);
    }
}

}  // namespace

std::string keeps_rounding(const Subject &subject) {
  if (subject.type->kind == DFM_KIND_FRICTION) use(subject);
  if (subject.type->kind == DFM_KIND_MODEL) use_model(subject);
  if (const std::string &left = left_changed(); !left.empty())
    broken("%s; restore what you change (fegetenv, fesetenv)", left.c_str());
  return "";
}

std::string keeps_process(const Subject &subject) {
  std::string printed[2], changed;
  int threads = Process::threads();
  {
    const Captured streams;
    const Process before = Process::now();
    const auto look = [&](const char *when) {
      if (const std::string what = before.difference(Process::now()); changed.empty() && !what.empty())
        changed = std::string(when) + " " + what;
    };
    try {
      Plugin plugin(subject.file);
      look("loading it");
      for (uint32_t i = 0; i < plugin.types().size() && changed.empty(); ++i) {
        if (plugin.types()[i]->kind == DFM_KIND_SOLVER) continue;
        Subject one = subject;
        one.plugin = &plugin;
        one.index = i;
        one.type = plugin.types()[i];
        stage("its type #%u is used", i);
        one.type->kind == DFM_KIND_MODEL ? use_model(one) : use(one);
        look("using it");
      }
      stage("it is unloaded");
      plugin.close();
      look("unloading it");
    } catch (const Broken &) {
      skip("it does not load or answer (other rules say why)");
    }
    // what is about to end may
    for (int wait = 0; wait < 100 && Process::threads() > threads; ++wait)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    threads = Process::threads() - threads;
    for (int k = 0; k < 2; ++k) printed[k] = streams.text(k + 1);
  }
  if (!changed.empty()) broken("%s", changed.c_str());
  for (int k = 0; k < 2; ++k)
    if (!printed[k].empty())
      broken("it writes to standard %s (\"%s\"); use dfm_host.log", k == 0 ? "output" : "error",
             printed[k].substr(0, std::min<size_t>(printed[k].find('\n'), 60)).c_str());
  if (threads > 0)
    broken(
        "%d thread%s of it still run%s after it was unloaded: %s next instruction may be gone; join them in "
        "shutdown()",
        threads, threads == 1 ? "" : "s", threads == 1 ? "s" : "", threads == 1 ? "its" : "their");
  return "";
}

}  // namespace cli::check
