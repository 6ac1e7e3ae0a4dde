#include "check/environment.h"

#include <unistd.h>

#include <algorithm>
#include <cfloat>
#include <cstdio>

#include "check/check.h"

namespace cli::check {
namespace {

thread_local std::string first_left;

}  // namespace

// ---- floating-point environment ---------------------------------------------------------------------------

Kept::Settings Kept::settings() {
  volatile double least = DBL_MIN, small = DBL_MIN / 4;
  const bool denormals = least / 4 > 0 && small * 4 > 0;  // neither results nor operands are flushed
  return {std::fegetround(), unmasked_exceptions(), denormals};
}

Kept::Kept(const char *call) : call_(call), before_(settings()) { std::fegetenv(&environment_); }

Kept::~Kept() {
  const Settings after = settings();
  const char *changed = after.rounding != before_.rounding     ? "the rounding mode"
                        : after.denormals != before_.denormals ? "how denormal numbers are treated"
                        : after.exceptions != before_.exceptions
                            ? "which floating-point exceptions raise a signal"
                            : nullptr;
  if (!changed) return;
  std::fesetenv(&environment_);
  if (first_left.empty()) first_left = text("%s leaves %s changed", call_, changed);
}

const std::string &left_changed() { return first_left; }

// ---- process ----------------------------------------------------------------------------------------------

std::string Process::difference(const Process &later) const {
  if (later.folder_ != folder_)
    return text("changes the current folder from %s to %s; open files by absolute paths", folder_.c_str(),
                later.folder_.c_str());
  if (later.locale_ != locale_)
    return text("changes the locale from \"%s\" to \"%s\"; leave the locale to the program", locale_.c_str(),
                later.locale_.c_str());
  for (const auto *both : {&later.environment_, &environment_})
    for (const std::string &entry : *both) {
      const auto &other = both == &environment_ ? later.environment_ : environment_;
      if (std::ranges::find(other, entry) == other.end())
        return text("changes the environment (%s); use parameters instead",
                    entry.substr(0, entry.find('=')).c_str());
    }
  for (const auto &[descriptor, target] : streams_)
    if (later.streams_.at(descriptor) != target)
      return text("%s %s: what the program prints is lost; leave it open",
                  later.streams_.at(descriptor).empty() ? "closes" : "redirects",
                  descriptor == 0   ? "standard input"
                  : descriptor == 1 ? "standard output"
                                    : "standard error");
  if (later.handlers_ != handlers_ || later.mask_ != mask_)
    return "changes the handlers of signals or fatal errors; leave them to the program";
  if (later.timers_ != timers_) return "leaves a timer running; stop it";
  if (later.file_mask_ != file_mask_)
    return text("changes the mask of new files from %03o to %03o; leave the mask to the program", file_mask_,
                later.file_mask_);
  return "";
}

// ---- streams ----------------------------------------------------------------------------------------------

Captured::Captured() {
  std::fflush(nullptr);
  for (int k = 0; k < 2; ++k) {
    saved_[k] = dup(k + 1);
    memory_[k] = memory_file();
    dup2(memory_[k], k + 1);
  }
}

Captured::~Captured() {
  std::fflush(nullptr);
  for (int k = 0; k < 2; ++k) {
    dup2(saved_[k], k + 1);
    close(saved_[k]);
    close(memory_[k]);
  }
}

std::string Captured::text(int descriptor) const {
  std::fflush(nullptr);
  std::string out(4096, '\0');
  const int file = memory_[descriptor - 1];  // whose place the stream shares
  lseek(file, 0, SEEK_SET);
  const auto n = read(file, out.data(), unsigned(out.size()));
  lseek(file, 0, SEEK_END);
  out.resize(n > 0 ? size_t(n) : 0);
  return out;
}

}  // namespace cli::check
