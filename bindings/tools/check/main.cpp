// deform-check, which `deform plugin check` starts: the command line of the validator.
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "arguments.h"
#include "become.h"
#include "check/command.h"
#include "cli.h"

namespace cli {
namespace {

// The file of a plugin that is found by its short name or full id; the same text where it is none of them.
std::string file_of(const std::string &text, const Globals &globals) {
  std::error_code error;
  if (std::filesystem::exists(text, error) || text.find('/') != std::string::npos) return text;
  const std::unique_ptr<dfm_context, decltype(&dfm_context_destroy)> context(make_context(globals),
                                                                             dfm_context_destroy);
  std::pair<std::string, std::string> named{text, text};
  dfm_plugin_visit(
      context.get(),
      [](void *user, const dfm_type *type, const char *file) {
        auto &[name, found] = *static_cast<std::pair<std::string, std::string> *>(user);
        const char *const dot = std::strrchr(type->id, '.');
        if (name == type->id || (dot && name == dot + 1)) found = file;
      },
      &named);
  return named.second;
}

void add_check(Command app, Globals &globals, int *exit_code) {
  Command sub = app.command("plugin").command(kCheck.name, kCheck.about);
  auto request = std::make_shared<check::Request>();
  sub.option("FILE", request->file, "plugin file, or short name or full id of a plugin that is found")
      .required();
  sub.option("--seed", request->seed, "of the random inputs").type_name("N");
  sub.option("--only", request->only, "run this rule alone; may be repeated").type_name("ID");
  sub.option("--limit", request->limit, "processor time that a rule may take, s")
      .positive()
      .type_name("SECONDS");
  sub.flag("--in-process", request->in_process,
           "run the rules in this process, for a debugger: what crashes ends the command");
  // What the command says to its own processes.
  sub.option("--rule", request->rule).hidden();
  sub.option("--type", request->type).hidden();
  sub.option("--digest", request->digest).hidden();
  sub.option("--report-to", request->report).hidden();
  sub.calls([=, &globals] {
    request->file = file_of(request->file, globals);
    *exit_code = check::run(globals, *request);
  });
}

}  // namespace
}  // namespace cli

int main(int argc, char **argv) { return cli::command_line(argc, argv, cli::add_check); }
