// Pictures of the rig's rows by matplotlib; the script lies beside this file and travels inside the command.
#pragma once
#include <string>

namespace cli {

// Runs the first of these that has matplotlib: the interpreter that DEFORM_PYTHON in the environment names
// (then no other is tried); the one that the build found; python3 in PATH. False where none has it; throws
// Failure where the picture could not be made for another reason.
bool plot_friction(const std::string &csv, const std::string &picture, const std::string &kind,
                   const std::string &title);

}  // namespace cli
