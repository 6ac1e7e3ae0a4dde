// Whole files in and out: bounded reading, and writing that leaves either the old file or the complete new one.
#pragma once
#include <cstdint>
#include <cstdio>
#include <string>

#include "core/memory.h"

namespace dfm {

// The bytes of a regular file. Throws Error(DFM_E_IO).
Array<char> read_whole_file(const Memory &memory, const std::string &path);

// Writes beside `path`; commit() renames. Without commit the temporary file is removed.
class AtomicFile {
 public:
  explicit AtomicFile(const std::string &path);
  ~AtomicFile();
  AtomicFile(const AtomicFile &) = delete;
  AtomicFile &operator=(const AtomicFile &) = delete;
  void write(const void *data, size_t bytes);
  void write(const std::string &text) { write(text.data(), text.size()); }
  template <class T>
  void put(const T &value) { write(&value, sizeof value); }
  void commit();

 private:
  [[noreturn]] void fail_io(const char *what);
  std::string path_, temporary_;
  std::FILE *file_ = nullptr;
};

}  // namespace dfm
