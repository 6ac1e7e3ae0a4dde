// Reading of whole files up to a limit, and atomic writing: either the old file or the complete new one
// remains.
#pragma once
#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>

#include "core/memory.h"

namespace dfm {

// Opens a regular file for reading; does not wait for the writer of a pipe. Throws Error(DFM_E_IO), whose
// sentence ends with `expected`.
class InputFile {
 public:
  InputFile(const std::string &path, const char *expected);
  ~InputFile();
  InputFile(const InputFile &) = delete;
  InputFile &operator=(const InputFile &) = delete;
  int descriptor() const { return descriptor_; }
  uint64_t bytes() const { return bytes_; }  // as the system reports; 0 for standard input
  size_t read(char *to, size_t n);           // returns fewer than n bytes only at the end

 private:
  std::string path_;
  int descriptor_;
  uint64_t bytes_ = 0;
};

// Returns the bytes of a regular file, or of standard input if `path` is /dev/stdin: at most `limit`, checked
// before anything is allocated. `expected` is the kind of file that is expected, with its article. Throws
// Error: DFM_E_IO, or DFM_E_FORMAT if the file is longer than `limit`.
Array<char> read_whole_file(const Memory &memory, const std::string &path, uint64_t limit,
                            const char *expected);

inline constexpr uint64_t kMiB = uint64_t(1) << 20;
// 1e8 tetrahedra in binary, the largest mesh that is allowed
inline constexpr uint64_t kMaxMeshBytes = 4096 * kMiB;

// Writes to a temporary file next to `path`; commit() renames it. Without commit(), or if the process is
// killed, nothing remains on file systems with unnamed files; elsewhere a killed process leaves a file
// PATH.partPID-N. A symbolic link at `path` is replaced, not followed; a device or pipe is written directly.
class AtomicFile {
 public:
  explicit AtomicFile(const std::string &path);
  ~AtomicFile();
  AtomicFile(const AtomicFile &) = delete;
  AtomicFile &operator=(const AtomicFile &) = delete;
  void write(const void *data, size_t bytes);
  void write(const std::string &text) { write(text.data(), text.size()); }
  template <class T>
  void put(const T &value, std::endian order = std::endian::native) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    if (order != std::endian::native) std::reverse(bytes, bytes + sizeof value);
    write(bytes, sizeof value);
  }
  void commit();

 private:
  [[noreturn]] void fail_io(const char *what);
  enum class Kind { device, named, unnamed };
  std::string path_, temporary_;
  Kind kind_ = Kind::named;
  std::FILE *file_ = nullptr;
};

}  // namespace dfm
