// Subcommands that the interface names and later work delivers: refused, never ignored.
#include <CLI/CLI.hpp>

#include "cli.h"

namespace cli {

void add_later(CLI::App &app, Globals &, int *exit_code) {
  const std::pair<const char *, const char *> later[] = {
      {"cost", "what accuracy costs on a scene (not available yet)"}};
  for (const auto &[name, what] : later) {
    CLI::App *sub = app.add_subcommand(name, what);
    sub->allow_extras();
    const std::string command = name;
    sub->callback([=] { *exit_code = fail("not available yet: deform " + command); });
  }
}

}  // namespace cli
