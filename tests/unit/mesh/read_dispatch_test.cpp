// Which reader a file gets: by content where that is beyond doubt, else by ending; foreign formats are
// refused with the way to convert them.
#include <gtest/gtest.h>

#include "mesh/raw_mesh.h"
#include "mesh_support.h"

using namespace dfm;

namespace {

const std::string kOff = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

RawMesh parse(const std::string &name, const std::string &text) {
  return parse_raw(Memory::standard(), name, text.data(), text.size());
}

void expect_unsupported(const std::string &name, const std::string &text,
                        const std::vector<std::string> &words) {
  test::expect_error(test::error_of([&] { parse(name, text); }), DFM_E_UNSUPPORTED, words, name + ": ");
}

}  // namespace

TEST(ReadDispatch, WrongFileNameEnding_IsWarnedOfAndTheFileRead) {
  const RawMesh raw = parse("a.ply", kOff);
  EXPECT_EQ(raw.ntri(), 1u);
  ASSERT_EQ(raw.warnings.size(), 1u);
  EXPECT_EQ(raw.warnings[0], "read as OFF, as its first bytes show, although its name ends in .ply");
  EXPECT_EQ(parse("a", kOff).warnings.at(0),
            "read as OFF, as its first bytes show, although its name has no ending");
  EXPECT_TRUE(parse("A.OFF", kOff).warnings.empty());
  const RestMesh mesh =
      finish_surface("a.ply", parse_raw(Memory::standard(), "a.ply", kOff.data(), kOff.size()));
  ASSERT_FALSE(mesh.warnings.empty());
  EXPECT_EQ(mesh.warnings[0], raw.warnings[0]);
}

TEST(ReadDispatch, ByteOrderMark_IsPassedOver) {
  EXPECT_EQ(parse("a.off", "\xef\xbb\xbf" + kOff).ntri(), 1u);
  EXPECT_EQ(parse("a.obj", "\xef\xbb\xbfv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").ntri(), 1u);
}

TEST(ReadDispatch, ForeignContent_IsNamedWhateverTheEnding) {
  expect_unsupported("a.msh", std::string("\x1f\x8b\x08\0", 4), {"gzip", "ends in .msh", "gunzip"});
  expect_unsupported("a.obj", "glTF\2", {"glTF", "deform mesh convert"});
  expect_unsupported("a.obj", "Kaydara FBX Binary  ", {"FBX", "deform mesh convert"});
  expect_unsupported("a.vtu", "<?xml version=\"1.0\"?>\n<COLLADA>", {"COLLADA", "deform mesh convert"});
  expect_unsupported("a.mesh", "\x89HDF\r\n", {"HDF5", "meshio convert"});
  expect_unsupported("a.obj", "\xff\xfev", {"UTF-16", "plain text"});
}

TEST(ReadDispatch, ForeignEndings_AreRefusedWithTheWayToConvert) {
  const std::pair<const char *, const char *> rows[] = {
      {"bdf", "meshio convert"}, {"poly", ".ele"},     {"edge", ".ele"},    {"gltf", "assimp"},
      {"glb", "assimp"},         {"fbx", "assimp"},    {"3ds", "assimp"},   {"dae", "assimp"},
      {"gz", "gunzip"},          {"meshb", "gmsh -3"}, {"step", "gmsh -3"}, {"med", "meshio"}};
  for (const auto &[end, word] : rows) expect_unsupported(std::string("a.") + end, "x", {word});
}

TEST(ReadDispatch, UnknownEnding_NamesTheNearestAndAllThatAreRead) {
  expect_unsupported(
      "a.stll", "x",
      {"'stll'", "did you mean .stl?", ".msh, .vtk, .vtu, .mesh, .obj, .ply, .stl, .off, .inp, .ele, .vol"});
  expect_unsupported("a.d/mesh", "x", {"unknown mesh file ending ''"});
}

TEST(ReadDispatch, ForeignEnding_IsRefusedBeforeTheFileIsRead) {
  try {
    read_raw(Memory::standard(), "/nowhere/a.bdf");
    ADD_FAILURE();
  } catch (const Error &e) {
    EXPECT_EQ(e.status, DFM_E_UNSUPPORTED);
  }
}
