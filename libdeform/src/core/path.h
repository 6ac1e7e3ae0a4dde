// File names of the library are UTF-8 everywhere; those of the standard library are the system's.
#pragma once
#include <filesystem>
#include <string>

namespace dfm {

inline std::filesystem::path path_of(const std::string &name) {
  return std::filesystem::path(std::u8string(name.begin(), name.end()));
}
// With '/' between folders.
inline std::string name_of(const std::filesystem::path &path) {
  const std::u8string name = path.generic_u8string();
  return {name.begin(), name.end()};
}

}  // namespace dfm
