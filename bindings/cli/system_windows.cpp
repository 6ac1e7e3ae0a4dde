#include "system.h"
#include "system_windows.h"

#include <winsock2.h>
#include <ws2tcpip.h>

#include <fcntl.h>
#include <io.h>
#include <process.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <system_error>

namespace cli::os {
namespace {

void start_sockets() {
  static const struct Started {
    Started() { WSAStartup(MAKEWORD(2, 2), &data); }
    WSADATA data;
  } started;
}

// As the run-time library of a program takes its command line apart.
std::wstring quoted_word(const std::string &word) {
  std::wstring out = L"\"";
  size_t backslashes = 0;
  for (const wchar_t c : path_of(word).wstring()) {
    if (c == L'"') out.append(backslashes + 1, L'\\');
    backslashes = c == L'\\' ? backslashes + 1 : 0;
    out += c;
  }
  return out.append(backslashes, L'\\') + L'"';
}

void (*end_handler)(int) = nullptr;
void once(int signal) {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  end_handler(signal);
}

}  // namespace

std::string own_file() {
  wchar_t name[32768];
  return name_of(std::wstring(name, GetModuleFileNameW(nullptr, name, DWORD(std::size(name)))));
}

std::string settings_folder() {
  const wchar_t *const folder = _wgetenv(L"APPDATA");
  return folder ? name_of(folder) : "";
}

void set_if_unset(const char *name, const std::string &value) {
  if (!std::getenv(name)) _wputenv_s(path_of(name).c_str(), path_of(value).c_str());
}

std::intptr_t start(int how, const std::string &program, const std::vector<std::string> &words) {
  std::vector<std::wstring> quoted{quoted_word(program)};
  for (const std::string &word : words) quoted.push_back(quoted_word(word));
  std::vector<const wchar_t *> argv;
  for (const std::wstring &word : quoted) argv.push_back(word.c_str());
  argv.push_back(nullptr);
  return _wspawnv(how, path_of(program).c_str(), argv.data());
}

// There is no becoming: the program is waited for.
void become(const std::string &program, const std::vector<std::string> &words) {
  const std::intptr_t code = start(_P_WAIT, program, words);
  if (code != -1) _exit(int(code));
}

void on_end_signals(void (*handler)(int)) {
  end_handler = handler;
  std::signal(SIGINT, once);
  std::signal(SIGTERM, once);
}

bool may_write(const std::string &folder) { return _waccess(path_of(folder).c_str(), 2) == 0; }

std::FILE *create_anew(const std::string &path) {
  const std::filesystem::path file = path_of(path);
  if (_wunlink(file.c_str()) != 0 && errno != ENOENT) return nullptr;
  const int fd =
      _wopen(file.c_str(), _O_RDWR | _O_CREAT | _O_EXCL | _O_BINARY | _O_NOINHERIT, _S_IREAD | _S_IWRITE);
  return fd < 0 ? nullptr : _fdopen(fd, "w+b");
}

// By a mutex that is named after the folder.
Hold hold_folder(const std::string &folder, std::intptr_t &token) {
  std::error_code error;
  std::wstring name = std::filesystem::canonical(path_of(folder), error).generic_wstring();
  for (wchar_t &c : name) c = c == L'/' ? L'|' : wchar_t(std::towlower(c));
  const HANDLE mutex = error ? nullptr : CreateMutexW(nullptr, FALSE, (L"Local\\deform-run-" + name).c_str());
  const DWORD result = GetLastError();
  if (!mutex) {
    if (!error) error.assign(int(result), std::system_category());
    errno = error.default_error_condition().value();
    return Hold::impossible;
  }
  token = reinterpret_cast<std::intptr_t>(mutex);
  if (result != ERROR_ALREADY_EXISTS) return Hold::held;
  let_go(token);
  return Hold::held_by_another;
}

void let_go(std::intptr_t token) { CloseHandle(reinterpret_cast<HANDLE>(token)); }

int datagram_socket(const std::string &host, const std::string &port, bool connected, std::string &why) {
  start_sockets();
  addrinfo wanted = {}, *found = nullptr;
  wanted.ai_socktype = SOCK_DGRAM;
  const auto message = [](int error) { return std::system_category().message(error); };
  const int error = getaddrinfo(host.c_str(), port.c_str(), &wanted, &found);
  why = error ? message(error) : "no address";
  SOCKET out = INVALID_SOCKET;
  for (const addrinfo *at = error ? nullptr : found; at && out == INVALID_SOCKET; at = at->ai_next) {
    out = socket(at->ai_family, SOCK_DGRAM, 0);
    const auto place = connected ? connect : bind;
    u_long yes = 1;
    if (out != INVALID_SOCKET && ioctlsocket(out, long(FIONBIO), &yes) == 0 &&
        place(out, at->ai_addr, int(at->ai_addrlen)) == 0)
      break;
    why = message(WSAGetLastError());
    if (out != INVALID_SOCKET) closesocket(out);
    out = INVALID_SOCKET;
  }
  if (!error) freeaddrinfo(found);
  return int(out);
}

bool send(int socket, const void *bytes, size_t n, int patience) {
  const auto sent = [&] { return ::send(SOCKET(socket), static_cast<const char *>(bytes), int(n), 0) >= 0; };
  if (sent()) return true;
  if (patience == 0 || (WSAGetLastError() != WSAEWOULDBLOCK && WSAGetLastError() != WSAENOBUFS)) return false;
  WSAPOLLFD room = {SOCKET(socket), POLLWRNORM, 0};
  WSAPoll(&room, 1, patience);
  return sent();
}

std::ptrdiff_t receive(int socket, void *to, size_t n) {
  return recv(SOCKET(socket), static_cast<char *>(to), int(n), 0);
}

void close_socket(int socket) { closesocket(SOCKET(socket)); }

}  // namespace cli::os
