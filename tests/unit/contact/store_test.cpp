// Contacts that live: found by key, taken over by warm starts, carried on while they sleep, and kept whole
// where a sub-step finds no memory.
#include "contact/store.h"

#include "refused_memory.h"

#include <algorithm>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

#include "../world/inside.h"
#include "contact/contact_state.h"
#include "contact/rows.h"
#include "math/turn.h"
#include "near.h"
#include "world.h"

namespace {

using namespace dfm;
using test::expect_near;
using test::inside;
using test::Refusal;

constexpr double kStep = 1e-4;  // s, below every bound: a step is one sub-step

// A store of one contact per key, in this order.
ContactStore store_of(std::vector<uint64_t> keys, uint32_t nstate = 0) {
  ContactStore s(Memory::standard());
  s.n = uint32_t(keys.size());
  s.nstate = nstate;
  each_column(
      [&](const ContactColumn &column, auto &values) {
        if (column.width != kOwnLength) values.resize(column.entries(s.n, nstate));
      },
      s);
  s.key.assign(keys.begin(), keys.end());
  std::iota(s.by_key.begin(), s.by_key.end(), 0u);
  std::sort(s.by_key.begin(), s.by_key.end(), [&](uint32_t i, uint32_t j) { return keys[i] < keys[j]; });
  for (uint32_t i = 0; i < s.n; ++i) {
    s.normal[3 * i + 2] = 1;
    s.tangent[3 * i] = s.turned[3 * i] = 1;
  }
  return s;
}

ContactPoint contact_of(uint64_t key, Vec3 normal = {0, 0, 1}) {
  ContactPoint c{};
  c.key = key;
  store3(c.normal, normal);
  return c;
}

struct Warm {
  ContactRows rows{Memory::standard()};
  ContactState state;
  std::vector<double> tangents;
  std::vector<uint32_t> match;
  Warm(const ContactStore &old, const std::vector<ContactPoint> &contacts, double h, uint32_t nstate,
       const std::vector<uint32_t> &law) {
    const uint32_t n = uint32_t(contacts.size());
    state.resize(n, nstate);
    std::copy(law.begin(), law.end(), state.law.begin());
    tangents.resize(3 * size_t{n});
    match.resize(n);
    warm_start(old, contacts, h, rows.impulse, state, tangents.data(), match.data());
  }
  Vec3 impulse(uint32_t i) const { return load3(&rows.impulse[3 * size_t{i}]); }
  double bristle(uint32_t i, uint32_t s) const { return state.bristle[size_t{s} * state.stride + i]; }
};

// Every column as bytes, beside what else the store, the events and the bodies of its world hold.
std::vector<std::string> all_of(const World &w) {
  std::vector<std::string> out;
  const auto put = [&](const void *data, size_t bytes) {
    out.emplace_back(static_cast<const char *>(data), bytes);
  };
  each_column([&](const ContactColumn &,
                  const auto &values) { put(values.data(), values.size() * sizeof(values[0])); },
              w.store);
  put(&w.store.n, sizeof w.store.n);
  put(&w.store.nstate, sizeof w.store.nstate);
  put(&w.store.h, sizeof w.store.h);
  put(w.events.data(), w.events.size() * sizeof(w.events[0]));
  const uint64_t hash = dfm_world_hash(w.handle);
  put(&hash, sizeof hash);
  return out;
}

// Every column has a value for every contact, and the place in the order of keys is the inverse of find().
void expect_whole(const ContactStore &s) {
  each_column(
      [&](const ContactColumn &column, const auto &values) {
        if (column.width == kOwnLength) return;
        EXPECT_EQ(values.size(), column.entries(s.n, s.nstate));
      },
      s);
  for (uint32_t k = 1; k < s.n; ++k) EXPECT_LT(s.key[s.by_key[k - 1]], s.key[s.by_key[k]]) << k;
  for (uint32_t i = 0; i < s.n; ++i) EXPECT_EQ(s.find(s.key[i]), i);
  EXPECT_EQ(std::set<uint32_t>(s.by_key.begin(), s.by_key.end()).size(), s.n);
}

// A floor, a box that rests on it under a law with bristles, and one `above` it that falls at 1 m/s or, where
// `beside`, slides on the floor at 2 m/s.
dfm_world two_boxes(dfm_context *c, bool sleepy, bool beside) {
  dfm_world_def d = dfm_world_def_default();
  d.sleep = sleepy;
  d.sleep_speed = 0.5;
  d.sleep_time = 3 * kStep;
  dfm_world w = 0;
  test::ok(dfm_world_create(c, &d, &w));
  test::add_plane(w, "floor");
  test::set_friction(w, 0.5, "dahl");
  test::BodyOptions o;
  o.young = 2e5;
  o.damping_stiffness = 2e-3;
  o.damping_mass = 20;
  o.position = {0, 0, 1e-4};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 10, o);
  o.position = {0.02, 0.03, 0.1009};
  o.velocity = {0, 0, -1};
  if (beside) {
    o.position = {0, 1, 1e-4};
    o.velocity = {2, 0, 0};
  }
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 10, o);
  return w;
}

}  // namespace

