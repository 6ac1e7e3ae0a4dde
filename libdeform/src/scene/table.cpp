#include "scene/table.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/file.h"

namespace dfm::scene {
namespace {

constexpr uint64_t kCellBytes = 64;  // a number of 17 digits has 24

std::string_view trim(std::string_view s) {
  while (!s.empty() && std::strchr(" \t\r", s.front())) s.remove_prefix(1);
  while (!s.empty() && std::strchr(" \t\r", s.back())) s.remove_suffix(1);
  return s;
}

}  // namespace

Table::Table(std::string path, std::string expected, uint64_t rows, int columns)
    : path_(std::move(path)),
      expected_(std::move(expected)),
      bytes_(read_whole_file(Memory::standard(), path_,
                             std::max(kMiB, 2 * rows * uint64_t(columns) * kCellBytes),
                             ("a table with the header " + expected_).c_str())) {}

bool Table::next_line(std::string_view &line) {
  if (at_ >= bytes_.size()) return false;
  const std::string_view rest(bytes_.data() + at_, bytes_.size() - at_);
  line = rest.substr(0, rest.find('\n'));
  at_ += line.size() + 1;
  line = trim(line);
  ++line_;
  return true;
}

std::string Table::first() {
  std::string_view line;
  return next_line(line) ? std::string(line) : "";
}

void Table::refuse_header() const {
  fail(DFM_E_FORMAT, "%s:1: expected the header %s", path_.c_str(), expected_.c_str());
}

void Table::begin(const std::string &header) {
  header_ = header;
  columns_ = 1 + int(std::count(header.begin(), header.end(), ','));
}

bool Table::next(double *row) {
  std::string_view text;
  while (next_line(text))
    if (!text.empty()) {
      split(text, row);
      return true;
    }
  return false;
}

void Table::split(std::string_view text, double *row) const {
  int n = 0;
  for (size_t i = 0; i <= text.size(); ++n) {
    const size_t comma = std::min(text.find(',', i), text.size());
    const std::string_view cell = trim(text.substr(i, comma - i));
    i = comma + 1;
    if (n >= columns_) continue;
    const char *first = cell.data() + (!cell.empty() && cell.front() == '+');
    const auto result = std::from_chars(first, cell.data() + cell.size(), row[n]);
    if (result.ec != std::errc() || result.ptr != cell.data() + cell.size() || !std::isfinite(row[n]))
      fail(DFM_E_FORMAT, "%s:%zu: expected a finite number in column %d of %s, found \"%.*s\"", path_.c_str(),
           line_, n + 1, header_.c_str(), int(std::min<size_t>(cell.size(), 40)), cell.data());
  }
  if (n != columns_)
    fail(DFM_E_FORMAT, "%s:%zu: expected the %d column%s %s, found %d", path_.c_str(), line_, columns_,
         columns_ == 1 ? "" : "s", header_.c_str(), n);
}

}  // namespace dfm::scene
