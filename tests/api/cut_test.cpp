// Cells removed and faces opened while a scene runs: mass, both momenta, contacts, state, snapshots, ends.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "cut_scenes.h"

namespace {

using namespace test::cutting;

}  // namespace

TEST(Cut, RemovedCells_TakeTheirMassAndMomentumWithThem) {
  for (const char *model : kModels) {
    Cube s(model);
    steps(s.w, 20);
    const dfm_body_measure before = test::measure(s.b);
    const State was(s.b);
    const dfm_cut_info done = cut(s.b, sphere({0.05, 0.05, 0.11}, 0.03));
    EXPECT_GT(done.cells, 10u);
    EXPECT_LT(done.cells, 320u);
    EXPECT_EQ(done.points, 0u);
    EXPECT_GT(done.area, 1e-4);
    const dfm_body_measure after = test::measure(s.b);
    EXPECT_NEAR(after.mass + done.mass, before.mass, 2e-14);  // of 1 kg, summed over 125 points
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(after.momentum[k] + done.momentum[k], before.momentum[k], 2e-14);
    EXPECT_NEAR(after.kinetic + done.kinetic, before.kinetic, 1e-13);
    EXPECT_NEAR(after.elastic + done.elastic, before.elastic, 1e-13);
    const State now(s.b);
    std::vector<uint32_t> from(info(s.b).npoint);
    test::ok(dfm_body_origins(s.b, uint32_t(from.size()), from.data(), 0, nullptr));
    for (size_t i = 0; i < from.size(); ++i)
      for (size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(now.x[3 * i + k], was.x[3 * size_t{from[i]} + k]);
        EXPECT_EQ(now.v[3 * i + k], was.v[3 * size_t{from[i]} + k]);
      }
    steps(s.w, 50);
  }
}

TEST(Cut, SplitBlade_LosesNothingAndLetsTheHalvesPart) {
  for (const char *model : kModels) {
    Cube s(model);
    test::set_friction(s.w, 0);
    steps(s.w, 20);
    const dfm_body_measure before = test::measure(s.b);
    const uint32_t cells = info(s.b).ntet;
    const dfm_cut_info done = cut(s.b, plane(0, 0.05 + 0.3 * 0.02, DFM_CUT_SPLIT));
    EXPECT_EQ(done.cells, 0u);
    EXPECT_GT(done.points, 10u);
    EXPECT_EQ(done.parts, 2u);
    EXPECT_GT(done.area, 0.02);  // both sides
    EXPECT_EQ(done.mass, 0);
    EXPECT_EQ(info(s.b).ntet, cells);
    const dfm_body_measure after = test::measure(s.b);
    EXPECT_NEAR(after.mass, before.mass, 1e-15);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(after.momentum[k], before.momentum[k], 1e-15);
      EXPECT_NEAR(after.angular[k], before.angular[k], 1e-15);
    }
    EXPECT_NEAR(after.kinetic, before.kinetic, 1e-13);
    EXPECT_NEAR(after.elastic, before.elastic, 1e-12);
    steps(s.w, 100);
    const dfm_body_measure later = test::measure(s.b);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(later.momentum[k], before.momentum[k], 1e-11);
    // The centers of the halves are 5 cm apart. Without friction they go straight on, while the halves turn
    // by 0.1 s of a spin of (2, -3) / s across the line between them.
    const double away = 0.05 * (1 - std::cos(0.1 * std::hypot(2, 3)));
    const State end(s.b);
    const std::vector<double> &x = end.x;
    double gap = 0;
    std::vector<uint32_t> from(x.size() / 3);
    test::ok(dfm_body_origins(s.b, uint32_t(from.size()), from.data(), 0, nullptr));
    std::vector<size_t> first(from.size(), SIZE_MAX);
    for (size_t i = 0; i < from.size(); ++i) {
      size_t &at = first[from[i]];
      if (at == SIZE_MAX) at = i;
      else gap = std::max(gap, std::fabs(x[3 * i] - x[3 * at]));
    }
    EXPECT_NEAR(gap, away, 0.1 * away);
  }
}