TEST(Store, Find_GivesThePlaceOfEveryKeyAndOfNoOther) {
  const ContactStore s = store_of({70, 10, 90, 30, ~uint64_t{0}, 50});
  expect_whole(s);
  for (const uint64_t key : {0, 9, 11, 40, 69, 71, 100}) EXPECT_EQ(s.find(key), kNone) << key;
  EXPECT_EQ(store_of({}).find(1), kNone);
}

// Memory, room, carrying over, sleep, budget, snapshot and hash go through the list of columns: an array that
// it does not name would be left out of all of them. Beside the arrays a store has two counts and a length of
// time.
TEST(Store, Columns_AreAllInTheList) {
  ContactStore s(Memory::standard());
  size_t bytes = 0;
  std::set<const void *> seen;
  each_column(
      [&](const ContactColumn &, const auto &values) {
        bytes += sizeof values;
        seen.insert(&values);
      },
      s);
  EXPECT_EQ(bytes + 2 * sizeof(uint32_t) + sizeof(double), sizeof s);
  EXPECT_EQ(seen.size() * sizeof(Array<double>), bytes) << "a column is named twice";
}

// The rotation that turns m to n along the shortest way, by the angle between them about m x n, applied to
// the tangent.
TEST(Transport, TurnsTheTangentAsTheNormalTurns) {
  const Vec3 m = normalized({1, -2, 0.5});
  const Vec3 t = any_tangent(m);
  const Vec3 axis = normalized(cross(m, {0.3, 0.2, 1}));
  for (const double degrees : {0.0, 1e-3, 20.0, 90.0, 119.0}) {
    const double angle = degrees * std::numbers::pi / 180;
    const Quat q = turned({0, 0, 0, 1}, angle * axis);
    bool reset = true;
    const Vec3 turned_tangent = transport(t, m, rotate(q, m), &reset);
    EXPECT_FALSE(reset) << degrees;
    expect_near(turned_tangent, rotate(q, t), 1e-14);
  }
  bool reset = false;
  const Vec3 far = rotate(turned({0, 0, 0, 1}, 121 * std::numbers::pi / 180 * axis), m);
  expect_near(transport(t, m, far, &reset), any_tangent(far), 0);
  EXPECT_TRUE(reset);
}

// Impulses belong to a length of time: half of it takes half of them. Bristles are the law's own.
TEST(WarmStart, TakesOverWhatTheContactOfTheKeyHas) {
  ContactStore old = store_of({20, 10}, 2);
  old.h = 2e-3;
  old.impulse = {1, 2, 3, 4, 5, 6};
  old.lasting = {1, 4};
  old.bristle = {0.1, 0.2, 0.3, 0.4};
  old.dwell = {7, 8};
  old.law = {0, 1};
  const Warm now(old, {contact_of(10), contact_of(15), contact_of(20)}, 1e-3, 3, {1, 1, 1});
  EXPECT_EQ(now.match, (std::vector<uint32_t>{1, kNone, 0}));
  expect_near(now.impulse(0), {2, 2.5, 3}, 0);
  expect_near(now.impulse(1), {}, 0);
  expect_near(now.impulse(2), {0.5, 1, 1.5}, 0);
  const double bristles[3][3] = {{0.3, 0.4, 0}, {0, 0, 0}, {0, 0, 0}};  // the last: of another law
  for (uint32_t i = 0; i < 3; ++i)
    for (uint32_t s = 0; s < 3; ++s) EXPECT_EQ(now.bristle(i, s), bristles[i][s]) << i << " " << s;
  EXPECT_EQ(now.state.dwell[0], 8);
  EXPECT_EQ(now.state.dwell[1], 0);
  EXPECT_EQ(now.state.dwell[2], 7);
  expect_near(load3(&now.tangents[0]), {1, 0, 0}, 0);
}

