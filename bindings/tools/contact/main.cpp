// deform-contact, which `deform contact` starts: solves contact problems of files, one line each, and sums.
//
//     deform-contact [--json] [--export DIR] -- FILE|FOLDER...
//
// Beside those of Siconos: how many of its solvers have found a solution, and how long the fastest took, from
// siconos_results.txt in the same folder where there is one.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

#include "core/file.h"
#include "json_text.h"
#include "solve.h"

namespace fs = std::filesystem;

namespace contact {
namespace {

struct Options {
  bool json = false;
  std::string folder;  // for FCLIB's form; empty: none is written
  std::vector<std::string> paths;
};

bool is_problem(const fs::path &path) {
  const fs::path end = path.extension();
  return end == ".contact" || end == ".dat" || end == ".hdf5";
}

std::vector<std::string> files_of(const std::vector<std::string> &paths) {
  std::vector<std::string> out;
  for (const std::string &path : paths) {
    const size_t before = out.size();
    if (!fs::is_directory(path)) {
      out.push_back(path);
      continue;
    }
    for (const auto &file : fs::recursive_directory_iterator(path))
      if (is_problem(file.path())) out.push_back(file.path().string());
    if (out.size() == before)
      throw std::runtime_error(path + ": no contact problem (.contact, .hdf5, .dat) lies there");
    std::sort(out.begin() + std::ptrdiff_t(before), out.end());
  }
  return out;
}

// "4 of 5, 0.08 s" of Siconos' solvers; names are cut in its table.
std::string of_siconos(const fs::path &path) {
  std::ifstream in(path.parent_path() / "siconos_results.txt");
  const std::string name = path.filename().string();
  uint32_t tried = 0, solved = 0;
  double best = HUGE_VAL;
  for (std::string line; std::getline(in, line);) {
    const std::string first = line.substr(0, line.find(' '));
    if (!name.starts_with(first) || (first.size() < 38 && first != name)) continue;
    ++tried;
    const size_t cpu = line.find("cpu=");
    if (line.find("info=0") == std::string::npos || cpu == std::string::npos) continue;
    ++solved;
    best = std::min(best, std::strtod(line.c_str() + cpu + 4, nullptr));
  }
  if (!tried) return "";
  std::ostringstream out;
  out << solved << " of " << tried;
  if (solved) out << ", " << best << " s";
  return out.str();
}

// Sums over problems of one kind.
struct Sums {
  const char *kind;
  uint32_t read = 0, solved = 0;
  uint64_t passes = 0, steps = 0, products = 0;
  uint32_t most_passes = 0, most_steps = 0, most_products = 0;
  double seconds = 0;
  void add(const Result &r) {
    ++read;
    solved += r.solved;
    passes += r.passes;
    steps += r.steps;
    products += r.products;
    most_passes = std::max(most_passes, r.passes);
    most_steps = std::max(most_steps, r.steps);
    most_products = std::max(most_products, r.products);
    seconds += r.seconds;
  }
  double mean(uint64_t sum) const { return double(sum) / std::max(1u, read); }
};

// JSON has no NaN.
std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", x);
  return std::isfinite(x) ? text : "null";
}

class Run {
 public:
  explicit Run(const Options &options) : options_(options) {
    dfm_context_def def = dfm_context_def_default();
    if (dfm_context_create(&def, &context_) != DFM_OK) throw std::runtime_error(dfm_last_error());
  }
  Run(const Run &) = delete;
  Run &operator=(const Run &) = delete;
  ~Run() { dfm_context_destroy(context_); }

  // Whether all have been read and solved.
  bool all() {
    files_ = files_of(options_.paths);
    if (options_.json) std::printf("{\"problems\": [");
    else
      std::printf("%-44s %4s %9s %3s %5s %5s %6s %4s %8s %8s %7s  %s\n", "problem", "nc", "rank", "run",
                  "pass", "step", "prod", "fact", "error", "m/s", "s", "Siconos");
    for (const std::string &path : files_) one(path);
    if (options_.json) std::printf("\n], \"kinds\": [");
    uint32_t solved = 0, read = 0;
    for (const Sums &s : sums_) {
      solved += s.solved;
      read += s.read;
      if (options_.json)
        std::printf(
            "%s\n  {\"kind\": \"%s\", \"read\": %u, \"solved\": %u, \"seconds\": %s, \"passes\": [%s, %u], "
            "\"steps\": [%s, %u], \"products\": [%s, %u]}",
            &s == sums_ ? "" : ",", s.kind, s.read, s.solved, number(s.seconds).c_str(),
            number(s.mean(s.passes)).c_str(), s.most_passes, number(s.mean(s.steps)).c_str(), s.most_steps,
            number(s.mean(s.products)).c_str(), s.most_products);
      else if (s.read > 0)
        std::printf(
            "%s: %u of %u solved in %.3g s; passes %.1f mean, %u most; Newton steps %.1f, %u; products "
            "%.1f, %u\n",
            s.kind, s.solved, s.read, s.seconds, s.mean(s.passes), s.most_passes, s.mean(s.steps),
            s.most_steps, s.mean(s.products), s.most_products);
    }
    if (options_.json) std::printf("\n], \"refused\": %u}\n", refused_);
    return refused_ == 0 && solved == read;
  }