// A cube on the floor, cut level: the upper part rests on the lower one, along faces that lie on each other
// at rest.
// unsanitized: too slow there; shorter tests run the same code
TEST(Cut, CutFaces_CarryTheWeightAboveThem) {
  for (const char *model : kModels) {
    const CubeOnFloor scene(model, 5e4);
    const dfm_world w = scene.w;
    const dfm_body b = scene.b;
    steps(w, 400);
    const dfm_body_measure before = test::measure(b);
    const std::string whole = test::snapshot(w);
    EXPECT_EQ(cut(b, plane(2, 0.052, DFM_CUT_SPLIT)).parts, 2u);
    steps(w, 600);
    const dfm_body_measure after = test::measure(b);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(after.com[k], before.com[k], 1e-4) << model;
    EXPECT_LT(after.speed_max, 2e-3) << model;
    double force = 0;
    for (const dfm_contact &c : test::contacts(w))
      if (c.body_a == b && c.body_b == b) force += c.fn * std::fabs(c.normal[2]);
    EXPECT_NEAR(force, 0.5 * 9.81, 0.15 * 9.81) << model;  // of half a kilogram
    // without contact between the parts they fall through each other
    restore(w, whole);
    test::ok(dfm_world_filter_pair(w, "cube", "cube", false));
    cut(b, plane(2, 0.052, DFM_CUT_SPLIT));
    steps(w, 300);
    EXPECT_LT(test::measure(b).com[2], before.com[2] - 5e-3) << model;
  }
}

TEST(Cut, ProgressiveBlade_EndsWhereOneBladeDoes) {
  Cube one("corotational_fem"), many("corotational_fem");
  cut(one.b, plane(1, 0.052, DFM_CUT_SPLIT));
  for (int i = 0; i < 7; ++i) {
    dfm_cut_def d = plane(1, 0.052, DFM_CUT_SPLIT);
    for (int k = 0; k < 4; ++k) d.blade[3 * k] = -0.01 + 0.02 * (i + (d.blade[3 * k] > 0));
    cut(many.b, d);
  }
  EXPECT_EQ(info(one.b).npoint, info(many.b).npoint);
  EXPECT_EQ(cut(one.b, plane(1, 0.052, DFM_CUT_SPLIT)).parts,
            cut(many.b, plane(1, 0.052, DFM_CUT_SPLIT)).parts);
}

TEST(Cut, StableStep_DoesNotFallWithASplit) {
  Cube s("corotational_fem");
  steps(s.w, 2);
  const double before = test::stats(s.w).stable_step;
  std::mt19937 random(5);
  for (int i = 0; i < 6; ++i)
    cut(s.b, plane(i % 3, 0.02 + 0.06 * double(random() % 1000) / 1000, DFM_CUT_SPLIT));
  steps(s.w, 1);
  EXPECT_GT(test::stats(s.w).stable_step, 0.5 * before);
}

TEST(Cut, ToSingleCells_AllStayWithTheirMass) {
  for (const char *model : kModels) {
    Cube s(model, {0, 0, -9.81}, 60);
    test::add_plane(s.w, "floor");
    test::set_friction(s.w, 0.5);
    steps(s.w, 30);
    const dfm_body_measure before = test::measure(s.b);
    // in every direction through every cell
    for (int axis = 0; axis < 3; ++axis)
      for (double at = -0.02; at < 0.2; at += 0.002) cut(s.b, plane(axis, at, DFM_CUT_SPLIT));
    const dfm_body_info i = info(s.b);
    EXPECT_EQ(i.npoint, 4 * i.ntet);
    const dfm_body_measure after = test::measure(s.b);
    EXPECT_NEAR(after.mass, before.mass, 1e-14);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(after.momentum[k], before.momentum[k], 1e-14);
    steps(s.w, 60);
    const State end(s.b);
    for (const double value : end.x) ASSERT_TRUE(std::isfinite(value));
    for (size_t k = 2; k < end.x.size(); k += 3) EXPECT_GT(end.x[k], -1e-3);
  }
}

