#include "file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "messages.h"
#include "system.h"

namespace cli {

std::string read_file(const std::string &path, uint64_t limit, const char *expected) {
  std::string text;
  const auto take = [](void *user, const char *bytes, size_t n) {
    static_cast<std::string *>(user)->assign(bytes, n);
  };
  need(dfm_file_read(path.c_str(), limit, expected, take, &text));
  return text;
}

void write_whole(const std::string &path, const std::string &text) {
  need(dfm_file_write(path.c_str(), text.data(), text.size()));
}

void cannot_write(const std::string &path) {
  throw Failure(kBadInput, path + ": cannot be written: " + std::strerror(errno));
}

bool holds(const std::string &path, const std::string &words) {
  char head[256];
  std::ifstream file(path_of(path), std::ios::binary);
  file.read(head, sizeof head);
  return std::string_view(head, size_t(file.gcount())).find(words) != std::string_view::npos;
}

void refuse_same(const std::string &option, const std::string &out, const std::string &in) {
  namespace fs = std::filesystem;
  std::error_code absent;
  if (fs::equivalent(path_of(out), path_of(in), absent) ||
      fs::weakly_canonical(path_of(out), absent) == fs::weakly_canonical(path_of(in), absent))
    throw Failure(kBadInput,
                  option + " " + out + ": this is " + in + ", which would be overwritten; give another name");
}

bool may_write_beside(const std::string &path) {
  const std::string folder = name_of(path_of(path).parent_path());
  return os::may_write(folder.empty() ? "." : folder);
}

File new_file(const std::string &path) {
  FILE *const file = os::create_anew(path);
  if (!file) cannot_write(path);
  return File(file, std::fclose);
}

std::string csv_cell(const std::string &text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + '"';
}

std::vector<std::string> csv_cells(const std::string &line) {
  std::vector<std::string> cells(1);
  for (const char c : line)
    if (c == ',') cells.emplace_back();
    else if (c != '\r') cells.back() += c;
  return cells;
}

}  // namespace cli
