// Everything a user can get wrong in a scene or an argument: exit 2, one sentence that names the file, the
// place and what was expected.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>

#include "support.h"
#include "world.h"

namespace {

const char *kScene = R"({
  "format": "deform-scene", "version": 1,
  "time": {"duration": 0.002, "step": 0.001},
  "materials": {"gel": {"density": 1000, "young": 20000, "poisson": 0.3,
    "damping": {"mass": 0.1, "stiffness": 0.001}}},
  "bodies": [{"name": "block", "mesh": "block.msh", "material": "gel", "model": {"type": "msm", "params": {}},
              "pose": {"position": [0, 0, 0.1], "rotation": {"axis": [0, 0, 1], "angle_deg": 10}, "scale": 1},
              "fix": [{"box": [[-1, -1, -1], [1, 1, 0.001]]}],
              "forces": [{"box": [[-1, -1, 0.099], [1, 1, 1]], "total": [0, 0, -1]}]}],
  "obstacles": [{"name": "floor", "shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}],
  "contact": {"friction": [{"between": ["*", "*"], "law": "coulomb", "params": {"mu": 0.5}}]},
  "probes": [{"name": "tip", "body": "block", "point": [0.05, 0.05, 0.1]}],
  "output": {"every": 0.001}
})";

const std::string &folder() {
  static const std::string dir = [] {
    const std::string d = test::scratch("scene_errors_" + std::to_string(getpid()));
    test::Context context;
    dfm_mesh_handle mesh = 0;
    const double size[3] = {0.1, 0.1, 0.1};
    test::ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 40, &mesh));
    test::ok(dfm_mesh_write(mesh, (d + "/block.msh").c_str()));
    test::write_file(d + "/scene.json", kScene);
    return d;
  }();
  return dir;
}

std::string scene() { return folder() + "/scene.json"; }

test::CommandResult run(std::vector<std::string> arguments) {
  const std::string out = folder() + "/out";
  std::filesystem::remove_all(out);
  arguments.insert(arguments.begin(), {"run"});
  arguments.insert(arguments.end(), {"--quiet", "--out", out});
  const test::CommandResult result = test::deform(arguments);
  EXPECT_NE(std::filesystem::exists(out), result.exit_code == 2) << "a refused scene leaves nothing behind";
  return result;
}

struct Case {
  const char *set;
  std::vector<std::string> parts;
};

void check(const std::vector<Case> &cases) {
  for (const Case &c : cases) {
    std::vector<std::string> parts = c.parts;
    parts.push_back("scene.json");
    test::expect_refused(run({scene(), "--set", c.set}), parts, c.set);
  }
}

}  // namespace