TEST(Cut, RemovingAllCells_LeavesAnEmptyBody) {
  for (const char *model : kModels) {
    test::Context context;
    test::Stack s = test::make_stack(context);
    test::ok(dfm_body_set_model(s.lower, model, nullptr));
    steps(s.world, 50);
    const std::string before = test::snapshot(s.world);
    steps(s.world, 30);
    const uint64_t uncut = dfm_world_hash(s.world);
    restore(s.world, before);
    const dfm_body_measure all = test::measure(s.lower);
    const dfm_cut_info done = cut(s.lower, sphere({0.05, 0.05, 0.05}, 1));
    EXPECT_NEAR(done.mass, all.mass, 1e-15);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(done.momentum[k], all.momentum[k], 1e-15);
    EXPECT_EQ(info(s.lower).ntet, 0u);
    EXPECT_EQ(info(s.lower).npoint, 0u);
    for (const dfm_contact &c : test::contacts(s.world)) {
      EXPECT_NE(c.body_a, s.lower);
      EXPECT_NE(c.body_b, s.lower);
    }
    dfm_body_measure m{};
    EXPECT_EQ(dfm_body_get_measure(s.lower, &m), DFM_E_STATE);
    test::says({"lower", "no cells left", "snapshot"});
    steps(s.world, 600);  // the upper one falls to the floor
    EXPECT_LT(test::measure(s.upper).com[2], 0.051);
    restore(s.world, before);
    steps(s.world, 30);
    EXPECT_EQ(dfm_world_hash(s.world), uncut);
    cut(s.lower, sphere({0.05, 0.05, 0.05}, 1));
    const std::string emptied = test::snapshot(s.world);
    restore(s.world, before);
    restore(s.world, emptied);
    EXPECT_EQ(info(s.lower).ntet, 0u);
    test::ok(dfm_body_destroy(s.lower));
    steps(s.world, 5);
  }
}

TEST(Cut, SurvivingContacts_KeepImpulsesAndBristles) {
  const CubeOnFloor scene("corotational_fem", 1e5, true);
  const dfm_world w = scene.w;
  const dfm_body b = scene.b;
  steps(w, 400);
  std::vector<dfm_contact> before = test::contacts(w);
  ASSERT_GT(before.size(), 9u);
  test::listed(dfm_world_events, w);
  // off the top: no surfel that touches goes
  const dfm_cut_info top = cut(b, sphere({0.05, 0.05, 0.11}, 0.03));
  EXPECT_GT(top.cells, 0u);
  const std::vector<dfm_contact> reported = test::contacts(w);
  ASSERT_EQ(reported.size(), before.size());
  for (size_t i = 0; i < reported.size(); ++i) EXPECT_EQ(reported[i].key, before[i].key);
  steps(w, 1);
  const std::vector<dfm_contact> after = test::contacts(w);
  ASSERT_EQ(after.size(), before.size());
  for (const dfm_contact &c : after) {
    const auto same = std::find_if(before.begin(), before.end(), [&](auto &x) { return x.key == c.key; });
    ASSERT_NE(same, before.end());
    EXPECT_FALSE(c.flags & DFM_CONTACT_BEGAN);
    EXPECT_NEAR(c.bristle[0], same->bristle[0], 0.1 * std::fabs(same->bristle[0]) + 1e-9);
    EXPECT_NEAR(c.fn, same->fn, 0.2 * same->fn + 0.02);
  }
  EXPECT_TRUE(test::listed(dfm_world_events, w).empty());
  // a corner at the floor: its contacts end, with their events, and no other does
  const dfm_cut_info corner = cut(b, sphere({0, 0, 0}, 0.02));
  EXPECT_GT(corner.cells, 0u);
  const size_t left = test::contacts(w).size();
  EXPECT_LT(left, before.size());
  const auto events = test::listed(dfm_world_events, w);
  EXPECT_EQ(events.size(), before.size() - left);
  for (const dfm_contact_event &e : events) EXPECT_EQ(e.kind, uint32_t{DFM_EVENT_END});
  steps(w, 600);
  EXPECT_LT(test::measure(b).speed_max, 1e-3);
}

