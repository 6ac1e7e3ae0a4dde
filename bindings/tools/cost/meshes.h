// Surfaces from which bodies are filled with another number of cells.
#pragma once
#include <string>

#include "choice.h"

namespace cli::cost {

// Why the cells of this scene's bodies cannot vary; "" where they can.
std::string why_cells_stay(const Subject &subject);
// Writes the boundary of each body whose cells come from a file to folder/BODY.obj. Absolute paths, by body;
// "" for a body that is made or filled already.
Surfaces write_surfaces(const Subject &subject, const std::string &folder);

}  // namespace cli::cost