TEST(SceneErrors, TheSceneItself_Runs) {
  const test::CommandResult result = run({scene()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST(SceneErrors, AMeshInPlaceOfTheScene_IsNamedWithTheSceneToWrite) {
  test::expect_refused(
      run({folder() + "/block.msh"}),
      {"block.msh: this is a mesh (MSH), and a scene is expected",
       "{\"name\": \"body\", \"mesh\": \"block.msh\"}", "deform mesh info ", folder() + "/block.msh"},
      "MSH");
  for (const char *ending : {"stl", "obj", "ply", "off", "vtk", "vtu", "mesh", "step"}) {
    const std::string file = folder() + "/a ball." + ending;
    if (std::string(ending) == "step") test::write_file(file, "ISO-10303-21;\n");
    else test::deform({"mesh", "make", "ball", "--cells", "100", "--quiet", "--out", file});
    test::expect_refused(run({file}), {"this is a mesh (", "deform mesh info '" + file + "'"}, ending);
  }
}

TEST(SceneErrors, UnknownKeys_NameTheNearest) {
  check({{"/gravty=[0,0,0]", {"/gravty", "did you mean \"gravity\"?"}},
         {"/bodies/0/mesg=\"x\"", {"/bodies/0/mesg", "did you mean \"mesh\"?"}},
         {"/bodies/0/pose/positon=[0,0,0]", {"/bodies/0/pose/positon", "position"}},
         {"/materials/gel/yuong=1", {"/materials/gel/yuong", "young"}},
         {"/time/zzzzzzzz=1",
          {"/time/zzzzzzzz", "expected one of: duration, integrator, max_time, max_work, mode, start, step"}},
         {"/bodies/0/model/params/volum=1", {"/bodies/0/model/params/volum", "volume"}},
         {"/contact/friction/0/params/mu_X=1", {"/contact/friction/0/params/mu_X", "mu_"}},
         {"/obstacles/0/radius=1", {"/obstacles/0/radius", "the shape plane has no \"radius\""}},
         {R"(/bodies/0/mesh={"make":"tube","inner":0.1,"radius":0.2,"length":1,"size":[1,1,1],"cells":100})",
          {"/bodies/0/mesh/size", "a tube has no \"size\"; that is for beam, bricks"}}});
}

TEST(SceneErrors, StepThatNeedsTooManySubSteps_IsRefusedBeforeTheRun) {
  test::expect_refused(run({scene(), "--set", "/materials/gel/young=1e13", "--set",
                            R"(/time={"duration":0.1,"step":0.1,"integrator":"symplectic_euler"})"}),
                       {"scene.json: /time/step: a step of 0.1 s needs", "at most 10000 are taken",
                        "body 'block', whose point", "move by tr_bdf2"},
                       "step");
  EXPECT_EQ(
      run({scene(), "--set", "/materials/gel/young=1e13", "--set", R"(/time={"duration":0.1,"step":0.1})"})
          .exit_code,
      0);
}

TEST(SceneErrors, WrongTypes_NameWhatWasExpected) {
  check({{"/gravity=5", {"/gravity", "expected [x, y, z] in m/s2 or an object with keyframes"}},
         {"/bodies/0/model=msm",
          {"/model", "expected an object with params, precision, type",
           "found string \"msm\"; write {\"type\": \"msm\"}"}},
         {"/contact/friction=0.5", {"/contact/friction", "\"law\": \"coulomb\"", "found number 0.5"}},
         {"/gravity=[0,0]", {"/gravity", "three numbers"}},
         {"/gravity=[0,0,\"down\"]", {"/gravity/2", "number"}},
         {"/bodies/0/mass_scaling=0.2", {"/bodies/0/mass_scaling", "0.1"}},
         {"/bodies/0/smooth=200", {"/bodies/0/smooth", "180"}},
         {"/bodies/0/device=tpu", {"/bodies/0/device", "\"cpu\""}},
         {"/bodies={}", {"/bodies", "array"}},
         {"/bodies/0=[]", {"/bodies/0", "expected an object"}},
         {"/bodies/0/name=5", {"/bodies/0/name", "string"}},
         {"/bodies/0/name=", {"/bodies/0/name", "not empty"}},
         {"/bodies/0/name=\"a/b\"", {"/bodies/0/name", "name"}},
         {"/output/states=1", {"/output/states", "true or false"}},
         {"/time/step=\"atuo\"", {"/time/step", "\"auto\""}},
         {"/effects=\"all\"", {"/effects", "\"auto\""}},
         {"/bodies/0/fix/0/axes=\"xw\"", {"/bodies/0/fix/0/axes", "xyz"}},
         {"/bodies/0/fix/0/box=[[1,1,1],[0,0,0]]", {"/bodies/0/fix/0/box", "lower"}},
         {"/bodies/0/fix/0/group=\"a\"", {"/bodies/0/fix/0", "one of \"box\", \"group\" and \"points\""}},
         {"/bodies/0/start={\"state\": \"a.csv\"}", {"/bodies/0/start/state", "a.csv", "No such file"}},
         {"/format=\"deform\"", {"/format", "deform-scene"}},
         {"/version=2", {"/version", "version 1"}}});
}

TEST(SceneErrors, Ranges_AreChecked) {
  check(
      {{"/time/duration=0", {"/time/duration", "above 0"}},
       {"/time/step=-1", {"/time/step", "above 0"}},
       {"/materials/gel/young=0", {"/materials/gel/young", "above 0"}},
       {"/materials/gel/poisson=0.5", {"/materials/gel/poisson", "0.5"}},
       {"/materials/gel/density=-1000", {"/materials/gel/density", "above 0"}},
       {"/materials/gel/damping/mass=-1", {"/materials/gel/damping/mass", "at least 0"}},
       {"/materials/gel/damping_mass=1", {"/materials/gel/damping_mass", "\"damping\": {\"mass\""}},
       {"/bodies/0/pose/scale=0", {"/bodies/0/pose/scale", "above 0"}},
       {"/bodies/0/pose/rotation/axis=[0,0,0]", {"/bodies/0/pose/rotation/axis", "zero"}},
       {"/obstacles/0/normal=[0,0,0]", {"/obstacles/0/normal", "zero"}},
       {"/contact/friction/0/params/mu=-0.1", {"/contact/friction/0/params/mu", "number from 0"}},
       {"/contact/friction/0/restitution=1.1", {"/contact/friction/0/restitution", "from 0 to 1"}},
       {"/contact/friction/0/restitution=-0.1", {"/contact/friction/0/restitution", "number"}},
       {"/contact/max_sweeps=0", {"/contact/max_sweeps", "whole number from 1 to 4294967295, found 0"}},
       {"/contact/max_sweeps=1.5", {"/contact/max_sweeps", "whole number", "1.5"}},
       {"/output/every=0", {"/output/every", "above 0"}},
       {"/output/camera={\"eye\":[1,1,1],\"look_at\":[1,1,1]}", {"/output/camera", "same point"}},
       {"/bodies/0/place={}", {"/bodies/0/place", "\"on\""}},
       {"/bodies/0/place={\"on\":\"flor\"}", {"/bodies/0/place/on", "did you mean \"floor\"?"}},
       {"/output={\"color\":\"speed\",\"color_range\":[1,1]}", {"/output/color_range", "second one larger"}},
       {"/output={\"color_range\":[0,1]}", {"/output/color_range", "give \"color\" a quantity"}},
       {"/gravity={\"keyframes\":[{\"t\":1,\"value\":[0,0,0]},{\"t\":1,\"value\":[0,0,0]}]}",
        {"/gravity/keyframes/1/t", "must increase"}}});
}

TEST(SceneErrors, Switches_NameWhatIsMissing) {
  const std::string at = "/bodies/0/switch";
  check(
      {{"/bodies/0/switch=[{\"t\":1}]", {at + "/0", "type"}},
       {"/bodies/0/switch=[{\"type\":\"msm\"}]", {at + "/0", "\"t\""}},
       {"/bodies/0/switch=[{\"t\":-1,\"type\":\"msm\"}]", {at + "/0/t", "-1"}},
       {"/bodies/0/switch=[{\"t\":1,\"type\":\"msm\",\"integrator\":\"auto\"}]",
        {at + "/0/integrator", "or leaves the body's own"}},
       {"/bodies/0/switch=[{\"t\":1,\"type\":\"mms\"}]", {at + "/0/type", "did you mean \"msm\"?"}},
       {"/bodies/0/switch=[{\"t\":1,\"type\":\"msm\",\"params\":{\"yuong\":1}}]",
        {at + "/0/params", "young"}},
       {"/bodies/0/switch=[{\"t\":2,\"type\":\"msm\"},{\"t\":1,\"type\":\"msm\"}]",
        {at, "a switch at 1 s after one at 2 s"}},
       {"/bodies/0/switch=[{\"t\":1,\"type\":\"msm\",\"max_jump\":0}]", {at + "/0/max_jump", "above 0"}},
       {"/bodies/0/switch=[{\"t\":1,\"type\":\"msm\",\"integrator\":\"euler\"}]",
        {at + "/0/integrator", "implicit_euler"}},
       {"/bodies/0/switch=5", {at, "array"}},
       {"/bodies/0/switch={\"touching\":\"msm\"}", {at, "far"}},
       {"/bodies/0/switch={\"far\":\"msm\"}", {at, "touching", "near"}},
       {"/bodies/0/switch={\"far\":\"msm\",\"near\":\"msm\"}", {at, "point"}},
       {"/bodies/0/switch={\"far\":\"msm\",\"near\":\"msm\",\"point\":[0,0,0]}", {at, "distance"}},
       {"/bodies/0/switch={\"far\":\"msm\",\"touching\":\"msm\",\"distance\":1}", {at + "/distance", "near"}},
       {"/bodies/0/switch={\"far\":{\"tpye\":\"msm\"},\"touching\":\"msm\"}", {at + "/far", "type"}},
       {"/bodies/0/switch={\"far\":\"msm\",\"touching\":\"msm\",\"wait\":-1}",
        {at + "/wait", "at least 0"}}});
}

TEST(SceneErrors, Springs_ReportWhereTheyPullAndEnd) {
  check({{"/bodies/0/springs=[{\"to\":[0,0,0],\"stiffness\":1}]",
          {"/bodies/0/springs/0", "point", "box", "group"}},
         {"/bodies/0/springs=[{\"point\":[0,0,0],\"stiffness\":1}]",
          {"/bodies/0/springs/0", "to", "keyframes"}},
         {"/bodies/0/springs=[{\"point\":[0,0,0],\"to\":[0,0,0]}]", {"/bodies/0/springs/0", "stiffness"}},
         {"/bodies/0/springs=[{\"point\":[0,0,0],\"keyframes\":[],\"stiffness\":1}]",
          {"/bodies/0/springs/0/keyframes", "at least one"}},
         {"/bodies/0/springs=[{\"point\":[9,9,9],\"to\":[0,0,0],\"stiffness\":1}]",
          {"/bodies/0/springs/0/point", "away"}},
         {"/bodies/0/springs=[{\"point\":[0,0,0],\"to\":[0,0,0],\"stiffness\":-1}]",
          {"/bodies/0/springs/0/stiffness"}}});
}

TEST(SceneErrors, Names_AreUniqueAndKnown) {
  check({{"/bodies/0/material=\"gle\"", {"/bodies/0/material", "did you mean \"gel\"?"}},
         {"/obstacles/0/name=\"block\"", {"/obstacles/0/name", "taken"}},
         {"/rigid={\"bodies\":[{\"name\":\"r\",\"shape\":\"sphere\",\"radius\":1,\"mass\":1},"
          "{\"name\":\"q\",\"id\":50,\"shape\":\"sphere\",\"radius\":1,\"mass\":1}]}",
          {"/rigid/bodies/1/id", "follow the first; omit it"}},
         {"/contact/friction/0/between=[\"blok\",\"*\"]",
          {"/contact/friction/0/between/0", "did you mean \"block\"?"}},
         {"/contact/friction/0/between=[\"block\"]", {"/contact/friction/0/between", "two sides"}},
         {"/contact/friction/0/between=[\"material=steel\",\"*\"]", {"/contact/friction/0", "gel"}},
         {"/probes/0/body=\"floor\"", {"/probes/0/body", "block"}},
         {"/probes/-={\"name\":\"tip\",\"body\":\"block\",\"point\":[0,0,0]}", {"/probes/1/name", "taken"}},
         {"/probes/0/point=[5,5,5]", {"/probes/0/point", "away"}},
         {"/bodies/0/fix/0/box=[[5,5,5],[6,6,6]]", {"/bodies/0/fix/0/box", "no point"}},
         {"/bodies/0/fix/0={\"group\":\"left\"}", {"/bodies/0/fix/0/group", "left"}},
         {"/bodies/0/mesh=\"missing.msh\"", {"/bodies/0/mesh", "missing.msh"}},
         {"/bodies/0/model/type=\"corotational\"", {"/bodies/0/model/type", "corotational_fem", "msm"}},
         {"/contact/friction/0/law=\"dalh\"", {"/contact/friction/0/law", "coulomb", "none"}},
         {"/contact/method=\"rollback\"", {"/contact/method", "remove", "deform rollback"}},
         {"/effects=[\"cutting\"]", {"/effects", "cutting"}}});
}

TEST(SceneErrors, NotDelivered_IsNeverIgnored) {
  const std::vector<std::pair<const char *, const char *>> later = {
      {"/rigid={\"bodies\":[{\"name\":\"r\",\"shape\":\"mesh\"}]}", "/rigid/bodies/0/shape"},

      {"/time/integrator=\"verlet\"", "/time/integrator"},
      {"/bodies/0/pressure=5", "/bodies/0/pressure"}};
  for (const auto &[set, pointer] : later)
    test::expect_refused(run({scene(), "--set", set}), {"not available yet: " + std::string(pointer) + "\n"},
                         set);
}

TEST(SceneErrors, Files_AreRefusedWithTheirPlace) {
  const std::string file = folder() + "/bad.json";
  const std::string whole = kScene;
  const std::vector<std::pair<std::string, std::vector<std::string>>> texts = {
      {"", {"bad.json:1:1", "empty"}},
      {"  \n ", {"empty"}},
      {whole.substr(0, whole.size() / 2), {"bad.json:", "not JSON"}},
      {"[1, 2]", {"expected an object"}},
      {"{\"gravity\": [0, 0, NaN]}", {"bad.json:1:", "finite"}},
      {"{\"gravity\": [0, 0, -Infinity]}", {"bad.json:1:", "finite"}},
      {"{\"gravity\": [0, 0, 1e400]}", {"bad.json"}},
      {"{\"a\": 1, \"a\": 2}", {"bad.json:1:10", "twice"}},
      {std::string(10 << 20, '['), {"bad.json:1:65", "nested deeper"}},
      {std::string("\x7f"
                   "ELF\0\1\2",
                   7),
       {"bad.json:1:5", "not JSON", "NUL"}},
      {"{\"version\": 1}", {"\"format\" is missing"}},
  };
  for (const auto &[text, parts] : texts) {
    test::write_file(file, text);
    test::expect_refused(run({file}), parts, text.substr(0, 40));
  }
  test::expect_refused(run({folder() + "/nothing.json"}),
                       {"nothing.json", "No such file", "a scene file (JSON)"}, "missing file");
  test::expect_refused(run({folder()}), {"is a directory", "a scene file (JSON)"}, "a folder");
}

TEST(SceneErrors, Arguments_AreRefused) {
  const std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>> calls = {
      {{"rnu"}, {"rnu", "did you mean \"run\"?"}},
      {{"validate", scene()}, {"there is no subcommand \"validate\"; a subcommand is needed: run, "}},
      {{}, {"subcommand"}},
      {{"run"}, {"SCENE"}},
      {{"run", scene(), "--tiem", "1"}, {"--tiem", "did you mean \"--time\"?"}},
      {{"run", scene(), "--time", "-1"}, {"--time"}},
      {{"run", scene(), "--time", "nan"}, {"--time"}},
      {{"run", scene(), "--time", "soon"}, {"--time"}},
      {{"run", scene(), "--threads", "-2"}, {"--threads"}},
      {{"run", scene(), "--jitter", "x"}, {"--jitter"}},
      {{"run", scene(), "--set", "time=1"}, {"--set", "/json/pointer=value"}},
      {{"run", scene(), "--set", "/bodies/7/mesh=x"}, {"--set /bodies/7/mesh", "1 entries"}},
      {{"explain", folder() + "/nothing.json"}, {"nothing.json"}},
      {{"cost", "scene.json", "--budget", "1"}, {"scene.json", "cannot be opened"}},
      {{"ccd", "q.csv"}, {"q.csv"}}};
  for (const auto &[arguments, parts] : calls) {
    std::string what;
    for (const std::string &a : arguments) what += a + " ";
    test::expect_refused(test::deform(arguments), parts, what);
  }
}

TEST(SceneErrors, OutputThatCannotBeWritten_IsRefused) {
  test::write_file(folder() + "/file", "in the way");
  test::expect_refused(test::deform({"run", scene(), "--quiet", "--out", folder() + "/file"}),
                       {folder() + "/file"}, "a file has the unknown way of cutting");
}

TEST(SceneApi, Errors_LeakNothing) {
  test::Context context;
  dfm_scene s = 77;
  dfm_world w = 77;
  EXPECT_EQ(dfm_scene_open(context, (folder() + "/nothing.json").c_str(), nullptr, &s), DFM_E_IO);
  EXPECT_EQ(dfm_scene_load(context, nullptr, &w), DFM_E_ARG);
  EXPECT_EQ(dfm_scene_open(nullptr, scene().c_str(), nullptr, &s), DFM_E_ARG);
  EXPECT_EQ(s, 77u);
  EXPECT_EQ(w, 77u);
  const char *set[] = {"/time/integrator=\"verlet\""};
  dfm_scene_options options = {sizeof options, 1, set, 0};
  EXPECT_EQ(dfm_scene_open(context, scene().c_str(), &options, &s), DFM_E_UNSUPPORTED);
  EXPECT_NE(std::string(dfm_last_error()).find("not available yet: /time/integrator"), std::string::npos);
}

TEST(SceneErrors, SelfContactRequestedAndRefused_IsReported) {
  test::Context context;
  const char *set[] = {"/effects=[\"self_contact\"]", "/contact/self=false"};
  dfm_scene_options options = {sizeof options, 2, set, 0};
  dfm_scene s = 0;
  EXPECT_EQ(dfm_scene_open(context, scene().c_str(), &options, &s), DFM_E_ARG);
  EXPECT_NE(std::string(dfm_last_error()).find("/contact/self"), std::string::npos) << dfm_last_error();
}

TEST(SceneErrors, UnknownValueOfSelfContact_ListsTheAllowedOnes) {
  test::Context context;
  const char *set[] = {"/contact/self=\"sometimes\""};
  dfm_scene_options options = {sizeof options, 1, set, 0};
  dfm_scene s = 0;
  EXPECT_EQ(dfm_scene_open(context, scene().c_str(), &options, &s), DFM_E_ARG);
  EXPECT_NE(std::string(dfm_last_error()).find("/contact/self"), std::string::npos) << dfm_last_error();
}

TEST(SceneApi, SelfContactAuto_IsReadAndIsOffWhereNothingFolds) {
  test::Context context;
  const char *set[] = {"/contact/self=\"auto\""};
  dfm_scene_options options = {sizeof options, 1, set, 0};
  dfm_scene s = 0;
  test::ok(dfm_scene_open(context, scene().c_str(), &options, &s));
  dfm_world w = 0;
  test::ok(dfm_scene_world(s, &w));
  EXPECT_NE(test::written(dfm_world_explain, w).find("contact.self"), std::string::npos);
  test::ok(dfm_world_step(w, 1e-3, nullptr));
  EXPECT_EQ(test::stats(w).self_max, 0u);
  test::ok(dfm_scene_close(s));
}

// Structs of an older header end earlier: what they lack is left out, or has its default.
TEST(SceneApi, OptionsAndSettingsOfAnOlderHeader_AreTaken) {
  test::Context context;
  const char *set[] = {"/time/duration=0.5"};
  dfm_scene_options options = {offsetof(dfm_scene_options, jitter_seed), 1, set, 4711};
  dfm_scene older = 0, today = 0;
  DFM_OK_OR_DIE(dfm_scene_open(context, scene().c_str(), &options, &older));
  options = {sizeof options, 1, set, 0};
  DFM_OK_OR_DIE(dfm_scene_open(context, scene().c_str(), &options, &today));
  dfm_world worlds[2] = {};
  DFM_OK_OR_DIE(dfm_scene_world(older, &worlds[0]));
  DFM_OK_OR_DIE(dfm_scene_world(today, &worlds[1]));
  EXPECT_EQ(dfm_world_hash(worlds[0]), dfm_world_hash(worlds[1]))
      << "the seed behind the struct's end counts";
  dfm_scene_settings settings = {};
  settings.size = offsetof(dfm_scene_settings, every);
  settings.every = -1;
  DFM_OK_OR_DIE(dfm_scene_get_settings(older, &settings));
  EXPECT_EQ(settings.duration, 0.5);
  EXPECT_EQ(settings.every, -1) << "behind the end that the caller named";
  EXPECT_EQ(settings.size, offsetof(dfm_scene_settings, every));
}

TEST(SceneApi, OpenScene_IsValidUntilItIsClosed) {
  test::Context context;
  const char *set[] = {"/time/duration=0.5", "/output/color=speed"};
  dfm_scene_options options = {sizeof options, 2, set, 0};
  dfm_scene s = 0;
  DFM_OK_OR_DIE(dfm_scene_open(context, scene().c_str(), &options, &s));
  dfm_scene_settings settings = {};
  settings.size = sizeof settings;
  DFM_OK_OR_DIE(dfm_scene_get_settings(s, &settings));
  EXPECT_EQ(settings.duration, 0.5);
  EXPECT_EQ(settings.step, 0.001);
  EXPECT_STREQ(settings.color, "speed");
  EXPECT_EQ(settings.nprobe, 1u);

  // Values after defaults: what the file leaves out is there too.
  size_t bytes = 0;
  DFM_OK_OR_DIE(dfm_scene_value(s, "/time/integrator", nullptr, &bytes));
  std::string text(bytes, ' ');
  DFM_OK_OR_DIE(dfm_scene_value(s, "/time/integrator", text.data(), &bytes));
  EXPECT_STREQ(text.c_str(), "\"auto\"");
  bytes = 3;
  EXPECT_EQ(dfm_scene_value(s, "/time/integrator", text.data(), &bytes), DFM_E_ARG);
  EXPECT_EQ(bytes, 7u);
  EXPECT_EQ(dfm_scene_value(s, "/nothing", nullptr, &bytes), DFM_E_ARG);

  // The probe stands where its point is, posed: 10 degrees about z and 0.1 m up.
  const char *name = nullptr;
  double x[3], v[3];
  DFM_OK_OR_DIE(dfm_scene_probe(s, 0, &name, x, v));
  EXPECT_STREQ(name, "tip");
  const double c = std::cos(M_PI / 18), d = std::sin(M_PI / 18);
  EXPECT_NEAR(x[0], 0.05 * (c - d), 1e-15);
  EXPECT_NEAR(x[1], 0.05 * (c + d), 1e-15);
  EXPECT_NEAR(x[2], 0.2, 1e-15);
  EXPECT_EQ(dfm_scene_probe(s, 1, &name, x, v), DFM_E_ARG);

  dfm_world w = 0;
  DFM_OK_OR_DIE(dfm_scene_world(s, &w));
  DFM_OK_OR_DIE(dfm_scene_close(s));
  EXPECT_EQ(dfm_scene_close(s), DFM_E_HANDLE);
  EXPECT_EQ(dfm_world_step(w, 0.001, nullptr), DFM_E_HANDLE);
}

TEST(SceneApi, LoadedWorld_OutlivesTheReader) {
  test::Context context;
  dfm_world w = 0;
  DFM_OK_OR_DIE(dfm_scene_load(context, scene().c_str(), &w));
  DFM_OK_OR_DIE(dfm_world_step(w, 0.001, nullptr));
  dfm_body body = 0;
  DFM_OK_OR_DIE(dfm_world_find_body(w, "block", &body));
}
