// A file in memory with the fuzzer's bytes, so that readers which take a path are fuzzed without touching a
// disk. Readers that go by the file name's ending get a link with that ending.
#pragma once
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "deform/deform.h"

namespace fuzz {

// One silent context for all inputs.
inline dfm_context *context() {
  static dfm_context *const one = [] {
    dfm_context_def def = dfm_context_def_default();
    def.log = [](void *, int32_t, const char *) {};
    dfm_context *made = nullptr;
    if (dfm_context_create(&def, &made) != DFM_OK) std::abort();
    return made;
  }();
  return one;
}

class File {
 public:
  File(const uint8_t *data, size_t size, const char *ending = "") : fd_(memfd_create("input", 0)) {
    if (fd_ < 0 || write(fd_, data, size) != static_cast<ssize_t>(size)) std::abort();
    path_ = "/proc/self/fd/" + std::to_string(fd_);
    if (*ending == 0) return;
    link_ = "/tmp/deform_fuzz_" + std::to_string(getpid()) + ending;
    unlink(link_.c_str());
    if (symlink(path_.c_str(), link_.c_str())) std::abort();
    path_ = link_;
  }
  ~File() {
    if (!link_.empty()) unlink(link_.c_str());
    close(fd_);
  }
  File(const File &) = delete;
  File &operator=(const File &) = delete;
  const char *path() const { return path_.c_str(); }

 private:
  int fd_;
  std::string path_, link_;
};

}  // namespace fuzz
