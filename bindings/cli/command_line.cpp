// What the command and the programs beside it do with their command line: global options, errors to exit
// codes.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>

#include "arguments.h"
#include "cli.h"
#include "leaving.h"
#include "messages.h"

namespace cli {
namespace {

Globals &globals = session_globals();

std::vector<CLI::App *> children(CLI::App *app) {
  return app->get_subcommands([](CLI::App *sub) { return !sub->get_group().empty(); });
}

// --quiet, --threads and --json belong to every subcommand, wherever they are written.
void add_common(CLI::App *app) {
  for (CLI::App *sub : children(app)) {
    sub->add_flag("--quiet", globals.quiet, "print results and errors only");
    sub->add_flag("--json", globals.json, "machine-readable output");
    sub->add_option("--threads", globals.threads, "worker threads; 0: one per processor")
        ->check(CLI::Range(0, 1024))
        ->type_name("N");
    add_common(sub);
  }
}

// The subcommand that was reached, or the application: what a word was meant for.
CLI::App *reached(CLI::App *app) {
  for (CLI::App *sub : app->get_subcommands()) return reached(sub);
  return app;
}

std::string nearest_to(const std::string &word, CLI::App *app) {
  std::vector<std::string> valid;
  for (const CLI::App *sub : children(app)) valid.push_back(sub->get_name());
  for (const CLI::Option *option : app->get_options())
    for (const std::string &name : option->get_lnames()) valid.push_back("--" + name);
  return nearest(word, valid);
}

std::string path_of(CLI::App *app) {
  return app->get_parent() ? path_of(app->get_parent()) + " " + app->get_name() : "deform";
}

// "Could not convert: --cells = 1e9" says what was read, not what was expected: whole numbers are those whose
// option is shown as N.
std::string not_a_number(const std::string &text, CLI::App *at) {
  for (const CLI::Option *option : at->get_options()) {
    const std::string begin = "Could not convert: " + option->get_name() + " = ";
    if (text.rfind(begin, 0) != 0) continue;
    if (option->get_type_size() > 1)
      return option->get_name() + ": expected " + option->get_type_name() + ", found \"" +
             text.substr(begin.size()) + "\"";
    return option->get_name() + ": expected " +
           (option->get_type_name()[0] == 'N' ? "a whole number, 0 or more" : "a number") + ", found \"" +
           text.substr(begin.size()) + "\"";
  }
  return text;
}

int value_count(const CLI::Option *option) { return option->get_type_size() * option->get_expected_min(); }

// "--frames: 1 required FPS missing" becomes "--frames needs a value: FPS".
std::string value_missing(const std::string &text, const CLI::App *at) {
  for (const CLI::Option *option : at->get_options())
    if (text.rfind(option->get_name() + ": ", 0) == 0 && text.find(" required ") != std::string::npos)
      return option->get_name() +
             (value_count(option) > 1 ? " needs " + std::to_string(value_count(option)) + " values: "
                                      : " needs a value: ") +
             option->get_type_name();
  return text;
}

int bad_usage(CLI::App &app, const CLI::ParseError &error) {
  CLI::App *at = reached(&app);
  std::string text = error.what();
  const std::vector<std::string> extra = app.remaining(true);
  if (dynamic_cast<const CLI::ExtrasError *>(&error) && !extra.empty()) {
    text = "\"" + extra[0] + "\" is not expected here";
    const std::string near = nearest_to(extra[0].substr(0, extra[0].find('=')), at);
    if (!near.empty()) text += "; did you mean \"" + near + "\"?";
  } else if (dynamic_cast<const CLI::RequiredError *>(&error) && at->get_subcommands().empty() &&
             !children(at).empty()) {
    std::vector<std::string> names;
    text = "a subcommand is needed:";
    for (const CLI::App *sub : children(at)) text += (text.back() == ':' ? " " : ", ") + sub->get_name();
    if (!extra.empty()) {
      const std::string wrong = "there is no subcommand \"" + extra[0] + "\"; ";
      const std::string near = nearest_to(extra[0], at);
      text = wrong + (near.empty() ? text : "did you mean \"" + near + "\"?");
    }
  }
  if (dynamic_cast<const CLI::ConversionError *>(&error)) text = not_a_number(text, at);
  if (dynamic_cast<const CLI::ArgumentMismatch *>(&error)) text = value_missing(text, at);
  std::replace(text.begin(), text.end(), '\n', ' ');
  return fail(text + " (see: " + path_of(at) + " --help)");
}

}  // namespace

}  // namespace cli

namespace {

// CLI11's validators are globals that take memory before main() and its handlers: where there is none the
// command ends there with its sentence.
std::terminate_handler before_main;
[[gnu::constructor(101)]] void say_before_main() {
  before_main = std::set_terminate([] {
    std::fputs("deform: the command could not start: out of memory\n", stderr);
    std::_Exit(cli::kBadInput);
  });
}

int run(int argc, char **argv, cli::AddCommands *add) {
  int exit_code = cli::kDone;
  CLI::App app{"Deformable bodies in contact with real friction.", "deform"};
  app.set_version_flag("--version", dfm_version(nullptr, nullptr, nullptr));
  const cli::Command top(&app);
  app.require_subcommand(1);
  app.allow_windows_style_options(false);  // what begins with "/" is a file on every system
  cli::globals.words.assign(argv + std::min(argc, 1), argv + argc);
  add(top, cli::globals, &exit_code);
  cli::add_common(&app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success &success) {  // --help, --version
    return app.exit(success);
  } catch (const CLI::ParseError &error) {
    return cli::bad_usage(app, error);
  } catch (const cli::Failure &failure) {
    cli::fail(failure.what());
    return failure.exit_code;
  }
  return exit_code;
}

}  // namespace

// Whatever run() throws, its own set-up and its error paths included, ends in an exit code; the sentence
// takes no memory.
int cli::command_line(int argc, char **argv, AddCommands *add) {
  std::set_terminate(before_main);
  cli::guard_leaving();
  try {
    const int code = run(argc, argv, add);
    if ((std::fflush(stdout) == 0 && !std::ferror(stdout)) || code != cli::kDone) return cli::leave(code);
    std::fputs("deform: standard output cannot be written; what it got may be cut short\n", stderr);
  } catch (const std::bad_alloc &) {
    std::fputs("deform: out of memory\n", stderr);
  } catch (const std::exception &error) {
    std::fprintf(stderr, "deform: %s\n", error.what());
  }
  return cli::leave(cli::kBadInput);
}
