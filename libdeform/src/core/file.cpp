#include "core/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>

#include "core/error.h"

namespace dfm {
namespace {

const char *kind_of(mode_t mode) {
  if (S_ISBLK(mode) || S_ISCHR(mode)) return "a device";
  return S_ISDIR(mode)    ? "a directory"
         : S_ISFIFO(mode) ? "a pipe"
         : S_ISSOCK(mode) ? "a socket"
                          : "not a regular file";
}

}  // namespace

InputFile::InputFile(const std::string &path, const char *expected) : path_(path) {
  // Without O_NONBLOCK, opening a pipe without a writer would block forever. Standard input may block.
  const bool standard = path == "/dev/stdin";
  descriptor_ = standard ? fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 0)
                         : open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (descriptor_ < 0)
    fail(DFM_E_IO, "%s: cannot be opened: %s; expected %s", path.c_str(), std::strerror(errno), expected);
  struct stat status;
  const bool known = fstat(descriptor_, &status) == 0, regular = known && S_ISREG(status.st_mode);
  if (regular || (known && standard && (S_ISFIFO(status.st_mode) || S_ISSOCK(status.st_mode)))) {
    bytes_ = regular ? uint64_t(status.st_size) : 0;
    return;
  }
  const std::string reason =
      known ? format("is %s", kind_of(status.st_mode)) : format("cannot be read: %s", std::strerror(errno));
  close(descriptor_);
  fail(DFM_E_IO, "%s: %s; give the name of %s", path.c_str(), reason.c_str(), expected);
}

InputFile::~InputFile() { close(descriptor_); }

size_t InputFile::read(char *to, size_t n) {
  size_t done = 0;
  while (done < n) {
    const ssize_t got = ::read(descriptor_, to + done, n - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(DFM_E_IO, "%s: cannot be read: %s", path_.c_str(), std::strerror(errno));
    if (got == 0) break;
    done += size_t(got);
  }
  return done;
}

Array<char> read_whole_file(const Memory &memory, const std::string &path, uint64_t limit,
                            const char *expected) {
  InputFile file(path, expected);
  const auto too_large = [&] {
    const bool small = limit < 2 * kMiB;
    fail(DFM_E_FORMAT, "%s: larger than the %llu %s that %s may have; give a smaller file", path.c_str(),
         static_cast<unsigned long long>(limit / (small ? 1024 : kMiB)), small ? "KiB" : "MiB", expected);
  };
  if (file.bytes() > limit) too_large();
  // The size that the system reports may be too small (pipes, growing files), so pieces are read until the
  // end.
  Array<char> bytes{HookAllocator<char>(memory)};
  size_t piece = size_t(file.bytes()) + 1;
  for (;;) {
    const size_t at = bytes.size();
    bytes.resize(at + std::max<size_t>(piece, 4096));
    const size_t got = file.read(bytes.data() + at, bytes.size() - at);
    const bool ended = got < bytes.size() - at;
    bytes.resize(at + got);
    if (bytes.size() > limit) too_large();
    if (ended) return bytes;
    piece = std::min<size_t>(bytes.size(), size_t(limit - bytes.size()) + 1);
  }
}

// Opens an unnamed file in the folder of `path`, which disappears if the process is killed; -1 if the file
// system does not support that.
int AtomicFile::open_beside() {
  const size_t slash = path_.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path_.substr(0, slash + 1);
#ifdef O_TMPFILE
  if (access("/proc/self/fd", X_OK) == 0) {
    const int fd = open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
    if (fd >= 0) {
      kind_ = Kind::unnamed;
      return fd;
    }
  }
#endif
  return open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
}

AtomicFile::AtomicFile(const std::string &path) : path_(path) {
  static std::atomic<unsigned> counter{0};
  temporary_ = path + format(".part%ld-%u", static_cast<long>(getpid()), counter.fetch_add(1));
  struct stat status;
  int fd = -1;
  if (stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) {
    kind_ = Kind::device;
    if (S_ISDIR(status.st_mode) || S_ISBLK(status.st_mode))
      fail(DFM_E_IO, "%s: is %s; give the name of a file to write", path.c_str(), kind_of(status.st_mode));
    // a pipe without a reader is an error; the call does not wait
    fd = open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (fd >= 0) fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) & ~O_NONBLOCK);
  } else {
    fd = open_beside();
  }
  file_ = fd < 0 ? nullptr : fdopen(fd, "wb");
  if (!file_) {
    const int code = errno;
    if (fd >= 0) close(fd);
    if (fd >= 0 && kind_ == Kind::named) unlink(temporary_.c_str());
    errno = code;
    const size_t slash = path.rfind('/');
    if (code == ENOENT && slash != std::string::npos)
      fail(DFM_E_IO, "%s: cannot be written: %s; make the folder '%s' first", path.c_str(),
           std::strerror(code), path.substr(0, slash).c_str());
    fail_io("cannot be written");
  }
}

AtomicFile::~AtomicFile() {
  if (!file_) return;
  std::fclose(file_);
  if (kind_ == Kind::named) unlink(temporary_.c_str());
}

void AtomicFile::fail_io(const char *what) {
  fail(DFM_E_IO, "%s: %s: %s", path_.c_str(), what, std::strerror(errno));
}

void AtomicFile::write(const void *data, size_t bytes) {
  if (bytes && std::fwrite(data, 1, bytes, file_) != bytes) fail_io("cannot be written");
}

void AtomicFile::commit() {
  if (std::fflush(file_) != 0) fail_io("cannot be written");
  bool placed = true;
  if (kind_ == Kind::unnamed) {
    const std::string own = format("/proc/self/fd/%d", fileno(file_));
    unlink(temporary_.c_str());
    placed = linkat(AT_FDCWD, own.c_str(), AT_FDCWD, temporary_.c_str(), AT_SYMLINK_FOLLOW) == 0;
    if (!placed) fail_io("cannot be written");
    kind_ = Kind::named;
  }
  const int closed = std::fclose(file_);
  file_ = nullptr;
  if (kind_ != Kind::device) placed = closed == 0 && std::rename(temporary_.c_str(), path_.c_str()) == 0;
  if (closed == 0 && placed) return;
  const int code = errno;
  if (kind_ == Kind::named) unlink(temporary_.c_str());
  errno = code;
  fail_io("cannot be written");
}

}  // namespace dfm
