// deform-check, which `deform plugin check FILE` starts: a run of the rules and a report.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "arguments.h"
#include "become.h"
#include "check/groups.h"
#include "check/plugin.h"
#include "check/runner.h"
#include "json_text.h"
#include "leaving.h"
#include "messages.h"
#include "system.h"

namespace cli::check {
namespace {

struct Request {
  std::string file;
  uint64_t seed = 1;
  std::vector<std::string> only;
  bool in_process = false;
  double limit = 10;  // s of processor time for each rule
  // What this program says to itself: which rule of which type, or whose digest, and where to report.
  std::string rule;
  int type = -1, digest = -1, report = -1;
};
struct Line {
  const Rule *rule;
  Verdict verdict;
  double seconds;
  bool late = false, ended = false;  // did not come back; or crashed: no verdict of its own
};
struct TypeName {
  uint32_t kind;
  bool usable;  // its parameters can be read, and it has the functions that every use of it calls
  std::string id;
};
struct Report {
  std::vector<Line> file;
  std::vector<TypeName> types;
  std::vector<std::vector<Line>> by_type;
};

const char *const kNotLoaded = "it does not load (V02 says why)";
const char *const kUnusable = "it cannot be used (V03 says why)";
const char *const kEnded = "two rules crashed or did not return; fix them first";

// The rules of a file that call the functions of its types.
bool uses_types(const Rule &rule) { return std::string(rule.id) == "V09" || std::string(rule.id) == "V12"; }

// ---- a rule of this file, in this process -----------------------------------------------------------------

Subject subject_of(const Request &request) {
  Subject s;
  s.file = cli::name_of(std::filesystem::absolute(path_of(request.file)));
  s.seed = request.seed;
  s.limit = request.limit;
  s.command = os::own_file();
  return s;
}

// type < 0: a rule about the file. V01 loads nothing, V12 loads it itself, V02 reports a failed load.
Verdict judge(const Request &request, const Rule &rule, int type) {
  Subject subject = subject_of(request);
  const std::string id = rule.id;
  if (id == "V01" || id == "V12") return run_here(rule, subject);
  std::unique_ptr<Plugin> plugin;
  try {
    plugin = std::make_unique<Plugin>(subject.file);
  } catch (const Broken &) {
    if (id != "V02") return {Result::skip, kNotLoaded};
  }
  subject.plugin = plugin.get();
  if (type >= 0) {
    if (static_cast<size_t>(type) >= plugin->types().size())
      return {Result::fail,
              "the number of types differs between two loads of the plugin; return constant tables"};
    subject.index = static_cast<uint32_t>(type);
    subject.type = plugin->types()[subject.index];
  }
  return run_here(rule, subject);
}

std::string digest_text(const Request &request) {
  Subject subject = subject_of(request);
  Plugin plugin(subject.file);
  subject.plugin = &plugin;
  subject.index = static_cast<uint32_t>(request.digest);
  subject.type = plugin.types().at(subject.index);
  return text("%016llx",
              static_cast<unsigned long long>(subject.type->kind == DFM_KIND_MODEL ? digest_of_model(subject)
                                                                                   : digest(subject)));
}

// "1 1 org.example.law" by lines: what the file offers, kind, whether it can be used, id.
std::string listed(const std::string &file) {
  std::string out;
  try {
    const Plugin plugin(file);
    for (uint32_t i = 0; i < plugin.types().size(); ++i)
      out += std::to_string(plugin.types()[i]->kind) +
             (unusable(*plugin.types()[i]).empty() ? " 1 " : " 0 ") + name_of(*plugin.types()[i], i) + "\n";
  } catch (const Broken &) {}
  return out;
}

int child(const Request &request) {
  report_to(request.report);
  suppress_crash_dialogs();
  leave(kDone);  // how it ends is for the parent to judge
  if (request.digest >= 0) send_verdict({Result::pass, digest_text(request)});
  else if (const Rule *rule = find_rule(request.rule)) send_verdict(judge(request, *rule, request.type));
  else send_verdict({Result::pass, listed(request.file)});
  return kDone;
}

// ---- all of them ------------------------------------------------------------------------------------------

std::vector<std::string> arguments(const Request &request, const std::string &rule, int type) {
  return {"plugin",
          "check",
          request.file,
          "--rule",
          rule,
          "--type",
          std::to_string(type),
          "--seed",
          std::to_string(request.seed),
          "--limit",
          text("%.17g", request.limit)};
}

// What a sanitizer wrote, in one line; empty where it was silent.
std::string sanitizer_line(const std::string &said) {
  for (const char *mark : {"SUMMARY: ", "runtime error: "})
    if (const size_t at = said.find(mark); at != std::string::npos) {
      const size_t begin = said.rfind('\n', at) == std::string::npos ? 0 : said.rfind('\n', at) + 1;
      return said.substr(begin, said.find('\n', at) - begin);
    }
  return "";
}

Line run_rule(const Request &request, const Rule &rule, int type) {
  if (request.in_process) return {&rule, judge(request, rule, type), 0};
  // V09 counts what is on the heap: only a fresh image has a heap without a past.
  const bool fresh = std::string(rule.id) == "V09";
  const std::string command = subject_of(request).command;
  const std::vector<std::string> words = arguments(request, rule.id, type);
  const Outcome a = fresh ? in_fresh_process(command, words, {request.limit})
                          : in_own_process([&] { send_verdict(judge(request, rule, type)); }, command, words,
                                           {request.limit});
  Line line{&rule, a.verdict, a.seconds, a.late, a.late || !a.spoke};
  const std::string found = sanitizer_line(a.said);
  if (!a.spoke)
    line.verdict = {Result::fail,
                    "it " + a.ending + (a.at.empty() ? "" : " (" + a.at + ")") +
                        (found.empty() ? "" : ": " + found) +
                        "; return in bounded time for every input, and access only the given arrays"};
  else if (!found.empty() && a.verdict.result != Result::fail)
    line.verdict = {Result::fail,
                    "the sanitizer reports " + found + "; fix this even if the results look right"};
  return line;
}

const char *word(Result r) { return r == Result::pass ? "pass" : r == Result::fail ? "fail" : "skip"; }

void print_line(const Line &l, bool quiet) {
  if (l.verdict.result == Result::fail)
    std::printf("  %s FAIL  %s\n            %s\n", l.rule->id, l.rule->title, l.verdict.detail.c_str());
  else if (!quiet)
    std::printf("  %s %s  %s%s%s%s\n", l.rule->id, word(l.verdict.result), l.rule->title,
                l.verdict.detail.empty() ? "" : " (", l.verdict.detail.c_str(),
                l.verdict.detail.empty() ? "" : ")");
  std::fflush(stdout);
}

// What stops one rule stops most of them: a missing function or a parameter table that cannot be read, which
// V03 names, and an eval that crashes or does not come back, which two rules have seen. The other rules are
// then skipped, and one line says why.
class Rules {
 public:
  Rules(const Globals &globals, const Request &request, const std::vector<const Rule *> &wanted)
      : globals_(globals), request_(request), wanted_(wanted) {}
  Report run() {
    if (!globals_.json) std::printf("%s\n", request_.file.c_str());
    list_types();
    const bool usable = std::ranges::all_of(report_.types, [](const TypeName &type) { return type.usable; });
    for (const Rule *rule : wanted_)
      if (!rule->by_type) one(report_.file, *rule, -1, !usable && uses_types(*rule) ? kUnusable : nullptr);
      else if (report_.types.empty()) add(report_.file, {rule, {Result::skip, kNotLoaded}, 0});
    say_skipped(kNotLoaded);
    // Rules that cannot run because there is no law are left out: the rule that reports the reason runs
    // beside them. So are those of a type that cannot be used.
    if (report_.types.empty() && !wants("V02")) one(report_.file, *find_rule("V02"), -1);
    const bool told = std::ranges::any_of(
        report_.file, [](const Line &line) { return line.verdict.result == Result::fail; });
    if (!unlisted_.empty() && !told) add(report_.file, {find_rule("V03"), {Result::fail, unlisted_}, 0});
    for (size_t t = 0; t < report_.types.size(); ++t) {
      const TypeName &type = report_.types[t];
      report_.by_type.emplace_back();
      if (!globals_.json) std::printf("%s %s\n", kind_name(type.kind), type.id.c_str());
      const Rule *const names = find_rule("V03");
      if (!type.usable && !wants("V03")) one(report_.by_type.back(), *names, static_cast<int>(t));
      for (const Rule *rule : wanted_)
        if (rule->by_type && check_for(*rule, type.kind))
          one(report_.by_type.back(), *rule, static_cast<int>(t),
              type.usable || rule == names ? nullptr : kUnusable);
      say_skipped(kUnusable);
      if (!globals_.json && type.kind == DFM_KIND_SOLVER)
        std::printf("  rules for solvers are not available yet\n");
    }
    say_skipped(kEnded);
    return std::move(report_);
  }

