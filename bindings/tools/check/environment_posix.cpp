#include "check/environment.h"

#include <dirent.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

#include <clocale>
#include <csignal>
#include <exception>
#include <filesystem>
#include <new>

extern char **environ;

namespace cli::check {

int unmasked_exceptions() { return fegetexcept(); }

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

int Process::threads() {
  int n = 0;
  if (DIR *d = opendir("/proc/self/task")) {
    while (const dirent *e = readdir(d)) n += e->d_name[0] != '.';
    closedir(d);
  }
  return n;
}

int memory_file() { return memfd_create("deform_check", MFD_CLOEXEC); }

}  // namespace cli::check
