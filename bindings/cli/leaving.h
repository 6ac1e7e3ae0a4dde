// How this process may end. A plugin that calls exit, crashes or never returns must not look like a run that
// is done: what ends the process before the command has decided on its exit code ends it with another one
// than 0, and a sentence on standard error names the plugin that was at work.
#pragma once
#include <string>

namespace cli {

// Beside those of cli.h: code that is not ours ended the process.
enum { kEndedByPlugin = 4 };

void guard_leaving();                            // first thing in main()
int leave(int exit_code);                        // the command has decided; returns exit_code
void results_lie_in(const std::string &folder);  // for the sentence; empty: nowhere
// After a signal to end: unless came_back() is called the process ends by itself,
// after kGraceInPlugin s where a plugin is at work by then, and after kGrace s in any case. For
// handlers of signals.
void expect_return();
void came_back();

}  // namespace cli
