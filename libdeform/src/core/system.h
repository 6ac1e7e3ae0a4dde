// What each operating system has functions of its own for; system_posix.cpp and system_windows.cpp have them.
// The dynamic linker's are in plugin/shared_object.h. Names are UTF-8. What returns false, -1 or null leaves
// the reason in errno.
#pragma once
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace dfm::os {

#ifdef _WIN32
inline constexpr char kBetweenPaths = ';';  // in variables of the environment
inline constexpr char kPluginEnding[] = ".dll";
#else
inline constexpr char kBetweenPaths = ':';
inline constexpr char kPluginEnding[] = ".so";
#endif

struct FileStatus {
  const char *kind;         // of what is no regular file, with its article; null: a regular file
  bool writable, readable;  // as a stream of bytes
  uint64_t bytes;
  uint64_t device, number;  // the same two for all names of a file
};
bool status_of(int descriptor, FileStatus &to);
bool status_of(const std::string &path, FileStatus &to);  // of what a link leads to

// Descriptors that a child process does not get.
int duplicate(int descriptor);
int open_input(const std::string &path);   // does not wait for the writer of a pipe
int open_stream(const std::string &path);  // to write to a device or pipe; one without a reader is an error
int create(const std::string &path);       // to write; an error if it exists
// A file without a name in this folder, which disappears if the process is killed; -1 also where there is no
// such thing. link_name: an error if `path` exists.
int create_unnamed(const std::string &folder);
bool link_name(int descriptor, const std::string &path);
bool rename_over(const std::string &from, const std::string &to);
void remove_file(const std::string &path);
long process_number();

// Names in a folder, without "." and "..", in the order of the file system.
bool list_folder(const std::string &folder, std::vector<std::string> &names);

// The value of an environment variable, if it is set. trusted_environment: none where the process could open
// files in the name of another user than the one who has set it.
std::optional<std::string> environment(const char *name);
std::optional<std::string> trusted_environment(const char *name);

// vsnprintf with a decimal point, whatever the locale of the program.
int print(char *text, size_t capacity, const char *format, va_list args);

uint64_t memory_of_machine();  // bytes that this process may have
// Large blocks begin at huge pages, if the system grants them on request: a step of a large body reads tens
// of arrays at the same time and exceeds the processor's buffer of page addresses. Null: no memory.
void *allocate(size_t bytes, size_t align);
void deallocate(void *p);

}  // namespace dfm::os
