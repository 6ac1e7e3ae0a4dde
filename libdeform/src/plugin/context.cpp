#include "plugin/context.h"

#include <bit>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>

#include "core/error.h"
#include "core/system.h"
#include "deform/plugin_draft.h"
#include "math/ldlt_solver.h"
#include "plugin/on_behalf.h"
#include "plugin/quiet.h"

namespace dfm {
namespace {

// Panels of right-hand sides that are processed at a time: two per thread, for this many threads.
constexpr uint32_t kThreads = 4;

// The library's solver as a service for plugins: it uses the memory and threads of the given host.
struct Direct {
  const dfm_host &host;
  Memory memory;
  Tasks tasks;
  LdltSolver solver;

  explicit Direct(const dfm_host &h)
      : host(h),
        memory{h.ctx, h.alloc, h.release},
        tasks(h.parallel_for ? kThreads : 1, h.parallel_for, h.ctx),
        solver(memory, h.parallel_for ? &tasks : nullptr) {}
};

Direct &direct(void *self) { return *static_cast<Direct *>(self); }

// Runs f; turns an exception into a status and a line in the log of the host.
template <class F>
dfm_status guarded(const dfm_host &host, F &&f) noexcept {
  try {
    return f();
  } catch (const std::bad_alloc &) {
    return DFM_E_NOMEM;
  } catch (const Error &e) {
    host.log(host.ctx, 3, 0, e.what());
    return e.status;
  } catch (...) {
    return DFM_E_FATAL;
  }
}

dfm_status analyse_at(const dfm_host *h, uint32_t n, uint32_t nb, const uint32_t *ij, const double *places,
                      void **self) {
  return guarded(*h, [&] {
    auto made = std::make_unique<Direct>(*h);
    if (places) made->solver.analyse({n, nb, ij}, places);
    else made->solver.analyse({n, nb, ij});
    *self = made.release();
    return DFM_OK;
  });
}

dfm_status analyse(const dfm_host *h, uint32_t n, uint32_t nb, const uint32_t *ij, void **self) {
  return analyse_at(h, n, nb, ij, nullptr, self);
}

dfm_status factor(void *self, const double *blk) {
  return guarded(direct(self).host, [&] { return direct(self).solver.factor(blk) ? DFM_OK : DFM_DISCARD; });
}

dfm_status solve(void *self, uint32_t nrhs, const double *b, double *x, double) {
  SolveInfo info;
  return guarded(direct(self).host,
                 [&] { return direct(self).solver.solve(nrhs, b, x, 0, info) ? DFM_OK : DFM_DISCARD; });
}

void release(void *self) { delete &direct(self); }

dfm_status inverse_at(void *self, uint32_t nsel, const uint32_t *sel, double *w) {
  return guarded(direct(self).host,
                 [&] { return direct(self).solver.restricted(nsel, sel, w) ? DFM_OK : DFM_DISCARD; });
}

constexpr dfm_solver kSolver = {sizeof(dfm_solver), DFM_SOLVER_DIRECT, analyse, factor, solve, release};
constexpr dfm_direct kDirect = {sizeof(dfm_direct), 0, &kSolver, analyse_at, inverse_at};

}  // namespace
}  // namespace dfm

namespace {

dfm_context &self(void *ctx) { return *static_cast<dfm_context *>(ctx); }

void *host_alloc(void *ctx, size_t bytes, size_t align) {
  if (!std::has_single_bit(align) || bytes > SIZE_MAX - align) return nullptr;
  const dfm::Memory &memory = self(ctx).memory;
  return memory.alloc(memory.user, bytes, align);
}

void host_release(void *ctx, void *p, size_t bytes, size_t align) {
  const dfm::Memory &memory = self(ctx).memory;
  if (p) memory.release(memory.user, p, bytes, align);
}

// Outside a PluginCall (on a thread of the plugin) each piece replaces the previous one, so that memory stays
// bounded.
void *host_scratch(void *ctx, size_t bytes) {
  dfm::ScratchArena *arena = self(ctx).scratch.arena();
  if (!arena) return nullptr;
  if (arena->depth == 0) arena->reset(0);
  return arena->take(bytes);
}

void host_log(void *ctx, int32_t level, uint32_t code, const char *utf8) {
  dfm::Loader::note_log(utf8);
  if (level >= DFM_LOG_ERROR && dfm::Overheard::take(utf8)) return;
  const char *const text = utf8 ? utf8 : "";
  const std::string *const body = dfm::OnBehalf::body();
  if (body && code) self(ctx).logf(level, "body '%s': [%u] %s", body->c_str(), code, text);
  else if (body) self(ctx).logf(level, "body '%s': %s", body->c_str(), text);
  else if (code) self(ctx).logf(level, "[%u] %s", code, text);
  else self(ctx).log(level, text);
}

void host_parallel_for(void *ctx, uint32_t n, uint32_t grain, void (*fn)(void *, uint32_t, uint32_t),
                       void *user) {
  dfm_context &context = self(ctx);
  const dfm::Running caller = dfm::running;
  context.tasks.parallel_for(n, grain, [&](uint32_t begin, uint32_t end) {
    // scratch memory of a worker is returned at the end of its block
    const dfm::PluginCall call(context.scratch);
    const dfm::Boundary boundary(caller.who, caller.what);
    fn(user, begin, end);
  });
}

const void *host_extension(void *, const char *id) {
  return id && std::strcmp(id, DFM_HOST_DIRECT) == 0 ? &dfm::kDirect : nullptr;
}

dfm::Memory memory_of(const dfm_context_def &def) {
  return def.alloc ? dfm::Memory{def.user, def.alloc, def.release} : dfm::Memory::standard();
}

}  // namespace

