// Where figures were taken: the first two columns of results/*.csv. Which rows such a table has already.
#pragma once
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <set>
#include <string>

namespace bench {

inline const char *compiler() {
#if defined(__clang__)
  return "clang " __clang_version__;
#else
  return "gcc " __VERSION__;
#endif
}

inline std::string machine() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  return "unknown";
}

// s of processor time: of this thread, of the program.
inline double seconds_of(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}
inline double cpu_seconds() { return seconds_of(CLOCK_THREAD_CPUTIME_ID); }
inline double process_seconds() { return seconds_of(CLOCK_PROCESS_CPUTIME_ID); }

// The least of the repetitions counts: others share the machine.
template <class Work>
double least_ns(int repetitions, const Work &work) {
  double least = 1e300;
  for (int n = 0; n < repetitions; ++n) {
    const double start = cpu_seconds();
    work();
    least = std::min(least, 1e9 * (cpu_seconds() - start));
  }
  return least;
}

// A sentence as one column.
inline std::string quoted(std::string text) {
  std::replace(text.begin(), text.end(), '"', '\'');
  return '"' + text + '"';
}

// Rows for results/*.csv, where the program was called with --csv FILE --commit HASH.
struct Csv {
  std::FILE *csv = nullptr;
  std::string head;  // machine, compiler, commit
  // columns: those behind the head's.
  Csv(int argc, char **argv, const char *columns) {
    std::string commit = "unknown";
    for (int n = 1; n + 1 < argc; n += 2) {
      if (!std::strcmp(argv[n], "--csv")) csv = std::fopen(argv[n + 1], "a");
      if (!std::strcmp(argv[n], "--commit")) commit = argv[n + 1];
    }
    head = machine() + "," + compiler() + "," + commit;
    if (csv && std::ftell(csv) == 0) std::fprintf(csv, "machine,compiler,commit,%s\n", columns);
  }
  ~Csv() {
    if (csv) std::fclose(csv);
  }
  Csv(const Csv &) = delete;
  Csv &operator=(const Csv &) = delete;
};

// Of each row the text of `count` columns after the first `skip`.
inline std::set<std::string> names_in(const std::string &path, int skip, int count) {
  std::set<std::string> names;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    size_t begin = 0;
    for (int i = 0; i < skip && begin < line.size(); ++i)
      begin = std::min(line.find(',', begin), line.size() - 1) + 1;
    size_t end = begin;
    for (int i = 0; i < count && end < line.size(); ++i)
      end = std::min(line.find(',', end + (i > 0)), line.size());
    if (end > begin) names.insert(line.substr(begin, end - begin));
  }
  return names;
}

}  // namespace bench
