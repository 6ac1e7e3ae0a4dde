// The shipped schema, whose names the reader takes.
#include <gtest/gtest.h>

#include <algorithm>

#include "deform/deform.h"
#include "scene/keys.h"
#include "scene/node.h"

namespace {

using dfm::scene::json;

const json &schema() {
  static const json tree =
      dfm::scene::parse_file(std::string(DEFORM_SOURCE_DIR) + "/libdeform/schema/deform-scene.schema.json");
  return tree;
}

}  // namespace

TEST(Schema, EveryObject_RefusesOtherKeys) {
  for (const auto &[kind, def] : schema()["$defs"].items()) {
    if (kind == "material" || !def.contains("properties")) continue;  // parameters of loaded models
    EXPECT_EQ(def["additionalProperties"], json(false)) << kind;
  }
}

TEST(Schema, WhatIsNotAvailableYet_IsNotDelivered) {
  const auto delivered = [](const std::vector<dfm::scene::Key> &keys, const std::string &name) {
    return std::ranges::find(keys, name, &dfm::scene::Key::name)->delivered;
  };
  EXPECT_TRUE(delivered(dfm::scene::keys_of("body"), "pose"));
  EXPECT_FALSE(delivered(dfm::scene::keys_of("body"), "pressure"));
  EXPECT_TRUE(delivered(dfm::scene::words_of("rigid_shape"), "capsule"));
  EXPECT_FALSE(delivered(dfm::scene::words_of("rigid_shape"), "mesh"));
  EXPECT_FALSE(delivered(dfm::scene::words_of("rigid_shape"), "voxels"));
  EXPECT_FALSE(delivered(dfm::scene::words_of("integrator"), "verlet"));
}

TEST(Schema, WordsOfTheHeaders_HaveTheirNumbers) {
  EXPECT_EQ(dfm::scene::number_of("integrator", "tr_bdf2"), uint32_t{DFM_INTEGRATOR_TR_BDF2});
  EXPECT_EQ(dfm::scene::number_of("shape", "voxels"), uint32_t{DFM_SHAPE_VOXELS});
  EXPECT_EQ(dfm::scene::number_of("tool_shape", "blade"), uint32_t{DFM_TOOL_BLADE});
  EXPECT_EQ(dfm::scene::number_of("joint_type", "fixed"), uint32_t{DFM_JOINT_FIXED});
  EXPECT_EQ(dfm::scene::number_of("cut_mode", "split"), uint32_t{DFM_CUT_SPLIT});
  EXPECT_EQ(dfm::scene::number_of("coupling", "thesis"), uint32_t{DFM_COUPLING_THESIS});
}

TEST(Schema, EveryReference_Leads) {
  const std::string text = schema().dump();
  for (size_t i = 0; (i = text.find("\"#/$defs/", i)) != std::string::npos; ++i) {
    const std::string name = text.substr(i + 9, text.find('"', i + 9) - i - 9);
    EXPECT_TRUE(schema()["$defs"].contains(name)) << name;
  }
}
