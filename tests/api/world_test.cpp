// Worlds: defs of older and newer callers, wrong arguments (one sentence, nothing changed), bodies that come
// and go while the world runs, and steps that cannot be taken.
#include <cstring>
#include <functional>

#include "stack.h"

namespace {

using test::says, test::Tet;

void steps(dfm_world w, int n) {
  for (int i = 0; i < n; ++i) ASSERT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK) << dfm_last_error();
}

uint64_t balance(const std::vector<dfm_contact_event> &events, uint32_t kind) {
  uint64_t n = 0;
  for (const auto &e : events) n += e.kind == kind;
  return n;
}

}  // namespace

// ---- structs of other versions ----------------------------------------------------------------------------

TEST(Structs, OfAnOlderCaller_KeepDefaultsForWhatTheyLack) {
  test::Context c;
  dfm_world_def wd;
  std::memset(&wd, 0xff, sizeof wd);  // what lies beyond the caller's struct is garbage
  wd.size = offsetof(dfm_world_def, reserved3);
  wd.flags = 0;
  wd.gravity[0] = wd.gravity[1] = 0;
  wd.gravity[2] = -1;
  dfm_world w = 0;
  ASSERT_EQ(dfm_world_create(c, &wd, &w), DFM_OK) << dfm_last_error();
  Tet t;
  for (double &x : t.points) x += 2;  // clear of the sphere below
  dfm_body_def bd;
  std::memset(&bd, 0xff, sizeof bd);
  std::memcpy(&bd, &t.def, offsetof(dfm_body_def, fixed));
  bd.size = offsetof(dfm_body_def, fixed);
  dfm_body b = 0;
  ASSERT_EQ(dfm_body_create(w, &bd, &b), DFM_OK) << dfm_last_error();
  dfm_obstacle_def od;
  std::memset(&od, 0xff, sizeof od);
  od.size = offsetof(dfm_obstacle_def, name);
  od.shape = DFM_SHAPE_SPHERE;
  dfm_obstacle o = 0;
  ASSERT_EQ(dfm_obstacle_create(w, &od, &o), DFM_OK) << dfm_last_error();
  dfm_material_def md;
  std::memset(&md, 0xff, sizeof md);
  md.size = offsetof(dfm_material_def, young);
  md.flags = 0;
  md.name = nullptr;
  md.density = 500;
  dfm_material m = 0;
  ASSERT_EQ(dfm_material_create(w, &md, &m), DFM_OK) << dfm_last_error();
  steps(w, 3);
  EXPECT_NEAR(test::measure(b).velocity[2], -3e-3, 1e-9);
}

TEST(Structs, OfANewerCaller_AreRead) {
  test::Context c;
  struct {
    dfm_world_def known;
    double added[4];
  } wd{dfm_world_def_default(), {0, 0, 0, 0}};
  wd.known.size = sizeof wd;
  dfm_world w = 0;
  ASSERT_EQ(dfm_world_create(c, &wd.known, &w), DFM_OK) << dfm_last_error();
  wd.known.size = 3;
  EXPECT_EQ(dfm_world_create(c, &wd.known, &w), DFM_E_ARG);
  says({"size", "_default()"});
}

template <class T, class Get>
void never_overrun(const char *name, Get get) {
  for (uint32_t size = 8; size <= sizeof(T); size += 4) {
    unsigned char memory[sizeof(T) + 8];
    std::memset(memory, 0xa5, sizeof memory);
    T *const out = reinterpret_cast<T *>(memory);
    std::memcpy(memory, &size, sizeof size);
    ASSERT_EQ(get(out), DFM_OK) << name << ": " << dfm_last_error();
    uint32_t given;
    std::memcpy(&given, memory, sizeof given);
    EXPECT_EQ(given, size) << name;
    for (size_t i = size; i < sizeof memory; ++i)
      ASSERT_EQ(memory[i], 0xa5) << name << " of size " << size << ", byte " << i;
  }
}