dfm_context::dfm_context(const dfm_context_def &def)
    : hooks(def),
      memory(memory_of(def)),
      tasks(def.threads, def.parallel_for, def.user),
      scratch(memory),
      host{},
      loader(registry, host) {
  host.size = sizeof host;
  host.abi = DFM_ABI;
  host.abi_draft = DFM_ABI_DRAFT;
  host.abi_min = DFM_ABI_MIN;
  host.ctx = this;
  host.alloc = host_alloc;
  host.release = host_release;
  host.scratch = host_scratch;
  host.log = host_log;
  host.parallel_for = host_parallel_for;
  host.extension = host_extension;
}

dfm_context::~dfm_context() {
  for (;;) {
    std::pair<uint64_t, void (*)(uint64_t)> last;
    {
      const std::lock_guard lock(live_mutex_);
      if (live_.empty()) return;
      last = live_.back();
      live_.pop_back();
    }
    last.second(last.first);
  }
}

void dfm_context::log(int32_t level, const char *utf8) const noexcept {
  if (dfm::Quiet::drops(level)) return;
  if (hooks.log) {
    try {
      hooks.log(hooks.user, level, utf8);
    } catch (...) {
      // a C++ hook ran out of memory: its message is lost, the caller's work continues
    }
  } else if (level >= DFM_LOG_WARNING) {
    std::fprintf(stderr, "deform: %s: %s\n", level >= DFM_LOG_ERROR ? "error" : "warning", utf8);
  }
}

void dfm_context::logf(int32_t level, const char *format, ...) const noexcept {
  va_list args;
  va_start(args, format);
  log_line(level, nullptr, format, args);
  va_end(args);
}

void dfm_context::warn(const char *format, ...) const noexcept {
  va_list args;
  va_start(args, format);
  log_line(DFM_LOG_WARNING, nullptr, format, args);
  va_end(args);
}

void dfm_context::warn(const dfm::Named &whose, const char *sentence, ...) const noexcept {
  va_list args;
  va_start(args, sentence);
  log_line(DFM_LOG_WARNING, &whose, sentence, args);
  va_end(args);
}

void dfm_context::log_line(int32_t level, const dfm::Named *whose, const char *format,
                           va_list args) const noexcept {
  char text[1024] = "";
  if (whose) std::snprintf(text, sizeof text, "%s '%s'", whose->kind, whose->name);
  const size_t before = std::strlen(text);
  dfm::os::print(text + before, sizeof text - before, format, args);
  char line[sizeof text];
  dfm::printable(text, line, sizeof line);
  log(level, line);
}

void dfm_context::add_live(uint64_t handle, void (*destroy)(uint64_t)) {
  const std::lock_guard lock(live_mutex_);
  live_.emplace_back(handle, destroy);
}

void dfm_context::remove_live(uint64_t handle) noexcept {
  const std::lock_guard lock(live_mutex_);
  for (size_t i = live_.size(); i-- > 0;)
    if (live_[i].first == handle) {
      live_.erase(live_.begin() + static_cast<std::ptrdiff_t>(i));
      return;
    }
}

namespace dfm {

thread_local Overheard *Overheard::now_ = nullptr;
thread_local bool Quiet::now_ = false;
thread_local const std::string *OnBehalf::now_ = nullptr;

bool Overheard::take(const char *text) noexcept {
  if (!now_) return false;
  if (now_->text_[0] || !text) return true;
  std::snprintf(now_->text_, sizeof now_->text_, "%s", text);
  const size_t n = std::strlen(now_->text_);
  if (n > 0 && now_->text_[n - 1] == '.') now_->text_[n - 1] = 0;
  return true;
}

}  // namespace dfm
