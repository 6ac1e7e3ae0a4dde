// Pieces of a rough cut rest where they touched as one body: a cut causes no motion.
#include <algorithm>
#include <cmath>

#include "cut_scenes.h"
#include "logged_context.h"
#include "support.h"

namespace {

using namespace test::cutting;

// A ball of irregular cells; a plane leaves teeth in it as large as they are.
struct Ball {
  test::LoggedContext made;
  dfm_context *context = made.context;
  dfm_world w;
  dfm_body b;
  explicit Ball(const char *model, double gravity, double spin = 0)
      : w(test::make_world(context, {0, 0, gravity})) {
    test::BodyOptions o;
    o.name = "ball";
    o.model = model;
    o.young = 3e4;
    o.damping_stiffness = 2e-3;
    o.spin = {0, spin, 0};
    b = test::make_body(context, w, "ball", {0.04}, 300, o);
  }
  void part() const {
    cut(b, plane(0, 0.005, DFM_CUT_SPLIT));
    dfm_cut_info out = request();
    test::ok(dfm_body_separate(b, nullptr, &out));
    ASSERT_GE(out.pieces, 1u);
  }
  std::vector<dfm_body> all() const {
    uint32_t n = 0;
    test::ok(dfm_body_pieces(b, 0, nullptr, &n));
    std::vector<dfm_body> out(n);
    test::ok(dfm_body_pieces(b, n, out.data(), &n));
    out.push_back(b);
    return out;
  }
  double kinetic() const {
    double sum = 0;
    for (const dfm_body each : all()) sum += test::measure(each).kinetic;
    return sum;
  }
};

}  // namespace

// With a rest distance of d_c: up to 4e-7 J, 86 solves that do not converge.
TEST(CutPieces, InFreeFall_MoveAsTheWholeBody) {
  for (const char *model : kModels) {
    const Ball whole(model, -9.81), cut(model, -9.81);
    steps(whole.w, 5);
    steps(cut.w, 5);
    cut.part();
    for (int i = 0; i < 40; ++i) {
      steps(whole.w, 1);
      steps(cut.w, 1);
      EXPECT_NEAR(cut.kinetic(), whole.kinetic(), 1e-12 * whole.kinetic()) << model << " " << i;
    }
    EXPECT_EQ(test::stats(cut.w).unconverged, 0u) << model;
    // after a cut the bound is that of row sums (doc/concepts/step.md)
    EXPECT_LE(test::stats(cut.w).substeps, 1.5 * double(test::stats(whole.w).substeps)) << model;
  }
}

// A rate at which no depth opens: 1 um in 10 ms is 4 % of d_c.
TEST(CutPieces, PulledApart_OpenAsFarAsTheyArePulled) {
  for (const char *model : kModels) {
    const Ball cut(model, 0);
    cut.part();
    const std::vector<dfm_body> all = cut.all();
    const dfm_body right = all.front();
    std::vector<uint32_t> points(State(right).x.size() / 3);
    for (uint32_t i = 0; i < points.size(); ++i) points[i] = i;
    const uint32_t n = uint32_t(points.size());
    test::ok(dfm_body_hold(right, n, points.data(), 7));
    dfm_pose_key keys[2] = {};
    for (auto &k : keys) k.pose.rotation[3] = 1;
    keys[1].t = 0.01;
    keys[1].pose.position[0] = test::measure(right).com[0] > 0 ? 1e-6 : -1e-6;
    test::ok(dfm_body_move_held(right, n, points.data(), 2, keys, nullptr));
    const dfm_body_measure before = test::measure(cut.b);
    steps(cut.w, 20);
    const dfm_body_measure after = test::measure(cut.b);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(after.com[k], before.com[k], 1e-7) << model;
    EXPECT_LT(after.kinetic, 1e-12) << model;
  }
}

// Snapshots hold nothing new: rest distances follow from the cut.
TEST(CutPieces, Snapshot_GoesOnWithTheSameBits) {
  for (const char *model : kModels) {
    const Ball one(model, 0, 20), other(model, 0, 20);
    one.part();
    steps(one.w, 5);
    const std::string begun = test::snapshot(one.w);
    steps(one.w, 10);
    restore(other.w, begun);
    steps(other.w, 10);
    EXPECT_EQ(test::snapshot(other.w), test::snapshot(one.w)) << model;
  }
}

