// Files that the command itself reads and writes, by the library's own bounded reader and its writer that
// never leaves half a file.
#pragma once
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace cli {

// All bytes of a file of at most `limit` bytes; `expected` says what is wanted, with its article.
// Throws Failure.
std::string read_file(const std::string &path, uint64_t limit, const char *expected);
// To a temporary name first, then renamed: a partial file is never read.
void write_whole(const std::string &path, const std::string &text);

using File = std::unique_ptr<FILE, int (*)(FILE *)>;
// A new file to write to as results come, and to read from. A former file is removed and not written into, so
// that a link's target stays what it is.
File new_file(const std::string &path);
bool holds(const std::string &path, const std::string &words);  // among its first bytes
// Throws Failure where an output would overwrite what is read.
void refuse_same(const std::string &option, const std::string &out, const std::string &in);
bool may_write_beside(const std::string &path);           // into its folder; false: errno says why
[[noreturn]] void cannot_write(const std::string &path);  // for the reason in errno

std::string csv_cell(const std::string &text);                // in quotes where it needs them
std::vector<std::string> csv_cells(const std::string &line);  // of numbers and names, without quotes

}  // namespace cli
