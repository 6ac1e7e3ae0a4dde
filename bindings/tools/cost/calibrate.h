#pragma once
#include "cli.h"

namespace cli {

void add_calibrate(Command app, Globals &globals, int *exit_code);

}  // namespace cli
