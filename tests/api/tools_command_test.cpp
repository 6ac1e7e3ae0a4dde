// Subcommands that are programs of their own, beside the command (bindings/tools).
#include <gtest/gtest.h>

#include <filesystem>

#include "support.h"

namespace {

namespace fs = std::filesystem;

const std::vector<std::vector<std::string>> kTools = {
    {"plugin", "check"},     {"cost"},           {"ccd"}, {"calibrate"}, {"friction"},
    {"mesh", "from-labels"}, {"mesh", "phantom"}};

}  // namespace

TEST(ToolsCommand, WithoutTheProgram_SaysWhichIsMissingAndWhatToDo) {
  const fs::path folder = test::scratch("tools_command"), command = folder / "bin" / "deform";
  fs::create_directories(folder / "bin");
  fs::copy_file(DEFORM_COMMAND, command, fs::copy_options::overwrite_existing);
  if (!fs::exists(folder / "lib")) fs::create_directory_symlink(DEFORM_BINARY_DIR "/lib", folder / "lib");
  for (std::vector<std::string> words : kTools) {
    words.insert(words.begin(), command.string());
    words.push_back("--help");
    const test::CommandResult r = test::run(words);
    EXPECT_EQ(r.exit_code, 2);
    const std::string missing = "there is no " + (folder / "bin" / "deform-").string();
    EXPECT_NE(r.err.find(missing), std::string::npos) << r.err;
    EXPECT_NE(r.err.find("`make tools` builds it"), std::string::npos) << r.err;
  }
}

TEST(ToolsCommand, HelpAndErrors_NameTheCommandThatWasWritten) {
  for (std::vector<std::string> words : kTools) {
    std::string command = "deform";
    for (const std::string &word : words) command += " " + word;
    words.push_back("--help");
    const test::CommandResult help = test::deform(words);
    EXPECT_EQ(help.exit_code, 0) << help.err;
    EXPECT_NE(help.out.find("Usage: " + command + " "), std::string::npos) << help.out;
    words.back() = "--bogus";
    const test::CommandResult wrong = test::deform(words);
    EXPECT_EQ(wrong.exit_code, 2);
    EXPECT_NE(wrong.err.find("(see: " + command + " --help)"), std::string::npos) << wrong.err;
  }
}

// Options of every subcommand may stand in front of the program's name.
TEST(ToolsCommand, OptionsInFrontOfTheName_ReachTheProgram) {
  const std::string file = test::scratch("tools_command") + "/nodule.nrrd";
  const test::CommandResult r = test::deform({"mesh", "--json", "phantom", "nodule", "--out", file});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_EQ(r.out.rfind("{", 0), 0U) << r.out;
}
