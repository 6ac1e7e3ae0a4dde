// What `deform cost` says of its choice.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "cost/calibrate.h"
#include "cost/report.h"
#include "support.h"

namespace cli::cost {
namespace {

// On the front by rising cost: 3 % at 1, 0.1 % at 20. The second is the choice within 5 %.
Study two_choices(double reference_error) {
  Study study;
  study.options.target = 0.05;
  study.rows.resize(2);
  study.rows[0].job.label = "long steps";
  study.rows[0].headline = 0.03;
  study.rows[0].cpu_per_s = 1;
  study.rows[1].job.label = "cells x2";
  study.rows[1].headline = 0.001;
  study.rows[1].cpu_per_s = 20;
  study.front = {0, 1};
  study.reference = study.check = 1;
  study.reference_headline = study.reference_bound = reference_error;
  study.pick = reference_error > 0.02 ? 1 : 0;
  study.proven = true;
  study.next = "take \"cells x4\" as the reference";
  study.next_budget = 119.2;
  return study;
}

std::string picked(const Study &study) { return pick_text(Subject{}, study); }

bool has(const std::string &text, const std::string &part) { return text.find(part) != std::string::npos; }

}  // namespace

// The front shows it as within the target, so the reader asks why it is not chosen.
TEST(CostWords, CheaperChoiceThatTheReferenceCannotProve_IsNamedWithItsReason) {
  const std::string said = picked(two_choices(0.04));
  EXPECT_TRUE(has(said, "cheapest within 5.00 %: cells x2")) << said;
  EXPECT_TRUE(
      has(said, "cheaper, but proven only to 7.00 % with the reference's own error of 4.00 %: long steps"))
      << said;
  EXPECT_TRUE(has(said, "--budget 120 continues from here")) << said;
}

TEST(CostWords, CheapestChoiceThatIsProven_HasNoOtherBesideIt) {
  const std::string said = picked(two_choices(0.01));
  EXPECT_TRUE(has(said, "cheapest within 5.00 %: long steps")) << said;
  EXPECT_FALSE(has(said, "proven only")) << said;
}

// A rubber block of 600 cells with "own error 4.6 %" was 18 % above one of 4,860 cells. Table, cost.json and
// --apply say the same.
TEST(CostWords, ChoiceThatNothingBounds_IsLikelyAndNotApplied) {
  Study study = two_choices(0.01);
  EXPECT_FALSE(has(picked(study), "not proven")) << picked(study);
  EXPECT_EQ(refusal_to_apply(study), "");
  study.headline = {"force"};
  study.limits["force"].basis = Basis::no_order;
  study.limits["force"].error = 0.01;
  study.limits["force"].bound = study.reference_bound = 0.3;
  study.proven = false;
  const std::string doubt =
      "the meshes show no order, so the reference's own error of 1.00 % may be larger (at most 30.0 %)";
  EXPECT_TRUE(has(picked(study), "likely, not proven: " + doubt)) << picked(study);
  const std::string refusal = refusal_to_apply(study);
  EXPECT_TRUE(has(refusal, "\"long steps\" is likely, not proven (" + doubt + "), so nothing is applied"))
      << refusal;
  EXPECT_TRUE(has(refusal, "--budget 120 continues from here; that is enough to take \"cells x4\""))
      << refusal;
  EXPECT_TRUE(has(reference_text(study), "NOT CONVERGED")) << reference_text(study);
}

// Every table that shows errors says what they are against, and whether that may be trusted.
TEST(CostWords, Reference_IsNamedWithItsBoundAndItsDoubt) {
  Study study = two_choices(0.01);
  study.headline = {"tip"};
  study.limits["tip"].basis = Basis::no_order;
  study.limits["tip"].error = 0.01;
  study.limits["tip"].bound = study.reference_bound = 0.3;
  EXPECT_TRUE(has(reference_text(study), "its own error 1.00 %")) << reference_text(study);
  EXPECT_TRUE(has(reference_text(study), ", bound 30.0 %; NOT CONVERGED")) << reference_text(study);
  EXPECT_EQ(short_reference(study), "against \"cells x2\", NOT CONVERGED");
  study.converged = true;
  EXPECT_EQ(short_reference(study), "against \"cells x2\"");
}

// Where explicit time is impossible, all runs damp impacts alike, and their distances prove nothing.
TEST(CostWords, ReferenceThatDampsImpacts_IsBoundedByNothing) {
  Study study = two_choices(0.01);
  study.headline = {"tip"};
  study.limits["tip"].basis = Basis::damped;
  study.limits["tip"].error = 0.01;
  study.limits["tip"].bound = study.reference_bound = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(has(reference_text(study), "NOT CONVERGED: contacts of implicit time damp impacts"))
      << reference_text(study);
}

TEST(CostWords, NoChoice_IsNotApplied) {
  Study study = two_choices(0.01);
  study.pick = -1;
  EXPECT_TRUE(has(refusal_to_apply(study), "nothing to apply")) << refusal_to_apply(study);
}

// The result states what is proven for model and step, and that nothing else is.
TEST(CostWords, ChoiceOnTheScenesOwnMesh_IsApplied) {
  Study study = two_choices(0.01);
  study.proven = false;
  study.mesh_stays = true;
  EXPECT_EQ(refusal_to_apply(study), "");
}

namespace {

Subject subject_of(const std::string &name, const std::string &bodies) {
  const std::string path = test::scratch("cost_subject") + "/" + name + ".json";
  test::write_file(path,
                   R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.01, "step": 0.001},
    "bodies": [)" + bodies +
                       "]}");
  Globals globals;
  return read_subject(path, globals);
}

std::string bar(const std::string &more) {
  return R"({"name": "bar", "mesh": {"make": "beam", "size": [0.3, 0.1, 0.1], "cells": 50})" + more + "}";
}

}  // namespace

