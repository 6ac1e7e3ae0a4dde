// Which parameters a list of effects changes.
#include <gtest/gtest.h>

#include "plugin/registry.h"
#include "plugin/selection.h"

namespace {

using dfm::EffectRow;

// Of three parameters, "loss" is off where `rate` and `kind` are 0, "delay" where `kind` is.
const dfm_param kRows[] = {{"volume", "", "1", 0, 9, 0, 0, 1, nullptr},
                           {"rate", "", "1", 0, 9, 0, 0, 1, nullptr},
                           {"kind", "", "1", 0, 9, 0, 0, 1, nullptr}};
const std::vector<EffectRow> kOff = {{"volume", 0, 0}, {"loss", 1, 0}, {"loss", 2, 0}, {"delay", 2, 0}};

struct Left {
  bool changed;
  std::vector<double> values;
  std::vector<uint8_t> by_cell;
};

Left left(std::vector<const char *> list, std::vector<double> values,
          std::vector<uint8_t> by_cell = {0, 0, 0}) {
  dfm_type type{};
  type.params = kRows;
  type.nparam = 3;
  list.push_back(nullptr);
  const dfm::Registry none;
  const dfm::Selection selection(list.data(), none);
  const auto works = [](const std::string &) { return true; };
  const bool changed = dfm::omit_effects(type, kOff, selection, works, values, by_cell);
  return {changed, values, by_cell};
}

TEST(Selection, ChangesTheRowsOfWhatItDoesNotList) {
  const Left l = left({"loss", "delay"}, {1, 2, 3});
  EXPECT_TRUE(l.changed);
  EXPECT_EQ(l.values, (std::vector<double>{0, 2, 3}));
  EXPECT_FALSE(left({"loss", "delay", "volume"}, {1, 2, 3}).changed);
}

// A row that two effects share goes with one of them, unless the other has nothing else.
TEST(Selection, KeepsARowThatAListedEffectHangsOn) {
  EXPECT_EQ(left({"loss"}, {0, 2, 3}).values, (std::vector<double>{0, 2, 0}));
  EXPECT_EQ(left({"loss"}, {0, 0, 3}).values, (std::vector<double>{0, 0, 3}));
  EXPECT_EQ(left({"delay"}, {0, 2, 3}).values, (std::vector<double>{0, 0, 3}));
}

TEST(Selection, LeavesOutWhatDiffersByCell) {
  const Left l = left({}, {0, 0, 0}, {1, 0, 0});
  EXPECT_TRUE(l.changed);
  EXPECT_EQ(l.by_cell, (std::vector<uint8_t>{0, 0, 0}));
}

TEST(Selection, WantsAllWithoutAList) {
  EXPECT_TRUE(dfm::Selection().wants("volume"));
  const dfm::Registry none;
  const char *const memory[] = {"memory", "cutting", nullptr};
  const dfm::Selection listed(memory, none);
  EXPECT_TRUE(listed.wants(dfm::kFriction)) << "memory is a law's";
  EXPECT_TRUE(listed.wants(dfm::kSelfContact)) << "what is cut lies on itself";
  EXPECT_FALSE(listed.wants("volume"));
  EXPECT_FALSE(listed.lists(dfm::kFriction));
}

}  // namespace