TEST(Structs, FilledForAnOlderCaller_AreNotOverrun) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  steps(s.world, 20);
  never_overrun<dfm_world_stats>("stats", [&](auto *out) { return dfm_world_get_stats(s.world, out); });
  never_overrun<dfm_body_info>("info", [&](auto *out) { return dfm_body_get_info(s.lower, out); });
  never_overrun<dfm_body_measure>("measure", [&](auto *out) { return dfm_body_get_measure(s.lower, out); });
  never_overrun<dfm_obstacle_def>("obstacle def",
                                  [&](auto *out) { return dfm_obstacle_get_def(s.floor, out); });
}

// ---- wrong arguments --------------------------------------------------------------------------------------

TEST(Arguments, Wrong_AreRefusedInOneSentenceAndChangeNothing) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  steps(s.world, 30);
  const uint64_t before = dfm_world_hash(s.world);
  const double nan = std::nan(""), bad3[3] = {0, nan, 0}, good3[3] = {0, 0, 1};
  const uint32_t far_point = 100000, zero = 0;
  dfm_body b = 0;
  dfm_obstacle o = 0;
  dfm_material m = 0;
  uint32_t n = 0;
  Tet t;
  auto body = [&](auto change) {
    Tet copy;
    copy.def.points = copy.points;
    copy.def.tets = copy.cells;
    change(copy);
    return dfm_body_create(s.world, &copy.def, &b);
  };
  auto obstacle = [&](auto change) {
    dfm_obstacle_def d = dfm_obstacle_def_default();
    change(d);
    return dfm_obstacle_create(s.world, &d, &o);
  };
  auto material = [&](auto change) {
    dfm_material_def d = dfm_material_def_default();
    change(d);
    return dfm_material_create(s.world, &d, &m);
  };
  auto friction = [&](const char *one, const char *two, const char *law, dfm_param_value v) {
    dfm_friction_def f{};
    f.size = sizeof f;
    f.between[0] = one;
    f.between[1] = two;
    f.law = law;
    if (v.key) f.params = {sizeof(dfm_params), 1, &v};
    return dfm_world_add_friction(s.world, &f);
  };
  const double half = 0.5, minus = -1;
  const dfm_pose_key falling[2] = {{1, {}}, {1, {}}};
  const dfm_vector_key gravity_back[2] = {{1, {0, 0, 0}}, {0.5, {0, 0, 0}}};
  const dfm_sine nan_sine{{nan, 0, 0}, 1, 0};
  struct Case {
    dfm_status status;
    std::function<dfm_status()> call;
    std::initializer_list<const char *> parts;
  };
  const Case cases[] = {
      {DFM_E_ARG, [&] { return dfm_world_step(s.world, 0, nullptr); }, {"step of 0 s", "positive"}},
      {DFM_E_ARG, [&] { return dfm_world_step(s.world, -1, nullptr); }, {"-1"}},
      {DFM_E_ARG, [&] { return dfm_world_step(s.world, nan, nullptr); }, {"finite"}},
      {DFM_E_ARG, [&] { return dfm_world_set_gravity(s.world, bad3); }, {"gravity"}},
      {DFM_E_ARG, [&] { return dfm_world_set_gravity(s.world, nullptr); }, {"'gravity'"}},
      {DFM_E_ARG, [&] { return dfm_world_set_gravity_keys(s.world, 2, nullptr); }, {"'keys'"}},
      {DFM_E_ARG,
       [&] { return dfm_world_set_gravity_keys(s.world, 2, gravity_back); },
       {"gravity", "increase"}},
      {DFM_E_ARG, [&] { return dfm_world_find_body(s.world, "lowr", &b); }, {"'lowr'", "'lower'"}},
      {DFM_E_ARG, [&] { return dfm_world_find_body(s.world, nullptr, &b); }, {"'name'"}},
      {DFM_E_ARG,
       [&] { return dfm_world_filter_pair(s.world, "upper", "flor", false); },
       {"'flor'", "'floor'"}},
      {DFM_E_ARG, [&] { return dfm_world_filter_pair(s.world, nullptr, "floor", false); }, {"NULL"}},
      {DFM_E_ARG, [&] { return dfm_world_get_stats(s.world, nullptr); }, {"NULL"}},
      {DFM_E_ARG, [&] { return dfm_world_hold(s.world, nullptr, nullptr); }, {"'creep'"}},
      {DFM_E_ARG,
       [&] {
         dfm_contact one;
         return dfm_world_contacts(s.world, 1, &one, &n);
       },
       {"capacity 1"}},
      // bodies
      {DFM_E_ARG, [&] { return body([](Tet &x) { x.def.name = "lower"; }); }, {"'lower'", "taken"}},
      {DFM_E_ARG, [&] { return body([](Tet &x) { x.def.name = "floor"; }); }, {"'floor'", "taken"}},
      {DFM_E_ARG, [&] { return body([](Tet &x) { x.def.name = "*"; }); }, {"reserved"}},
      {DFM_E_ARG, [&] { return body([](Tet &x) { x.def.points = nullptr; }); }, {"points"}},
      {DFM_E_ARG, [&] { return body([](Tet &x) { x.def.ntet = 0; }); }, {"0 tetrahedra"}},
      {DFM_E_ARG, [&] { return body([&](Tet &x) { x.points[4] = nan; }); }, {"point 1", "finite"}},
      {DFM_E_ARG, [&] { return body([](Tet &x) { x.cells[2] = 9; }); }, {"tetrahedron 0", "9"}},
      {DFM_E_ARG, [&] { return body([](Tet &x) { std::swap(x.cells[0], x.cells[1]); }); }, {"volume"}},
      {DFM_E_ARG, [&] { return body([&](Tet &x) { x.def.velocity[1] = nan; }); }, {"velocity"}},
      {DFM_E_UNSUPPORTED, [&] { return body([](Tet &x) { x.def.model = "msn"; }); }, {"msn", "msm"}},
      {DFM_E_HANDLE, [&] { return body([&](Tet &x) { x.def.material = s.lower; }); }, {"material handle"}},
      {DFM_E_ARG,
       [&] {
         return body([&](Tet &x) {
           static dfm_param_value v;
           v = {"volum", &half, 1};
           x.def.model_params = {sizeof(dfm_params), 1, &v};
         });
       },
       {"volum", "volume"}},
      {DFM_E_ARG, [&] { return dfm_body_create(s.world, &t.def, nullptr); }, {"'out'"}},
      {DFM_E_ARG, [&] { return dfm_body_create(s.world, nullptr, &b); }, {"0 points"}},
      {DFM_E_ARG, [&] { return dfm_body_hold(s.lower, 1, &far_point, 7); }, {"'lower'", "100000"}},
      {DFM_E_ARG, [&] { return dfm_body_hold(s.lower, 1, &zero, 8); }, {"axes"}},
      {DFM_E_ARG, [&] { return dfm_body_hold(s.lower, 1, nullptr, 7); }, {"'points'"}},
      {DFM_E_ARG,
       [&] { return dfm_body_move_held(s.lower, 1, &zero, 0, nullptr, nullptr); },
       {"keys or a sine"}},
      {DFM_E_ARG, [&] { return dfm_body_move_held(s.lower, 1, &zero, 2, falling, nullptr); }, {"increase"}},
      {DFM_E_ARG,
       [&] { return dfm_body_move_held(s.lower, 1, &zero, 2, nullptr, nullptr); },
       {"keys is NULL"}},
      {DFM_E_ARG,
       [&] {
         const dfm_sine x{};
         return dfm_body_move_held(s.lower, 1, &zero, 0, nullptr, &x);
       },
       {"not held"}},
      {DFM_E_ARG,
       [&] { return dfm_body_add_load(s.lower, 1, &zero, bad3, 0, nullptr, nullptr, nullptr); },
       {"'lower'", "finite"}},
      {DFM_E_ARG,
       [&] { return dfm_body_add_load(s.lower, 1, &zero, nullptr, 0, nullptr, nullptr, nullptr); },
       {"'force'"}},
      {DFM_E_ARG,
       [&] { return dfm_body_add_load(s.lower, 1, &zero, good3, 3, nullptr, nullptr, nullptr); },
       {"keys is NULL"}},
      {DFM_E_ARG,
       [&] { return dfm_body_add_load(s.lower, 1, &zero, good3, 0, nullptr, &nan_sine, nullptr); },
       {"sine"}},
      {DFM_E_ARG, [&] { return dfm_body_remove_load(s.lower, 77); }, {"no load 77"}},
      {DFM_E_ARG, [&] { return dfm_body_set_state(s.lower, 3, nullptr, nullptr); }, {"points", "3"}},
      {DFM_E_ARG, [&] { return dfm_body_apply_impulse(s.lower, bad3, good3); }, {"finite"}},
      {DFM_E_ARG, [&] { return dfm_body_apply_impulse(s.lower, good3, nullptr); }, {"'impulse'"}},
      {DFM_E_ARG,
       [&] {
         const dfm_params p{sizeof p, 2, nullptr};
         return dfm_body_set_params(s.lower, &p);
       },
       {"params.values is NULL"}},
      {DFM_E_ARG,
       [&] {
         const dfm_param_value v{"yung", &half, 1};
         const dfm_params p{sizeof p, 1, &v};
         return dfm_body_set_params(s.lower, &p);
       },
       {"young"}},
      {DFM_E_ARG, [&] { return dfm_body_get_measure(s.lower, nullptr); }, {"NULL"}},
      // obstacles and materials
      {DFM_E_ARG, [&] { return obstacle([](auto &d) { d.shape = 9; }); }, {"shape 9"}},
      {DFM_E_ARG,
       [&] {
         return obstacle([](auto &d) {
           d.shape = DFM_SHAPE_SPHERE;
           d.radius = 0;
         });
       },
       {"radius"}},
      {DFM_E_ARG,
       [&] {
         return obstacle([](auto &d) {
           d.shape = DFM_SHAPE_BOX;
           d.half_size[1] = -1;
         });
       },
       {"half_size"}},
      {DFM_E_ARG,
       [&] {
         return obstacle([](auto &d) {
           d.shape = DFM_SHAPE_CAPSULE;
           d.half_length = -1;
         });
       },
       {"half_length"}},
      {DFM_E_ARG,
       [&] {
         return obstacle([](auto &d) {
           d.shape = DFM_SHAPE_CAPSULE;
           d.half_length = INFINITY;
         });
       },
       {"half_length inf", "finite"}},
      {DFM_E_ARG,
       [&] {
         return obstacle([](auto &d) {
           d.shape = DFM_SHAPE_SPHERE;
           d.radius = INFINITY;
         });
       },
       {"radius inf", "finite"}},
      {DFM_E_ARG,
       [&] {
         return obstacle([](auto &d) {
           d.shape = DFM_SHAPE_BOX;
           d.half_size[1] = INFINITY;
         });
       },
       {"half_size inf", "finite"}},
      {DFM_E_ARG, [&] { return obstacle([](auto &d) { d.name = "floor"; }); }, {"taken"}},
      {DFM_E_ARG, [&] { return obstacle([](auto &d) { d.nkey = 2; }); }, {"keys is NULL"}},
      {DFM_E_ARG,
       [&] {
         return obstacle([&](auto &d) {
           d.nkey = 2;
           d.keys = falling;
         });
       },
       {"increase"}},
      {DFM_E_ARG, [&] { return obstacle([&](auto &d) { d.sine.frequency = nan; }); }, {"sine"}},
      {DFM_E_ARG, [&] { return dfm_obstacle_move_to(s.floor, nullptr); }, {"'pose'"}},
      {DFM_E_ARG, [&] { return material([](auto &d) { d.density = 0; }); }, {"density", "positive"}},
      {DFM_E_ARG, [&] { return material([](auto &d) { d.poisson = 0.5; }); }, {"poisson", "(-1, 0.5)"}},
      {DFM_E_ARG, [&] { return material([](auto &d) { d.damping_stiffness = -1; }); }, {"damping_stiffness"}},
      {DFM_E_ARG,
       [&] { return material([](auto &d) { d.damping_mass = INFINITY; }); },
       {"damping_mass is inf", "finite"}},
      {DFM_E_ARG,
       [&] {
         return material([](auto &d) {
           static const dfm_param_value v{"x", nullptr, 1};
           d.extra = {sizeof(dfm_params), 1, &v};
         });
       },
       {"no value"}},
      // friction
      {DFM_E_ARG, [&] { return friction("upper", "flor", "coulomb", {}); }, {"'flor'", "'floor'"}},
      {DFM_E_UNSUPPORTED, [&] { return friction("*", "*", "culomb", {}); }, {"culomb", "coulomb"}},
      {DFM_E_ARG, [&] { return friction("*", "*", "coulomb", {"muu", &half, 1}); }, {"muu"}},
      {DFM_E_ARG, [&] { return friction("*", "*", "coulomb", {"mu", &minus, 1}); }, {"mu", "-1"}},
      {DFM_E_ARG, [&] { return friction("*", nullptr, "coulomb", {}); }, {"NULL"}},
      {DFM_E_ARG, [&] { return friction("*", "*", nullptr, {}); }, {"'law'"}},
      {DFM_E_ARG,
       [&] { return friction("upper:top", "*", "coulomb", {}); },
       {"'upper'", "'top'", "no groups"}},
      {DFM_E_ARG, [&] { return dfm_world_add_friction(s.world, nullptr); }, {"NULL"}},
  };
  for (const Case &k : cases) {
    const size_t at = size_t(&k - cases);
    EXPECT_EQ(k.call(), k.status) << "case " << at << ": " << dfm_last_error();
    SCOPED_TRACE("case " + std::to_string(at));
    says(k.parts);
    EXPECT_EQ(std::string(dfm_last_error()).find('\n'), std::string::npos) << "one sentence";
    ASSERT_EQ(dfm_world_hash(s.world), before) << "case " << at;
  }
  EXPECT_EQ(b + o + m, 0u) << "outs are untouched";
  test::ok(dfm_world_bodies(s.world, 0, nullptr, &n));
  EXPECT_EQ(n, 2u);
  // a world that was never asked anything wrong goes the same way
  const test::Stack clean = test::make_stack(c);
  steps(clean.world, 130);
  steps(s.world, 100);
  EXPECT_EQ(dfm_world_hash(s.world), dfm_world_hash(clean.world));
}

