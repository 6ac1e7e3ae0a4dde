// How an error message reaches the caller: the library throws Error, and the guard in api/ turns it into a
// status and dfm_last_error().
#pragma once
#include <cstdarg>
#include <exception>
#include <string>
#include <vector>

#include "deform/plugin.h"

// Marks a function with a format as of printf; that of mingw-w64 has a name of its own.
#ifdef __MINGW_PRINTF_FORMAT
#define DEFORM_PRINTF(text, first) __attribute__((format(__MINGW_PRINTF_FORMAT, text, first)))
#else
#define DEFORM_PRINTF(text, first) __attribute__((format(printf, text, first)))
#endif

namespace dfm {

struct Error : std::exception {
  dfm_status status;
  std::string sentence;
  Error(dfm_status s, std::string text) : status(s), sentence(std::move(text)) {}
  const char *what() const noexcept override { return sentence.c_str(); }
};

// printf-style; the message is one sentence: what was wrong, where, and what to do.
[[noreturn]] void fail(dfm_status status, const char *format, ...) DEFORM_PRINTF(2, 3);
std::string format(const char *format, ...) DEFORM_PRINTF(1, 2);

// What a sentence is about: it begins with "body 'NAME'". T::kKind: the word.
struct Named {
  const char *kind, *name;
  Named(const char *k, const char *n) : kind(k), name(n) {}
  template <class T>
    requires requires { T::kKind; }
  Named(const T &thing) : kind(T::kKind), name(thing.name.c_str()) {}
};
[[noreturn]] void refuse(const Named &whose, const char *sentence, ...) DEFORM_PRINTF(2, 3);  // DFM_E_ARG
[[noreturn]] void refuse(const Named &whose, dfm_status status, const char *sentence, ...)
    DEFORM_PRINTF(3, 4);
std::string vformat(const char *format, va_list args);

// Makes a text safe for any terminal: control characters (file names may contain them) become \uXXXX, bytes
// that are not valid UTF-8 become "?".
void printable(const char *text, char *out, size_t capacity) noexcept;

void set_last_error(const char *sentence) noexcept;  // thread-local
const char *last_error() noexcept;
// number of messages set by this thread: shows whether a called function gave a reason
uint64_t sentences() noexcept;

// The valid name nearest to a wrong one (edit distance), for "did you mean"; empty if none is near.
std::string nearest(const std::string &wrong, const std::vector<std::string> &valid);
std::string join(const std::vector<std::string> &names, const char *separator = ", ");

}  // namespace dfm
