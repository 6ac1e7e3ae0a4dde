// What the window makes of packets (bindings/live/received.h): the library's surfaces in whatever order and
// number they come, and nothing broken where they are lost or are no packets at all.
#include "live/received.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <deque>
#include <map>
#include <random>
#include <utility>

#include "coupled.h"
#include "stack.h"

namespace {

using Packet = std::vector<unsigned char>;

std::vector<Packet> stream(dfm_world w, uint32_t kind, uint32_t frame, uint32_t flags = 0, dfm_body body = 0,
                           uint32_t packet = 300) {
  dfm_stream_def d = dfm_stream_def_default();
  d.kind = kind;
  d.flags = flags;
  d.packet = packet;
  d.frame = frame;
  d.body = body;
  size_t n = 0;
  test::ok(dfm_world_stream(w, &d, nullptr, &n));
  Packet all(n);
  test::ok(dfm_world_stream(w, &d, all.data(), &n));
  std::vector<Packet> out;
  for (size_t at = 0; at < n; at += out.back().size()) {
    uint32_t size = 0;
    std::copy_n(&all[at + 16], 4, reinterpret_cast<unsigned char *>(&size));
    out.emplace_back(all.begin() + long(at), all.begin() + long(at + size));
  }
  return out;
}

bool read(live::Received &r, const std::vector<Packet> &packets) {
  return std::ranges::all_of(packets, [&](const Packet &p) { return r.read(p.data(), p.size()); });
}

// Of a body, as LIST tells it; 0: none does.
uint32_t shape_in(const std::vector<Packet> &frame, uint32_t body) {
  for (const Packet &p : frame)
    for (size_t at = 32, size = 0; at < p.size(); at += 8 + size) {
      const auto word = [&](size_t i) {
        uint32_t x = 0;
        std::memcpy(&x, &p[i], sizeof x);
        return x;
      };
      size = word(at + 4);
      for (size_t i = at + 12; std::memcmp(&p[at], "LIST", 4) == 0 && i < at + 8 + size; i += 8)
        if (word(i) == body) return word(i + 4);
    }
  return 0;
}

void compare(const live::Received &r, dfm_body b, double within) {
  SCOPED_TRACE(testing::Message() << "body " << uint32_t(b));
  ASSERT_TRUE(r.present(uint32_t(b)));
  const live::Received::Mesh *const m = r.meshes().at(uint32_t(b)).drawn();
  ASSERT_TRUE(m);
  const std::vector<double> x = test::surface_positions(b);
  uint32_t nt = 0;
  test::ok(dfm_surface_triangles(b, 0, nullptr, &nt));
  std::vector<uint32_t> tri(3 * size_t{nt});
  test::ok(dfm_surface_triangles(b, nt, tri.data(), &nt));
  EXPECT_EQ(m->triangles, tri);
  ASSERT_EQ(m->x.size(), x.size());
  for (size_t i = 0; i < x.size(); ++i) ASSERT_NEAR(m->x[i], x[i], within);
}

// Whatever has come: what is drawn is whole.
void check(const live::Received &r) {
  for (const auto &[number, body] : r.meshes()) {
    const live::Received::Mesh *const m = body.drawn();
    if (!m) continue;
    ASSERT_TRUE(std::ranges::all_of(m->x, [](double x) { return std::isfinite(x); }));
    for (const uint32_t corner : m->triangles) ASSERT_LT(corner, m->x.size() / 3);
  }
}

// m: rounding of a place to a float, and half a step of displacements, which differ by less than 1 cm.
constexpr double kWithin = 3e-7 + 0.01 / 131070;

TEST(Received, PacketsInAnyOrderAndTwice_AreWhatTheLibraryHas) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  test::run(s.world, 30e-3, 1e-3);
  std::mt19937 dice(1);
  for (const uint32_t flags : {0u, uint32_t{DFM_STREAM_FLOAT32 | DFM_STREAM_CONTACTS}}) {
    std::vector<Packet> scene = stream(s.world, DFM_STREAM_SCENE, 7);
    std::vector<Packet> frame = stream(s.world, DFM_STREAM_FRAME, 7, flags);
    live::Received r;
    for (int i = 0; i < 8; ++i) {  // a range is passed over until its body is known
      std::ranges::shuffle(scene, dice);
      std::ranges::shuffle(frame, dice);
      EXPECT_TRUE(read(r, scene));
      EXPECT_TRUE(read(r, frame));
      check(r);
    }
    compare(r, s.upper, kWithin);
    compare(r, s.lower, kWithin);
    EXPECT_EQ(r.meshes().at(uint32_t(s.floor)).name, "floor");
    live::Received once;
    EXPECT_TRUE(read(once, frame));
    EXPECT_EQ(r.contacts().size(), once.contacts().size());
    EXPECT_EQ(r.contacts().empty(), !(flags & DFM_STREAM_CONTACTS));
    EXPECT_EQ(r.frame(), 7u);
    test::run(s.world, 5e-3, 1e-3);
  }
}

