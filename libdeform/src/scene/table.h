// Rows of numbers in a CSV file, with file and line in every complaint.
#pragma once
#include <string>
#include <string_view>

#include "core/memory.h"

namespace dfm::scene {

// A table of about `rows` rows, read whole; a sentence with what was expected where there is none.
class Table {
 public:
  Table(std::string path, std::string expected, uint64_t rows, int columns);
  bool empty() const { return bytes_.empty(); }
  std::string first();  // the first line
  [[noreturn]] void refuse_header() const;
  // Rows have the columns of this header from now on.
  void begin(const std::string &header);
  bool next(double *row);  // of finite numbers; lines without any are skipped
  size_t line() const { return line_; }

 private:
  bool next_line(std::string_view &line);  // trimmed
  void split(std::string_view text, double *row) const;

  std::string path_, expected_, header_;
  Array<char> bytes_;
  size_t at_ = 0, line_ = 0;
  int columns_ = 0;
};

}  // namespace dfm::scene