TEST(Cut, Snapshot_UndoesACutAndMakesItAgain) {
  for (const char *model : kModels) {
    test::Context context;
    test::Stack s = test::make_stack(context), fresh = test::make_stack(context);
    for (const dfm_body b : {s.lower, s.upper, fresh.lower, fresh.upper})
      test::ok(dfm_body_set_model(b, model, nullptr));
    steps(s.world, 60);
    const std::string before = test::snapshot(s.world);
    steps(s.world, 20);
    const uint64_t uncut = dfm_world_hash(s.world);
    restore(s.world, before);
    cut(s.lower, sphere({0.05, 0.05, 0.12}, 0.04));
    cut(s.upper, plane(0, 0.06, DFM_CUT_SPLIT));
    steps(s.world, 3);
    cut(s.upper, sphere({0.02, 0.02, 0.2}, 0.04));
    const std::string after = test::snapshot(s.world);
    steps(s.world, 20);
    const uint64_t cut_hash = dfm_world_hash(s.world);
    restore(s.world, before);
    steps(s.world, 20);
    EXPECT_EQ(dfm_world_hash(s.world), uncut) << model;
    restore(s.world, after);
    EXPECT_EQ(test::snapshot(s.world), after) << model;
    steps(s.world, 20);
    EXPECT_EQ(dfm_world_hash(s.world), cut_hash) << model;
    restore(fresh.world, after);  // of a world that has seen no cut
    steps(fresh.world, 20);
    EXPECT_EQ(dfm_world_hash(fresh.world), cut_hash) << model;
  }
}

// Whatever model the body has by now: one that takes no parts does not matter.
TEST(Cut, Snapshot_MakesTheModelThatItHas) {
  for (const char *now : {"modal", "condensed"}) {
    CubeAtRest s;
    const std::string whole = test::snapshot(s.w);
    cut(s.body, plane(0, 0.001, DFM_CUT_SPLIT));
    steps(s.w, 3);
    const std::string parted = test::snapshot(s.w);
    steps(s.w, 5);
    const uint64_t later = dfm_world_hash(s.w);
    restore(s.w, whole);
    test::ok(dfm_body_set_model(s.body, now, nullptr));
    restore(s.w, parted);
    EXPECT_EQ(test::snapshot(s.w), parted) << now;
    steps(s.w, 5);
    EXPECT_EQ(dfm_world_hash(s.w), later) << now;
  }
}

TEST(Cut, Undone_LeavesTheStepsOfTheWholeBody) {
  const auto stable_step = [](bool cuts) {
    CubeAtRest s;
    const std::string whole = test::snapshot(s.w);
    if (cuts) cut(s.body, plane(0, 0.001, DFM_CUT_SPLIT));
    restore(s.w, whole);
    const double young = 6e4;
    const dfm_param_value value{"young", &young, 1};
    const dfm_params params{sizeof params, 1, &value};
    test::ok(dfm_body_set_params(s.body, &params));
    steps(s.w, 5);
    return test::stats(s.w).stable_step;
  };
  EXPECT_EQ(stable_step(true), stable_step(false));
}