TEST(Received, OlderFrame_IsPassedOver) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  const std::vector<Packet> before = stream(s.world, DFM_STREAM_FRAME, 0xffffffff);
  test::run(s.world, 30e-3, 1e-3);
  live::Received r;
  EXPECT_TRUE(read(r, stream(s.world, DFM_STREAM_SCENE, 0)));
  EXPECT_TRUE(read(r, before));
  EXPECT_TRUE(read(r, stream(s.world, DFM_STREAM_FRAME, 0)));
  const double time = r.time();
  EXPECT_TRUE(read(r, before));
  EXPECT_EQ(r.time(), time);
  compare(r, s.upper, kWithin);
}

TEST(Received, CutBody_IsDrawnAsItWasUntilTheNewOneIsComplete) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  live::Received r;
  EXPECT_TRUE(read(r, stream(s.world, DFM_STREAM_SCENE, 0)));
  EXPECT_TRUE(read(r, stream(s.world, DFM_STREAM_FRAME, 0)));
  const size_t before = r.meshes().at(uint32_t(s.upper)).drawn()->triangles.size();
  test::split_upper(s);
  std::vector<Packet> scene = stream(s.world, DFM_STREAM_SCENE, 1, 0, s.upper);
  const Packet last = scene.back();
  scene.pop_back();
  EXPECT_TRUE(read(r, scene));
  EXPECT_TRUE(read(r, stream(s.world, DFM_STREAM_FRAME, 1)));
  ASSERT_TRUE(r.meshes().at(uint32_t(s.upper)).drawn());
  EXPECT_EQ(r.meshes().at(uint32_t(s.upper)).drawn()->triangles.size(), before);
  EXPECT_TRUE(r.read(last.data(), last.size()));
  EXPECT_TRUE(read(r, stream(s.world, DFM_STREAM_FRAME, 2)));
  compare(r, s.upper, kWithin);
  compare(r, s.lower, kWithin);
}

// The second sphere gets the number of the first one.
TEST(Received, ThingsThatAreAddedAndRemoved_AreSeenSo) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  live::Received r;
  EXPECT_TRUE(read(r, stream(s.world, DFM_STREAM_SCENE, 0)));
  EXPECT_TRUE(read(r, stream(s.world, DFM_STREAM_FRAME, 0)));
  uint32_t frame = 0, number = 0;
  for (const double radius : {0.1, 0.2}) {
    dfm_obstacle_def d = dfm_obstacle_def_default();
    d.shape = DFM_SHAPE_SPHERE;
    d.radius = radius;
    d.pose.position[0] = 3;
    dfm_obstacle sphere = 0;
    test::ok(dfm_obstacle_create(s.world, &d, &sphere));
    EXPECT_TRUE(number == 0 || number == uint32_t(sphere));
    number = uint32_t(sphere);
    const std::vector<Packet> now = stream(s.world, DFM_STREAM_FRAME, ++frame);
    EXPECT_EQ(shape_in(now, number), uint32_t(sphere >> 32)) << "frames tell of it";
    EXPECT_TRUE(read(r, stream(s.world, DFM_STREAM_SCENE, frame, 0, sphere)));
    EXPECT_TRUE(read(r, now));
    EXPECT_TRUE(r.present(number));
    EXPECT_EQ(r.meshes().at(number).kind, uint32_t{DFM_SHAPE_SPHERE});
    EXPECT_EQ(r.meshes().at(number).radius, float(radius));
    EXPECT_EQ(r.meshes().at(number).position[0], 3);
    EXPECT_EQ(r.meshes().at(uint32_t(s.floor)).name, "floor");
    test::ok(dfm_obstacle_destroy(sphere));
    EXPECT_TRUE(read(r, stream(s.world, DFM_STREAM_FRAME, ++frame)));
    EXPECT_FALSE(r.present(number));
  }
  EXPECT_TRUE(read(r, stream(s.world, DFM_STREAM_FRAME, ++frame)));
  EXPECT_EQ(r.meshes().size(), 3u);
  compare(r, s.upper, kWithin);
}