TEST(Arguments, OfContextAndWorld_AreChecked) {
  dfm_context *c = nullptr;
  dfm_context_def def = dfm_context_def_default();
  EXPECT_EQ(dfm_context_create(&def, nullptr), DFM_E_ARG);
  def.alloc = [](void *, size_t, size_t) -> void * { return nullptr; };
  EXPECT_EQ(dfm_context_create(&def, &c), DFM_E_ARG);
  says({"release"});
  def = dfm_context_def_default();
  def.trace_end = [](void *, const char *) {};
  EXPECT_EQ(dfm_context_create(&def, &c), DFM_E_ARG);
  def = dfm_context_def_default();
  def.threads = 5000;
  EXPECT_EQ(dfm_context_create(&def, &c), DFM_E_ARG);
  says({"5000"});
  def = dfm_context_def_default();
  def.plugin_dir = "/nonexistent/plugins";
  EXPECT_EQ(dfm_context_create(&def, &c), DFM_E_ARG);
  says({"/nonexistent/plugins"});
  EXPECT_EQ(c, nullptr);

  test::Context good;
  dfm_world w = 0;
  EXPECT_EQ(dfm_world_create(nullptr, nullptr, &w), DFM_E_ARG);
  EXPECT_EQ(dfm_world_create(good, nullptr, nullptr), DFM_E_ARG);
  dfm_world_def wd = dfm_world_def_default();
  wd.gravity[1] = INFINITY;
  EXPECT_EQ(dfm_world_create(good, &wd, &w), DFM_E_ARG);
  wd = dfm_world_def_default();
  wd.contact_offset = -1;
  EXPECT_EQ(dfm_world_create(good, &wd, &w), DFM_E_ARG);
  says({"contact_offset"});
  wd = dfm_world_def_default();
  wd.max_sweeps = 0;
  EXPECT_EQ(dfm_world_create(good, &wd, &w), DFM_E_ARG);
  wd = dfm_world_def_default();
  wd.reserved3 = 1;
  EXPECT_EQ(dfm_world_create(good, &wd, &w), DFM_E_UNSUPPORTED);
  says({"contact method", "integrator"});
  const char *const effects[] = {"magic", nullptr};
  wd = dfm_world_def_default();
  wd.effects = effects;
  EXPECT_EQ(dfm_world_create(good, &wd, &w), DFM_E_ARG);
  says({"'magic'"});
  EXPECT_EQ(w, 0u);
}

