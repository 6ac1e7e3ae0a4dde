// Pictures of the rig's rows by matplotlib; the script lies beside this file and travels inside the command.
#pragma once
#include <string>

namespace cli {

// Runs the first of pythons() (bindings/cli/become.h) that has matplotlib. False where none has it; throws
// Failure where the picture could not be made for another reason.
bool plot_friction(const std::string &csv, const std::string &picture, const std::string &kind,
                   const std::string &title);

}  // namespace cli
