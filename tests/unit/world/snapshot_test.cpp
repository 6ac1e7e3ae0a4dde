// Snapshots that are damaged or forged: whatever the bytes, a restore refuses them whole with a sentence and
// leaves the world as it was, or takes them and the world can go on. Forged ones carry a checksum that holds,
// so that every check behind it is met.
#include <cstring>
#include <limits>
#include <random>

#include "bristle_law.h"
#include "heap_calls.h"
#include "inside.h"
#include "rigid.h"
#include "sealed_snapshot.h"
#include "snapshot/snapshot.h"
#include "snapshot/snapshot_cuts.h"
#include "snapshot/snapshot_fields.h"
#include "snapshot/snapshot_things.h"

namespace {

using Bytes = std::vector<unsigned char>;

// Something of everything that a snapshot holds, and at a time at which one island sleeps and
// another does not.
dfm_world build(dfm_context *c) {
  dfm_world_def d = dfm_world_def_default();
  d.sleep = 1;
  d.sleep_speed = 0.5;
  d.sleep_time = 4e-3;
  dfm_world w = 0;
  test::ok(dfm_world_create(c, &d, &w));
  test::ok(dfm_plugin_register_static(c, dfm_plugin_entry_bristle, "bristle"));
  test::add_plane(w, "floor");
  test::set_friction(w, 0.5, "test.bristle");
  test::BodyOptions o;
  o.young = 2e5;
  o.damping_stiffness = 2e-3;
  o.damping_mass = 20;
  o.name = "sleeper";
  o.position = {2, 0, 1e-4};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 10, o);
  o.name = "lower";
  o.position = {0, 0, 4e-5};
  const dfm_body lower = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 10, o);
  o.name = "upper";
  o.position = {0.013, 0.007, 0.1001};
  o.velocity = {0.3, 0, 0};
  o.spin = {0, 0, 10};
  const dfm_body upper = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 10, o);
  const uint32_t pushed[] = {3, 5}, held[] = {0, 1};
  const double force[] = {0.1, 0, 0, 0, 0.1, 0};
  const dfm_scale_key scale[] = {{0, 0}, {5, 1}};
  const dfm_sine wobble{{0.5, 0, 0}, 30, 0.2}, sway{{1e-4, 0, 0}, 20, 0};
  test::ok(dfm_body_add_load(upper, 2, pushed, force, 2, scale, &wobble, nullptr));
  test::ok(dfm_body_hold(lower, 2, held, 7));
  test::ok(dfm_body_move_held(lower, 2, held, 0, nullptr, &sway));
  const dfm_vector_key ends[] = {{0, {0, 0, 0.3}}, {5, {0.1, 0, 0.3}}};
  const dfm_spring_def spring{sizeof spring, 2, pushed, nullptr, {0, 0, 0.3}, ends, 2, 0, 3, 0.1};
  test::ok(dfm_body_add_spring(upper, &spring, nullptr));
  dfm_cut_def plane = dfm_cut_def_default(), box = plane;
  plane.shape = DFM_CUT_PLANE;
  plane.how = DFM_CUT_SPLIT;
  plane.blade[3] = 1;
  box.shape = DFM_CUT_BOX;
  for (double &size : box.half_size) size = 0.03;
  test::ok(dfm_body_plan_cut(lower, 0.03105, &plane));  // in the step after the snapshot
  test::ok(dfm_body_plan_cut(upper, 1, &plane));
  test::ok(dfm_body_plan_cut(upper, 2, &box));
  dfm_obstacle_def jaw = dfm_obstacle_def_default();
  const dfm_pose_key keys[] = {{0, {{-1, 0.05, 0.15}, {0, 0, 0, 1}}},
                               {1, {{-0.9, 0.05, 0.15}, {0, 0, 0.1, 1}}}};
  jaw.name = "jaw";
  jaw.shape = DFM_SHAPE_BOX;
  jaw.nkey = 2;
  jaw.keys = keys;
  for (double &size : jaw.half_size) size = 0.1;
  dfm_obstacle obstacle = 0;
  test::ok(dfm_obstacle_create(w, &jaw, &obstacle));
  dfm_joint_def hinge = test::joint(DFM_JOINT_HINGE, 0, DFM_RIGID_WORLD, {5, 0, 1}, {0, 1, 0});
  hinge.motor = 1;
  hinge.velocity = -2;
  hinge.max = 5;
  test::create(w, {test::box("arm", {0.2, 0.02, 0.02}, 0.5, {5.1, 0, 1})}, {hinge});
  test::ok(dfm_world_filter_pair(w, "upper", "jaw", false));
  for (int i = 0; i < 60; ++i) test::ok(dfm_world_step(w, 5e-4, nullptr));
  test::ok(dfm_world_hold_begin(w));
  for (int i = 0; i < 2; ++i) test::ok(dfm_world_step(w, 5e-4, nullptr));
  EXPECT_EQ(test::stats(w).asleep, 1u) << "one sleeps, the others move";
  EXPECT_GT(test::contacts(w).size(), 5u);
  return w;
}