TEST(UserData, OfABody_IsKeptAndChanged) {
  test::Context c;
  int one = 1, two = 2;
  Tet t;
  t.def.user = &one;
  const dfm_world w = test::make_world(c);
  dfm_body b = 0;
  test::ok(dfm_body_create(w, &t.def, &b));
  dfm_body_info info{};
  test::ok(dfm_body_get_info(b, &info));
  EXPECT_EQ(info.user, &one);
  EXPECT_EQ(info.world, w);
  test::ok(dfm_body_set_user(b, &two));
  test::ok(dfm_body_get_info(b, &info));
  EXPECT_EQ(info.user, &two);
  dfm_obstacle_def od = dfm_obstacle_def_default();
  od.user = &one;
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(w, &od, &o));
  dfm_obstacle_def got{};
  test::ok(dfm_obstacle_get_def(o, &got));
  EXPECT_EQ(got.user, &one);
}

// ---- coming and going while the world runs ----------------------------------------------------------------

TEST(Running, ABodyRemovedInContact_EndsItsContactsAndTheOthersContinue) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  steps(s.world, 300);
  auto log = test::events(s.world);
  uint64_t open = 0;
  for (const auto &k : test::contacts(s.world)) open += k.body_a == s.upper || k.body_b == s.upper;
  ASSERT_GT(open, 0u);
  EXPECT_EQ(balance(log, DFM_EVENT_BEGIN) - balance(log, DFM_EVENT_END), test::contacts(s.world).size());
  test::ok(dfm_body_destroy(s.upper));
  log = test::events(s.world);
  EXPECT_EQ(balance(log, DFM_EVENT_END), open);
  for (const auto &e : log) EXPECT_TRUE(e.kind == DFM_EVENT_END && (e.a == s.upper || e.b == s.upper));
  EXPECT_GT(test::contacts(s.world).size(), 0u) << "of the other one, in the last sub-step";
  for (const auto &k : test::contacts(s.world)) EXPECT_TRUE(k.body_a == s.lower && k.body_b == 0);
  steps(s.world, 300);
  for (const auto &k : test::contacts(s.world)) EXPECT_TRUE(k.body_a == s.lower && k.body_b == 0);
  const auto pairs = test::pairs(s.world);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_NEAR(pairs[0].normal, test::measure(s.lower).mass * 9.81, 0.05 * pairs[0].normal);
  for (const auto &e : test::events(s.world)) EXPECT_TRUE(e.a == s.lower && e.b == s.floor);
}

