// What files for Windows share.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace cli::os {

// Starts the program with these words behind its name; how: _P_WAIT, _P_NOWAIT of process.h. Exit code or
// handle of the process; -1: it cannot be started.
std::intptr_t start(int how, const std::string &program, const std::vector<std::string> &words);

}  // namespace cli::os