TEST(Cut, LoadsHoldsAndAttachments_FollowTheirPoints) {
  Cube s("msm", {0, 0, -1});
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.name = "hook";
  d.shape = DFM_SHAPE_BOX;
  for (double &size : d.half_size) size = 0.05;
  d.pose.position[2] = 0.3;
  dfm_obstacle hook = 0;
  test::ok(dfm_obstacle_create(s.w, &d, &hook));
  dfm_attach_def a = dfm_attach_def_default();
  const double box[] = {-1, -1, 0.155, 1, 1, 1};
  a.to = hook;
  a.box = box;
  uint32_t number = 0;
  test::ok(dfm_body_attach(s.b, &a, &number));
  const uint32_t points[] = {0, 3, 7};
  const double force[] = {0, 0, -1e-3, 0, 0, -1e-3, 0, 0, -1e-3};
  test::ok(dfm_body_add_load(s.b, 3, points, force, 0, nullptr, nullptr, nullptr));
  test::ok(dfm_body_hold(s.b, 1, points, 7));
  steps(s.w, 20);
  dfm_attachment is{};
  is.size = sizeof is;
  test::ok(dfm_body_get_attachment(s.b, number, &is));
  const uint32_t all = is.nsurfel;
  cut(s.b, sphere({0, 0, 0.16}, 0.04));
  test::ok(dfm_body_get_attachment(s.b, number, &is));
  EXPECT_LT(is.nsurfel, all);
  EXPECT_GT(is.nsurfel, 0u);
  steps(s.w, 20);
  dfm_cut_def top = dfm_cut_def_default();
  top.shape = DFM_CUT_BOX;
  for (int k = 0; k < 3; ++k) top.half_size[k] = k == 2 ? 0.002 : 1;
  top.pose.position[2] = 0.17;
  top.motion[2] = -0.02;
  cut(s.b, top);
  EXPECT_EQ(dfm_body_get_attachment(s.b, number, &is), DFM_E_ARG);
  steps(s.w, 20);
}

TEST(Cut, PlasticStrain_StaysWithItsCell) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  dfm_mesh_handle mesh = 0;
  const double size[] = {0.3, 0.1, 0.1};
  test::ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 120, &mesh));
  dfm_body_def d = dfm_body_def_default();
  test::lend(mesh, d);
  test::BodyOptions o;
  o.young = 1e4;
  o.damping_mass = 5;
  d.material = test::make_material(w, o);
  d.model = "corotational_fem";
  const double yield = 0.02, creep = 50, most = 0.5;
  const dfm_param_value rows[] = {{"yield", &yield, 1}, {"creep", &creep, 1}, {"plastic_limit", &most, 1}};
  d.model_params = {sizeof(dfm_params), 3, rows};
  dfm_body b = 0;
  ASSERT_EQ(dfm_body_create(w, &d, &b), DFM_OK) << dfm_last_error();
  State s(b);
  for (size_t i = 0; i < s.x.size(); i += 3) s.x[i] *= 1.3;
  test::ok(dfm_body_set_state(b, uint32_t(s.x.size() / 3), s.x.data(), nullptr));
  steps(w, 100);
  const auto density = [&] {
    std::vector<double> out(info(b).ntet);
    test::ok(dfm_body_energy_density(b, uint32_t(out.size()), out.data()));
    return out;
  };
  const std::vector<double> before = density();
  const dfm_cut_info done = cut(b, plane(0, 0.2, DFM_CUT_REMOVE));
  ASSERT_GT(done.cells, 0u);
  const std::vector<double> after = density();
  std::vector<uint32_t> from(after.size());
  test::ok(dfm_body_origins(b, 0, nullptr, uint32_t(from.size()), from.data()));
  for (size_t c = 0; c < after.size(); ++c) EXPECT_EQ(after[c], before[from[c]]);
}

