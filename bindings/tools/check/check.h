// `deform plugin check`: rules that a plugin must keep, one table (table.cpp), one file per group of
// rules. A rule is a function that returns (pass, with what it measured), throws Broken (the sentence says
// what follows from it and what to do) or throws Skipped (with the reason). runner.cpp gives each rule a
// process of its own.
#pragma once
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/error.h"
#include "deform/deform.h"

namespace cli::check {

struct Broken : std::runtime_error { using std::runtime_error::runtime_error; };
struct Skipped : std::runtime_error { using std::runtime_error::runtime_error; };
[[noreturn]] void broken(const char *format, ...) DEFORM_PRINTF(1, 2);
[[noreturn]] void skip(const char *format, ...) DEFORM_PRINTF(1, 2);
std::string text(const char *format, ...) DEFORM_PRINTF(1, 2);

enum class Result { pass, fail, skip };
struct Verdict {
  Result result = Result::pass;
  std::string detail;
};

class Plugin;
// What a rule works on. type is null for rules about the file alone.
struct Subject {
  std::string file;
  uint64_t seed = 1;
  Plugin *plugin = nullptr;
  const dfm_type *type = nullptr;
  uint32_t index = 0;   // of the type in the file
  std::string command;  // this program, for rules that start a second process
  double limit = 10;    // s of processor time that the rule may take
};

using Check = std::string(const Subject &);
struct Rule {
  const char *id, *title;
  bool by_type;  // runs once for each type, else once for the file
  // null: does not apply to that kind of type; law: also what runs for the file
  Check *law = nullptr, *model = nullptr, *solver = nullptr;
};
const std::vector<Rule> &rules();
const Rule *find_rule(const std::string &id);

// What runs for a type of this kind, DFM_KIND_*; null: nothing.
Check *check_for(const Rule &rule, uint32_t kind);

// Runs one rule here and now.
Verdict run_here(const Rule &rule, const Subject &subject);

// Hash of the outputs of fixed batches, which V07 compares with another process (`--digest TYPE`).
uint64_t digest(const Subject &subject);

}  // namespace cli::check
