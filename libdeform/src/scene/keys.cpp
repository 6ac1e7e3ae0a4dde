#include "scene/keys.h"

#include <algorithm>

#include "scene_names.h"

namespace dfm::scene {

const std::vector<Key> &keys_of(std::string_view kind) { return objects().at(std::string(kind)); }
const std::vector<Key> &words_of(std::string_view what) { return words().at(std::string(what)); }
uint32_t number_of(std::string_view what, const std::string &word) {
  const std::vector<Key> &rows = words_of(what);
  const auto at = std::find_if(rows.begin(), rows.end(), [&](const Key &k) { return k.name == word; });
  return static_cast<uint32_t>(at - rows.begin());
}

const std::string &word_of(std::string_view what, uint32_t number) { return words_of(what)[number].name; }

}  // namespace dfm::scene
