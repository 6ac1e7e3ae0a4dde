// Text of others, such as names in files and paths, on its way to a terminal.
#pragma once
#include <string>

namespace cli {

// On one line, with control characters as \uXXXX, so that no name moves the cursor, colors the screen
// or fakes a line.
std::string shown(const std::string &text);

}  // namespace cli
