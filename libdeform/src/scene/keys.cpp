#include "scene/keys.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "scene_names.h"

namespace dfm::scene {
namespace {

class Names {
 public:
  template <size_t n>
  explicit Names(const Row (&rows)[n]) {
    for (const Row &row : rows) {
      kinds.push_back(row.of);
      keys_.emplace_back();
      for (const char *at = row.names; *at; at += std::strspn(at, " ")) {
        const char *const end = at + std::strcspn(at, " ");
        const bool delivered = *at != '-';
        keys_.back().push_back({{delivered ? at : at + 1, end}, delivered});
        at = end;
      }
    }
  }
  const std::vector<Key> &operator[](const std::string &kind) const {
    for (size_t i = 0; i < kinds.size(); ++i)
      if (kinds[i] == kind) return keys_[i];
    throw std::logic_error("no such table in scene/keys: " + kind);
  }
  std::vector<std::string> kinds;

 private:
  std::vector<std::vector<Key>> keys_;
};

const Names &objects() {
  static const Names names(kObjects);
  return names;
}
const Names &words() {
  static const Names names(kWords);
  return names;
}

}  // namespace

const std::vector<Key> &keys_of(const std::string &kind) { return objects()[kind]; }
const std::vector<Key> &words_of(const std::string &what) { return words()[what]; }
uint32_t number_of(const std::string &what, const std::string &word) {
  const std::vector<Key> &rows = words_of(what);
  const auto at = std::find_if(rows.begin(), rows.end(), [&](const Key &k) { return k.name == word; });
  return static_cast<uint32_t>(at - rows.begin());
}

const std::string &word_of(const std::string &what, uint32_t number) { return words_of(what)[number].name; }

}  // namespace dfm::scene
