#pragma once
#include <cstddef>
#include <string>

namespace cli {

// In a time that does not tell where they differ.
inline bool same_secret(const std::string &secret, const void *given, size_t n) {
  if (n != secret.size()) return false;
  const auto *const bytes = static_cast<const unsigned char *>(given);
  unsigned char differ = 0;
  for (size_t i = 0; i < n; ++i)
    differ |= static_cast<unsigned char>(bytes[i] ^ static_cast<unsigned char>(secret[i]));
  return differ == 0;
}

}  // namespace cli