using Words = std::vector<uint32_t>;

// With one chunk.
Packet packet(const char *tag, const Words &words, uint32_t frame = 0) {
  const auto n = uint32_t(4 * words.size()), size = 40 + n, one = 1u;
  Packet p(size);
  std::memcpy(&p[0], "DFMS\x01", 5);
  p[5] = std::strcmp(tag, "LIST") == 0 || std::strcmp(tag, "POSE") == 0 || std::strcmp(tag, "SURF") == 0;
  std::memcpy(&p[8], &one, 4);
  std::memcpy(&p[16], &size, 4);
  std::memcpy(&p[20], &frame, 4);
  std::memcpy(&p[32], tag, 4);
  std::memcpy(&p[36], &n, 4);
  std::memcpy(&p[40], words.data(), n);
  return p;
}

// A triangle, and a sphere.
std::vector<Packet> body(uint32_t number, uint32_t shape, uint32_t frame) {
  return {packet("BODY", {number, shape, 3, 1, 0}, frame),
          packet("TRIS", {number, shape, 0, 1, 0, 1, 2}, frame),
          packet("BASE", {number, shape, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0}, frame),
          packet("SURF", {number, shape, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, frame)};
}
std::vector<Packet> sphere(uint32_t number, uint32_t shape, uint32_t frame) {
  return {packet("OBST", {number, shape, 0, 0, 1, 0x3f800000, 0, 0, 0, 0, 0}, frame),
          packet("POSE", {number, 0, 0, 0, 0, 0, 0, 0x3f800000}, frame)};
}

TEST(Received, NumberThatAnotherThingGets_IsThatOneAlone) {
  live::Received r;
  for (uint32_t frame = 0; frame < 6; ++frame) {
    const bool rigid = frame % 2 == 1;
    EXPECT_TRUE(read(r, rigid ? sphere(7, 1, frame) : body(7, 1, frame)));
    EXPECT_TRUE(read(r, {packet("LIST", {1, 7, 1}, frame)}));
    ASSERT_EQ(r.meshes().size(), 1u);
    EXPECT_EQ(r.meshes().at(7).rigid, rigid);
    EXPECT_EQ(r.meshes().at(7).drawn(), &r.meshes().at(7));
    EXPECT_TRUE(r.present(7));
  }
  EXPECT_TRUE(read(r, body(7, 1, 2)));  // late
  EXPECT_TRUE(r.meshes().at(7).rigid);
}

TEST(Received, ListOfWhichAPartIsLost_HidesNothing) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  std::vector<uint32_t> numbers;
  for (int i = 0; i < 300; ++i) {
    dfm_obstacle_def d = dfm_obstacle_def_default();
    d.shape = DFM_SHAPE_SPHERE;
    d.radius = 0.01;
    d.pose.position[0] = 3 + i;
    dfm_obstacle sphere = 0;
    test::ok(dfm_obstacle_create(s.world, &d, &sphere));
    numbers.push_back(uint32_t(sphere));
  }
  live::Received r;
  const auto there = [&] { return std::ranges::count_if(numbers, [&](uint32_t n) { return r.present(n); }); };
  EXPECT_TRUE(read(r, stream(s.world, DFM_STREAM_SCENE, 0)));
  EXPECT_TRUE(read(r, stream(s.world, DFM_STREAM_FRAME, 0, 0, 0, 1188)));
  EXPECT_EQ(there(), 300);
  std::vector<Packet> frame = stream(s.world, DFM_STREAM_FRAME, 1, 0, 0, 1188);
  const Packet second = frame[1];
  EXPECT_EQ(std::memcmp(&second[32], "LIST", 4), 0);
  frame.erase(frame.begin() + 1);
  EXPECT_TRUE(read(r, frame));
  EXPECT_EQ(there(), 300);
  // what is taken away is gone where the list has come as a whole, in any order
  for (const dfm_obstacle o : test::listed(dfm_world_obstacles, s.world))
    if (std::ranges::count(std::vector(numbers.begin(), numbers.begin() + 100), uint32_t(o)))
      test::ok(dfm_obstacle_destroy(o));
  frame = stream(s.world, DFM_STREAM_FRAME, 2, 0, 0, 1188);
  EXPECT_TRUE(read(r, {frame[1], frame[1]}));
  EXPECT_EQ(there(), 300);
  EXPECT_TRUE(read(r, {frame[0]}));
  EXPECT_EQ(there(), 200);
  EXPECT_EQ(r.meshes().size(), 203u);
  for (const dfm_obstacle o : test::listed(dfm_world_obstacles, s.world)) test::ok(dfm_obstacle_destroy(o));
  for (const dfm_body b : test::listed(dfm_world_bodies, s.world)) test::ok(dfm_body_destroy(b));
  EXPECT_TRUE(read(r, stream(s.world, DFM_STREAM_FRAME, 3, 0, 0, 1188)));
  EXPECT_EQ(r.meshes().size(), 0u) << "of nothing, too, there is a list";
}