TEST(Running, AnObstacleRemovedInContact_LetsTheBodiesFall) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  steps(s.world, 300);
  test::events(s.world);
  test::ok(dfm_obstacle_destroy(s.floor));
  uint64_t ended = 0;
  for (const auto &e : test::events(s.world)) ended += e.kind == DFM_EVENT_END && e.b == s.floor;
  EXPECT_GT(ended, 3u);
  const double before = test::measure(s.lower).velocity[2];
  steps(s.world, 100);
  EXPECT_NEAR(test::measure(s.lower).velocity[2] - before, -0.981, 0.05);
  test::ok(dfm_body_destroy(s.lower));
  test::ok(dfm_body_destroy(s.upper));
  steps(s.world, 2);  // an empty world steps too
  EXPECT_EQ(test::contacts(s.world).size(), 0u);
}

TEST(Running, ABodyCreatedAmongOthers_TakesPart) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  steps(s.world, 200);
  test::BodyOptions o;
  o.name = "third";
  o.young = 2e5;
  o.damping_stiffness = 2e-3;
  o.position = {0.02, 0.02, 0.2005};
  const dfm_body third = test::make_body(c, s.world, "beam", {0.06, 0.06, 0.06}, 60, o);
  steps(s.world, 300);
  bool touches = false;
  for (const auto &p : test::pairs(s.world)) touches |= p.a == s.upper && p.b == third;
  EXPECT_TRUE(touches);
  EXPECT_NEAR(test::measure(third).com[2], 0.23, 0.01);
}

