// Names as errors and files have them: a wrong one, one of a group, one of a file within a command.
#pragma once
#include <algorithm>
#include <cctype>
#include <string_view>

#include "core/error.h"

namespace dfm {

// `; did you mean "NAME"?` with the valid name that is nearest to the wrong one; empty if none is near.
// Quotes are double for what stands in a file, single for what a program passed.
inline std::string did_you_mean(const std::string &wrong, const std::vector<std::string> &valid,
                                char quote = '"') {
  const std::string near = nearest(wrong, valid);
  return near.empty() ? "" : std::string("; did you mean ") + quote + near + quote + "?";
}

// ASCII letters in lower case.
inline std::string lower(std::string_view text) {
  std::string out(text);
  for (char &c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

// A name in a format where it ends with its line.
inline std::string one_line(std::string name) {
  std::replace_if(name.begin(), name.end(), [](unsigned char c) { return c < ' '; }, '_');
  return name;
}

// A path within a command that the reader can copy: quoted where a shell would split or change it.
inline std::string shell_word(const std::string &path) {
  const char *const plain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+./:,@%=";
  if (!path.empty() && path.find_first_not_of(plain) == path.npos) return path;
  std::string out = "'";
  for (const char c : path) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}

}  // namespace dfm