TEST(Received, FrameWithoutATime_IsPassedOver) {
  live::Received r;
  EXPECT_TRUE(read(r, body(7, 1, 0)));
  EXPECT_TRUE(read(r, {packet("LIST", {1, 7, 1}, 0)}));
  Packet bad = packet("LIST", {0}, 1);
  const double never = std::nan("");
  std::memcpy(&bad[24], &never, sizeof never);
  EXPECT_TRUE(read(r, {bad}));
  EXPECT_EQ(r.time(), 0);
  EXPECT_TRUE(r.present(7));
}

// A late scene does not take what is newer; an obstacle is nowhere before it has a place.
TEST(Received, OlderScene_ForgetsNothingNewer) {
  live::Received r;
  Packet all = packet("BODY", {1, 1, 0, 0, 0}, 5);
  all[6] = 1;
  EXPECT_TRUE(read(r, {all}));
  EXPECT_TRUE(read(r, {packet("OBST", {2, 1, 0, 0, 1, 0x3f800000, 0, 0, 0, 0, 0}, 6)}));
  EXPECT_FALSE(r.meshes().at(2).drawn());
  EXPECT_TRUE(read(r, {packet("POSE", {2, 0, 0, 0, 0, 0, 0, 0x3f800000}, 6), all}));
  ASSERT_TRUE(r.meshes().contains(2));
  EXPECT_TRUE(r.meshes().at(2).drawn());
}

TEST(Received, ChunkThatIsNotOfFourBytes_EndsItsPacket) {
  live::Received r;
  Packet p = packet("BODY", {1, 1, 0, 0, 0});
  const uint32_t odd = 19;
  std::memcpy(&p[36], &odd, 4);
  const Packet more = packet("BODY", {2, 1, 0, 0, 0});
  p.insert(p.end() - 1, more.begin() + 32, more.end());
  const auto size = uint32_t(p.size());
  std::memcpy(&p[16], &size, 4);
  EXPECT_TRUE(read(r, {p}));
  EXPECT_TRUE(r.meshes().empty());
}

// Bodies of nothing, and long names; what is cut, whole again and removed, more often than would fit at once.
TEST(Received, WhatIsReportedAgainAndAgain_TakesNoMoreMemory) {
  live::Received r;
  Words named = {1, 0, 0, 0, 10000};
  named.resize(5 + 2500, 0x61616161);
  EXPECT_TRUE(read(r, {packet("BODY", named)}));
  EXPECT_EQ(r.meshes().at(1).name.size(), 100u);
  for (uint32_t shape = 1; shape < 200000; ++shape) {
    EXPECT_TRUE(read(r, {packet("BODY", {1, shape, 0, 0, 0})}));
    ASSERT_EQ(r.meshes().at(1).shape, shape);
  }
  for (uint32_t i = 0; i < 70000; ++i) {
    for (const uint32_t shape : {2 * i, 2 * i + 1}) {
      ASSERT_TRUE(read(r, body(2, shape, 2 * i)));
      ASSERT_EQ(r.meshes().at(2).shape, shape);
      ASSERT_EQ(r.meshes().at(2).drawn(), &r.meshes().at(2));
      ASSERT_FALSE(r.meshes().at(2).before);
    }
    ASSERT_TRUE(read(r, {packet("LIST", {0}, 2 * i + 1)}));
    ASSERT_TRUE(r.meshes().empty());
  }
}

TEST(Received, NameThatIsLongerThanItsChunk_EndsWithIt) {
  live::Received r;
  EXPECT_TRUE(read(r, {packet("BODY", {1, 0, 0, 0, 9, 0x61616161})}));
  EXPECT_EQ(r.meshes().at(1).name, "aaaa");
}

