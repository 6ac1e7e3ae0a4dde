#include <elf.h>
#include <link.h>
#include <sys/mman.h>
#include <ucontext.h>
#include <unistd.h>

#include <algorithm>
#include <csetjmp>
#include <csignal>
#include <cstring>
#include <functional>
#include <new>

#include "check/watch.h"

namespace cli::check {

namespace pages {

size_t size() { return static_cast<size_t>(sysconf(_SC_PAGESIZE)); }

void *reserve(size_t bytes) {
  void *p = mmap(nullptr, bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (p == MAP_FAILED) throw std::bad_alloc();
  return p;
}

void release(void *begin, size_t bytes) { munmap(begin, bytes); }

bool allow(void *begin, size_t bytes, Access access) {
  const int how = access == Access::write  ? PROT_READ | PROT_WRITE
                  : access == Access::read ? PROT_READ
                                           : PROT_NONE;
  return mprotect(begin, bytes, how) == 0;
}

}  // namespace pages

// ---- calls ------------------------------------------------------------------------------------------------

namespace {

sigjmp_buf back_from_call, back_from_fault;

using Look = std::function<void(void **at, const char *name)>;

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
      (*static_cast<Look *>(user))(reinterpret_cast<void **>(info->dlpi_addr + t.at[i].r_offset),
                                   strings + symbols[ELF64_R_SYM(t.at[i].r_info)].st_name);
    }
  return 0;
}

}  // namespace

void Watch::find() {
  Look look = [this](void **at, const char *name) { look_at(at, name); };
  dl_iterate_phdr(look_into, &look);
}

void Watch::call(const std::function<void()> &f) {
  if (sigsetjmp(back_from_call, 0) == 0) f();
}

void Watch::stop(const char *name) {
  caught = name;
  siglongjmp(back_from_call, 1);
}

// ---- static variables -------------------------------------------------------------------------------------

namespace {

struct Wanted {
  uintptr_t inside, base;
  std::vector<StaticsLocked::Range> *ranges;
};

int writable_parts(dl_phdr_info *info, size_t, void *user) {
  Wanted &wanted = *static_cast<Wanted *>(user);
  const uintptr_t page = pages::size(), base = info->dlpi_addr;
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

void StaticsLocked::find(const void *inside) {
  Wanted wanted{reinterpret_cast<uintptr_t>(inside), 0, &ranges_};
  dl_iterate_phdr(writable_parts, &wanted);
  base = wanted.base;
}

// ---- faults -----------------------------------------------------------------------------------------------

namespace {

void on_fault(int, siginfo_t *info, [[maybe_unused]] void *context) {
  const char *what = "touches";
#if defined(__x86_64__)
  what = static_cast<ucontext_t *>(context)->uc_mcontext.gregs[REG_ERR] & 2 ? "writes" : "reads";
#endif
  Fenced::tell(info->si_addr, what);
  siglongjmp(back_from_fault, 1);
}

}  // namespace

void Fenced::call(const std::function<void()> &f) {
  struct sigaction action{};
  struct sigaction before_segv;
  struct sigaction before_bus;
  action.sa_sigaction = on_fault;
  action.sa_flags = SA_SIGINFO | SA_NODEFER;
  sigaction(SIGSEGV, &action, &before_segv);
  sigaction(SIGBUS, &action, &before_bus);
  if (sigsetjmp(back_from_fault, 1) == 0) f();
  sigaction(SIGSEGV, &before_segv, nullptr);
  sigaction(SIGBUS, &before_bus, nullptr);
}

}  // namespace cli::check
