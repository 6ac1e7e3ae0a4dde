// How the command's parts stop with a sentence, and what is kept of the library's warnings.
#pragma once
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "cli.h"
#include "deform/plugin.h"
#include "shown.h"

namespace cli {

// Thrown anywhere below a subcommand: main prints the sentence and leaves with the code.
struct Failure : std::runtime_error {
  Failure(int code, const std::string &sentence) : std::runtime_error(sentence), exit_code(code) {}
  int exit_code;
};

// Throws what the library said about a call that failed.
inline void need(dfm_status status) {
  if (status < 0) throw Failure(kBadInput, dfm_last_error());
}

// What a function of the library writes into a struct of its caller, and the rows of a list.
template <class T, class Get, class... Of>
T got(Get get, Of... of) {
  T out{};
  out.size = sizeof out;
  need(get(of..., &out));
  return out;
}
template <class T, class List, class... Of>
std::vector<T> listed(List list, Of... of) {
  uint32_t n = 0;
  need(list(of..., 0, nullptr, &n));
  std::vector<T> out(n);
  if (n > 0) need(list(of..., n, out.data(), &n));
  return out;
}

// As printf writes it.
#ifdef __MINGW_PRINTF_FORMAT
[[gnu::format(__MINGW_PRINTF_FORMAT, 1, 2)]]
#else
[[gnu::format(printf, 1, 2)]]
#endif
std::string formatted(const char *format, ...);
void warn(const std::string &sentence);          // to stderr, and kept for the summary
void keep_warning(const std::string &sentence);  // for the summary only
const std::vector<std::string> &warnings();
// While it lives nothing but errors is said: what scenes that the command makes itself warn of is not the
// user's doing.
class Quiet {
 public:
  explicit Quiet(Globals &globals) : globals_(globals), before_(globals.quiet) { globals_.quiet = true; }
  ~Quiet() { globals_.quiet = before_; }
  Quiet(const Quiet &) = delete;
  Quiet &operator=(const Quiet &) = delete;

 private:
  Globals &globals_;
  bool before_;
};

// The context's copies of rows have the size of this header's.
inline std::span<const dfm_param> params_of(const dfm_type &type) { return {type.params, type.nparam}; }
// The word for a type of a plugin: "law", "model", "solver".
const char *kind_name(uint32_t kind);
// The valid name nearest to a wrong one, for "did you mean"; empty when nothing is near.
std::string nearest(const std::string &word, const std::vector<std::string> &valid);
// The end of a sentence about a wrong word: `; did you mean "NEAR"?`; empty when nothing is near.
std::string did_you_mean(const std::string &word, const std::vector<std::string> &valid);
// Exit code of a run that a signal ended in order, as shells give it for SIGINT.
enum { kInterrupted = 130 };

}  // namespace cli