using test::inside;

// The location of a field.
struct Field {
  const char *name;
  size_t at, bytes;  // of its values; for a list, of its count
  char kind;         // d: doubles, u: unsigned, f: flags, n: a count
  bool checked;
};
// Notes where the writer of a snapshot puts each field.
class FieldMap {
 public:
  void where(const char *, const std::string &) {}
  template <class T, class B>
  void value(const char *name, const T &x, const B &) {
    note<T, B>(name, sizeof x);
  }
  template <class A, class B>
  void array(const char *name, const A &a, uint64_t, const B &) {
    using T = std::remove_cvref_t<decltype(a[0])>;
    count(name);
    if (!a.empty()) note<T, B>(name, a.size() * sizeof(T));
  }
  template <class A, class F>
  void list(const char *name, const A &a, F f) {
    count(name);
    for (const auto &x : a) f(x);
  }
  template <class A, class F>
  void members(const char *name, const A &a, uint64_t, F f) {
    list(name, a, f);
  }
  template <class F>
  void must_hold(const char *, const char *, F) {}
  std::vector<Field> fields;
  size_t at = sizeof(dfm::SnapshotHead);

 private:
  void count(const char *name) {
    fields.push_back({name, at, 8, 'n', true});
    at += 8;
  }
  template <class T, class B>
  void note(const char *name, size_t bytes) {
    const bool whole = std::is_unsigned_v<T> || std::is_enum_v<T>;
    fields.push_back({name, at, bytes,
                      std::is_same_v<T, bool> ? 'f'
                      : whole                 ? 'u'
                                              : 'd',
                      !std::is_same_v<B, std::remove_const_t<decltype(dfm::must::any)>>});
    at += bytes;
  }
};

struct Taken {
  Bytes bytes;
  std::vector<Field> map;
};
Taken take(dfm_world world) {
  Taken t;
  const dfm::World &w = inside(world);
  dfm::world_snapshot(w, t.bytes);
  FieldMap map;
  const auto things = dfm::thing_rows(w);
  const auto cuts = dfm::cut_rows(w);
  dfm::thing_fields(map, things);
  dfm::cut_fields(map, cuts);
  dfm::snapshot::fields(map, w, w);
  EXPECT_EQ(map.at, t.bytes.size());
  t.map = std::move(map.fields);
  return t;
}

using test::seal;

dfm_status restore(dfm_world w, const Bytes &b) { return dfm_world_restore(w, b.data(), b.size()); }

// After bytes that were taken in: everything may be asked, and a step ends one way or the other.
void use(dfm_world w) {
  uint32_t trouble = 0;
  test::contacts(w);
  dfm_world_hash(w);
  const dfm_status s = dfm_world_step(w, 1e-4, &trouble);
  // a target that the host might have set too, and farther away than an obstacle may go in this step
  const bool far = s == DFM_E_ARG && std::strstr(dfm_last_error(), "would move at");
  EXPECT_TRUE(s == DFM_OK || s == DFM_E_DIVERGED || s == DFM_DISCARD || far)
      << dfm_status_name(s) << ": " << dfm_last_error();
  test::contacts(w);
}

template <class T>
void put(Bytes &b, size_t at, T x) {
  std::memcpy(b.data() + at, &x, sizeof x);
}

struct DamagedSnapshot : testing::Test {
  test::Context c;
  dfm_world w = build(c);
  Taken good = take(w);
  uint64_t hash = 0;
  Bytes state;

