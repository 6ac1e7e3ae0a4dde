// The folder that a run writes into: made, held by one run at a time, and free of what an earlier
// run left there.
#pragma once
#include <cstdint>
#include <string>

namespace cli {

void make_folder(const std::string &path);

class RunFolder {
 public:
  // Throws Failure where another run holds the folder. The hold is a lock of the system's and ends with the
  // process, however that ends.
  explicit RunFolder(const std::string &path);
  ~RunFolder();
  RunFolder(const RunFolder &) = delete;
  RunFolder &operator=(const RunFolder &) = delete;

 private:
  std::intptr_t held_;
};

}  // namespace cli