// Torn faces are rough, and lie on each other under tension. Before, the guard found no way out at 0.53 s,
// with residuals of 300 m/s.
TEST(CutPieces, BarTornInTwo_IsNotStopped) {
  const std::string out = test::scratch("cut_pieces");
  test::write_file(out + "/bar.json",
                   R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.6},
    "materials": {"dough": {"young": 3e4, "tear": 0.2, "damping": {"mass": 2, "stiffness": 0.003}}},
    "bodies": [{"name": "dough", "mesh": {"make": "beam", "size": [0.2, 0.05, 0.04], "cells": 500},
      "material": "dough", "model": {"type": "corotational_fem"}, "pose": {"position": [-0.1, -0.025, 0.2]},
      "fix": [{"box": [[-0.001, -1, -1], [0.001, 1, 1]]},
              {"box": [[0.199, -1, -1], [0.201, 1, 1]], "motion": {"keyframes": [
                {"t": 0, "position": [0, 0, 0]}, {"t": 1, "position": [0.1, 0, 0]}]}}],
      "separate": {"least_cells": 8}}],
    "obstacles": [{"name": "floor", "shape": "plane"}]})");
  const test::CommandResult r = test::deform({"run", out + "/bar.json", "--quiet", "--out", out + "/result"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
}

// Explicit pieces in each other's teeth: friction of contacts that hold the same points contradicts itself.
// By sweeps alone 406 of 600 sub-steps did not converge (doc/decisions/contact_solver.md).
TEST(CutPieces, TubeInPieces_IsSolved) {
  const std::string out = test::scratch("cut_tube");
  test::write_file(out + "/tube.json",
                   R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.15, "step": 0.0005},
    "materials": {"jelly": {"young": 1e4, "damping": {"mass": 2, "stiffness": 0.002}}},
    "bodies": [{"name": "jelly", "material": "jelly", "model": {"type": "corotational_fem"}, "separate": {},
      "mesh": {"make": "tube", "radius": 0.03, "inner": 0.02, "length": 0.06, "cells": 600},
      "pose": {"position": [0, 0, 1e-4]}}],
    "obstacles": [{"name": "floor", "shape": "plane"}],
    "cuts": [{"body": "jelly", "t": 0.02, "shape": "plane",
              "point": [-0.00084, 0.0108, 0.0312], "normal": [0.713, 0.238, 0.198]},
             {"body": "jelly", "t": 0.06, "shape": "plane",
              "point": [-0.00997, -0.00252, 0.0241], "normal": [0.184, 2.622, -0.322]}]})");
  const test::CommandResult r =
      test::deform({"run", out + "/tube.json", "--quiet", "--out", out + "/result"});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const std::string summary = test::read_file(out + "/result/summary.json"), key = "\"unconverged_steps\": ";
  const size_t at = summary.find(key);
  ASSERT_NE(at, std::string::npos);
  EXPECT_LT(std::stoul(summary.substr(at + key.size())), 100u);
}

namespace {

// Pairs of triangles of two bodies that cross, the most in one state.
unsigned long crossings_of(const std::string &result) {
  const std::string summary = test::read_file(result + "/summary.json"),
                    key = "\"intersections_between_max\": ";
  const size_t at = summary.find(key);
  return at == std::string::npos ? ~0ul : std::stoul(summary.substr(at + key.size()));
}

unsigned long crossings(const std::string &name, const std::string &scene, const char *jitter = "0") {
  const std::string out = test::scratch(name);
  test::write_file(out + "/scene.json", scene);
  const test::CommandResult r = test::deform(
      {"run", out + "/scene.json", "--quiet", "--check", "--jitter", jitter, "--out", out + "/result"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  return crossings_of(out + "/result");
}

// A bar of dough of so many cells that its ends pull apart by 0.1 m/s until it tears.
std::string pulled_bar(const char *time, const char *material, int cells) {
  return std::string(R"({"format": "deform-scene", "version": 1, "time": )") + time +
         R"(, "materials": {"dough": )" + material +
         R"(}, "bodies": [{"name": "dough", "mesh": {"make": "beam", "size": [0.2, 0.05, 0.04], "cells": )" +
         std::to_string(cells) + R"(},
      "material": "dough", "pose": {"position": [-0.1, -0.025, 0.2]}, "separate": {"least_cells": 8},
      "fix": [{"box": [[-0.001, -1, -1], [0.001, 1, 1]]},
              {"box": [[0.199, -1, -1], [0.201, 1, 1]], "motion": {"keyframes": [
                {"t": 0, "position": [0, 0, 0]}, {"t": 1, "position": [0.1, 0, 0]}]}}]}],
    "obstacles": [{"name": "floor", "shape": "plane"}]})";
}

std::string torn_slit() {
  return pulled_bar(R"({"duration": 0.5, "step": 0.01})", R"({"density": 1000, "young": 3e4, "tear": 0.2})",
                    500);
}

}  // namespace

// A first scene at the defaults (tests/bench/first_scenes, seed 140): two halves of a bar of jelly that falls
// on a floor. Where least squares set bent teeth of the cut back through each other, the guard was off for
// both halves: 28 pairs.
TEST(CutPieces, JellyCutInTwo_NothingPassesThrough) {
  EXPECT_EQ(crossings("cut_jelly", R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.5},
    "materials": {"jelly": {"density": 1000, "young": 1000, "poisson": 0.45, "damping": {"mass": 0.5}}},
    "bodies": [{"name": "dough", "mesh": {"make": "beam", "size": [0.3, 0.05, 0.05], "cells": 1000},
      "material": "jelly", "pose": {"position": [-0.15, -0.025, 0.1]}, "separate": {}}],
    "obstacles": [{"name": "floor", "shape": "plane"}],
    "cuts": [{"body": "dough", "t": 0.1, "shape": "plane", "point": [0, 0, 0.025], "normal": [1, 0, 0]}],
    "contact": {"friction": [{"between": ["*", "*"], "law": "dahl", "params": {"mu": 0.5}}]}})"),
            0u);
}

