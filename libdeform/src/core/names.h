// What an error says about a wrong name.
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

}  // namespace dfm