TEST(Cut, WhatCannotBeCut_IsRefusedInOneSentence) {
  test::Context context;
  const dfm_world w = test::make_world(context);
  test::BodyOptions o;
  o.name = "jelly";
  o.model = "modal";
  const dfm_body b = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  const uint64_t before = dfm_world_hash(w);
  const uint32_t cell = 0, none = 999;
  EXPECT_EQ(dfm_body_remove_cells(b, 1, &cell, nullptr), DFM_E_UNSUPPORTED);
  test::says({"jelly", "modal", "needs all of its cells", "msm"});
  EXPECT_EQ(dfm_body_remove_cells(b, 1, &none, nullptr), DFM_E_ARG);
  test::says({"jelly", "no cell 999", "96"});
  dfm_cut_def d = dfm_cut_def_default();
  EXPECT_EQ(dfm_body_cut(b, &d, nullptr), DFM_E_ARG);
  test::says({"half_size", "positive"});
  d.how = DFM_CUT_SPLIT;
  EXPECT_EQ(dfm_body_cut(b, &d, nullptr), DFM_E_ARG);
  test::says({"blade"});
  d.how = 7;
  EXPECT_EQ(dfm_body_cut(b, &d, nullptr), DFM_E_ARG);
  d = sphere({0, 0, 0}, NAN);
  EXPECT_EQ(dfm_body_cut(b, &d, nullptr), DFM_E_ARG);
  EXPECT_EQ(dfm_world_hash(w), before);
}

TEST(Cut, MissedShape_ChangesNoBit) {
  Cube s("msm"), other("msm");
  steps(s.w, 10);
  steps(other.w, 10);
  const dfm_cut_info done = cut(s.b, sphere({1, 1, 1}, 0.1));
  EXPECT_EQ(done.cells, 0u);
  EXPECT_EQ(done.parts, 1u);
  steps(s.w, 10);
  steps(other.w, 10);
  EXPECT_EQ(dfm_world_hash(s.w), dfm_world_hash(other.w));
}

TEST(Cut, Limit_LeavesTheRestForTheNextCall) {
  Cube s("msm");
  dfm_cut_def d = sphere({0.05, 0.05, 0.11}, 0.05);
  d.most = 7;
  const dfm_cut_info first = cut(s.b, d);
  EXPECT_EQ(first.cells, 7u);
  EXPECT_GT(first.left, 0u);
  uint32_t sum = first.cells;
  for (uint32_t left = first.left; left > 0;) {
    const dfm_cut_info next = cut(s.b, d);
    EXPECT_EQ(next.cells + next.left, left);
    left = next.left;
    sum += next.cells;
  }
  Cube whole("msm");
  EXPECT_EQ(cut(whole.b, sphere({0.05, 0.05, 0.11}, 0.05)).cells, sum);
}

TEST(Cut, LimitOfABlade_OpensFacesInTheOrderInWhichItMeetsThem) {
  Cube s("msm"), whole("msm");
  dfm_cut_def d = plane(2, 0.11, DFM_CUT_SPLIT);  // the edge goes along y
  const dfm_cut_info all = cut(whole.b, d);
  d.most = 20;
  uint32_t calls = 0, points = 0;
  double area = 0;
  for (uint32_t left = 1; left > 0; ++calls) {
    const dfm_cut_info done = cut(s.b, d);
    left = done.left;
    points += done.points;
    area += done.area;
  }
  EXPECT_GT(calls, 2u);
  EXPECT_EQ(points, all.points);
  EXPECT_NEAR(area, all.area, 1e-15);
  EXPECT_EQ(info(s.b).npoint, info(whole.b).npoint);
}

// A knife goes down through a cube on the floor in forty cuts, ten times, each time in another place.
TEST(Cut, MovingBlade_WithJitter_PartsTheCubeEachTime) {
  std::mt19937 random(11);
  const auto jitter = [&](double size) { return size * (double(random() % 2001) / 1000 - 1); };
  for (int run = 0; run < 10; ++run) {
    const CubeOnFloor scene("corotational_fem", 1e5, false, 60);
    const dfm_world w = scene.w;
    const dfm_body b = scene.b;
    steps(w, 100);
    const dfm_body_measure before = test::measure(b);
    double edge[2] = {0.2, 0.2};  // heights of its two ends
    const double x = 0.05 + jitter(0.01);
    uint32_t parts = 1;
    for (int i = 0; i < 40; ++i) {
      dfm_cut_def d = dfm_cut_def_default();
      d.shape = DFM_CUT_BLADE;
      d.how = DFM_CUT_SPLIT;
      const double next[2] = {edge[0] - 0.006 + jitter(0.001), edge[1] - 0.006 + jitter(0.001)};
      const double corner[4][3] = {
          {x, -0.5, edge[0]}, {x, 0.5, edge[1]}, {x, 0.5, next[1]}, {x, -0.5, next[0]}};
      std::memcpy(d.blade, corner, sizeof corner);
      std::copy(next, next + 2, edge);
      parts = cut(b, d).parts;
      steps(w, 2);
    }
    EXPECT_GE(parts, 2u) << run;
    EXPECT_NEAR(test::measure(b).mass, before.mass, 1e-13);
    steps(w, 20);
    const State end(b);
    for (const double value : end.x) ASSERT_TRUE(std::isfinite(value)) << run;
  }
}