TEST(WarmStart, OfAContactThatTurnedOver_StartsAgain) {
  ContactStore old = store_of({10}, 1);
  old.h = 1e-3;
  old.impulse = {1, 2, 3};
  old.lasting = {1};
  old.bristle = {0.5};
  old.dwell = {7};
  const Warm now(old, {contact_of(10, {0, 0, -1})}, 1e-3, 1, {0});
  EXPECT_EQ(now.match[0], kNone);
  expect_near(now.impulse(0), {}, 0);
  EXPECT_EQ(now.bristle(0, 0), 0);
  EXPECT_EQ(now.state.dwell[0], 0);
}

// What sleeps stays as it is: all columns that are carried have the same values sub-step after sub-step,
// whatever the contacts of other bodies do in front of them.
TEST(Store, OfSleepers_StaysAsItIsBesideContactsThatMove) {
  const test::Context c;
  const dfm_world w = two_boxes(c, true, true);
  const World &world = inside(w);
  test::run(w, kStep, kStep);
  test::ok(dfm_world_hold_begin(w));
  for (int i = 0; i < 200 && world.sleepers == 0; ++i) test::run(w, kStep, kStep);
  ASSERT_EQ(world.sleepers, 1u);
  ASSERT_GT(world.store.nstate, 0u);
  const uint64_t sleeper = world.bodies[0]->id;
  const auto rows = [&] {
    std::map<uint64_t, std::vector<double>> out;
    const ContactStore &s = world.store;
    for (uint32_t i = 0; i < s.n; ++i) {
      if (s.id_a[i] != sleeper) continue;
      each_column(
          [&](const ContactColumn &column, const auto &values) {
            if constexpr (std::is_arithmetic_v<std::remove_cvref_t<decltype(values[0])>>) {
              if (!column.carried || column.width == kOwnLength) return;
              const size_t width = column.width == kPerState ? s.nstate : column.width;
              for (size_t k = 0; k < width; ++k) out[s.key[i]].push_back(double(values[i * width + k]));
            }
          },
          s);
    }
    return out;
  };
  test::run(w, kStep, kStep);
  const auto before = rows();
  const auto hash = dfm_world_hash(w);
  ASSERT_GT(before.size(), 3u);
  ASSERT_GT(world.store.n, before.size()) << "the other one has contacts, too";
  for (int i = 0; i < 20; ++i) {
    test::run(w, kStep, kStep);
    ASSERT_EQ(world.sleepers, 1u);
    const auto now = rows();
    ASSERT_EQ(now.size(), before.size());
    // impulses belong to the length of a sub-step, which is a part of the step up to rounding
    for (const auto &[key, row] : before)
      for (size_t k = 0; k < row.size(); ++k)
        EXPECT_NEAR(now.at(key).at(k), row[k], 1e-14 * std::fabs(row[k])) << i << ", " << k;
    expect_whole(world.store);
  }
  EXPECT_NE(dfm_world_hash(w), hash) << "the other one moves";
}

// The sub-step in which a second box lands, with one allocation after the other refused: a step that fails
// leaves every column as it was, those too that neither hash nor snapshot hold.
TEST(Store, WithoutMemoryForNewContacts_StaysWhole) {
  dfm_context_def d = test::refusing_context();
  d.plugin_dir = DEFORM_PLUGIN_DIR;
  dfm_context *c = nullptr;
  test::ok(dfm_context_create(&d, &c));
  const auto landing = [&] {
    const dfm_world w = two_boxes(c, false, false);
    test::run(w, kStep, kStep);
    const uint32_t start = inside(w).store.n;
    int steps = 1;
    for (; steps < 50 && inside(w).store.n == start; ++steps) test::run(w, kStep, kStep);
    test::ok(dfm_world_destroy(w));
    return steps;
  }();
  ASSERT_LT(landing, 50);
  int refused = 0;
  bool came = true;
  for (int64_t n = 0; came && n < 500; ++n) {
    const dfm_world w = two_boxes(c, false, false);
    for (int i = 1; i < landing; ++i) test::run(w, kStep, kStep);
    const World &world = inside(w);
    const std::vector<std::string> before = all_of(world);
    const uint32_t contacts = world.store.n;
    ASSERT_GT(contacts, 0u);
    Refusal::arm(n);
    const dfm_status status = dfm_world_step(w, kStep, nullptr);
    came = Refusal::disarm();
    if (status != DFM_OK) {
      ++refused;
      EXPECT_EQ(status, DFM_E_NOMEM) << n;
      EXPECT_EQ(all_of(world), before) << "allocation " << n;
      test::ok(dfm_world_step(w, kStep, nullptr));
    }
    EXPECT_GT(world.store.n, contacts);
    expect_whole(world.store);
    test::ok(dfm_world_destroy(w));
  }
  EXPECT_FALSE(came);
  EXPECT_GT(refused, 10);
  dfm_context_destroy(c);
}