  void SetUp() override {
    for (int i = 0; i < 3; ++i) test::ok(dfm_world_step(w, 5e-4, nullptr));
    hash = dfm_world_hash(w);
    state = take(w).bytes;
  }
  void refused(const Bytes &bad, const std::string &what, const char *part = "") {
    EXPECT_EQ(restore(w, bad), DFM_E_FORMAT) << what << ": " << dfm_last_error();
    EXPECT_NE(std::string(dfm_last_error()).find(part), std::string::npos)
        << what << ": " << dfm_last_error();
    EXPECT_EQ(dfm_world_hash(w), hash) << what;
  }
};

}  // namespace

TEST_F(DamagedSnapshot, WithFlippedBytes_IsRefusedAndChangesNothing) {
  std::mt19937 random(7);
  for (int i = 0; i < 10000; ++i) {
    Bytes bad = good.bytes;
    for (uint32_t flips = 1 + random() % 3; flips-- > 0;)
      bad[random() % bad.size()] ^= static_cast<unsigned char>(1 + random() % 255);
    if (bad == good.bytes) continue;
    ASSERT_EQ(restore(w, bad), DFM_E_FORMAT) << i;
  }
  EXPECT_EQ(dfm_world_hash(w), hash);
  EXPECT_EQ(take(w).bytes, state);
}

TEST_F(DamagedSnapshot, CutAnywhere_IsRefused) {
  for (size_t n = 1; n < good.bytes.size(); n += 1 + n / 16)
    refused(Bytes(good.bytes.begin(), good.bytes.begin() + std::ptrdiff_t(n)), "cut");
  // with a head that agrees
  for (size_t n = sizeof(dfm::SnapshotHead); n < good.bytes.size(); n += 1 + n / 16) {
    Bytes bad(good.bytes.begin(), good.bytes.begin() + std::ptrdiff_t(n));
    seal(bad);
    refused(bad, "cut and sealed");
  }
  Bytes longer = good.bytes;
  longer.push_back(0);
  seal(longer);
  refused(longer, "longer", "the end");
}

TEST_F(DamagedSnapshot, OfAnotherVersion_IsNamed) {
  Bytes bad = good.bytes;
  put(bad, 8, uint32_t{6});
  seal(bad);
  refused(bad, "version", "another version");
  bad = good.bytes;
  bad[7] = '5';
  seal(bad);
  refused(bad, "the format before", "another version");
  bad = good.bytes;
  bad[0] = 'x';
  seal(bad);
  refused(bad, "not a snapshot", "not a snapshot");
}

// Each field that has a check, with what it must not be.
TEST_F(DamagedSnapshot, ForgedFieldByField_IsRefusedUnderItsName) {
  const double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  int forged = 0;
  for (const Field &f : good.map) {
    if (!f.checked) continue;
    const auto forge = [&](auto value, size_t at, const char *what) {
      Bytes bad = good.bytes;
      put(bad, at, value);
      seal(bad);
      refused(bad, std::string(f.name) + " " + what, f.name);
      ++forged;
    };
    const size_t last = f.at + f.bytes;
    if (f.kind == 'd') {
      forge(nan, f.at, "nan first");
      if (std::string(f.name) == "friction work") {
        forge(nan, last - 8, "nan last");
      } else if (std::string(f.name) != "statistics") {
        forge(nan, last - 8, "nan last");
        forge(-inf, f.at, "-inf");
      }
    } else if (f.kind == 'u') {
      forge(static_cast<unsigned char>(0xff), last - 1, "large");
    } else if (f.kind == 'f') {
      forge(uint8_t{2}, f.at, "2");
      forge(uint8_t{255}, f.at, "255");
    } else {
      uint64_t n;
      std::memcpy(&n, good.bytes.data() + f.at, sizeof n);
      Bytes bad = good.bytes;
      for (const uint64_t wrong : {uint64_t{1} << 60, ~uint64_t{0}, n + 1}) {
        put(bad, f.at, wrong);
        seal(bad);
        refused(bad, std::string(f.name) + " count");
        ++forged;
      }
    }
  }
  EXPECT_GT(forged, 400);
  EXPECT_EQ(take(w).bytes, state);
}