 private:
  const Options &options_;
  dfm_context *context_ = nullptr;
  Sums sums_[3] = {{"explicit"}, {"implicit"}, {"of others"}};
  uint32_t refused_ = 0, lines_ = 0;
  std::vector<std::string> files_;
  std::map<std::string, std::string> written_;  // from which problem

  // Problems of several runs have the same names; a folder may be that of the problems.
  void write(const std::string &path, const std::string &to, const LocalProblem &form) {
    const auto is = [&](const std::string &file) {
      std::error_code absent;
      return fs::equivalent(file, to, absent);
    };
    if (std::ranges::any_of(files_, is))
      throw std::runtime_error("the export would replace " + to + "; give another folder");
    const auto [other, first] = written_.try_emplace(to, path);
    if (!first)
      throw std::runtime_error("not exported: " + to + " is that of " + other->second +
                               "; export each folder by itself");
    write_local_problem(to, form);
  }

  void one(const std::string &path) {
    const bool captured = path.ends_with(".contact");
    try {
      Result r;
      LocalProblem form;
      if (captured) {
        const dfm::Array<char> bytes =
            dfm::read_whole_file(dfm::Memory::standard(), path, dfm::kMaxMeshBytes, "a contact problem");
        dfm::ContactProblem problem;
        problem.read({bytes.data(), bytes.size()});
        r = solve(problem, context_, form);
      } else {
        form = read_local_problem(path);
        r = solve(form);
      }
      sums_[!captured ? 2 : r.implicit].add(r);
      print(path, r);
      if (options_.folder.empty()) return;
      if (form.mu.empty())
        std::fprintf(stderr, "deform: %s is not exported: a law of it remembers, or something is attached\n",
                     path.c_str());
      else write(path, options_.folder + "/" + fs::path(path).stem().string() + ".hdf5", form);
    } catch (const std::exception &e) {
      ++refused_;
      std::fprintf(stderr, "deform: %s: %s\n", path.c_str(), e.what());
    }
  }
  void print(const std::string &path, const Result &r) {
    const std::string name = fs::path(path).filename().string();
    const uint32_t size = 3 * (r.contacts + r.bonds);
    if (options_.json) {
      std::printf(
          "%s\n  {\"file\": %s, \"contacts\": %u, \"attachments\": %u, \"rank\": %u, \"implicit\": %s, "
          "\"solved\": %s, \"runs\": %u, \"passes\": %u, \"steps\": %u, \"products\": %u, \"factors\": %u, "
          "\"error\": %s, \"speed\": %s, \"seconds\": %s}",
          lines_++ ? "," : "", cli::quoted(path).c_str(), r.contacts, r.bonds, r.rank,
          r.implicit ? "true" : "false", r.solved ? "true" : "false", r.runs, r.passes, r.steps, r.products,
          r.factors, number(r.error).c_str(), number(r.speed).c_str(), number(r.seconds).c_str());
      return;
    }
    std::printf("%-44s %4u %4u/%4u %3u %5u %5u %6u %4u %8.1e %8.1e %7.3f  %s%s\n", name.c_str(), r.contacts,
                r.rank, size, r.runs, r.passes, r.steps, r.products, r.factors, r.error, r.speed, r.seconds,
                of_siconos(path).c_str(), r.solved ? "" : "  UNSOLVED");
    std::fflush(stdout);
  }
};

int run(int argc, char **argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--json") options.json = true;
    else if (word == "--export" && i + 1 < argc) options.folder = argv[++i];
    else if (word == "--") options.paths.assign(argv + i + 1, argv + argc);
    if (word == "--") break;
  }
  if (!options.folder.empty()) fs::create_directories(options.folder);
  return Run(options).all() ? 0 : 1;
}

}  // namespace
}  // namespace contact

int main(int argc, char **argv) {
  try {
    return contact::run(argc, argv);
  } catch (const std::exception &e) {
    std::fprintf(stderr, "deform: %s\n", e.what());
    return 2;
  }
}