// Of more than half of what a window keeps: it is not drawn while the new one comes.
TEST(Received, LargestBodyThatIsCut_IsTheNewOne) {
  const uint32_t n = 2200000;
  live::Received r;
  Words base = {7, 1, 0, n}, moved = {7, 1, 0, n, 1};
  base.resize(4 + 3 * size_t{n});
  moved.resize(5 + 3 * size_t{n});
  EXPECT_TRUE(read(r, {packet("BODY", {7, 1, n, 0, 0}), packet("BASE", base), packet("SURF", moved)}));
  ASSERT_TRUE(r.meshes().at(7).drawn());
  EXPECT_TRUE(read(r, {packet("BODY", {7, 2, n, 0, 0}, 1)}));
  EXPECT_EQ(r.meshes().at(7).shape, 2u);
  EXPECT_FALSE(r.meshes().at(7).drawn());
  EXPECT_TRUE(read(r, sphere(7, 3, 2)));
  EXPECT_TRUE(r.meshes().at(7).rigid);
  EXPECT_TRUE(read(r, {packet("BODY", {8, 1, (1u << 22) - 128, 0, 0}, 2)}));
  EXPECT_TRUE(r.meshes().contains(8)) << "of what is gone, nothing counts";
  EXPECT_TRUE(read(r, {packet("BODY", {9, 1, 0, 0, 0}, 2)}));
  EXPECT_FALSE(r.meshes().contains(9)) << "no more than that";
}

// A few bytes say that the largest surface of all comes.
TEST(Received, WhatIsAnnounced_TakesNoMemoryBeforeItComes) {
  const uint32_t most = (1u << 21) - 64;
  live::Received r;
  EXPECT_TRUE(read(r, {packet("BODY", {7, 1, most, most, 0})}));
  const live::Received::Mesh &m = r.meshes().at(7);
  EXPECT_EQ(m.points, most);
  for (uint32_t i = 1; i <= 100; ++i)
    EXPECT_TRUE(read(
        r, {packet("BASE", {7, 1, most - i, 1, 0, 0, 0}), packet("SURF", {7, 1, most - i, 1, 1, 0, 0, 0}),
            packet("TRIS", {7, 1, most - i, 1, 0, 1, 2})}));
  EXPECT_EQ(m.base.capacity() + m.moved.capacity() + m.x.capacity() + m.triangles.capacity(), 0u);
  EXPECT_LE(m.waiting.capacity(), 4u * 100 * 3 * 48);
  EXPECT_FALSE(m.drawn());
}

