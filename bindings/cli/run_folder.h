// The folder that a run writes into: made, held by one run at a time, and free of what an earlier
// run left there.
#pragma once
#include <cstdint>
#include <string>

namespace cli {

void make_folder(const std::string &path);

class HeldFolder {
 public:
  // Makes it. Throws Failure where another run holds the folder. The hold is a lock of the system's and ends
  // with the process, however that ends.
  explicit HeldFolder(const std::string &path);
  ~HeldFolder();
  HeldFolder(const HeldFolder &) = delete;
  HeldFolder &operator=(const HeldFolder &) = delete;

 private:
  std::intptr_t held_;
};

class RunFolder {
 public:
  explicit RunFolder(const std::string &path);

 private:
  HeldFolder held_;
};

}  // namespace cli