 private:
  void list_types() {
    std::string types;
    if (request_.in_process) {
      types = listed(request_.file);
    } else {
      const Outcome a =
          in_own_process([&] { send_verdict({Result::pass, listed(request_.file)}); },
                         subject_of(request_).command, arguments(request_, "", -1), {request_.limit});
      types = a.verdict.detail;
      if (!a.spoke) unlisted_ = "it " + a.ending + " while its types were listed; return constant tables";
      ended_ += a.late;
      hung_ = a.late;
    }
    for (size_t at = 0, end; (end = types.find('\n', at)) != std::string::npos; at = end + 1) {
      const size_t flag = types.find(' ', at) + 1;
      report_.types.push_back({static_cast<uint32_t>(std::stoul(types.substr(at))), types[flag] == '1',
                               types.substr(flag + 2, end - flag - 2)});
    }
  }
  bool wants(const char *id) const { return std::ranges::find(wanted_, find_rule(id)) != wanted_.end(); }
  // why: not to be run at all
  void one(std::vector<Line> &to, const Rule &rule, int type, const char *why = nullptr) {
    // What it was that crashed V06 says: it names the array.
    const bool reports = !hung_ && std::string(rule.id) == "V06";
    if (!why && ended_ >= kEnough && !reports) why = kEnded;
    if (why) return add(to, {&rule, {Result::skip, why}, 0});
    add(to, run_rule(request_, rule, type));
    ended_ += to.back().ended;
    hung_ = hung_ || to.back().late;
  }
  // A line is printed when it is there: who waits sees what is done.
  void add(std::vector<Line> &to, Line line) {
    to.push_back(std::move(line));
    const Verdict &verdict = to.back().verdict;
    if (verdict.result == Result::skip)
      for (const char *why : {kNotLoaded, kUnusable, kEnded})
        if (verdict.detail == why) {
          skipped_.insert(why);
          return;
        }
    if (!globals_.json) print_line(to.back(), globals_.quiet);
  }
  // One line for all rules that were skipped for this reason, so that what stopped them stays in sight.
  void say_skipped(const char *why) {
    if (skipped_.erase(why) && !globals_.json && !globals_.quiet)
      std::printf("  the other rules are skipped: %s\n", why);
  }
  static constexpr int kEnough = 2;
  const Globals &globals_;
  const Request &request_;
  const std::vector<const Rule *> &wanted_;
  Report report_;
  int ended_ = 0;  // rules that gave no verdict
  bool hung_ = false;
  std::string unlisted_;  // why there is no list of types; empty: there is one, or it does not load
  std::set<std::string> skipped_;
};

// ---- report -----------------------------------------------------------------------------------------------

std::string json_lines(const std::vector<Line> &lines) {
  std::vector<std::string> out;
  for (const Line &l : lines)
    out.push_back(json_object("id", quoted(l.rule->id), "title", quoted(l.rule->title), "result",
                              quoted(word(l.verdict.result)), "detail", quoted(l.verdict.detail), "cpu_s",
                              std::round(1e4 * l.seconds) / 1e4));
  return json_array(out);
}

int print_report(const Globals &globals, const Request &request, const Report &report) {
  uint32_t count[3] = {0, 0, 0};
  for (const auto *lines : {&report.file})
    for (const Line &l : *lines) ++count[static_cast<int>(l.verdict.result)];
  for (const auto &lines : report.by_type)
    for (const Line &l : lines) ++count[static_cast<int>(l.verdict.result)];
  const int code = count[static_cast<int>(Result::fail)] ? kFound : kDone;
  if (globals.json) {
    std::vector<std::string> types;
    for (size_t t = 0; t < report.types.size(); ++t)
      types.push_back(json_object("kind", quoted(kind_name(report.types[t].kind)), "id",
                                  quoted(report.types[t].id), "rules", json_lines(report.by_type[t])));
    JsonObject o;
    o.add("file", quoted(request.file), "seed", request.seed, "rules", json_lines(report.file), "types",
          json_array(types), "passed", count[0], "failed", count[1], "skipped", count[2]);
    std::fputs(indented(o.text()).c_str(), stdout);
    return code;
  }
  std::printf("%u passed, %u failed, %u skipped\n", count[0], count[1], count[2]);
  return code;
}

// kDone all kept or skipped, kFound a rule is broken, kBadInput no such file or rule.
int run(const Globals &globals, const Request &request) {
  if (request.report >= 0) return child(request);
  std::error_code error;
  if (!std::filesystem::is_regular_file(path_of(request.file), error))
    return fail(
        request.file + ": " +
        (std::filesystem::exists(path_of(request.file), error) ? "is no file" : "there is no such file") +
        "; expected the shared library of a plugin, such as ./mylaw.so, or a name of deform plugin list");
  std::vector<const Rule *> wanted;
  for (const std::string &id : request.only) {
    const Rule *rule = find_rule(id);
    if (!rule)
      return fail("--only: there is no rule \"" + id + "\"; rules are V01 to V14, F01 to F17 and M01 to M23");
    wanted.push_back(rule);
  }
  for (const Rule &rule : rules())
    if (request.only.empty()) wanted.push_back(&rule);
  return print_report(globals, request, Rules(globals, request, wanted).run());
}

// The file of a plugin that is found by its short name or full id; the same text where it is none of them.
std::string file_of(const std::string &text, const Globals &globals) {
  std::error_code error;
  const std::filesystem::file_status here = std::filesystem::status(path_of(text), error);
  if ((exists(here) && !is_directory(here)) || text.find('/') != std::string::npos) return text;
  const std::unique_ptr<dfm_context, decltype(&dfm_context_destroy)> context(make_context(globals),
                                                                             dfm_context_destroy);
  std::map<std::string, std::string> file_of_id;
  dfm_plugin_visit(
      context.get(),
      [](void *user, const dfm_type *type, const char *file) {
        (*static_cast<std::map<std::string, std::string> *>(user))[type->id] = file;
      },
      &file_of_id);
  if (const auto whole = file_of_id.find(text); whole != file_of_id.end()) return whole->second;
  std::erase_if(file_of_id, [&](const auto &one) { return !one.first.ends_with("." + text); });
  const auto elsewhere = [&](const auto &one) { return one.second != file_of_id.begin()->second; };
  if (std::ranges::any_of(file_of_id, elsewhere))
    throw Failure(kBadInput, text + ": several plugins have this short name; give the id, as " +
                                 file_of_id.begin()->first);
  return file_of_id.empty() ? text : file_of_id.begin()->second;
}

void add_check(Command app, Globals &globals, int *exit_code) {
  Command sub = app.command("plugin").command(kCheck.name, kCheck.about);
  auto request = std::make_shared<Request>();
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
    *exit_code = run(globals, *request);
  });
}

}  // namespace
}  // namespace cli::check

int main(int argc, char **argv) { return cli::command_line(argc, argv, cli::check::add_check); }
