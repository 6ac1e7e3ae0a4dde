// What each operating system has functions of its own for; system_posix.cpp and system_windows.cpp have them.
// Names and texts are UTF-8. What returns false, null or -1 leaves the reason in errno, unless it says `why`.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

namespace cli {

inline std::filesystem::path path_of(const std::string &name) {
  return std::filesystem::path(std::u8string(name.begin(), name.end()));
}
// With '/' between folders.
inline std::string name_of(const std::filesystem::path &path) {
  const std::u8string name = path.generic_u8string();
  return {name.begin(), name.end()};
}

namespace os {

#ifdef _WIN32
inline constexpr char kProgramEnding[] = ".exe";
#else
inline constexpr char kProgramEnding[] = "";
#endif

std::string own_file();                                         // of the program that runs; empty: unknown
std::string settings_folder();                                  // of this user's programs; empty: none
void set_if_unset(const char *name, const std::string &value);  // in the environment
// Becomes the program, with these words behind its name; returns only where it cannot be started.
void become(const std::string &program, const std::vector<std::string> &words);
void on_end_signals(void (*handler)(int));  // SIGINT, SIGTERM; the second one ends the process

bool may_write(const std::string &folder);
// A new file to write and to read. A former one is removed and not written into, so that a link's target
// stays what it is.
std::FILE *create_anew(const std::string &path);
// Until let_go, or until the process ends, however that ends. unlocked: the system cannot hold this one;
// impossible: it cannot be opened.
enum class Hold { held, held_by_another, unlocked, impossible };
Hold hold_folder(const std::string &folder, std::intptr_t &token);
void let_go(std::intptr_t token);

// A socket for datagrams that does not wait: connected to, or bound to, the first of the host's addresses at
// which that can be done; -1: none, and why.
int datagram_socket(const std::string &host, const std::string &port, bool connected, std::string &why);
// What the network does not take within `patience` ms is lost: false.
bool send(int socket, const void *bytes, size_t n, int patience = 0);
std::ptrdiff_t receive(int socket, void *to, size_t n);  // bytes of a datagram; below 1: none is there
void close_socket(int socket);

}  // namespace os
}  // namespace cli