// A bar of dough is pulled until it tears at both ends. Splinters that hang in the teeth of an end were parts
// of the middle, whose contact with that end was off as a whole: 164 pairs. In 13 of 80 starts that differ by
// nanometers, a corner beside a held point is drawn up to 8 d_c behind a face in one state; faces as contact
// has them, set back, do not cross there.
TEST(CutPieces, SplintersOfATornBar_StayWithTheEndTheyHangOn) {
  const std::string scene =
      pulled_bar(R"({"duration": 0.9, "step": 0.0005})",
                 R"({"density": 1000, "young": 1e4, "tear": 0.5, "damping": {"stiffness": 0.003}})", 1000);
  int none = 0;
  for (const char *const start : {"0", "1", "2"}) {
    const unsigned long found = crossings("torn_bar", scene, start);
    EXPECT_LE(found, 4u);
    none += found == 0;
  }
  EXPECT_GE(none, 2);
}

namespace {

// The half beyond the plane x = at lies mirrored in the other one.
void fold(dfm_body b, double at) {
  State s(b);
  for (size_t i = 0; i < s.x.size(); i += 3) s.x[i] = std::min(s.x[i], 2 * at - s.x[i]);
  test::ok(dfm_body_set_state(b, uint32_t(s.x.size() / 3), s.x.data(), nullptr));
}

void put_where_it_is(dfm_body b) {
  const State s(b);
  test::ok(dfm_body_set_state(b, uint32_t(s.x.size() / 3), s.x.data(), nullptr));
}

}  // namespace

// Sides of a slit that cross when a part comes off are a result of contact: the pair keeps it. A piece that a
// host puts there would be thrown out.
TEST(CutPieces, CrossedWhenTheyPart_KeepContactUnlessPlaced) {
  const Ball ball("corotational_fem", 0);
  cut(ball.b, plane(0, 0.005, DFM_CUT_SPLIT));
  fold(ball.b, 0.005);
  ASSERT_TRUE(test::listed(dfm_world_overlaps, ball.w).empty());
  dfm_cut_info out = request();
  test::ok(dfm_body_separate(ball.b, nullptr, &out));
  ASSERT_GE(out.pieces, 1u);
  const auto parted = test::listed(dfm_world_overlaps, ball.w);
  ASSERT_FALSE(parted.empty());
  for (const dfm_overlap &o : parted) {
    EXPECT_GT(o.crossings, 10u);
    EXPECT_FALSE(o.flags & DFM_OVERLAP_ASIDE);
  }
  EXPECT_NE(ball.made.log.find("came off with their faces in each other"), std::string::npos)
      << ball.made.log;
  EXPECT_EQ(ball.made.log.find("move one of them"), std::string::npos) << ball.made.log;
  put_where_it_is(ball.all().front());
  const auto placed = test::listed(dfm_world_overlaps, ball.w);
  ASSERT_FALSE(placed.empty());
  EXPECT_TRUE(placed.front().flags & DFM_OVERLAP_ASIDE);
  EXPECT_NE(ball.made.log.find("contact between them is off"), std::string::npos) << ball.made.log;
}

// Sides of a slit cross before the part comes off at 0.33 s. Contact of the two pieces was off from there on:
// 46 pairs. At this step one start in eight leaves one or two pairs crossed.
TEST(CutPieces, SidesOfASlitThatCrossed_ComeApartAsPieces) {
  EXPECT_EQ(crossings("torn_slit", torn_slit()), 0u);
}

// soak: three minutes. Of 192 starts 23 left one or two pairs crossed, one jammed.
TEST(CutPieces, SidesOfASlitThatCrossed_SeldomStayCrossed) {
  const std::string out = test::scratch("torn_slits"), scene = out + "/scene.json";
  test::write_file(scene, torn_slit());
  int crossed = 0, stopped = 0;
  for (int start = 0; start < 48; ++start) {
    const test::CommandResult r = test::deform(
        {"run", scene, "--quiet", "--check", "--jitter", std::to_string(start), "--out", out + "/result"});
    const unsigned long found = crossings_of(out + "/result");
    EXPECT_LE(found, 2u) << start;
    crossed += found > 0;
    stopped += r.exit_code != 0;
  }
  EXPECT_LE(crossed, 12);
  EXPECT_LE(stopped, 1);
}

// Splinters that leave each other no way ended the run at 0.995 s ("squeezed until nothing can move"), though
// nothing closes on them. They come off with two pairs of triangles in each other.
TEST(CutPieces, SplintersThatJam_EndNoRun) {
  const char *const dough = R"({"density": 1000, "tear": 0.5, "young": 1e5})";
  EXPECT_LE(crossings("torn_jam", pulled_bar(R"({"duration": 1, "step": 0.001})", dough, 1000)), 2u);
}
