#include "system.h"

#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>

namespace cli::os {
namespace {

// In one call where the system has it: between two, a child process could get the socket.
int open_datagram_socket(int family) {
#ifdef SOCK_CLOEXEC
  return socket(family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
#else
  const int out = socket(family, SOCK_DGRAM, 0);
  if (out >= 0) {
    fcntl(out, F_SETFD, FD_CLOEXEC);
    fcntl(out, F_SETFL, O_NONBLOCK);
  }
  return out;
#endif
}

}  // namespace

std::string own_file() {
  std::error_code error;
  return name_of(std::filesystem::read_symlink("/proc/self/exe", error));
}

std::string settings_folder() {
  const char *const config = std::getenv("XDG_CONFIG_HOME"), *const home = std::getenv("HOME");
  if (config && *config) return config;
  if (home && *home) return std::string(home) + "/.config";
  return "";
}

void set_if_unset(const char *name, const std::string &value) { setenv(name, value.c_str(), 0); }

void become(const std::string &program, const std::vector<std::string> &words) {
  std::vector<const char *> argv{program.c_str()};
  for (const std::string &word : words) argv.push_back(word.c_str());
  argv.push_back(nullptr);
  execv(program.c_str(), const_cast<char **>(argv.data()));
}

void on_end_signals(void (*handler)(int)) {
  struct sigaction action = {};
  action.sa_handler = handler;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool may_write(const std::string &folder) { return access(folder.c_str(), W_OK) == 0; }

std::FILE *create_anew(const std::string &path) {
  if (unlink(path.c_str()) != 0 && errno != ENOENT) return nullptr;
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  return fd < 0 ? nullptr : fdopen(fd, "w+b");
}

Hold hold_folder(const std::string &folder, std::intptr_t &token) {
  token = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (token < 0) return Hold::impossible;
  if (flock(int(token), LOCK_EX | LOCK_NB) == 0) return Hold::held;
  if (errno != EWOULDBLOCK) return Hold::unlocked;
  let_go(token);
  return Hold::held_by_another;
}

void let_go(std::intptr_t token) { close(int(token)); }

int datagram_socket(const std::string &host, const std::string &port, bool connected, std::string &why) {
  addrinfo wanted = {}, *found = nullptr;
  wanted.ai_socktype = SOCK_DGRAM;
  wanted.ai_flags = AI_NUMERICSERV;
  const int error = getaddrinfo(host.c_str(), port.c_str(), &wanted, &found);
  why = error ? gai_strerror(error) : "no address";
  int out = -1;
  for (const addrinfo *at = error ? nullptr : found; at && out < 0; at = at->ai_next) {
    out = open_datagram_socket(at->ai_family);
    const auto place = connected ? connect : bind;
    if (out >= 0 && place(out, at->ai_addr, at->ai_addrlen) == 0) break;
    why = std::strerror(errno);
    if (out >= 0) close(out);
    out = -1;
  }
  if (!error) freeaddrinfo(found);
  return out;
}

bool send(int socket, const void *bytes, size_t n, int patience) {
  if (::send(socket, bytes, n, 0) >= 0) return true;
  if (patience == 0 || (errno != EAGAIN && errno != ENOBUFS)) return false;
  pollfd room = {socket, POLLOUT, 0};
  poll(&room, 1, patience);
  return ::send(socket, bytes, n, 0) >= 0;
}

std::ptrdiff_t receive(int socket, void *to, size_t n) { return recv(socket, to, n, 0); }

void close_socket(int socket) { close(socket); }

}  // namespace cli::os