TEST(Running, FiltersChangedInContact_LetGoAndCatchAgain) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  steps(s.world, 300);
  test::events(s.world);
  // meets nothing of category 2: the floor and the lower cube are of category 1
  test::ok(dfm_body_set_filter(s.upper, 2, ~2u));
  test::ok(dfm_body_set_filter(s.lower, 1, 1));  // and is no longer met by the lower one
  steps(s.world, 20);
  uint64_t between = 0;
  for (const auto &e : test::events(s.world))
    between +=
        e.kind == DFM_EVENT_END && (e.a == s.upper || e.b == s.upper) && e.b != s.floor && e.a != s.floor;
  EXPECT_GT(between, 0u);
  EXPECT_LT(test::measure(s.upper).velocity[2], -0.1) << "it falls through the lower one";
  for (const auto &p : test::pairs(s.world)) EXPECT_FALSE(p.a == s.lower && p.b == s.upper);

  const test::Stack named = test::make_stack(c);
  steps(named.world, 100);
  test::ok(dfm_world_filter_pair(named.world, "upper", "lower", false));
  steps(named.world, 10);
  EXPECT_LT(test::measure(named.upper).velocity[2], -0.05);
  test::ok(dfm_world_filter_pair(named.world, "upper", "lower", true));  // the last rule wins
  steps(named.world, 5);
  bool touches = false;
  for (const auto &p : test::pairs(named.world)) touches |= p.a == named.lower && p.b == named.upper;
  EXPECT_TRUE(touches);
}