// The world has a body with an id before those without.
TEST(CostSubject, BodiesWithIds_KeepTheirPlacesInTheFile) {
  const Subject s = subject_of("ids", bar(R"(, "pose": {"position": [0, 0, 5]})") +
                                          R"(, {"name": "cube", "id": 3,
      "mesh": {"make": "beam", "size": [0.1, 0.1, 0.1], "cells": 5},
      "model": {"type": "corotational_fem"}})");
  ASSERT_EQ(s.bodies.size(), 2u);
  EXPECT_EQ(s.bodies[0].name, "bar");
  EXPECT_EQ(s.bodies[1].name, "cube");
  EXPECT_GT(s.bodies[0].cells, s.bodies[1].cells);
  EXPECT_EQ(s.bodies[1].model, "corotational_fem");
}

TEST(CostSubject, EndsOfATurnedBody_LieInTheFrameOfItsMesh) {
  const Subject s = subject_of("axis",
                               bar(R"(, "pose": {"rotation": {"axis": [0, 1, 0], "angle_deg": 60}})")),
                q = subject_of("quaternion", bar(R"(, "pose": {"rotation": {"quaternion":
                                                   [0, 1, 0, 1.7320508075688772]}})"));
  for (const Subject *of : {&s, &q}) {
    EXPECT_FALSE(of->bodies[0].ends.empty());
    for (const auto &end : of->bodies[0].ends)
      for (size_t k = 0; k < 3; ++k) {
        const double size = k == 0 ? 0.3 : 0.1;
        EXPECT_LT(std::min(std::fabs(end[k]), std::fabs(end[k] - size)), 1e-9) << k;
      }
  }
}

TEST(CostSubject, SceneAppliedBehindALink_FindsItsFiles) {
  const std::string mesh = test::scratch("cost_subject") + "/cube", far = test::scratch("cost_far/away"),
                    link = test::scratch("cost_subject") + "/link";
  test::write_file(mesh + ".node", "4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n");
  test::write_file(mesh + "_stored", "1 4 0\n0 0 1 2 3\n");
  std::filesystem::remove(mesh + ".ele");
  std::filesystem::create_symlink("cube_stored", mesh + ".ele");
  std::filesystem::remove(link);
  std::filesystem::create_directory_symlink(far, link);
  write_applied(subject_of("linked", R"({"name": "one", "mesh": "cube.ele"})"), two_choices(0.01),
                link + "/applied.json");
  JsonValue scene;
  ASSERT_TRUE(parse_json(test::read_file(link + "/applied.json"), scene));
  const std::string found = link + "/" + scene.list("bodies").at(0).get("mesh");
  EXPECT_TRUE(std::filesystem::exists(found) && found.ends_with("/cube.ele")) << found;
}

// Other meshes have other nodes of these numbers.
TEST(CostSubject, BodyHeldByNumbersOfNodes_KeepsItsCells) {
  EXPECT_EQ(why_cells_stay(subject_of("box", bar(R"(, "fix": [{"box": [[-1, -1, -1], [0, 1, 1]]}])"))), "");
  EXPECT_TRUE(has(why_cells_stay(subject_of("fix", bar(R"(, "fix": [{"points": [0, 1, 2]}])"))),
                  "body 'bar' has fix by points"));
  test::write_file(test::scratch("cost_subject") + "/corner.obj",
                   "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  EXPECT_TRUE(has(why_cells_stay(subject_of("surface", R"({"name": "organ", "mesh": "corner.obj",
      "fill": {"cells": 0}, "model": {"type": "boundary"}})")),
                  "body 'organ' has no cells"));
}

