// What every subcommand and the viewer use: global options, the context, warnings and errors.
#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "cli.h"
#ifdef DEFORM_HAVE_BULLET
#include "bullet_host.h"
#endif
#ifdef DEFORM_HAVE_ODE
#include "deform/ode_host.h"
#endif
#include "leaving.h"
#include "messages.h"

namespace cli {
namespace {

Globals globals;
std::vector<std::string> kept_warnings;

void on_log(void *, int32_t level, const char *utf8) {
  if (level < DFM_LOG_WARNING) return;
  if (level == DFM_LOG_WARNING) {
    // Once each: `--save-scene` loads what it has written, and steps may find the same overlap again.
    if (std::ranges::find(kept_warnings, utf8) != kept_warnings.end()) return;
    kept_warnings.push_back(utf8);
  }
  if (!globals.quiet || level > DFM_LOG_WARNING)
    std::fprintf(stderr, "deform: %s: %s\n", level == DFM_LOG_WARNING ? "warning" : "error",
                 shown(utf8).c_str());
}

size_t edit_distance(const std::string &a, const std::string &b) {
  std::vector<size_t> row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] != b[j - 1])});
      diagonal = above;
    }
  }
  return row[b.size()];
}

dfm_context *offered = nullptr;

}  // namespace

Globals &session_globals() { return globals; }

std::string nearest(const std::string &word, const std::vector<std::string> &valid) {
  std::string best;
  size_t least = std::max<size_t>(2, word.size() / 3) + 1;
  for (const std::string &name : valid)
    if (const size_t d = edit_distance(word, name); d < least) {
      least = d;
      best = name;
    }
  return best;
}

std::string did_you_mean(const std::string &word, const std::vector<std::string> &valid) {
  const std::string near = nearest(word, valid);
  return near.empty() ? "" : "; did you mean \"" + near + "\"?";
}

std::string formatted(const char *format, ...) {
  va_list values, again;
  va_start(values, format);
  va_copy(again, values);
  std::string out(size_t(std::vsnprintf(nullptr, 0, format, values)), '\0');
  std::vsnprintf(out.data(), out.size() + 1, format, again);
  va_end(again);
  va_end(values);
  return out;
}

int fail(const std::string &sentence) {
  std::fflush(stdout);
  std::fprintf(stderr, "deform: %s\n", shown(sentence).c_str());
  return kBadInput;
}

const std::vector<std::string> &warnings() { return kept_warnings; }

void keep_warning(const std::string &sentence) { kept_warnings.push_back(sentence); }

const char *kind_name(uint32_t kind) {
  return kind == DFM_KIND_FRICTION ? "law" : kind == DFM_KIND_SOLVER ? "solver" : "model";
}

void warn(const std::string &sentence) { on_log(nullptr, DFM_LOG_WARNING, sentence.c_str()); }

void offer_context(dfm_context *context) { offered = context; }

dfm_context *make_context(const Globals &g) {
  if (dfm_context *const ready = std::exchange(offered, nullptr)) return ready;
  dfm_context_def def = dfm_context_def_default();
  def.threads = g.threads;
  def.log = on_log;
  dfm_context *context = nullptr;
  if (dfm_context_create(&def, &context) < 0) std::exit(leave(fail(dfm_last_error())));
#ifdef DEFORM_HAVE_BULLET
  register_bullet();
#endif
#ifdef DEFORM_HAVE_ODE
  if (dfm_ode_register() != DFM_OK) on_log(nullptr, DFM_LOG_WARNING, dfm_last_error());
#endif
  return context;
}

}  // namespace cli
