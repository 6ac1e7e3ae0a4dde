// What a call into a plugin may leave changed: the floating-point environment of its thread (V11) and the
// process (V12).
#pragma once
#include <cfenv>
#include <map>
#include <string>
#include <vector>

namespace cli::check {

int unmasked_exceptions();  // of floating-point numbers: they raise a signal

// Encloses every call into the plugin. What the call leaves changed in the floating-point environment is
// noted, for V11, and put back, so that no other rule judges what it has spoilt.
class Kept {
 public:
  explicit Kept(const char *call);
  ~Kept();
  Kept(const Kept &) = delete;
  Kept &operator=(const Kept &) = delete;

 private:
  struct Settings {
    int rounding, exceptions;
    bool denormals;
  };
  static Settings settings();
  const char *call_;
  Settings before_;
  fenv_t environment_;
};
// The first call of this thread that left it changed: "eval leaves the rounding mode changed"; empty
// where none did.
const std::string &left_changed();

// What belongs to the whole program, as it is at one moment.
class Process {
 public:
  static Process now();
  // The first difference, as "changes the current folder from ... to ...: what follows; what to do"; empty
  // where there is none.
  std::string difference(const Process &later) const;
  static int threads();

 private:
  std::string folder_, locale_, timers_;
  std::vector<std::string> environment_;
  std::map<int, std::string> streams_;  // descriptors 0 to 2
  std::vector<const void *> handlers_;  // of signals, of std::terminate and of operator new
  std::string mask_;
  unsigned file_mask_ = 0;
};

int memory_file();  // a descriptor: a file that is gone once it is closed
// While it lives, what is written to standard output and standard error goes to memory.
class Captured {
 public:
  Captured();
  ~Captured();
  Captured(const Captured &) = delete;
  Captured &operator=(const Captured &) = delete;
  std::string text(int descriptor) const;  // so far; 1 or 2

 private:
  int saved_[2], memory_[2];
};

}  // namespace cli::check
