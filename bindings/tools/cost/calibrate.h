#pragma once
#include <string>
#include <vector>

#include "cli.h"

namespace cli {

void add_calibrate(Command app, Globals &globals, int *exit_code);
// Rows, as JSON, for models that are not measured now: of a file of costs, if this machine has measured them,
// else those that the library ships.
std::vector<std::string> kept_rows(const std::string &file, const std::string &machine,
                                   const std::vector<std::string> &measured);

}  // namespace cli
