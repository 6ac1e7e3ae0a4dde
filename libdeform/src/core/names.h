// What an error says about names: a wrong one, and one of a file within a command.
#pragma once
#include "core/error.h"

namespace dfm {

// `; did you mean "NAME"?` with the valid name that is nearest to the wrong one; empty if none is near.
// Quotes are double for what stands in a file, single for what a program passed.
inline std::string did_you_mean(const std::string &wrong, const std::vector<std::string> &valid,
                                char quote = '"') {
  const std::string near = nearest(wrong, valid);
  return near.empty() ? "" : std::string("; did you mean ") + quote + near + quote + "?";
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
