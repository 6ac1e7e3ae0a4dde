#include "scene/table.h"

#include <charconv>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/file.h"

namespace dfm::scene {

namespace {

constexpr uint64_t kCellBytes = 64;  // a number of 17 digits has 24

}  // namespace

Table::Table(const std::string &path, const std::string &header, uint64_t rows, int columns)
    : bytes_(read_whole_file(Memory::standard(), path,
                             std::max(kMiB, 2 * rows * uint64_t(columns) * kCellBytes),
                             ("a table with the header " + header).c_str())) {}

bool Table::next(std::string_view &line) {
  if (at_ >= bytes_.size()) return false;
  const std::string_view rest(bytes_.data() + at_, bytes_.size() - at_);
  line = rest.substr(0, rest.find('\n'));
  at_ += line.size() + 1;
  return true;
}

std::string_view trim(std::string_view s) {
  while (!s.empty() && std::strchr(" \t\r", s.front())) s.remove_prefix(1);
  while (!s.empty() && std::strchr(" \t\r", s.back())) s.remove_suffix(1);
  return s;
}

void split_row(const std::string &path, size_t line, std::string_view text, const char *header, int columns,
               double *out) {
  int n = 0;
  for (size_t i = 0; i <= text.size(); ++n) {
    const size_t comma = std::min(text.find(',', i), text.size());
    const std::string_view cell = trim(text.substr(i, comma - i));
    i = comma + 1;
    if (n >= columns) continue;
    const char *first = cell.data() + (!cell.empty() && cell.front() == '+');
    const auto result = std::from_chars(first, cell.data() + cell.size(), out[n]);
    if (result.ec != std::errc() || result.ptr != cell.data() + cell.size() || !std::isfinite(out[n]))
      fail(DFM_E_FORMAT, "%s:%zu: expected a finite number in column %d of %s, found \"%.*s\"", path.c_str(),
           line, n + 1, header, int(std::min<size_t>(cell.size(), 40)), cell.data());
  }
  if (n != columns)
    fail(DFM_E_FORMAT, "%s:%zu: expected the %d column%s %s, found %d", path.c_str(), line, columns,
         columns == 1 ? "" : "s", header, n);
}

}  // namespace dfm::scene
