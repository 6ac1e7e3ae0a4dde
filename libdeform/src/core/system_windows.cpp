#include <dirent.h>
#include <fcntl.h>
#include <io.h>
#include <locale.h>
#include <process.h>
#include <sys/stat.h>
#include <windows.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <system_error>

#include "core/path.h"
#include "core/system.h"

namespace dfm::os {
namespace {

constexpr int kFlags = _O_BINARY | _O_NOINHERIT;

}  // namespace

bool status_of(int descriptor, FileStatus &to) {
  struct _stat64 status;
  if (_fstat64(descriptor, &status) != 0) return false;
  const bool regular = (status.st_mode & _S_IFMT) == _S_IFREG;
  const bool pipe = (status.st_mode & _S_IFMT) == _S_IFIFO;
  to.kind = regular ? nullptr : pipe ? "a pipe" : "a device";
  to.readable = regular || pipe;
  to.writable = true;
  to.bytes = uint64_t(status.st_size);
  to.device = to.number = 0;
  BY_HANDLE_FILE_INFORMATION known;
  if (regular) {
    if (!GetFileInformationByHandle(reinterpret_cast<HANDLE>(_get_osfhandle(descriptor)), &known)) {
      errno = EIO;
      return false;
    }
    to.device = known.dwVolumeSerialNumber;
    to.number = uint64_t(known.nFileIndexHigh) << 32 | known.nFileIndexLow;
  }
  return true;
}

bool status_of(const std::string &path, FileStatus &to) {
  std::error_code error;
  if (std::filesystem::is_directory(path_of(path), error)) {
    to = {"a directory", false, false, 0, 0, 0};
    return true;
  }
  const int descriptor = open_input(path);
  if (descriptor < 0) return false;
  const bool known = status_of(descriptor, to);
  _close(descriptor);
  return known;
}

int duplicate(int descriptor) {
  const int out = _dup(descriptor);
  if (out >= 0) _setmode(out, _O_BINARY);
  return out;
}

int open_input(const std::string &path) { return _wopen(path_of(path).c_str(), _O_RDONLY | kFlags); }

int open_stream(const std::string &path) { return _wopen(path_of(path).c_str(), _O_WRONLY | kFlags); }

int create(const std::string &path) {
  return _wopen(path_of(path).c_str(), _O_WRONLY | _O_CREAT | _O_EXCL | kFlags, _S_IREAD | _S_IWRITE);
}

int create_unnamed(const std::string &) { return -1; }
bool link_name(int, const std::string &) { return false; }

bool rename_over(const std::string &from, const std::string &to) {
  std::error_code error;
  std::filesystem::rename(path_of(from), path_of(to), error);
  if (error) errno = error.default_error_condition().value();
  return !error;
}

void remove_file(const std::string &path) { _wunlink(path_of(path).c_str()); }

long process_number() { return _getpid(); }

bool list_folder(const std::string &folder, std::vector<std::string> &names) {
  const std::unique_ptr<_WDIR, int (*)(_WDIR *)> open(_wopendir(path_of(folder).c_str()), &_wclosedir);
  if (!open) return false;
  errno = 0;
  for (const _wdirent *entry; (entry = _wreaddir(open.get()));)
    if (const std::string name = name_of(entry->d_name); name != "." && name != "..") names.push_back(name);
  return errno == 0;
}

std::optional<std::string> environment(const char *name) {
  const wchar_t *const value = _wgetenv(path_of(name).c_str());
  if (!value) return {};
  const std::u8string text = std::filesystem::path(value).u8string();
  return std::string(text.begin(), text.end());
}

std::optional<std::string> trusted_environment(const char *name) { return environment(name); }

int print(char *text, size_t capacity, const char *format, va_list args) {
  // switching the locale takes much longer than the text
  if (localeconv()->decimal_point == std::string_view("."))
    return std::vsnprintf(text, capacity, format, args);
  const int mode = _configthreadlocale(_ENABLE_PER_THREAD_LOCALE);
  char before[128];
  std::snprintf(before, sizeof before, "%s", setlocale(LC_NUMERIC, nullptr));
  setlocale(LC_NUMERIC, "C");
  const int n = std::vsnprintf(text, capacity, format, args);
  setlocale(LC_NUMERIC, before);
  _configthreadlocale(mode);
  return n;
}

uint64_t memory_of_machine() {
  MEMORYSTATUSEX status{};
  status.dwLength = sizeof status;
  return GlobalMemoryStatusEx(&status) ? status.ullTotalPhys : UINT64_MAX;
}

void *allocate(size_t bytes, size_t align) { return _aligned_malloc(std::max(bytes, align), align); }

void deallocate(void *p) { _aligned_free(p); }

}  // namespace dfm::os
