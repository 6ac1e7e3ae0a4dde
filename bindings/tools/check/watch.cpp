#include "check/watch.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <utility>

namespace cli::check {

const char *Watch::caught;
bool Watch::active;
char Fenced::sentence[256];
const void *Fenced::touched;
std::vector<Fenced *> Fenced::all;

namespace {

// Names of all systems: one that a system lacks is found nowhere.
constexpr const char *kForbidden[] = {
    // memory; the _Z names are operator new in its forms
    "malloc", "calloc", "realloc", "reallocarray", "free", "posix_memalign", "aligned_alloc", "memalign",
    "strdup", "mmap", "mmap64", "munmap", "brk", "sbrk", "_Znwm", "_Znam", "_ZnwmSt11align_val_t",
    "_ZnamSt11align_val_t", "_ZnwmRKSt9nothrow_t", "_ZnamRKSt9nothrow_t", "_ZdlPv", "_ZdaPv", "_ZdlPvm",
    "_ZdaPvm", "__cxa_allocate_exception", "_aligned_malloc", "_aligned_free", "HeapAlloc", "HeapReAlloc",
    "HeapFree", "VirtualAlloc", "VirtualFree", "LocalAlloc", "GlobalAlloc", "_strdup",
    // files and streams
    "open", "open64", "openat", "openat64", "__open_2", "__open64_2", "creat", "fopen", "fopen64", "freopen",
    "fdopen", "tmpfile", "opendir", "read", "pread", "write", "pwrite", "fread", "fwrite", "fgets", "fputs",
    "fputc", "putc", "putchar", "puts", "printf", "vprintf", "fprintf", "vfprintf", "dprintf", "__printf_chk",
    "__fprintf_chk", "__vfprintf_chk", "__vprintf_chk", "perror", "fflush", "stat", "fstat", "access",
    "unlink", "remove", "rename", "socket", "connect", "pipe", "ioctl", "syscall", "_open", "_wopen",
    "_wfopen", "_read", "_write", "_access", "_stat64", "_unlink", "CreateFileA", "CreateFileW", "ReadFile",
    "WriteFile", "OutputDebugStringA",
    // environment and processes
    "getenv", "secure_getenv", "setenv", "unsetenv", "putenv", "system", "popen", "fork", "execve", "exit",
    "_exit", "abort", "dlopen", "dlsym", "pthread_create", "sleep", "usleep", "nanosleep", "quick_exit",
    "_Exit", "pthread_exit", "setlocale", "chdir", "signal", "sigaction", "umask", "_wgetenv", "_putenv",
    "getenv_s", "_chdir", "_umask", "_getpid", "GetEnvironmentVariableA", "GetEnvironmentVariableW",
    "LoadLibraryA", "LoadLibraryW", "LoadLibraryExW", "CreateThread", "_beginthread", "_beginthreadex",
    "Sleep", "ExitProcess", "TerminateProcess",
    // clocks and chance: what they answer differs from run to run
    "time", "clock", "clock_gettime", "gettimeofday", "timespec_get", "times", "localtime", "gmtime", "rand",
    "srand", "rand_s", "random", "srandom", "drand48", "lrand48", "getrandom", "getentropy", "arc4random",
    "_time64", "_time32", "_ftime64", "GetSystemTimeAsFileTime", "GetTickCount", "GetTickCount64",
    "QueryPerformanceCounter"};
constexpr size_t kCount = std::size(kForbidden);

template <size_t I>
[[noreturn]] void caught_call() {
  Watch::stop(kForbidden[I]);
}

template <size_t... I>
std::array<void *, kCount> stubs(std::index_sequence<I...>) {
  return {reinterpret_cast<void *>(&caught_call<I>)...};
}

}  // namespace

Watch::Watch() { find(); }

void Watch::look_at(void **at, const char *name) {
  static const std::array<void *, kCount> ours = stubs(std::make_index_sequence<kCount>{});
  for (size_t k = 0; k < kCount; ++k) {
    if (std::strcmp(name, kForbidden[k]) != 0) continue;
    // the system has made these pages read only after it filled them; they stay writable for the rest of
    // this process
    void *begin = reinterpret_cast<void *>(reinterpret_cast<uintptr_t>(at) & ~(pages::size() - 1));
    if (pages::allow(begin, pages::size(), pages::Access::write)) slots_.push_back({at, ours[k], *at});
    return;
  }
}

// A lazily bound entry changes when it is first used, so its value is read again each time.
void Watch::exchange(bool ours) {
  active = ours;
  for (Slot &slot : slots_) {
    if (ours) slot.theirs = *slot.at;
    *slot.at = ours ? slot.ours : slot.theirs;
  }
}

const char *Watch::run(const std::function<void()> &f) {
  exchange(true);
  call(f);
  exchange(false);
  return std::exchange(caught, nullptr);
}

// ---- static variables -------------------------------------------------------------------------------------

StaticsLocked::StaticsLocked(const void *inside) {
  find(inside);
  protect(false);
}

void StaticsLocked::protect(bool writable) const {
  for (const Range &r : ranges_)
    pages::allow(r.begin, static_cast<size_t>(r.end - r.begin),
                 writable ? pages::Access::write : pages::Access::read);
}

bool StaticsLocked::hold(const void *at) const {
  return std::ranges::any_of(ranges_, [&](const Range &r) { return at >= r.begin && at < r.end; });
}

// ---- fenced arrays ----------------------------------------------------------------------------------------

namespace {

constexpr unsigned char kPattern = 0xa5;

}  // namespace

Fenced::Fenced(const char *name, size_t bytes, Place place) : name_(name), bytes_(bytes) {
  const size_t page = pages::size(), inner = (bytes + page - 1) / page * page + (bytes ? 0 : page);
  span_ = inner + 2 * page;
  pages_ = static_cast<unsigned char *>(pages::reserve(span_));
  middle_ = pages_ + page;
  pages::allow(middle_, inner, pages::Access::write);
  std::memset(middle_, kPattern, inner);
  data_ = place == at_start ? middle_ : middle_ + inner - bytes;
  all.push_back(this);
}

Fenced::~Fenced() {
  all.erase(std::ranges::find(all, this));
  pages::release(pages_, span_);
}

void Fenced::lock() {
  pages::allow(middle_, span_ - 2 * pages::size(), pages::Access::read);
  locked_ = true;
}

bool Fenced::spoilt(long *offset) const {
  const unsigned char *begin = static_cast<const unsigned char *>(data_);
  const unsigned char *end = middle_ + span_ - 2 * pages::size();
  const auto other = [](unsigned char byte) { return byte != kPattern; };
  const unsigned char *p = std::find_if(static_cast<const unsigned char *>(middle_), begin, other);
  if (p == begin) p = std::find_if(begin + bytes_, end, other);
  *offset = static_cast<long>(p - begin);
  return p != end;
}

// Formats with snprintf in a handler: the fault is the law's own, at a known place of its code, and this
// process ends with the rule.
std::string Fenced::guard(const std::function<void()> &f, const void **at) {
  sentence[0] = 0;
  touched = nullptr;
  call(f);
  if (at) *at = touched;
  return sentence;
}

void Fenced::tell(const void *where, const char *what) {
  const unsigned char *at = static_cast<const unsigned char *>(where);
  touched = at;
  std::snprintf(sentence, sizeof sentence, "%s memory at %p, which belongs to none of its arrays", what,
                static_cast<const void *>(at));
  if (reinterpret_cast<uintptr_t>(at) < pages::size())
    std::snprintf(sentence, sizeof sentence,
                  "%s through a pointer that is NULL (as are inputs that it did not ask for and outputs that "
                  "are not wanted)",
                  what);
  for (const Fenced *f : all) {
    const unsigned char *begin = static_cast<const unsigned char *>(f->data_);
    if (at < f->pages_ || at >= f->pages_ + f->span_) continue;
    const long offset = static_cast<long>(at - begin), size = static_cast<long>(f->bytes_);
    if (offset >= 0 && offset < size)
      std::snprintf(sentence, sizeof sentence, "%s into %s, an input that others read too", what, f->name_);
    else if (offset < 0)
      std::snprintf(sentence, sizeof sentence, "%s %ld bytes before %s", what, -offset, f->name_);
    else
      std::snprintf(sentence, sizeof sentence, "%s %ld bytes past the end of %s (%ld bytes)", what,
                    offset - size, f->name_, size);
  }
}

}  // namespace cli::check
