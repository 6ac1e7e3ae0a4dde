// Text of others, such as names in files and paths, on its way to a terminal.
#pragma once
#include <string>

namespace cli {

// On one line, with control characters as \uXXXX, so that no name moves the cursor, colors the screen
// or fakes a line.
std::string shown(const std::string &text);

// The same as one word of a shell's command line: in quotes where it has a space or another character that
// a shell reads.
std::string shown_word(const std::string &text);

}  // namespace cli
