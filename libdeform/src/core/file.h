// Whole files in and out: bounded reading, and writing that leaves either the old file or the
// complete new one.
#pragma once
#include <cstdint>
#include <cstdio>
#include <string>

#include "core/memory.h"

namespace dfm {

// Opens for reading what is a regular file, without waiting for the writer of a pipe. Throws Error(DFM_E_IO).
// `expected` ends the sentence.
class InputFile {
 public:
  InputFile(const std::string &path, const char *expected);
  ~InputFile();
  InputFile(const InputFile &) = delete;
  InputFile &operator=(const InputFile &) = delete;
  int descriptor() const { return descriptor_; }
  uint64_t bytes() const { return bytes_; }  // that the system claims; 0 for standard input
  size_t read(char *to, size_t n);           // fewer than n at the end only

 private:
  std::string path_;
  int descriptor_;
  uint64_t bytes_ = 0;
};

// The bytes of a regular file, or of standard input where `path` is /dev/stdin: at most `limit`, which is
// checked before anything is allocated. `expected` says what kind of file is wanted, with its article. Throws
// Error: DFM_E_IO, DFM_E_FORMAT where there are more bytes than that.
Array<char> read_whole_file(const Memory &memory, const std::string &path, uint64_t limit,
                            const char *expected);

inline constexpr uint64_t kMiB = uint64_t(1) << 20;
// 1e8 tetrahedra in binary, the most that a mesh may have
inline constexpr uint64_t kMaxMeshBytes = 4096 * kMiB;

// Writes beside `path`; commit() renames. Without commit, and where the process is killed, nothing stays
// behind on file systems that know files without a name; elsewhere a killed process leaves a file
// PATH.partPID-N. A link at `path` is replaced and not followed; a device or pipe is written to as it stands.
class AtomicFile {
 public:
  explicit AtomicFile(const std::string &path);
  ~AtomicFile();
  AtomicFile(const AtomicFile &) = delete;
  AtomicFile &operator=(const AtomicFile &) = delete;
  void write(const void *data, size_t bytes);
  void write(const std::string &text) { write(text.data(), text.size()); }
  template <class T>
  void put(const T &value) {
    write(&value, sizeof value);
  }
  void commit();

 private:
  [[noreturn]] void fail_io(const char *what);
  int open_beside();
  enum class Kind { device, named, unnamed };
  std::string path_, temporary_;
  Kind kind_ = Kind::named;
  std::FILE *file_ = nullptr;
};

}  // namespace dfm
