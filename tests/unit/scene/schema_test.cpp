// The shipped schema and the reader must name the same keys and words.
#include <gtest/gtest.h>

#include <algorithm>

#include "scene/keys.h"
#include "scene/node.h"

namespace {

using dfm::scene::json;

const json &schema() {
  static const json tree =
      dfm::scene::parse_file(std::string(DEFORM_SOURCE_DIR) + "/libdeform/schema/deform-scene.schema.json");
  return tree;
}

std::vector<std::string> sorted(std::vector<std::string> v) {
  std::sort(v.begin(), v.end());
  return v;
}

std::vector<std::string> names(const std::vector<dfm::scene::Key> &keys) {
  std::vector<std::string> out;
  for (const auto &k : keys) out.push_back(k.name);
  return sorted(out);
}

}  // namespace

TEST(Schema, EveryObject_HasTheReadersKeys) {
  for (const std::string &kind : dfm::scene::object_kinds()) {
    ASSERT_TRUE(schema()["$defs"].contains(kind)) << kind;
    std::vector<std::string> keys;
    for (const auto &entry : schema()["$defs"][kind]["properties"].items()) keys.push_back(entry.key());
    EXPECT_EQ(sorted(keys), names(dfm::scene::keys_of(kind))) << kind;
  }
}

TEST(Schema, EveryObject_RefusesOtherKeys) {
  for (const std::string &kind : dfm::scene::object_kinds()) {
    if (kind == "material") continue;  // takes the parameters of loaded models
    EXPECT_EQ(schema()["$defs"][kind]["additionalProperties"], json(false)) << kind;
  }
}

TEST(Schema, EveryWord_IsTheReaders) {
  for (const std::string &set : dfm::scene::word_sets()) {
    ASSERT_TRUE(schema()["$defs"].contains(set + "_word")) << set;
    EXPECT_EQ(sorted(schema()["$defs"][set + "_word"]["enum"].get<std::vector<std::string>>()),
              names(dfm::scene::words_of(set)))
        << set;
  }
}

TEST(Schema, KeysNotDelivered_AreMarked) {
  for (const std::string &kind : dfm::scene::object_kinds()) {
    for (const auto &key : dfm::scene::keys_of(kind)) {
      const json &property = schema()["$defs"][kind]["properties"][key.name];
      const std::string text =
          property.contains("description") ? property["description"].get<std::string>() : "";
      EXPECT_EQ(text.rfind("not available yet", 0) == 0, !key.delivered) << kind << "/" << key.name;
    }
  }
}

TEST(Schema, EveryReference_Leads) {
  const std::string text = schema().dump();
  for (size_t i = 0; (i = text.find("\"#/$defs/", i)) != std::string::npos; ++i) {
    const std::string name = text.substr(i + 9, text.find('"', i + 9) - i - 9);
    EXPECT_TRUE(schema()["$defs"].contains(name)) << name;
  }
}
