// deform mesh fill
#include "cmd_mesh.h"

namespace cli {

void add_mesh_fill(CLI::App *mesh, Globals &, int *exit_code) {
  CLI::App *fill_command = mesh->add_subcommand("fill", "tetrahedra for a closed surface (not available yet)");
  fill_command->allow_extras();
  fill_command->callback([=] { *exit_code = fail("not available yet: deform mesh fill; give a tetrahedral mesh (.msh or .vtk) instead of a surface"); });
}

}  // namespace cli
