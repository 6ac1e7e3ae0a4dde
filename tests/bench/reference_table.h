// What contact_reference measures: rows that are run two at a time, printed as Markdown, and put into the
// page between its markers.
#pragma once
#include <atomic>
#include <cstdarg>
#include <cstdio>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace bench {

inline std::string text(const char *format, ...) {
  char out[512];
  va_list args;
  va_start(args, format);
  vsnprintf(out, sizeof out, format, args);
  va_end(args);
  return out;
}
inline double percent(double got, double want) { return 100 * (got / want - 1); }

// fn(i) for i in [0, n), each on one thread; worlds of different contexts do not know each other.
inline void in_parallel(size_t n, const std::function<void(size_t)> &fn) {
  std::atomic<size_t> next{0};
  std::vector<std::thread> threads;
  const unsigned workers = std::max(1u, std::thread::hardware_concurrency());
  for (unsigned t = 0; t < workers; ++t)
    threads.emplace_back([&] {
      for (size_t i; (i = next++) < n;) fn(i);
    });
  for (std::thread &t : threads) t.join();
}

struct Table {
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;
  std::string markdown() const {
    std::string out;
    const auto line = [&](const std::vector<std::string> &cells) {
      for (const std::string &c : cells) out += "| " + c + " ";
      out += "|\n";
    };
    line(head);
    line(std::vector<std::string>(head.size(), "---"));
    for (const auto &r : rows) line(r);
    return out;
  }
};

// The text between <!-- name --> and <!-- /name --> of a page becomes `text`. False: the page
// lacks the markers.
bool put(const std::string &page, const std::string &name, const std::string &text);

}  // namespace bench