// The scene names one of them.
TEST(CostSubject, FingerprintOfATetGenMesh_IsOfAllItsFiles) {
  const std::string mesh = test::scratch("cost_subject") + "/one";
  test::write_file(mesh + ".ele", "1 4 0\n0 0 1 2 3\n");
  const auto fingerprint = [&](const char *top) {
    test::write_file(mesh + ".node", "4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 " + std::string(top) + "\n");
    return subject_of("tetgen", R"({"name": "one", "mesh": "one.ele"})").fingerprint;
  };
  EXPECT_NE(fingerprint("1"), fingerprint("1.5"));
}

// What a run has left that was cut is no result of the run that takes its place.
TEST(CostRuns, RunThatIsStartedAgain_HasNothingOfTheEarlierOne) {
  const Subject subject = subject_of("again", bar(""));
  Runs runs(subject, test::scratch("cost_runs"), 1, 100, false);
  Job job;
  job.set = {{"/bodies/0/model/type", "\"none such\""}};
  job.limit = 100;
  runs.prepare(job);
  std::filesystem::create_directories(job.folder);
  test::write_file(job.folder + "/summary.json", R"({"cpu_s": 5, "simulated_s": 5, "steps": 5})");
  test::write_file(job.folder + "/bodies.csv", "t,body\n5,bar\n");
  job.outcome = {};
  runs.run({&job}, 1);
  EXPECT_EQ(job.outcome.state, Outcome::refused);
  EXPECT_TRUE(has(job.outcome.sentence, "none such")) << job.outcome.sentence;
  EXPECT_EQ(job.outcome.made, 0);
  EXPECT_EQ(job.outcome.cpu, 0);
}

// A comma and quotes in a label stay in its cell.
TEST(CostReport, TableOfChoices_HasOneCellPerColumn) {
  const Subject subject = subject_of("table", bar(""));
  Study study = two_choices(0.01);
  study.rows.resize(1);
  Knobs knobs;
  knobs.cells = 2;
  knobs.self = "\"auto\"";
  study.rows[0].job.label = label_of(knobs);
  const std::string text = csv_text(subject, study);
  EXPECT_TRUE(has(text, "\n0,\"cells x2, self auto\",")) << text;
  study.rows[0].job.label = "a \"b\"";
  EXPECT_TRUE(has(csv_text(subject, study), "\n0,\"a \"\"b\"\"\","));
}

// As --apply renames them where it writes into another folder.
TEST(CostSubject, FilesOfTools_AreAmongThoseOfTheScene) {
  JsonValue scene;
  ASSERT_TRUE(parse_json(R"({"tools": [{"name": "a", "motion": {"file": "hand.csv"}},
      {"name": "b", "mesh": "blade.obj", "motion": {"keyframes": []}}]})",
                         scene));
  EXPECT_EQ(file_pointers(scene), (std::vector<std::string>{"/tools/0/motion/file", "/tools/1/mesh"}));
}

// `deform calibrate --model` measures one of them.
TEST(Costs, OfOtherModels_AreThoseOfThisMachineElseTheShippedOnes) {
  const std::string path = test::scratch("costs_kept") + "/costs.json";
  test::write_file(path, R"({"format": "deform-costs", "version": 4, "machine": "this one", "models": [
    {"model": "msm", "wave_steps": 2}, {"model": "modal", "wave_steps": 3}]})");
  const std::string own = R"({"model": "msm", "wave_steps": 2})", ships = R"("machine": ")";
  const std::vector<std::string> here = kept_rows(path, "this one", {"modal"});
  ASSERT_GE(here.size(), 5u);
  EXPECT_EQ(here[0], own);
  for (size_t i = 0; i < here.size(); ++i) {
    EXPECT_EQ(here[i].find(ships) == std::string::npos, i == 0) << here[i];
    EXPECT_EQ(here[i].find(R"("model": "msm")") != std::string::npos, i == 0) << here[i];
    EXPECT_EQ(here[i].find(R"("model": "modal")"), std::string::npos) << here[i];
  }
  for (const std::string &file : {path, path + ".none"}) {
    const std::vector<std::string> shipped = kept_rows(file, "another one", {"modal"});
    EXPECT_EQ(shipped.size(), here.size());
    for (const std::string &row : shipped) EXPECT_NE(row.find(ships), std::string::npos) << row;
  }
}

}  // namespace cli::cost