// A restore gives an obstacle that was created again its former id before it reads the rest.
TEST_F(DamagedSnapshot, ForgedForAWorldOfOtherIds_IsRefusedAndChangesNothing) {
  dfm_obstacle jaw = 0;
  test::ok(dfm_world_find_obstacle(w, "jaw", &jaw));
  test::ok(dfm_obstacle_destroy(jaw));
  dfm_obstacle_def again = dfm_obstacle_def_default();
  again.name = "jaw";
  again.shape = DFM_SHAPE_BOX;
  for (double &size : again.half_size) size = 0.1;
  test::ok(dfm_obstacle_create(w, &again, &jaw));
  hash = dfm_world_hash(w);
  state = take(w).bytes;
  for (const Field &f : good.map) {
    if (!f.checked || (f.kind != 'd' && f.kind != 'u')) continue;
    Bytes bad = good.bytes;
    if (f.kind == 'd') put(bad, f.at, std::numeric_limits<double>::quiet_NaN());
    else put(bad, f.at + f.bytes - 1, static_cast<unsigned char>(0xff));
    seal(bad);
    refused(bad, f.name, f.name);
    ASSERT_EQ(take(w).bytes, state) << f.name;
  }
  test::ok(restore(w, good.bytes));
  EXPECT_EQ(take(w).bytes, good.bytes);
  use(w);
}

TEST_F(DamagedSnapshot, WithAStepBoundThatNoSubStepCanHave_IsRefused) {
  for (const Field &f : good.map) {
    if (std::string(f.name) != "step bound") continue;
    for (const double bound : {0.0, 5e-312, 1e-300, -1.0}) {
      Bytes bad = good.bytes;
      put(bad, f.at, bound);
      seal(bad);
      refused(bad, "bound", "step bound");
    }
  }
}

// Any bytes behind a checksum that holds.
TEST_F(DamagedSnapshot, ForgedAtRandom_IsRefusedOrTheWorldContinues) {
  std::mt19937 random(11);
  int taken = 0;
  for (int i = 0; i < 1500; ++i) {
    Bytes bad = good.bytes;
    for (uint32_t flips = 1 + random() % 4; flips-- > 0;) {
      const size_t at = sizeof(dfm::SnapshotHead) + random() % (bad.size() - sizeof(dfm::SnapshotHead));
      bad[at] ^= static_cast<unsigned char>(1u << (random() % 8));
    }
    seal(bad);
    const dfm_status s = restore(w, bad);
    ASSERT_TRUE(s == DFM_OK || s == DFM_E_FORMAT || s == DFM_E_UNSUPPORTED)
        << i << ": " << dfm_status_name(s) << ": " << dfm_last_error();
    if (s == DFM_OK) {
      ++taken;
      use(w);
      test::ok(restore(w, good.bytes));
    }
  }
  EXPECT_GT(taken, 100) << "low bits of positions are anyone's";
}

// A list may not ask for more memory than its bytes account for: not by its count, and not by entries that
// are small in the file and large in memory.
TEST_F(DamagedSnapshot, ThatClaimsMuchMemory_TakesNoMoreThanAFewTimesItsBytes) {
  constexpr size_t kPadding = 1 << 20;
  for (const Field &f : good.map) {
    if (f.kind != 'n') continue;
    Bytes bad = good.bytes;
    bad.insert(bad.begin() + std::ptrdiff_t(f.at) + 8, kPadding, 0);
    for (const size_t entry : {size_t{1}, size_t{8}, size_t{68}}) {
      put(bad, f.at, uint64_t{kPadding / entry});
      seal(bad);
      const uint64_t before = test::heap_bytes;
      EXPECT_NE(restore(w, bad), DFM_OK) << f.name;
      EXPECT_LT(test::heap_bytes - before, 12 * bad.size()) << f.name << ", entries of " << entry << " bytes";
    }
  }
  EXPECT_EQ(dfm_world_hash(w), hash);
}

// Contacts of a removed body stay in the books until the next sub-step, also while others sleep.
TEST_F(DamagedSnapshot, TakenRightAfterABodyWasRemoved_RestoresAndContinues) {
  test::ok(restore(w, good.bytes));
  dfm_body upper = 0;
  test::ok(dfm_world_find_body(w, "upper", &upper));
  test::ok(dfm_body_destroy(upper));
  ASSERT_EQ(test::stats(w).asleep, 1u);
  const Bytes without = take(w).bytes;
  test::ok(dfm_world_step(w, 5e-4, nullptr));
  const uint64_t later = dfm_world_hash(w);
  test::ok(restore(w, without));
  test::ok(dfm_world_step(w, 5e-4, nullptr));
  EXPECT_EQ(dfm_world_hash(w), later);
}
