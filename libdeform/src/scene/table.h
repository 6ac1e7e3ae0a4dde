// Rows of numbers in a CSV file, with file and line in every complaint.
#pragma once
#include <fstream>
#include <string>
#include <string_view>

namespace dfm::scene {

// A table to read; a sentence with what was expected where there is none.
std::ifstream open_table(const std::string &path, const std::string &expected);
std::string_view trim(std::string_view text);
// The columns of a row, as many as the header names; each a finite number.
void split_row(const std::string &path, size_t line, std::string_view text, const char *header, int columns, double *out);

}  // namespace dfm::scene
