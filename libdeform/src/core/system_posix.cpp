#include <dirent.h>
#include <fcntl.h>
#include <locale.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "core/error.h"
#include "core/system.h"

namespace dfm::os {
namespace {

const char *kind_of(mode_t mode) {
  if (S_ISREG(mode)) return nullptr;
  if (S_ISBLK(mode) || S_ISCHR(mode)) return "a device";
  return S_ISDIR(mode)    ? "a directory"
         : S_ISFIFO(mode) ? "a pipe"
         : S_ISSOCK(mode) ? "a socket"
                          : "not a regular file";
}

void fill(FileStatus &to, const struct stat &from) {
  const mode_t mode = from.st_mode;
  to.kind = kind_of(mode);
  to.writable = !S_ISDIR(mode) && !S_ISBLK(mode);
  to.readable = S_ISREG(mode) || S_ISFIFO(mode) || S_ISSOCK(mode);
  to.bytes = uint64_t(from.st_size);
  to.device = from.st_dev;
  to.number = from.st_ino;
}

std::optional<std::string> text_of(const char *value) {
  if (!value) return {};
  return value;
}

}  // namespace

bool status_of(int descriptor, FileStatus &to) {
  struct stat status;
  if (fstat(descriptor, &status) != 0) return false;
  fill(to, status);
  return true;
}

bool status_of(const std::string &path, FileStatus &to) {
  struct stat status;
  if (stat(path.c_str(), &status) != 0) return false;
  fill(to, status);
  return true;
}

int duplicate(int descriptor) { return fcntl(descriptor, F_DUPFD_CLOEXEC, 0); }

int open_input(const std::string &path) {
  return open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
}

int open_stream(const std::string &path) {
  const int fd = open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (fd >= 0) fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) & ~O_NONBLOCK);
  return fd;
}

int create(const std::string &path) {
  return open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
}

int create_unnamed([[maybe_unused]] const std::string &folder) {
#ifdef O_TMPFILE
  if (access("/proc/self/fd", X_OK) == 0) return open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
#endif
  return -1;
}

bool link_name(int descriptor, const std::string &path) {
  const std::string own = format("/proc/self/fd/%d", descriptor);
  return linkat(AT_FDCWD, own.c_str(), AT_FDCWD, path.c_str(), AT_SYMLINK_FOLLOW) == 0;
}

bool rename_over(const std::string &from, const std::string &to) {
  return std::rename(from.c_str(), to.c_str()) == 0;
}

void remove_file(const std::string &path) { unlink(path.c_str()); }

long process_number() { return getpid(); }

// Uses readdir, because the iterators of the standard library allocate inside noexcept functions, which ends
// the process if memory runs out.
bool list_folder(const std::string &folder, std::vector<std::string> &names) {
  const std::unique_ptr<DIR, int (*)(DIR *)> open(opendir(folder.c_str()), &closedir);
  if (!open) return false;
  errno = 0;
  for (const dirent *entry; (entry = readdir(open.get()));)
    if (const std::string name = entry->d_name; name != "." && name != "..") names.push_back(name);
  return errno == 0;
}

std::optional<std::string> environment(const char *name) { return text_of(std::getenv(name)); }

std::optional<std::string> trusted_environment(const char *name) {
#if defined(__GLIBC__)
  return text_of(secure_getenv(name));
#elif defined(__EMSCRIPTEN__)  // one user
  return environment(name);
#else
  return issetugid() ? std::nullopt : environment(name);
#endif
}

int print(char *text, size_t capacity, const char *format, va_list args) {
  static const locale_t plain = newlocale(LC_ALL_MASK, "C", locale_t{});
  const locale_t before = uselocale(plain);
  const int n = std::vsnprintf(text, capacity, format, args);
  uselocale(before);
  return n;
}

uint64_t memory_of_machine() {
  const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
  uint64_t most = pages > 0 && page > 0 ? uint64_t(pages) * uint64_t(page) : UINT64_MAX;
  // The limit of the process's control group; the file contains "max" if there is none.
  const std::unique_ptr<FILE, int (*)(FILE *)> file(std::fopen("/sys/fs/cgroup/memory.max", "re"),
                                                    std::fclose);
  unsigned long long limit = 0;
  if (file && std::fscanf(file.get(), "%llu", &limit) == 1 && limit > 0)
    most = std::min<uint64_t>(most, limit);
  return most;
}

void *allocate(size_t bytes, size_t align) {
  constexpr size_t kHugePage = size_t(2) << 20;  // on x86-64: 512 small pages
  if (bytes == 0) bytes = align;
  if (bytes < kHugePage || align > kHugePage)
    return std::aligned_alloc(align, (bytes + align - 1) / align * align);
  void *p = nullptr;
  if (posix_memalign(&p, kHugePage, bytes) != 0) return nullptr;
#ifdef MADV_HUGEPAGE
  madvise(p, bytes / kHugePage * kHugePage, MADV_HUGEPAGE);  // advice only; a failure has no effect
#endif
  return p;
}

void deallocate(void *p) { std::free(p); }

}  // namespace dfm::os
