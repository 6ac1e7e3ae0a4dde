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
  dfm_mesh_handle mesh = 0;
  const double size[3] = {0.1, 0.1, 0.1};
  test::ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 60, &mesh));
  test::ok(dfm_mesh_write(mesh, (folder + "/block.msh").c_str()));
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
  EXPECT_NE(result.out.find("bounds explicit sub-steps, to "), std::string::npos) << result.out;
}

TEST(Explain, Step_ReportsWhetherStiffnessOrDampingBoundsIt) {
  const auto damped = [](const std::string &name, const std::string &damping) {
    const std::string path =
        scene(name, R"("materials": {"m": {"young": 1e5, "damping": {)" + damping +
                        R"(}}}, "bodies": [{"name": "lone", "mesh": "block.msh", "material": "m",
                                 "integrator": "symplectic_euler"}])");
    return test::deform({"explain", path}).out;
  };
  const std::string stiff = damped("stiff", R"("stiffness": 1e-5)");
  const std::string slow = damped("slow", R"("stiffness": 1)");
  const std::string heavy = damped("heavy", R"("mass": 1e6)");
  EXPECT_NE(stiff.find("the stiffest point for its mass"), std::string::npos) << stiff;
  EXPECT_NE(stiff.find("soften or coarsen"), std::string::npos) << stiff;
  EXPECT_NE(slow.find("the lag of the dampers bound it (a lag of "), std::string::npos) << slow;
  EXPECT_NE(heavy.find("damping bounds it"), std::string::npos) << heavy;
  EXPECT_NE(slow.find("lower its damping"), std::string::npos) << slow;
  EXPECT_NE(heavy.find("lower the damping"), std::string::npos) << heavy;
  for (const std::string &out : {slow, heavy}) {
    EXPECT_EQ(out.find("stiffest"), std::string::npos) << out;
  }
}

