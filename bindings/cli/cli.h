// The `deform` command: one cmd_*.cpp per subcommand, each on the public API only.
#pragma once
#include <string>
#include <vector>

#include "deform/deform.h"

namespace cli {

class Command;

// Exit codes of interfaces: 0 done, 2 bad usage or input, 3 the simulation stopped itself. Beside them: 1 a
// check was made and found something, 4 a plugin ended the process (leaving.h), 130 a signal did.
enum Exit { kDone = 0, kFound = 1, kBadInput = 2, kStopped = 3 };

struct Globals {
  bool quiet = false;
  bool json = false;
  unsigned threads = 1;
  std::vector<std::string> words;  // of the command line, behind the program's name
};

// The command line's own; what is logged follows them.
Globals &session_globals();

// Prints "deform: <sentence>" to stderr and returns kBadInput.
int fail(const std::string &sentence);

// A context with the command's options; prints the sentence and exits the process with 2 where that fails.
dfm_context *make_context(const Globals &globals);
// The next make_context() returns this one, which its caller then owns.
void offer_context(dfm_context *context);

// Writes contact problems of a world from now on: unsolved ones, and every `every`-th (0: no other).
using CaptureProblems = void(dfm_world world, const std::string &folder, uint32_t every);

// Each adds its subcommand; the callback stores its exit code in *exit_code.
// capture: for --contact-problems; null: the command becomes deform-capture there.
void add_run(Command app, Globals &globals, int *exit_code, CaptureProblems *capture);
void add_replay(Command app, Globals &globals, int *exit_code);
void add_mesh(Command app, Globals &globals, int *exit_code);
void add_plugin(Command app, Globals &globals, int *exit_code);
void add_contact(Command app, Globals &globals, int *exit_code);
void add_study(Command app, const Globals &globals, const char *name, const char *about);
void add_worker(Command app, Globals &globals, int *exit_code);   // for deform.sweep; not listed in --help
void add_montage(Command app, Globals &globals, int *exit_code);  // for `make demo`; not listed in --help

// Reads the command line by the subcommands that `add` adds and calls the one that is meant; all of main().
using AddCommands = void(Command, Globals &, int *);
int command_line(int argc, char **argv, AddCommands *add);

}  // namespace cli