// soak: the frames of ten minutes at 30 Hz, sent as `deform run --stream` does: everything again and again,
// at once what a cut changes. 5 % are lost, 2 % come twice, 5 % come with the next frame. A point is nowhere
// where it never was, and in a frame that came as a whole all are where they are now.
TEST(Received, TenMinutesOfLoss_LeaveNoMoreThanOlderPoints) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  size_t n = 0;
  test::ok(dfm_world_snapshot(s.world, nullptr, &n));
  std::vector<char> first(n);
  test::ok(dfm_world_snapshot(s.world, first.data(), &n));
  std::mt19937 dice(3);
  const auto chance = [&](double share) { return std::uniform_real_distribution<>(0, 1)(dice) < share; };
  live::Received r;
  std::map<uint32_t, uint32_t> shapes;
  std::map<uint32_t, std::deque<std::vector<double>>> places;  // of the last frames with these triangles
  std::map<uint32_t, double> ranges;                           // m, of displacements since then
  std::vector<Packet> late;
  size_t cuts = 0, packets = 0, lost = 0, points = 0, newest = 0, oldest = 0, waits = 0;
  for (uint32_t frame = 0; frame < 600 * 30; ++frame) {
    test::run(s.world, 2e-3, 2e-3);
    if (frame % 60 == 30) {
      dfm_cut_def cut = dfm_cut_def_default();
      cut.shape = DFM_CUT_PLANE;
      cut.how = DFM_CUT_SPLIT;
      const dfm_body body = frame % 120 == 30 ? s.upper : s.lower;
      dfm_body_measure m = {};
      m.size = sizeof m;
      test::ok(dfm_body_get_measure(body, &m));
      std::copy_n(m.com, 3, cut.blade);
      for (int k = 3; k < 6; ++k) cut.blade[k] = std::uniform_real_distribution<>(-1, 1)(dice);
      test::ok(dfm_body_cut(body, &cut, nullptr));
      ++cuts;
    }
    if (frame % 300 == 299) test::ok(dfm_world_restore(s.world, first.data(), first.size()));
    std::vector<Packet> sent = stream(s.world, DFM_STREAM_FRAME, frame, 0, 0, 1188);
    std::vector<Packet> way = std::exchange(late, {});
    const auto add = [&](const std::vector<Packet> &more) {
      sent.insert(sent.begin(), more.begin(), more.end());
    };
    for (const dfm_body body : test::listed(dfm_world_bodies, s.world)) {
      const uint32_t shape = shape_in(sent, uint32_t(body));
      if (shapes[uint32_t(body)] == shape) continue;
      shapes[uint32_t(body)] = shape;
      places[uint32_t(body)].clear();
      ranges[uint32_t(body)] = 0;
      add(stream(s.world, DFM_STREAM_SCENE, frame, 0, body, 1188));
    }
    if (frame % 18 == 0) add(stream(s.world, DFM_STREAM_SCENE, frame, 0, 0, 1188));
    bool whole = true;
    for (const Packet &p : sent) {
      ++packets;
      const bool gone = chance(0.05);
      lost += gone;
      whole = whole && !gone;
      if (gone) continue;
      for (int k = chance(0.02) ? 2 : 1; k > 0; --k) (chance(0.05) ? late : way).push_back(p);
    }
    whole = whole && late.empty();
    std::ranges::shuffle(way, dice);
    EXPECT_TRUE(read(r, way));
    check(r);
    for (const dfm_body body : test::listed(dfm_world_bodies, s.world)) {
      const uint32_t number = uint32_t(body);
      std::deque<std::vector<double>> &ages = places[number];
      ages.push_front(test::surface_positions(body));
      if (ages.size() > 20) ages.pop_back();
      const auto found = r.meshes().find(number);
      const live::Received::Mesh *const m = found == r.meshes().end() ? nullptr : &found->second;
      if (!m || m->missing || m->shape != shapes[number]) {  // it is told again
        ++waits;
        continue;
      }
      ASSERT_EQ(m->x.size(), ages.front().size());
      const auto [low, high] = std::ranges::minmax(m->moved);
      ranges[number] = std::max(ranges[number], high - low);
      const double within = 3e-7 + ranges[number] / 131070;
      for (size_t i = 0; i < m->x.size(); i += 3) {
        size_t age = 0;
        const auto differs = [&](size_t k) { return std::fabs(m->x[i + k] - ages[age][i + k]) > within; };
        while (age < ages.size() && (differs(0) || differs(1) || differs(2))) ++age;
        ASSERT_LT(age, ages.size()) << "frame " << frame << ": a place that the point never had";
        if (whole) {
          ASSERT_EQ(age, 0u) << "frame " << frame;
        }
        ++points;
        newest += age == 0;
        oldest = std::max(oldest, age);
      }
    }
  }
  std::printf(
      "%zu packets, %zu lost; %zu cuts; %.1f %% of points are the newest, the oldest is of %zu frames "
      "before; bodies waited for triangles in %zu of 36,000 cases\n",
      packets, lost, cuts, 100.0 * double(newest) / double(points), oldest, waits);
  EXPECT_GT(cuts, 250u);
  EXPECT_LE(oldest, 4u);
  EXPECT_GT(double(newest), 0.85 * double(points));
}

// A million: what a network or an enemy can send.
TEST(Received, MalformedPackets_HarmNothing) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  test::run(s.world, 10e-3, 1e-3);
  std::vector<Packet> good = stream(s.world, DFM_STREAM_SCENE, 0);
  for (const Packet &p : stream(s.world, DFM_STREAM_FRAME, 0, DFM_STREAM_CONTACTS)) good.push_back(p);
  std::mt19937 dice(2);
  const auto below = [&](size_t n) { return size_t{dice()} % n; };
  std::unique_ptr<live::Received> r;
  for (int i = 0; i < 1000000; ++i) {
    if (i % 100 == 0) {  // or all is older than the frame of a wrong number
      if (r) check(*r);
      r = std::make_unique<live::Received>();
      EXPECT_TRUE(read(*r, good));
    }
    Packet p = good[below(good.size())];
    for (size_t k = below(4); k > 0; --k) {
      const size_t at = below(p.size());
      if (below(2)) p[at] = static_cast<unsigned char>(dice());
      else  // a number of a head
        for (size_t b = at / 4 * 4; b < std::min(p.size(), at / 4 * 4 + 4); ++b) p[b] = below(2) ? 0xff : 0;
    }
    if (below(8) == 0) p.resize(below(p.size()));
    r->read(p.data(), p.size());
  }
  r = std::make_unique<live::Received>();  // as if nothing had been
  EXPECT_TRUE(read(*r, good));
  compare(*r, s.upper, kWithin);
}

}  // namespace
