#include "core/file.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>

#include "core/error.h"
#include "core/system.h"

namespace dfm {

InputFile::InputFile(const std::string &path, const char *expected) : path_(path) {
  // Standard input may block.
  const bool standard = path == "/dev/stdin";
  descriptor_ = standard ? os::duplicate(STDIN_FILENO) : os::open_input(path);
  if (descriptor_ < 0)
    fail(DFM_E_IO, "%s: cannot be opened: %s; expected %s", path.c_str(), std::strerror(errno), expected);
  os::FileStatus status;
  const bool known = os::status_of(descriptor_, status), regular = known && !status.kind;
  if (regular || (known && standard && status.readable)) {
    bytes_ = regular ? status.bytes : 0;
    return;
  }
  const std::string reason =
      known ? format("is %s", status.kind) : format("cannot be read: %s", std::strerror(errno));
  close(descriptor_);
  fail(DFM_E_IO, "%s: %s; give the name of %s", path.c_str(), reason.c_str(), expected);
}

InputFile::~InputFile() { close(descriptor_); }

size_t InputFile::read(char *to, size_t n) {
  size_t done = 0;
  while (done < n) {
    // of more than 2 GiB at a time no system reads all
    const auto got = ::read(descriptor_, to + done, std::min<size_t>(n - done, size_t{1} << 30));
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
  Array<char> bytes{memory};
  size_t chunk = size_t(file.bytes()) + 1;
  for (;;) {
    const size_t at = bytes.size();
    bytes.resize(at + std::max<size_t>(chunk, 4096));
    const size_t got = file.read(bytes.data() + at, bytes.size() - at);
    const bool ended = got < bytes.size() - at;
    bytes.resize(at + got);
    if (bytes.size() > limit) too_large();
    if (ended) return bytes;
    chunk = std::min<size_t>(bytes.size(), size_t(limit - bytes.size()) + 1);
  }
}

AtomicFile::AtomicFile(const std::string &path) : path_(path) {
  static std::atomic<unsigned> counter{0};
  temporary_ = path + format(".part%ld-%u", os::process_number(), counter.fetch_add(1));
  const size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  os::FileStatus status;
  int fd = -1;
  if (os::status_of(path, status) && status.kind) {
    kind_ = Kind::device;
    if (!status.writable)
      fail(DFM_E_IO, "%s: is %s; give the name of a file to write", path.c_str(), status.kind);
    fd = os::open_stream(path);
  } else {
    fd = os::create_unnamed(folder);
    if (fd >= 0) kind_ = Kind::unnamed;
    else fd = os::create(temporary_);
  }
  file_ = fd < 0 ? nullptr : fdopen(fd, "wb");
  if (!file_) {
    const int code = errno;
    if (fd >= 0) close(fd);
    if (fd >= 0 && kind_ == Kind::named) os::remove_file(temporary_);
    errno = code;
    if (code == ENOENT && slash != std::string::npos)
      fail(DFM_E_IO, "%s: cannot be written: %s; make the folder '%s' first", path.c_str(),
           std::strerror(code), path.substr(0, slash).c_str());
    fail_io("cannot be written");
  }
}

AtomicFile::~AtomicFile() {
  if (!file_) return;
  std::fclose(file_);
  if (kind_ == Kind::named) os::remove_file(temporary_);
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
    os::remove_file(temporary_);
    placed = os::link_name(fileno(file_), temporary_);
    if (!placed) fail_io("cannot be written");
    kind_ = Kind::named;
  }
  const int closed = std::fclose(file_);
  file_ = nullptr;
  if (kind_ != Kind::device) placed = closed == 0 && os::rename_over(temporary_, path_);
  if (closed == 0 && placed) return;
  const int code = errno;
  if (kind_ == Kind::named) os::remove_file(temporary_);
  errno = code;
  fail_io("cannot be written");
}

}  // namespace dfm
