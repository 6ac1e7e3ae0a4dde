// Catches what eval must not do: calls of the C library that allocate, open, print or read the environment,
// and touches of memory outside the arrays. Calls are caught by exchanging addresses: every function that a
// loaded object calls in another one is in that object's table of addresses (global offset table; Windows:
// import address table), so while eval runs, the entries of those names, in the plugin and in every library
// under it that is not the system's, point to ours.
// Nothing is forwarded: the first such call ends eval by a jump back to the rule. Not seen: bare system calls
// in machine code, the variable `environ`, and a C library linked into the plugin.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace cli::check {

class Watch {
 public:
  Watch();  // finds the entries; the plugin must be loaded
  // Runs f; the name of the function that it called and may not, or null.
  const char *run(const std::function<void()> &f);
  size_t entries() const { return slots_.size(); }
  [[noreturn]] static void stop(const char *name);  // for services that have no entry to exchange
  static bool watching() { return active; }

 private:
  struct Slot {
    void **at;
    void *ours, *theirs;
  };
  void exchange(bool ours);
  static void call(const std::function<void()> &f);  // the system's; returns early where f has called stop()
  void find();                                       // the system's; calls look_at for each entry
  void look_at(void **at, const char *name);         // if that is one of those, the entry is made writable
  static const char *caught;
  static bool active;
  std::vector<Slot> slots_;
};

// The writable memory of the plugin's own file (its static variables), read only while this lives.
class StaticsLocked {
 public:
  explicit StaticsLocked(const void *inside);  // any address in the plugin
  ~StaticsLocked() { protect(true); }
  StaticsLocked(const StaticsLocked &) = delete;
  StaticsLocked &operator=(const StaticsLocked &) = delete;
  bool hold(const void *at) const;
  struct Range { unsigned char *begin, *end; };
  uintptr_t base = 0;  // of the loaded file

 private:
  void find(const void *inside);  // the system's: base and ranges
  void protect(bool writable) const;
  std::vector<Range> ranges_;
};

// Pages of memory: their size, fresh ones that may not be touched (bad_alloc), given back, and what may be
// done with them.
namespace pages {
enum class Access { none, read, write };
size_t size();
void *reserve(size_t bytes);
void release(void *begin, size_t bytes);
bool allow(void *begin, size_t bytes, Access access);
}  // namespace pages

// An array between two pages that may not be touched, at the end or at the start of what lies between them;
// the rest holds a pattern.
class Fenced {
 public:
  enum Place { at_start, at_end };
  Fenced(const char *name, size_t bytes, Place place);
  ~Fenced();
  Fenced(const Fenced &) = delete;
  Fenced &operator=(const Fenced &) = delete;
  void *data() const { return data_; }
  double *numbers() const { return static_cast<double *>(data_); }
  void lock();  // read only from here on
  // The first byte beside the array that is no longer the pattern, as an offset from its beginning; false
  // where there is none.
  bool spoilt(long *offset) const;

  // Runs f and turns a touch of a fence into a sentence; empty where there was none.
  static std::string guard(const std::function<void()> &f, const void **at = nullptr);
  // What a fault at `at` did: "reads", "writes", or "touches" where that is unknown.
  static void tell(const void *at, const char *what);

 private:
  static void call(const std::function<void()> &f);  // the system's; ends f at a fault, which it has told
  static char sentence[256];
  static const void *touched;  // where; null where there was no touch
  static std::vector<Fenced *> all;
  const char *name_;
  unsigned char *pages_, *middle_;
  size_t span_, bytes_;
  void *data_;
  bool locked_ = false;
};

}  // namespace cli::check
