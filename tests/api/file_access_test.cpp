// Whatever name of a file a user gives: no reader waits for a pipe, reads a device or takes a file without
// bound; each says which file and why.
#include <gtest/gtest.h>

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "deform/deform.h"
#include "support.h"
#include "world.h"

namespace {

namespace fs = std::filesystem;

const std::string &folder() {
  static const std::string dir = [] {
    const std::string d = test::scratch("file_access_" + std::to_string(getpid()));
    test::Context context;
    dfm_mesh_handle mesh = 0;
    const double size[3] = {0.1, 0.1, 0.1};
    test::ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 40, &mesh));
    test::ok(dfm_mesh_write(mesh, (d + "/block.msh").c_str()));
    test::ok(dfm_mesh_destroy(mesh));
    EXPECT_EQ(mkfifo((d + "/pipe").c_str(), 0600), 0);
    return d;
  }();
  return dir;
}

std::string scene_with(const std::string &body, const std::string &rest = "") {
  return R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.002, "step": 0.001},
    "bodies": [{"name": "block", "mesh": ")" +
         folder() + R"(/block.msh")" + body + "}]" + rest + "}";
}

// Within a time that only a reader that waits or never ends would need.
test::CommandResult run(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"/usr/bin/timeout", "60", DEFORM_COMMAND});
  return test::run(arguments);
}

void expect_refused(const std::vector<std::string> &arguments, const std::vector<std::string> &parts) {
  test::expect_refused(run(arguments), parts, arguments[0]);
}

struct Door {
  std::string pointer;                 // where a scene names the file; empty: the file is an argument
  std::vector<std::string> arguments;  // FILE stands for the name
  std::string scene;
};

std::vector<Door> doors() {
  const std::string out = folder() + "/out", scene = folder() + "/scene.json";
  const auto in_scene = [&](const std::string &pointer, const std::string &text) {
    return Door{pointer, {"run", scene, "--quiet", "--out", out}, text};
  };
  return {
      {"", {"run", "FILE", "--quiet", "--out", out}, ""},
      {"", {"explain", "FILE"}, ""},
      {"", {"friction", "FILE"}, ""},
      {"", {"ccd", "FILE"}, ""},
      {"", {"mesh", "info", "FILE"}, ""},
      {"", {"mesh", "convert", "FILE", folder() + "/x.vtk"}, ""},
      {"", {"mesh", "fill", "FILE", "--out", folder() + "/x.msh"}, ""},
      in_scene("/bodies/0/nodal_bc", scene_with(R"(, "nodal_bc": "FILE")")),
      in_scene("/bodies/0/fields/young", scene_with(R"(, "fields": {"young": "FILE"})")),
      in_scene("/bodies/0/surface/mesh",
               scene_with(R"(, "surface": {"mesh": "FILE", "coupling": "barycentric"})")),
      in_scene("/obstacles/0/mesh",
               scene_with("", R"(, "obstacles": [{"name": "o", "shape": "voxels", "mesh": "FILE"}])")),
  };
}

void try_all(const std::string &file, const std::string &kind) {
  for (Door door : doors()) {
    std::replace(door.arguments.begin(), door.arguments.end(), std::string("FILE"), file);
    if (const size_t at = door.scene.find("FILE"); at != std::string::npos)
      test::write_file(folder() + "/scene.json", door.scene.replace(at, 4, file));
    expect_refused(door.arguments, {file, kind, door.pointer});
  }
}

void make_sparse(const std::string &path, uint64_t bytes) {
  test::write_file(path, "");
  ASSERT_EQ(truncate(path.c_str(), off_t(bytes)), 0);
}

}  // namespace

TEST(FileAccess, Devices_AreRefusedByEveryReader) { try_all("/dev/zero", "is a device"); }
TEST(FileAccess, PipesWithoutAWriter_AreRefusedByEveryReader) { try_all(folder() + "/pipe", "is a pipe"); }
TEST(FileAccess, Directories_AreRefusedByEveryReader) { try_all(folder(), "is a directory"); }
TEST(FileAccess, MissingFiles_AreRefusedByEveryReader) { try_all(folder() + "/absent.obj", "No such file"); }

TEST(FileAccess, PluginFiles_AreRefusedWithoutWaiting) {
  for (const std::string &file : {std::string("/dev/zero"), folder() + "/pipe"}) {
    expect_refused(
        {"friction", std::string(DEFORM_SOURCE_DIR) + "/examples/friction/circle.json", "--law", file}, {});
    EXPECT_NE(run({"plugin", "check", file}).exit_code, 124) << file;
    EXPECT_NE(run({"plugin", "check", file}).exit_code, 0) << file;
  }
}