TEST(Cut, FractureEnergy_IsTheForceOnTheBladeTimesItsWay) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  const double toughness = 250;
  const dfm_body b = make(context, w, {.size = {0.1, 0.06, 0.08}, .cells = 600, .energy = toughness});
  dfm_cut_def blade = plane(0, 0, DFM_CUT_SPLIT);
  double work = 0, most = 0, z = 0.09;
  const double step = 0.001;
  for (int k = 0; k < 100; ++k) {
    const double edge[] = {0.047, -1, z, 0.047, 1, z, 0.047, 1, z - step, 0.047, -1, z - step};
    std::copy(edge, edge + 12, blade.blade);
    const dfm_cut_info done = cut(b, blade);
    EXPECT_NEAR(done.force[2] * step, done.fracture, 1e-12);
    EXPECT_NEAR(done.force[0], 0, 1e-9);
    work += done.force[2] * step;
    most = std::max(most, done.force[2]);
    z = blade.blade[8];
  }
  // width of the block times its height, however rough the cut face is: mean force G b = 15 N
  EXPECT_NEAR(work, toughness * 0.06 * 0.08, 1e-10);
  EXPECT_GT(most, toughness * 0.06);
}

// Across the layers of cells, single faces lean back over the blade's way, and their areas count below zero.
TEST(Cut, FractureEnergy_IsNeverGivenBack) {
  test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  const dfm_body b = make(context, w, {.size = {0.1, 0.06, 0.08}, .cells = 600, .energy = 250});
  dfm_cut_def blade = plane(0, 0, DFM_CUT_SPLIT);
  const double center[] = {0.05, 0.03, 0.04}, along[] = {0.2966, 0.0812, -0.9515},
               way[] = {0.619, -0.7751, 0.1268};
  double work = 0;
  for (int k = 0; k < 200; ++k) {
    for (int corner = 0; corner < 4; ++corner)
      for (int c = 0; c < 3; ++c)
        blade.blade[3 * corner + c] = center[c] + (corner == 0 || corner == 3 ? -along[c] : along[c]) +
                                      (-0.1 + 0.001 * (corner < 2 ? k : k + 1)) * way[c];
    const dfm_cut_info done = cut(b, blade);
    EXPECT_GE(done.fracture, 0) << k;
    double against = 0;
    for (int c = 0; c < 3; ++c) against -= done.force[c] * way[c];
    EXPECT_GE(against, 0) << k << ": the force holds back and never pulls";
    work += done.fracture;
  }
  EXPECT_GT(work, 1.58);  // J, the signed sum of all faces
  EXPECT_LT(work, 1.62);
}

