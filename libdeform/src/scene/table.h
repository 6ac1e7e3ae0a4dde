// Rows of numbers in a CSV file, with file and line in every complaint.
#pragma once
#include <string>
#include <string_view>

namespace dfm::scene {

std::string_view trim(std::string_view text);
// The columns of a row, as many as the header names; each a finite number.
void split_row(const std::string &path, size_t line, std::string_view text, const char *header, int columns, double *out);

}  // namespace dfm::scene