TEST(FileAccess, FilesBeyondTheirBound_AreRefusedBeforeTheyAreRead) {
  const std::string huge = folder() + "/huge.csv";
  const std::string mesh = folder() + "/huge.msh";
  const std::string scene = folder() + "/scene.json";
  const std::string out = folder() + "/out";
  make_sparse(huge, uint64_t(1) << 40);
  make_sparse(mesh, uint64_t(1) << 40);
  expect_refused({"ccd", huge}, {huge, "larger than the 1024 MiB", "table of queries"});
  expect_refused({"friction", huge}, {huge, "larger than the 64 MiB"});
  expect_refused({"run", huge, "--out", out}, {huge, "larger than the 64 MiB"});
  expect_refused({"mesh", "info", mesh}, {mesh, "larger than the 4096 MiB"});
  test::write_file(scene, scene_with(R"(, "nodal_bc": ")" + huge + "\""));
  expect_refused({"run", scene, "--out", out}, {"/bodies/0/nodal_bc", huge, "larger than"});
  test::write_file(scene, scene_with(R"(, "fields": {"young": ")" + huge + "\"}"));
  expect_refused({"run", scene, "--out", out}, {"/bodies/0/fields/young", huge, "larger than"});
  fs::remove(huge);
  fs::remove(mesh);
}

TEST(FileAccess, StandardInput_IsReadByItsName) {
  test::write_file(folder() + "/scene.json", scene_with(""));
  const std::string command =
      "cat '" + folder() + "/scene.json' | timeout 60 '" DEFORM_COMMAND "' run /dev/stdin --quiet --out '" +
      folder() + "/piped'";
  const test::CommandResult r = test::run({"/bin/sh", "-c", command});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_TRUE(fs::exists(folder() + "/piped/summary.json"));
  const test::CommandResult endless =
      test::run({"/bin/sh", "-c", "timeout 60 '" DEFORM_COMMAND "' friction /dev/stdin < /dev/zero"});
  EXPECT_EQ(endless.exit_code, 2) << endless.err;
  const test::CommandResult stream =
      test::run({"/bin/sh", "-c", "cat /dev/zero | timeout 60 '" DEFORM_COMMAND "' friction /dev/stdin"});
  EXPECT_EQ(stream.exit_code, 2) << stream.err;
  EXPECT_NE(stream.err.find("larger than the 64 MiB"), std::string::npos) << stream.err;
}

TEST(FileAccess, ApiReadAndWrite_RefuseAndReplaceAsTheCommandDoes) {
  const std::string victim = folder() + "/victim", link = folder() + "/link";
  test::write_file(victim, "kept");
  fs::create_symlink(victim, link);
  EXPECT_EQ(dfm_file_write(link.c_str(), "new", 3), DFM_OK) << dfm_last_error();
  EXPECT_EQ(test::read_file(victim), "kept");
  EXPECT_EQ(test::read_file(link), "new");
  EXPECT_FALSE(fs::is_symlink(link));
  std::string got;
  const auto take = [](void *user, const char *bytes, size_t n) {
    static_cast<std::string *>(user)->assign(bytes, n);
  };
  EXPECT_EQ(dfm_file_read(link.c_str(), 3, "a test file", take, &got), DFM_OK) << dfm_last_error();
  EXPECT_EQ(got, "new");
  EXPECT_EQ(dfm_file_read(link.c_str(), 2, "a test file", take, &got), DFM_E_FORMAT);
  EXPECT_EQ(dfm_file_read("", 2, "a test file", take, &got), DFM_E_ARG);
  EXPECT_EQ(dfm_file_read(nullptr, 2, "a test file", take, &got), DFM_E_ARG);
  EXPECT_EQ(dfm_file_read(link.c_str(), 2, "a test file", nullptr, &got), DFM_E_ARG);
  EXPECT_EQ(dfm_file_write(nullptr, "x", 1), DFM_E_ARG);
  EXPECT_EQ(dfm_file_write(folder().c_str(), "x", 1), DFM_E_IO);
  EXPECT_EQ(dfm_file_write((folder() + "/pipe").c_str(), "x", 1), DFM_E_IO) << "nobody reads it";
  EXPECT_EQ(dfm_file_write("/dev/null", "x", 1), DFM_OK) << dfm_last_error();
  EXPECT_FALSE(fs::is_regular_file("/dev/null"));
  for (const auto &entry : fs::directory_iterator(folder()))
    EXPECT_EQ(entry.path().string().find(".part"), std::string::npos) << entry.path();
}
