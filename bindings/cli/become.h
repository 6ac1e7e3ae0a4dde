// Subcommands that are programs of their own, beside the command.
#pragma once
#include <string>
#include <vector>

namespace cli {

// Becomes the program `name`, with these words behind its own, or throws; missing: what to do where it is not
// there.
[[noreturn]] void become(const std::string &subcommand, const std::string &name,
                         const std::vector<std::string> &words, const std::string &missing);

}  // namespace cli