// ---- steps that cannot be taken ---------------------------------------------------------------------------

TEST(Step, OfImplicitBodies_SaysWhatHoldsItBack) {
  test::Context c;
  dfm_world_def wd = dfm_world_def_default();
  wd.integrator = DFM_INTEGRATOR_IMPLICIT_EULER;
  wd.solver = "pcg";
  wd.solver_iterations = 1;
  dfm_world w = 0;
  test::ok(dfm_world_create(c, &wd, &w));
  test::BodyOptions o;
  o.name = "soft";
  o.model = "corotational_fem";
  o.spin = {0, 0, 5};
  const dfm_body body = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  uint32_t trouble = 0;
  EXPECT_EQ(dfm_world_step(w, 0.1, &trouble), DFM_E_DIVERGED);
  says({"body 'soft'", "equations of motion"});
  const uint32_t point = 0;
  dfm_spring_def d{};
  d.size = sizeof d;
  d.npoint = 1;
  d.points = &point;
  d.stiffness = 1e9;
  uint32_t number = 0;
  test::ok(dfm_body_add_spring(body, &d, &number));
  EXPECT_EQ(dfm_world_step(w, 0.1, &trouble), DFM_DISCARD);
  says({"soften the springs that pull body 'soft'"});
}

TEST(Step, WithALoadThatOverflows_DivergesAtTheLastGoodSubStepAndContinuesWithoutIt) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  steps(s.world, 40);
  const uint32_t point = 4;
  const double huge[3] = {0, 0, 1.7e308};
  // starts in the middle of the step from 0.041 s
  const dfm_scale_key grow[2] = {{0.0415, 0}, {0.0416, 1e20}};
  uint32_t load = 0, trouble = 0;
  test::ok(dfm_body_add_load(s.upper, 1, &point, huge, 2, grow, nullptr, &load));
  steps(s.world, 1);
  ASSERT_EQ(dfm_world_step(s.world, 1e-3, &trouble), DFM_E_DIVERGED);
  EXPECT_TRUE(trouble & DFM_TROUBLE_NONFINITE);
  says({"step 41", "body 'upper'", "not finite"});
  const double t = dfm_world_time(s.world);
  EXPECT_GE(t, 0.041);
  EXPECT_LT(t, 0.0416);
  EXPECT_LT(test::measure(s.upper).speed_max, 1.0) << "the state is that of a good sub-step";
  const uint64_t hash = dfm_world_hash(s.world);
  EXPECT_EQ(dfm_world_step(s.world, 1e-3, nullptr), DFM_E_DIVERGED) << "the cause is still there";
  EXPECT_EQ(dfm_world_hash(s.world), hash);
  test::ok(dfm_body_remove_load(s.upper, load));
  steps(s.world, 200);
  EXPECT_NEAR(test::measure(s.upper).com[2], 0.149, 0.005);
}

