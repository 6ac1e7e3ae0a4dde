// One way for a sentence to reach the caller: code inside throws Error, the guard in api/ turns it into a
// status and dfm_last_error().
#pragma once
#include <cstdarg>
#include <exception>
#include <string>
#include <vector>

#include "deform/plugin.h"

namespace dfm {

struct Error : std::exception {
  dfm_status status;
  std::string sentence;
  Error(dfm_status s, std::string text) : status(s), sentence(std::move(text)) {}
  const char *what() const noexcept override { return sentence.c_str(); }
};

// printf-style; the sentence says what was wrong, where, and what to do.
[[noreturn]] void fail(dfm_status status, const char *format, ...) __attribute__((format(printf, 2, 3)));
std::string format(const char *format, ...) __attribute__((format(printf, 1, 2)));

// One line that any terminal may be shown: control characters (names of a file may hold them) become \uXXXX,
// bytes that are no UTF-8 become "?".
void printable(const char *text, char *out, size_t capacity) noexcept;

void set_last_error(const char *sentence) noexcept;  // thread-local
const char *last_error() noexcept;
// of this thread so far: has what was called said why it failed?
uint64_t sentences() noexcept;

// The valid name nearest to a wrong one (edit distance), for "did you mean"; empty when nothing is near.
std::string nearest(const std::string &wrong, const std::vector<std::string> &valid);
std::string join(const std::vector<std::string> &names, const char *separator = ", ");

}  // namespace dfm
