#include "file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "messages.h"

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

File new_file(const std::string &path) {
  if (unlink(path.c_str()) != 0 && errno != ENOENT) cannot_write(path);
  const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  FILE *file = fd < 0 ? nullptr : fdopen(fd, "w+b");
  if (!file) cannot_write(path);
  return File(file, std::fclose);
}

}  // namespace cli
