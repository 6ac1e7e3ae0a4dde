// Where the measured costs of this machine lie, which `deform calibrate` writes and scenes with an accuracy
// or a budget read.
#pragma once
#include <string>

namespace cli {

// $XDG_CONFIG_HOME/deform/costs.json, else $HOME/.config/deform/costs.json; "" where neither is set.
std::string costs_file();
// Names that file to the library (DEFORM_COSTS), where it is there and nothing else is named.
void offer_costs();
std::string machine_name();  // processor, compiler, version of the library

}  // namespace cli
