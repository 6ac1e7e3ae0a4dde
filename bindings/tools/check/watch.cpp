#include "check/watch.h"

#include <elf.h>
#include <link.h>
#include <sys/mman.h>
#include <ucontext.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>
#include <utility>

namespace cli::check {

sigjmp_buf Watch::back;
const char *Watch::caught;
bool Watch::active;
sigjmp_buf Fenced::back;
char Fenced::sentence[256];
const void *Fenced::touched;
std::vector<Fenced *> Fenced::all;

namespace {

constexpr const char *kForbidden[] = {
    // memory; the _Z names are operator new in its forms
    "malloc", "calloc", "realloc", "reallocarray", "free", "posix_memalign", "aligned_alloc", "memalign",
    "strdup", "mmap", "mmap64", "munmap", "brk", "sbrk", "_Znwm", "_Znam", "_ZnwmSt11align_val_t",
    "_ZnamSt11align_val_t", "_ZnwmRKSt9nothrow_t", "_ZnamRKSt9nothrow_t", "_ZdlPv", "_ZdaPv", "_ZdlPvm",
    "_ZdaPvm", "__cxa_allocate_exception",
    // files and streams
    "open", "open64", "openat", "openat64", "__open_2", "__open64_2", "creat", "fopen", "fopen64", "freopen",
    "fdopen", "tmpfile", "opendir", "read", "pread", "write", "pwrite", "fread", "fwrite", "fgets", "fputs",
    "fputc", "putc", "putchar", "puts", "printf", "vprintf", "fprintf", "vfprintf", "dprintf", "__printf_chk",
    "__fprintf_chk", "__vfprintf_chk", "__vprintf_chk", "perror", "fflush", "stat", "fstat", "access",
    "unlink", "remove", "rename", "socket", "connect", "pipe", "ioctl", "syscall",
    // environment and processes
    "getenv", "secure_getenv", "setenv", "unsetenv", "putenv", "system", "popen", "fork", "execve", "exit",
    "_exit", "abort", "dlopen", "dlsym", "pthread_create", "sleep", "usleep", "nanosleep", "quick_exit",
    "_Exit", "pthread_exit", "setlocale", "chdir", "signal", "sigaction", "umask",
    // clocks and chance: what they answer differs from run to run
    "time", "clock", "clock_gettime", "gettimeofday", "timespec_get", "times", "localtime", "gmtime", "rand",
    "srand", "random", "srandom", "drand48", "lrand48", "getrandom", "getentropy", "arc4random"};
constexpr size_t kCount = std::size(kForbidden);

template <size_t I>
[[noreturn]] void caught_call() {
  Watch::stop(kForbidden[I]);
}

template <size_t... I>
std::array<void *, kCount> stubs(std::index_sequence<I...>) {
  return {reinterpret_cast<void *>(&caught_call<I>)...};
}

struct Object { std::vector<std::pair<void **, size_t>> found; };

// Relocations that hold the address of a function of another object.
#if defined(__x86_64__)
constexpr bool holds_address(unsigned type) {
  return type == R_X86_64_JUMP_SLOT || type == R_X86_64_GLOB_DAT || type == R_X86_64_64;
}
#elif defined(__aarch64__)
constexpr bool holds_address(unsigned type) {
  return type == R_AARCH64_JUMP_SLOT || type == R_AARCH64_GLOB_DAT || type == R_AARCH64_ABS64;
}
#else
constexpr bool holds_address(unsigned) { return false; }
#endif

// The program and what belongs to the validator keep their own entries: what they do in the meantime is no
// doing of eval.
bool is_ours(const char *name) {
  if (!name || !*name) return true;
  const char *file = std::strrchr(name, '/') ? std::strrchr(name, '/') + 1 : name;
  for (const char *begin : {"libdeform.", "ld-linux", "linux-vdso", "libasan.", "libtsan.", "libubsan.",
                            "liblsan.", "libclang_rt"})
    if (std::strncmp(file, begin, std::strlen(begin)) == 0) return true;
  return false;
}

int look_into(dl_phdr_info *info, size_t, void *user) {
  if (is_ours(info->dlpi_name)) return 0;
  // ld.so has relocated most of them
  const auto here = [&](ElfW(Addr) a) { return a < info->dlpi_addr ? info->dlpi_addr + a : a; };
  const ElfW(Dyn) *dynamic = nullptr;
  for (int i = 0; i < info->dlpi_phnum; ++i)
    if (info->dlpi_phdr[i].p_type == PT_DYNAMIC)
      dynamic = reinterpret_cast<const ElfW(Dyn) *>(info->dlpi_addr + info->dlpi_phdr[i].p_vaddr);
  const ElfW(Sym) *symbols = nullptr;
  const char *strings = nullptr;
  struct Table {
    const ElfW(Rela) *at = nullptr;
    size_t bytes = 0;
  } tables[2];
  for (const ElfW(Dyn) *d = dynamic; d && d->d_tag != DT_NULL; ++d) {
    if (d->d_tag == DT_SYMTAB) symbols = reinterpret_cast<const ElfW(Sym) *>(here(d->d_un.d_ptr));
    if (d->d_tag == DT_STRTAB) strings = reinterpret_cast<const char *>(here(d->d_un.d_ptr));
    if (d->d_tag == DT_RELA) tables[0].at = reinterpret_cast<const ElfW(Rela) *>(here(d->d_un.d_ptr));
    if (d->d_tag == DT_RELASZ) tables[0].bytes = d->d_un.d_val;
    if (d->d_tag == DT_JMPREL) tables[1].at = reinterpret_cast<const ElfW(Rela) *>(here(d->d_un.d_ptr));
    if (d->d_tag == DT_PLTRELSZ) tables[1].bytes = d->d_un.d_val;
  }
  if (!symbols || !strings) return 0;
  for (const Table &t : tables)
    for (size_t i = 0; t.at && i < t.bytes / sizeof(ElfW(Rela)); ++i) {
      if (!holds_address(static_cast<unsigned>(ELF64_R_TYPE(t.at[i].r_info)))) continue;
      const char *name = strings + symbols[ELF64_R_SYM(t.at[i].r_info)].st_name;
      for (size_t k = 0; k < kCount; ++k)
        if (std::strcmp(name, kForbidden[k]) == 0)
          static_cast<Object *>(user)->found.emplace_back(
              reinterpret_cast<void **>(info->dlpi_addr + t.at[i].r_offset), k);
    }
  return 0;
}

}  // namespace

Watch::Watch() {
  const std::array<void *, kCount> ours = stubs(std::make_index_sequence<kCount>{});
  Object object;
  dl_iterate_phdr(look_into, &object);
  const size_t page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
  for (const auto &[at, k] : object.found) {
    // after relocation the linker makes these pages read only; they stay writable for the rest
    // of this process
    void *begin = reinterpret_cast<void *>(reinterpret_cast<uintptr_t>(at) & ~(page - 1));
    if (mprotect(begin, page, PROT_READ | PROT_WRITE) != 0) continue;
    slots_.push_back({at, ours[k], *at});
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

void Watch::stop(const char *name) {
  caught = name;
  siglongjmp(back, 1);
}

// ---- static variables -------------------------------------------------------------------------------------

namespace {

struct Wanted {
  uintptr_t inside, base;
  std::vector<StaticsLocked::Range> *ranges;
};

int writable_parts(dl_phdr_info *info, size_t, void *user) {
  Wanted &wanted = *static_cast<Wanted *>(user);
  const uintptr_t page = static_cast<uintptr_t>(sysconf(_SC_PAGESIZE)), base = info->dlpi_addr;
  bool here = false;
  uintptr_t relro = 0;  // the linker has made these read only already
  for (int i = 0; i < info->dlpi_phnum; ++i) {
    const ElfW(Phdr) &p = info->dlpi_phdr[i];
    here |= p.p_type == PT_LOAD && wanted.inside >= base + p.p_vaddr &&
            wanted.inside < base + p.p_vaddr + p.p_memsz;
    if (p.p_type == PT_GNU_RELRO) relro = (base + p.p_vaddr + p.p_memsz) / page * page;
  }
  if (!here) return 0;
  wanted.base = base;
  for (int i = 0; i < info->dlpi_phnum; ++i) {
    const ElfW(Phdr) &p = info->dlpi_phdr[i];
    if (p.p_type != PT_LOAD || !(p.p_flags & PF_W)) continue;
    const uintptr_t begin = std::max((base + p.p_vaddr) / page * page, relro);
    const uintptr_t end = (base + p.p_vaddr + p.p_memsz + page - 1) / page * page;
    if (begin < end)
      wanted.ranges->push_back(
          {reinterpret_cast<unsigned char *>(begin), reinterpret_cast<unsigned char *>(end)});
  }
  return 1;
}

}  // namespace

StaticsLocked::StaticsLocked(const void *inside) {
  Wanted wanted{reinterpret_cast<uintptr_t>(inside), 0, &ranges_};
  dl_iterate_phdr(writable_parts, &wanted);
  base = wanted.base;
  protect(false);
}

void StaticsLocked::protect(bool writable) const {
  for (const Range &r : ranges_)
    mprotect(r.begin, static_cast<size_t>(r.end - r.begin), writable ? PROT_READ | PROT_WRITE : PROT_READ);
}

bool StaticsLocked::hold(const void *at) const {
  return std::any_of(ranges_.begin(), ranges_.end(),
                     [&](const Range &r) { return at >= r.begin && at < r.end; });
}

// ---- fenced arrays ----------------------------------------------------------------------------------------

namespace {

constexpr unsigned char kPattern = 0xa5;
size_t page_size() { return static_cast<size_t>(sysconf(_SC_PAGESIZE)); }
struct sigaction before_segv, before_bus;

}  // namespace

Fenced::Fenced(const char *name, size_t bytes, Place place) : name_(name), bytes_(bytes) {
  const size_t page = page_size(), inner = (bytes + page - 1) / page * page + (bytes ? 0 : page);
  span_ = inner + 2 * page;
  void *p = mmap(nullptr, span_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (p == MAP_FAILED) throw std::bad_alloc();
  pages_ = static_cast<unsigned char *>(p);
  middle_ = pages_ + page;
  mprotect(middle_, inner, PROT_READ | PROT_WRITE);
  std::memset(middle_, kPattern, inner);
  data_ = place == at_start ? middle_ : middle_ + inner - bytes;
  all.push_back(this);
}

Fenced::~Fenced() {
  all.erase(std::find(all.begin(), all.end(), this));
  munmap(pages_, span_);
}

void Fenced::lock() {
  mprotect(middle_, span_ - 2 * page_size(), PROT_READ);
  locked_ = true;
}

bool Fenced::spoilt(long *offset) const {
  const unsigned char *begin = static_cast<const unsigned char *>(data_);
  const unsigned char *end = middle_ + span_ - 2 * page_size();
  const auto other = [](unsigned char byte) { return byte != kPattern; };
  const unsigned char *p = std::find_if(static_cast<const unsigned char *>(middle_), begin, other);
  if (p == begin) p = std::find_if(begin + bytes_, end, other);
  *offset = static_cast<long>(p - begin);
  return p != end;
}

// Formats with snprintf in a handler: the fault is the law's own, at a known place of its code, and this
// process ends with the rule.
void Fenced::on_fault(int, void *info, void *context) {
  const unsigned char *at = static_cast<const unsigned char *>(static_cast<siginfo_t *>(info)->si_addr);
  const char *what = "touches";
  touched = at;
#if defined(__x86_64__)
  what = static_cast<ucontext_t *>(context)->uc_mcontext.gregs[REG_ERR] & 2 ? "writes" : "reads";
#endif
  std::snprintf(sentence, sizeof sentence, "%s memory at %p, which belongs to none of its arrays", what,
                static_cast<const void *>(at));
  if (reinterpret_cast<uintptr_t>(at) < page_size())
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
  siglongjmp(back, 1);
}

void Fenced::arm() {
  sentence[0] = 0;
  touched = nullptr;
  struct sigaction action{};
  action.sa_sigaction = [](int number, siginfo_t *info, void *context) { on_fault(number, info, context); };
  action.sa_flags = SA_SIGINFO | SA_NODEFER;
  sigaction(SIGSEGV, &action, &before_segv);
  sigaction(SIGBUS, &action, &before_bus);
}

void Fenced::disarm() {
  sigaction(SIGSEGV, &before_segv, nullptr);
  sigaction(SIGBUS, &before_bus, nullptr);
}

}  // namespace cli::check
