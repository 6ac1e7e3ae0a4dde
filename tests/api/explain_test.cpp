// `deform explain`: what runs, what does not, and why.
#include <gtest/gtest.h>
#include <unistd.h>

#include "support.h"
#include "world.h"

namespace {

std::string scene(const std::string &name, const std::string &rest) {
  const std::string folder = test::scratch("explain_" + std::to_string(getpid()));
  const std::string path = folder + "/" + name + ".json";
  test::Context context;
  dfm_tetmesh mesh = 0;
  const double size[3] = {0.1, 0.1, 0.1};
  test::ok(dfm_tetmesh_make(context, "beam", size, 60, &mesh));
  test::ok(dfm_tetmesh_write(mesh, (folder + "/block.msh").c_str()));
  test::write_file(
      path,
      R"({"format": "deform-scene", "version": 1, "time": {"duration": 1, "step": 0.1}, )" + rest + "}");
  return path;
}

const char *kOneBody = R"("bodies": [{"name": "lone", "mesh": "block.msh"}])";
const char *kOnFloor =
    R"("bodies": [{"name": "lone", "mesh": "block.msh"}],
       "obstacles": [{"name": "floor", "shape": "plane"}])";

// The part of the text that lists what runs.
std::string running(const std::string &text) {
  const size_t begin = text.find("stages of a step"), end = text.find("left out");
  return begin == std::string::npos || end == std::string::npos ? "" : text.substr(begin, end - begin);
}

}  // namespace

TEST(Explain, OneBodyAlone_HasNoBroadPhase) {
  const test::CommandResult result = test::deform({"explain", scene("alone", kOneBody)});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(running(result.out).find("model"), std::string::npos) << result.out;
  EXPECT_EQ(running(result.out).find("broad"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("broad"), std::string::npos) << "and says why it is left out:\n" << result.out;
}

TEST(Explain, BodyOverFloor_HasContact) {
  const test::CommandResult result = test::deform({"explain", scene("floor", kOnFloor)});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (const char *stage : {"broad", "narrow", "friction", "distribute"})
    EXPECT_NE(running(result.out).find(stage), std::string::npos) << stage << "\n" << result.out;
}

TEST(Explain, Step_NamesBoundAndSubSteps) {
  const test::CommandResult result = test::deform({"explain", scene("step", kOneBody)});
  EXPECT_NE(result.out.find("\"lone\""), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("the scene asks for 0.1 s: at least "), std::string::npos) << result.out;
}

TEST(Explain, Step_SaysWhetherStiffnessOrDampingBoundsIt) {
  const auto damped = [](const std::string &name, const std::string &damping) {
    const std::string path =
        scene(name, R"("materials": {"m": {"young": 1e5, "damping": {)" + damping +
                        R"(}}}, "bodies": [{"name": "lone", "mesh": "block.msh", "material": "m"}])");
    return test::deform({"explain", path}).out;
  };
  const std::string stiff = damped("stiff", R"("stiffness": 1e-5)");
  const std::string slow = damped("slow", R"("stiffness": 1)");
  const std::string heavy = damped("heavy", R"("mass": 1e6)");
  EXPECT_NE(stiff.find("the stiffest point for its mass"), std::string::npos) << stiff;
  EXPECT_NE(stiff.find("soften or coarsen"), std::string::npos) << stiff;
  for (const std::string &out : {slow, heavy}) {
    EXPECT_NE(out.find("damping bounds it"), std::string::npos) << out;
    EXPECT_NE(out.find("lower the damping"), std::string::npos) << out;
    EXPECT_EQ(out.find("stiffest"), std::string::npos) << out;
  }
}

TEST(Explain, Json_IsOneObject) {
  const test::CommandResult result = test::deform({"explain", scene("json", kOnFloor), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out[0], '{');
  for (const char *key : {"\"effects\":", "\"stages\":", "\"absent\":", "\"step\":"})
    EXPECT_NE(result.out.find(key), std::string::npos) << key;
}

TEST(Explain, Set_ChangesThePlan) {
  const std::string path = scene("set", kOneBody);
  const char *varying = R"(/gravity={"keyframes":[{"t":0,"value":[0,0,0]},{"t":1,"value":[0,0,-9.81]}]})";
  const test::CommandResult still = test::deform({"explain", path});
  const test::CommandResult moving = test::deform({"explain", path, "--set", varying});
  EXPECT_EQ(running(still.out).find("motion"), std::string::npos) << still.out;
  EXPECT_NE(running(moving.out).find("motion"), std::string::npos) << moving.out;
}
