// All names in scene files, as the schema has them.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace dfm::scene {

struct Key {
  std::string name;
  bool delivered;  // false: named in the format, refused with "not available yet: POINTER"
};

// Objects by kind ("scene", "time", "body", ...); kinds are also the names of the schema's definitions.
const std::vector<Key> &keys_of(std::string_view kind);

// The allowed words of a value, if the format fixes them ("time.mode", "shape", ...).
const std::vector<Key> &words_of(std::string_view what);
// A word's place among them: its number in the public headers where it has one there; and back.
uint32_t number_of(std::string_view what, const std::string &word);
const std::string &word_of(std::string_view what, uint32_t number);

}  // namespace dfm::scene