// Cuts of every kind at random places while two cubes lie on each other, until nothing is left.
TEST(Cut, RandomCuts_KeepTheBooksToTheEnd) {
  std::mt19937 random(3);
  const auto share = [&] { return double(random() % 10001) / 10000; };
  for (const char *model : kModels) {
    test::Context context;
    test::Stack s = test::make_stack(context);
    for (const dfm_body b : {s.lower, s.upper}) test::ok(dfm_body_set_model(b, model, nullptr));
    double gone = 0;
    const double all = test::measure(s.lower).mass + test::measure(s.upper).mass;
    for (int i = 0; i < 80; ++i) {
      const dfm_body b = i % 2 ? s.lower : s.upper;
      if (info(b).ntet == 0) continue;
      dfm_cut_def d = dfm_cut_def_default();
      d.shape = random() % 3;
      for (int k = 0; k < 3; ++k) {
        d.half_size[k] = 0.001 + 0.02 * share();
        d.pose.position[k] = (k == 2 ? 0.2 : 0.11) * share();
        d.motion[k] = 0.03 * (share() - 0.5);
      }
      for (int k = 0; k < 12; ++k) d.blade[k] = (k % 3 == 2 ? 0.2 : 0.12) * share();
      if (d.shape == DFM_CUT_BLADE) d.how = random() % 2;
      d.most = random() % 3 ? 0 : 5;
      gone += cut(b, d).mass;
      steps(s.world, 2, 5e-4);
      double left = 0;
      for (const dfm_body other : {s.lower, s.upper})
        if (info(other).ntet > 0) left += test::measure(other).mass;
      ASSERT_NEAR(left + gone, all, 1e-12) << model << " " << i;
      for (const dfm_contact &c : test::contacts(s.world)) ASSERT_LT(c.feature_a, 10000u);
    }
    const std::string before = test::snapshot(s.world);
    for (const dfm_body b : {s.lower, s.upper})
      if (info(b).ntet > 0) cut(b, sphere({0, 0, 0}, 9));
    steps(s.world, 3);
    EXPECT_TRUE(test::contacts(s.world).empty());
    restore(s.world, before);
    EXPECT_EQ(test::snapshot(s.world), before);
  }
}

TEST(Tear, PulledBar_PartsAtTheStrainOfItsMaterial) {
  for (const char *model : kModels) {
    PulledBar s(model, 0.3), tough(model, 0);
    const dfm_body_measure before = test::measure(s.b);
    const uint32_t cells = info(s.b).ntet, points = info(s.b).npoint;
    steps(s.w, 200);  // 20 %
    EXPECT_EQ(s.tears(), 0u) << model;
    steps(s.w, 400);
    steps(tough.w, 600);
    const uint32_t split = s.tears();
    EXPECT_GT(split, 4u) << model;
    EXPECT_EQ(info(s.b).npoint, points + split);
    EXPECT_EQ(info(s.b).ntet, cells);
    EXPECT_GT(cut(s.b, sphere({9, 9, 9}, 0.1)).parts, 1u) << model;
    const dfm_body_measure after = test::measure(s.b);
    EXPECT_NEAR(after.mass, before.mass, 1e-13);
    EXPECT_LT(after.elastic, 0.3 * test::measure(tough.b).elastic) << model;
    EXPECT_EQ(tough.tears(), 0u);
    steps(s.w, 200);
    const State end(s.b);
    for (const double value : end.x) ASSERT_TRUE(std::isfinite(value));
  }
}

TEST(Tear, WholeBodyWithALimitItNeverReaches_HasTheBitsOfOneWithout) {
  PulledBar s("corotational_fem", 5), tough("corotational_fem", 0);
  steps(s.w, 200);
  steps(tough.w, 200);
  const State a(s.b), b(tough.b);
  EXPECT_EQ(a.x, b.x);
}

TEST(Tear, ModelThatNeedsItsCells_IsRefusedAtOnce) {
  PulledBar s("modal", 0.3);
  EXPECT_EQ(s.b, 0u);
  test::says({"bar", "neither cut nor torn", "modal"});
  PulledBar t("msm", 0.3);
  EXPECT_EQ(dfm_body_set_model(t.b, "modal", nullptr), DFM_E_UNSUPPORTED);
  test::says({"bar", "neither cut nor torn", "modal"});
  PulledBar u("msm", -1);  // no material, so no body
  EXPECT_EQ(u.b, 0u);
}
