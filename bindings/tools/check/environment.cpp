#include "check/environment.h"

#include <dirent.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <cfloat>
#include <clocale>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>

#include "check/check.h"

extern char **environ;

namespace cli::check {
namespace {

thread_local std::string first_left;

}  // namespace

// ---- floating-point environment ---------------------------------------------------------------------------

Kept::Settings Kept::settings() {
  volatile double least = DBL_MIN, small = DBL_MIN / 4;
  const bool denormals = least / 4 > 0 && small * 4 > 0;  // neither results nor operands are flushed
  return {std::fegetround(), fegetexcept(), denormals};
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

namespace {

std::string link_of(const std::string &path) {
  std::error_code error;
  const std::string target = std::filesystem::read_symlink(path, error).string();
  return error ? "" : target;
}

}  // namespace

Process Process::now() {
  Process p;
  p.folder_ = link_of("/proc/self/cwd");
  p.locale_ = std::setlocale(LC_ALL, nullptr);
  for (char **e = environ; e && *e; ++e) p.environment_.emplace_back(*e);
  for (int fd = 0; fd < 3; ++fd) p.streams_[fd] = link_of("/proc/self/fd/" + std::to_string(fd));
  for (int number = 1; number < SIGRTMIN; ++number) {
    struct sigaction action{};
    sigaction(number, nullptr, &action);
    p.handlers_.push_back(reinterpret_cast<const void *>(action.sa_handler));
  }
  p.handlers_.push_back(reinterpret_cast<const void *>(std::get_terminate()));
  p.handlers_.push_back(reinterpret_cast<const void *>(std::get_new_handler()));
  sigset_t blocked;
  sigprocmask(SIG_BLOCK, nullptr, &blocked);
  for (int number = 1; number < SIGRTMIN; ++number) p.mask_ += sigismember(&blocked, number) ? '1' : '0';
  for (const auto which : {ITIMER_REAL, ITIMER_VIRTUAL, ITIMER_PROF}) {
    itimerval timer{};
    getitimer(which, &timer);
    p.timers_ += timer.it_value.tv_sec || timer.it_value.tv_usec ? '1' : '0';
  }
  p.file_mask_ = umask(0);
  umask(p.file_mask_);
  return p;
}

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
      if (std::find(other.begin(), other.end(), entry) == other.end())
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

int Process::threads() {
  int n = 0;
  if (DIR *d = opendir("/proc/self/task")) {
    while (const dirent *e = readdir(d)) n += e->d_name[0] != '.';
    closedir(d);
  }
  return n;
}

// ---- streams ----------------------------------------------------------------------------------------------

Captured::Captured() {
  std::fflush(nullptr);
  for (int k = 0; k < 2; ++k) {
    saved_[k] = dup(k + 1);
    memory_[k] = memfd_create("deform_check", MFD_CLOEXEC);
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
  const ssize_t n = pread(memory_[descriptor - 1], out.data(), out.size(), 0);
  out.resize(n > 0 ? static_cast<size_t>(n) : 0);
  return out;
}

}  // namespace cli::check