TEST(Step, ThatNeedsTooManySubSteps_IsDiscardedAndNothingChanges) {
  test::Context c;
  dfm_world_def wd = dfm_world_def_default();
  wd.max_substeps = 2;
  dfm_world w = 0;
  test::ok(dfm_world_create(c, &wd, &w));
  test::BodyOptions o;
  o.name = "stiff";
  o.young = 1e7;
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  double dt = 0;
  dfm_body body = 0;
  test::ok(dfm_world_stable_step(w, &dt, &body, nullptr));
  const uint64_t hash = dfm_world_hash(w);
  uint32_t trouble = 0;
  EXPECT_EQ(dfm_world_step(w, 5 * dt, &trouble), DFM_DISCARD);
  EXPECT_EQ(trouble, uint32_t(DFM_TROUBLE_SUBSTEPS));
  says({"'stiff'", "needs 5 sub-steps", "max_substeps 2", "let bodies move by tr_bdf2"});
  EXPECT_EQ(dfm_world_step(w, 1e300, nullptr), DFM_DISCARD);
  says({"e+30", "max_substeps 2"});
  EXPECT_LT(std::strlen(dfm_last_error()), 300u) << dfm_last_error();
  EXPECT_EQ(dfm_world_hash(w), hash);
  EXPECT_EQ(dfm_world_time(w), 0);
  EXPECT_EQ(dfm_world_step(w, 1.9 * dt, &trouble), DFM_OK);
  EXPECT_EQ(trouble, uint32_t(DFM_TROUBLE_SUBSTEPS));
  EXPECT_EQ(test::stats(w).last_substeps, 2u);
}

TEST(Step, WithAnInvertedCell_ReportsIt) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  Tet t;
  dfm_body b = 0;
  test::ok(dfm_body_create(w, &t.def, &b));
  uint32_t trouble = 0;
  test::ok(dfm_world_step(w, 1e-4, &trouble));
  EXPECT_EQ(trouble, 0u);
  double x[12], v[12] = {};
  std::copy(t.points, t.points + 12, x);
  x[11] = -0.1;
  test::ok(dfm_body_set_state(b, 4, x, v));
  test::ok(dfm_world_step(w, 1e-4, &trouble));
  EXPECT_TRUE(trouble & DFM_TROUBLE_INVERTED);
  EXPECT_EQ(test::stats(w).inverted_max, 1u);
  EXPECT_EQ(test::measure(b).inverted, 1u);
}

TEST(Step, CalledFromInsideAStep_IsBusy) {
  struct Host {
    dfm_world world = 0;
    dfm_status step = DFM_OK, destroy = DFM_OK, gravity = DFM_OK;
  } host;
  dfm_context_def def = dfm_context_def_default();
  def.plugin_dir = DEFORM_PLUGIN_DIR;
  def.user = &host;
  def.log = [](void *, int32_t, const char *) {};
  def.trace_begin = [](void *user, const char *) {
    Host &h = *static_cast<Host *>(user);
    const double g[3] = {0, 0, 0};
    h.step = dfm_world_step(h.world, 1e-3, nullptr);
    h.destroy = dfm_world_destroy(h.world);
    h.gravity = dfm_world_set_gravity(h.world, g);
  };
  def.trace_end = [](void *, const char *) {};
  dfm_context *c = nullptr;
  ASSERT_EQ(dfm_context_create(&def, &c), DFM_OK);
  host.world = test::make_stack(c).world;
  steps(host.world, 1);
  EXPECT_EQ(host.step, DFM_E_BUSY);
  EXPECT_EQ(host.destroy, DFM_E_BUSY);
  EXPECT_EQ(host.gravity, DFM_E_BUSY);
  dfm_context_destroy(c);
}
