#include "mesh/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>

#include "core/error.h"

namespace dfm {

Array<char> read_whole_file(const Memory &memory, const std::string &path) {
  struct Descriptor {
    int fd;
    ~Descriptor() { if (fd >= 0) close(fd); }
  };
  // Without O_NONBLOCK opening a pipe that nobody writes would wait for ever.
  const Descriptor file{open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (file.fd < 0) fail(DFM_E_IO, "%s: cannot be opened: %s", path.c_str(), std::strerror(errno));
  struct stat status;
  if (fstat(file.fd, &status) != 0) fail(DFM_E_IO, "%s: %s", path.c_str(), std::strerror(errno));
  if (!S_ISREG(status.st_mode))
    fail(DFM_E_IO, "%s: is %s; give the name of a mesh file", path.c_str(), S_ISDIR(status.st_mode) ? "a directory" : "not a regular file");
  Array<char> bytes(size_t(status.st_size), HookAllocator<char>(memory));
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = read(file.fd, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(DFM_E_IO, "%s: cannot be read: %s", path.c_str(), std::strerror(errno));
    if (n == 0) break;  // the file shrank meanwhile; the reader will miss its end marker
    done += size_t(n);
  }
  bytes.resize(done);
  return bytes;
}

AtomicFile::AtomicFile(const std::string &path) : path_(path) {
  static std::atomic<unsigned> counter{0};
  temporary_ = path + format(".part%ld-%u", static_cast<long>(getpid()), counter.fetch_add(1));
  const int fd = open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  file_ = fd < 0 ? nullptr : fdopen(fd, "wb");
  if (!file_) {
    const int code = errno;
    if (fd >= 0) close(fd), unlink(temporary_.c_str());
    fail(DFM_E_IO, "%s: cannot be written: %s", path.c_str(), std::strerror(code));
  }
}

AtomicFile::~AtomicFile() {
  if (!file_) return;
  std::fclose(file_);
  unlink(temporary_.c_str());
}

void AtomicFile::fail_io(const char *what) { fail(DFM_E_IO, "%s: %s: %s", path_.c_str(), what, std::strerror(errno)); }

void AtomicFile::write(const void *data, size_t bytes) {
  if (bytes && std::fwrite(data, 1, bytes, file_) != bytes) fail_io("cannot be written");
}

void AtomicFile::commit() {
  if (std::fflush(file_) != 0) fail_io("cannot be written");
  const int closed = std::fclose(file_);
  file_ = nullptr;
  if (closed != 0 || std::rename(temporary_.c_str(), path_.c_str()) != 0) {
    const int code = errno;
    unlink(temporary_.c_str());
    errno = code;
    fail_io("cannot be written");
  }
}

}  // namespace dfm