// Mass may move between the points of a body that nothing divides: what is offered is accepted.
TEST(Explain, MassScaling_IsOfferedWhereItIsAccepted) {
  const std::string path = scene("offered", R"("materials": {"m": {"young": 1e4}},
      "bodies": [{"name": "liver", "mesh": ")" DEFORM_SOURCE_DIR
                                            R"(/examples/data/liver.msh", "material": "m",
                  "model": {"type": "msm"}}],
      "tools": [{"name": "knife", "shape": "blade", "half_size": [0.001, 0.1, 0.1],
                 "pose": {"position": [1, 0, 0]}}])");
  const std::vector<std::string> divides = {
      "/tools/0/cuts=[\"liver\"]", "/materials/m/tear=0.5", "/bodies/0/separate={\"least_cells\":2}",
      R"(/cuts=[{"body":"liver","t":1,"shape":"plane","point":[0,0,0],"normal":[1,0,0]}])"};
  const auto explained = [&](const std::vector<std::string> &changes) {
    std::vector<std::string> args = {"explain", path};
    for (const std::string &c : changes) args.insert(args.end(), {"--set", c});
    return test::deform(args);
  };
  const std::string take = "/bodies/0/mass_scaling=0.01", offer = "\"mass_scaling\": 0.01 would allow";
  EXPECT_NE(explained({}).out.find(offer), std::string::npos) << explained({}).out;
  EXPECT_EQ(explained({take}).exit_code, 0);
  for (const std::string &by : divides) {
    const test::CommandResult before = explained({by});
    EXPECT_EQ(before.exit_code, 0) << before.err;
    EXPECT_EQ(before.out.find("mass_scaling"), std::string::npos) << before.out;
    EXPECT_NE(explained({by, take}).err.find("can be neither cut nor torn"), std::string::npos) << by;
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

namespace {

// A stiff block and a soft one side by side; h: the step, s or "auto".
std::string stiff_and_soft(const std::string &name, const std::string &model, const std::string &soft) {
  return scene(name, R"("materials": {"stiff": {"young": 1e9}, "soft": {"young": )" + soft + R"(}},
    "bodies": [{"name": "bone", "mesh": "block.msh", "material": "stiff", "model": {"type": ")" +
                         model + R"("}},
               {"name": "gel", "mesh": "block.msh", "material": "soft", "pose": {"position": [1, 0, 0]}}])");
}

struct Moves { std::string bone, gel; };  // the lines of `deform explain`
Moves moves(const std::string &path, const std::vector<std::string> &set) {
  std::vector<std::string> args = {"explain", path};
  for (const std::string &s : set) args.insert(args.end(), {"--set", s});
  const test::CommandResult result = test::deform(args);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const auto line = [&](const std::string &body) {
    for (size_t at = 0, end = 0; (end = result.out.find('\n', at)) != std::string::npos; at = end + 1)
      if (const std::string text = result.out.substr(at, end - at);
          text.rfind("  " + body + " ", 0) == 0 && text.find("moves by: ") != std::string::npos)
        return text.substr(text.find("moves by: ") + 10);
    return std::string();
  };
  return {line("bone"), line("gel")};
}

}  // namespace

TEST(Explain, IntegratorAuto_IsImplicitWhereExplicitTimeCostsFourTimesAsMuch) {
  const std::string path = stiff_and_soft("auto", "corotational_fem", "2e4");
  for (const char *step : {"/time/step=0.016667", "/time/step=auto"}) {
    const Moves long_step = moves(path, {step});
    EXPECT_EQ(long_step.bone.find("tr_bdf2  auto"), 0u) << long_step.bone;
    EXPECT_EQ(long_step.gel.find("symplectic_euler  auto"), 0u) << long_step.gel;
    for (const char *part : {"(explicit: ", " sub-steps of ", " s in a step, bounded by point "})
      EXPECT_NE(long_step.bone.find(part), std::string::npos) << long_step.bone;
  }
  const Moves short_step = moves(path, {"/time/step=0.0002"});
  EXPECT_EQ(short_step.bone.find("symplectic_euler  auto"), 0u) << short_step.bone;
}

// All bodies take the same sub-steps: one that is named explicit and bounds them leaves nothing to be gained.
TEST(Explain, IntegratorNamed_Stays) {
  const std::string path = stiff_and_soft("named", "corotational_fem", "2e4"), step = "/time/step=0.016667";
  const Moves named = moves(path, {step, "/bodies/0/integrator=symplectic_euler"});
  EXPECT_EQ(named.bone.find("symplectic_euler  named"), 0u) << named.bone;
  EXPECT_EQ(named.gel.find("symplectic_euler  auto"), 0u) << named.gel;
  EXPECT_EQ(moves(path, {step, "/time/integrator=symplectic_euler"}).bone.find("symplectic_euler  named"),
            0u);
  EXPECT_EQ(moves(path, {step, "/contact/method=velocity"}).bone.find("symplectic_euler  named"), 0u);
  EXPECT_EQ(moves(path, {step, "/contact/method=implicit"}).gel.find("implicit_euler  named"), 0u);
}

// The soft one has 130 explicit sub-steps. The bone would take each of them implicitly, which costs more than
// its own 1,104 explicit ones.
TEST(Explain, IntegratorAuto_IsNeverImplicitBecauseOfANeighbor) {
  const std::string path = stiff_and_soft("neighbors", "corotational_fem", "2e7");
  const Moves both = moves(path, {"/time/step=0.016667"});
  EXPECT_EQ(both.bone.find("symplectic_euler"), 0u) << both.bone;
  EXPECT_EQ(both.gel.find("symplectic_euler"), 0u) << both.gel;
  const Moves alone = moves(path, {"/time/step=0.016667", "/bodies/0/material=soft"});
  EXPECT_EQ(alone.gel, both.gel) << "as it is alone";
}

TEST(Run, StiffBodyWithoutAnIntegrator_TakesFewSubSteps) {
  const std::string path = stiff_and_soft("run", "corotational_fem", "2e4");
  test::Context context;
  const char *set[] = {"/time/step=0.016667"};
  const dfm_scene_options options = {sizeof options, 1, set, 0};
  dfm_scene s = 0;
  dfm_world w = 0;
  test::ok(dfm_scene_open(context, path.c_str(), &options, &s));
  test::ok(dfm_scene_world(s, &w));
  for (int i = 0; i < 3; ++i) test::ok(dfm_world_step(w, 0.016667, nullptr));
  dfm_world_stats stats = {};
  stats.size = sizeof stats;
  test::ok(dfm_world_get_stats(w, &stats));
  EXPECT_LT(stats.substeps, 3 * 20u) << "the soft body's";
  test::ok(dfm_scene_close(s));
}

TEST(World, StepOfTheDef_IsWhatAutoGoesBy) {
  test::Context context;
  const auto moves = [&](double step) {
    dfm_world_def d = dfm_world_def_default();
    d.step = step;
    dfm_world w = 0;
    test::ok(dfm_world_create(context, &d, &w));
    dfm_material_def m = dfm_material_def_default();
    m.name = "stiff";
    m.young = 1e9;
    dfm_material stiff = 0;
    test::ok(dfm_material_create(w, &m, &stiff));
    test::Tet t;
    t.def.material = stiff;
    dfm_body b = 0;
    test::ok(dfm_body_create(w, &t.def, &b));
    double stable = 0;
    test::ok(dfm_world_stable_step(w, &stable, nullptr, nullptr));
    test::ok(dfm_world_destroy(w));
    return stable < 1e-4 ? "explicit" : "implicit";
  };
  EXPECT_STREQ(moves(0.1), "implicit");
  EXPECT_STREQ(moves(0), "explicit");
  for (const double wrong : {-1.0, double(NAN), HUGE_VAL}) {
    dfm_world_def d = dfm_world_def_default();
    d.step = wrong;
    dfm_world w = 0;
    EXPECT_EQ(dfm_world_create(context, &d, &w), DFM_E_ARG);
    test::says({"step is"});
  }
}

// A query between two creations does not fix the choice for the first body: it is one choice for all of
// them before the first step.
TEST(World, QueriesBetweenBodies_DoNotChangeTheChoice) {
  test::Context context;
  const auto substeps = [&](bool asks) {
    dfm_world_def d = dfm_world_def_default();
    d.step = 1.0 / 60;
    d.gravity[2] = 0;
    dfm_world w = 0;
    test::ok(dfm_world_create(context, &d, &w));
    for (const double young : {1e6, 1e10}) {
      dfm_material_def m = dfm_material_def_default();
      m.name = young > 1e7 ? "stiff" : "soft";
      m.young = young;
      dfm_material material = 0;
      test::ok(dfm_material_create(w, &m, &material));
      test::Tet t;
      t.def.material = material;
      t.def.pose.position[0] = young > 1e7 ? 10 : 0;
      dfm_body b = 0;
      test::ok(dfm_body_create(w, &t.def, &b));
      double stable = 0;
      if (asks) test::ok(dfm_world_stable_step(w, &stable, nullptr, nullptr));
    }
    test::ok(dfm_world_step(w, 1.0 / 60, nullptr));
    dfm_world_stats stats = {};
    stats.size = sizeof stats;
    test::ok(dfm_world_get_stats(w, &stats));
    test::ok(dfm_world_destroy(w));
    return stats.substeps;
  };
  EXPECT_EQ(substeps(true), substeps(false));
}

namespace {

std::string one_model(const std::string &name, const std::string &model, const std::string &more = "") {
  return scene(name, R"("bodies": [{"name": "lone", "mesh": "block.msh", "model": )" + model + "}]" + more);
}

std::string line_of(const std::string &text, const std::string &effect) {
  for (size_t at = 0, end = 0; (end = text.find('\n', at)) != std::string::npos; at = end + 1)
    if (const std::string line = text.substr(at, end - at);
        line.rfind("  lone ", 0) == 0 && line.find("  " + effect + " ") != std::string::npos)
      return line;
  return "";
}

}  // namespace

TEST(Explain, EffectsOfABody_AreUsedIdleOrTheModelsOwn) {
  const std::string path = one_model("effects", R"({"type": "msm", "params": {"damping_mass": 2}})");
  const test::CommandResult result = test::deform({"explain", path});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string &out = result.out;
  EXPECT_NE(line_of(out, "damping").find("used; off with damping_stiffness 0, damping_mass 0, damper voigt"),
            std::string::npos)
      << out;
  EXPECT_NE(line_of(out, "anisotropy").find("idle: anisotropy_slope 0"), std::string::npos) << out;
  EXPECT_NE(line_of(out, "large_rotation").find("the model's own"), std::string::npos) << out;
  EXPECT_NE(out.find("--costs measures"), std::string::npos) << out;
  const test::CommandResult listed = test::deform({"explain", path, "--set", R"(/effects=["damping"])"});
  EXPECT_NE(line_of(listed.out, "volume").find("idle: volume 0"), std::string::npos) << listed.out;
  EXPECT_NE(listed.out.find("off: not in the list of effects; body 'lone' calls for it: volume \"auto\""),
            std::string::npos)
      << listed.out;
  EXPECT_NE(line_of(listed.out, "large_rotation").find("on, not asked for; no parameter switches it off"),
            std::string::npos)
      << listed.out;
  EXPECT_NE(line_of(listed.out, "damping").find("used"), std::string::npos) << listed.out;
}

// The values that a model names for "off" do switch the effect off, for every model and effect that has some.
TEST(Explain, SwitchesOfAnEffect_SwitchItOff) {
  struct Case {
    const char *model, *effect, *on;
    std::vector<const char *> off;
  };
  const std::vector<Case> cases = {
      {"msm", "volume", R"({"volume": 1})", {"volume=0"}},
      {"msm",
       "damping",
       R"({"damping_stiffness": 0.01, "damper": "sls"})",
       {"damping_stiffness=0", "damping_mass=0", "damper=voigt"}},
      {"msm", "anisotropy", R"({"anisotropy_slope": 1})", {"anisotropy_slope=0"}},
      {"msm", "deform.relaxation", R"({"damper": "maxwell"})", {"damper=voigt"}},
      {"corotational_fem", "damping", R"({"damping_mass": 1})", {"damping_stiffness=0", "damping_mass=0"}},
      {"corotational_fem",
       "anisotropy",
       R"({"anisotropy_young": 2e5})",
       {"anisotropy_young=auto", "anisotropy_poisson=auto", "anisotropy_shear=auto"}},
      {"corotational_fem", "deform.plasticity", R"({"yield": 1e3})", {"yield=0"}},
      {"linear_fem", "damping", R"({"damping_stiffness": 0.01})", {"damping_stiffness=0", "damping_mass=0"}},
      {"meshless", "damping", R"({"damping_mass": 1})", {"damping_stiffness=0", "damping_mass=0"}},
      {"shape_matching", "damping", "{}", {"damping_ratio=0", "damping_mass=0"}},
      {"shape_matching", "plasticity", R"({"plastic_creep": 1})", {"plastic_creep=0"}},
      {"modal", "damping", R"({"damping_mass": 1, "modes": 4})", {"damping_stiffness=0", "damping_mass=0"}},
      {"condensed",
       "damping",
       R"({"damping_mass": 1, "modes": 4})",
       {"damping_stiffness=0", "damping_mass=0"}},
  };
  for (const Case &c : cases) {
    const std::string path =
        one_model("off", std::string(R"({"type": ")") + c.model + R"(", "params": )" + c.on + "}");
    const std::string on = line_of(test::deform({"explain", path}).out, c.effect);
    std::string wanted = "used; off with";
    std::vector<std::string> args = {"explain", path};
    for (const char *assignment : c.off) {
      std::string reported = assignment;
      reported[reported.find('=')] = ' ';
      wanted += (wanted.back() == 'h' ? " " : ", ") + reported;
      args.insert(args.end(), {"--set", std::string("/bodies/0/model/params/") + assignment});
    }
    EXPECT_NE(on.find(wanted), std::string::npos) << c.model << ": " << on << "\nwanted: " << wanted;
    const test::CommandResult without = test::deform(args);
    EXPECT_NE(line_of(without.out, c.effect).find("idle"), std::string::npos)
        << c.model << " " << c.effect << ": " << without.out << without.err;
  }
}

TEST(Explain, Costs_AreMeasuredOnRequest) {
  const std::string path =
      one_model("costs", R"({"type": "msm", "params": {"damping_stiffness": 1e-4, "volume": 0}})",
                R"(, "effects": ["damping"])");
  const std::vector<std::string> args = {"explain", path, "--costs", "--set", "/time/step=0.001"};
  const test::CommandResult text = test::deform(args);
  ASSERT_EQ(text.exit_code, 0) << text.err;
  for (const char *part : {"us per step", "11 pairs of"})
    EXPECT_NE(line_of(text.out, "damping").find(part), std::string::npos) << text.out;
  EXPECT_EQ(line_of(text.out, "volume").find("us per step"), std::string::npos) << "idle: " << text.out;
  EXPECT_EQ(line_of(text.out, "large_rotation").find("us per step"), std::string::npos) << text.out;
  std::vector<std::string> json_args = args;
  json_args.push_back("--json");
  const test::CommandResult json = test::deform(json_args);
  EXPECT_NE(json.out.find(R"("costs":[{"body": "lone", "effect": "damping", "us_per_step": )"),
            std::string::npos)
      << json.out;
  EXPECT_EQ(json.out.find("why_not"), std::string::npos) << json.out;
}

TEST(Explain, CostsOfAModelThatStepsItself_AreMeasuredAtTheStepOfARun) {
  const test::CommandResult r =
      test::deform({"explain", one_model("own_steps", R"({"type": "modal", "params": {"damping_mass": 2}})"),
                    "--costs", "--set", "/time/step=\"auto\""});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_EQ(r.out.find("a step of inf"), std::string::npos) << r.out;
  EXPECT_NE(line_of(r.out, "damping").find(" us per step"), std::string::npos) << r.out;
}

TEST(Explain, CostsOfASceneWithoutSteps_AreRefused) {
  const std::string path = one_model("still", R"({"type": "corotational_fem"})");
  const test::CommandResult result =
      test::deform({"explain", path, "--costs", "--set", "/time/mode=static", "--set",
                    R"(/bodies/0/fix=[{"box": [[-1, -1, -1], [0.001, 1, 1]]}])"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("static mode has none"), std::string::npos) << result.err;
}

// How much of a body its modes hold is shown before a run and after it.
TEST(Explain, ModesAndTheirShare_AreReported) {
  const std::string path = one_model("modes", R"({"type": "modal", "params": {"modes": 7}})");
  const test::CommandResult plan = test::deform({"explain", path});
  EXPECT_NE(plan.out.find("  modes: 7  ("), std::string::npos) << plan.out;
  EXPECT_NE(plan.out.find("  share: 0."), std::string::npos) << plan.out;
  const std::string folder = test::scratch("explain_modes_" + std::to_string(getpid()));
  const test::CommandResult run =
      test::deform({"run", path, "--out", folder + "/out", "--quiet", "--set", "/time/duration=0.1"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string summary = test::read_file(folder + "/out/summary.json");
  EXPECT_NE(summary.find(R"("facts": {"modes": 7,)"), std::string::npos) << summary;
  EXPECT_NE(summary.find(R"("share": 0.)"), std::string::npos) << summary;
}

TEST(Explain, ToolThatCutsAndTear_AreReported) {
  const test::CommandResult result =
      test::deform({"explain", scene("cut",
                                     R"("materials": {"dough": {"young": 1e4, "tear": 0.4}},
                "bodies": [{"name": "loaf", "mesh": "block.msh", "material": "dough"}],
                "tools": [{"name": "knife", "shape": "blade", "half_size": [0.001, 0.1, 0.1],
                           "pose": {"position": [0.05, 0, 0.3]},
                           "cuts": {"bodies": ["loaf"], "most": 9}}])")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (const char *text : {"cut by knife, which opens faces, 9 in a step at most",
                           "tears beyond a strain of 0.4", "rebuilds the body"})
    EXPECT_NE(result.out.find(text), std::string::npos) << text << "\n" << result.out;
}
