// Rows of numbers in a CSV file, with file and line in every complaint.
#pragma once
#include <string>
#include <string_view>

#include "core/memory.h"

namespace dfm::scene {

// The lines of a table of about `rows` rows, read whole; a sentence with what was expected where
// there is none.
class Table {
 public:
  Table(const std::string &path, const std::string &header, uint64_t rows, int columns);
  bool next(std::string_view &line);  // without its line end

 private:
  Array<char> bytes_;
  size_t at_ = 0;
};
std::string_view trim(std::string_view text);
// The columns of a row, as many as the header names; each a finite number.
void split_row(const std::string &path, size_t line, std::string_view text, const char *header, int columns,
               double *out);

}  // namespace dfm::scene
