#include "check/environment.h"

#include <windows.h>

#include <fcntl.h>
#include <io.h>
#include <sys/stat.h>
#include <tlhelp32.h>
#include <xmmintrin.h>

#include <clocale>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <filesystem>

#include "system.h"

namespace cli::check {

int unmasked_exceptions() { return int(~_MM_GET_EXCEPTION_MASK() & _MM_MASK_MASK); }

Process Process::now() {
  Process p;
  std::error_code error;
  p.folder_ = name_of(std::filesystem::current_path(error));
  p.locale_ = std::setlocale(LC_ALL, nullptr);
  for (char **e = _environ; e && *e; ++e) p.environment_.emplace_back(*e);
  for (int fd = 0; fd < 3; ++fd) {
    const std::intptr_t handle = _get_osfhandle(fd);
    p.streams_[fd] = handle == -1 || handle == -2 ? "" : std::to_string(handle);
  }
  for (const int number : {SIGINT, SIGILL, SIGFPE, SIGSEGV, SIGTERM, SIGBREAK, SIGABRT}) {
    const auto handler = std::signal(number, SIG_DFL);
    std::signal(number, handler);
    p.handlers_.push_back(reinterpret_cast<const void *>(handler));
  }
  const auto filter = SetUnhandledExceptionFilter(nullptr);
  SetUnhandledExceptionFilter(filter);
  p.handlers_.push_back(reinterpret_cast<const void *>(filter));
  const int mask = _umask(0);
  _umask(mask);
  p.file_mask_ = unsigned(mask);
  return p;
}

int Process::threads() {
  const HANDLE all = CreateToolhelp32Snapshot(TH32CS_SNAPTHREAD, 0);
  THREADENTRY32 entry = {};
  entry.dwSize = sizeof entry;
  int n = 0;
  for (BOOL there = Thread32First(all, &entry); there; there = Thread32Next(all, &entry))
    n += entry.th32OwnerProcessID == GetCurrentProcessId();
  CloseHandle(all);
  return n;
}

int memory_file() {
  wchar_t folder[MAX_PATH], name[MAX_PATH];
  GetTempPathW(MAX_PATH, folder);
  GetTempFileNameW(folder, L"dfm", 0, name);
  return _wopen(name, _O_RDWR | _O_CREAT | _O_TEMPORARY | _O_BINARY | _O_NOINHERIT, _S_IREAD | _S_IWRITE);
}

}  // namespace cli::check
