// deform/stream.h: what packets say is what the library has, in every size of packets, and whatever is cut.
#include <cmath>
#include <cstring>
#include <map>
#include <random>

#include "cut_scenes.h"
#include "stack.h"

namespace {

using Bytes = std::vector<unsigned char>;

Bytes stream(dfm_world w, uint32_t kind, uint32_t flags = 0, uint32_t packet = 0, dfm_body body = 0) {
  dfm_stream_def d = dfm_stream_def_default();
  d.kind = kind;
  d.flags = flags;
  d.packet = packet;
  d.frame = 7;
  d.body = body;
  size_t n = 0;
  test::ok(dfm_world_stream(w, &d, nullptr, &n));
  Bytes out(n);
  test::ok(dfm_world_stream(w, &d, out.data(), &n));
  EXPECT_EQ(n, out.size());
  return out;
}

template <class T>
T at(const Bytes &b, size_t i) {
  T x;
  std::memcpy(&x, &b.at(i + sizeof x - 1) - (sizeof x - 1), sizeof x);
  return x;
}

// What a viewer has after these packets.
struct Viewer {
  struct Mesh {
    uint32_t shape = 0;
    std::string name;
    std::vector<double> base, moved, step;
    std::vector<uint32_t> tri;
    size_t missing = 0;
  };
  std::map<uint32_t, Mesh> meshes;
  std::map<uint32_t, uint32_t> present;
  std::map<uint32_t, std::vector<float>> poses;
  std::vector<std::vector<float>> contacts;
  size_t packets = 0, longest = 0, listed = 0;

  void read(const Bytes &b) {
    size_t n = 0;
    for (size_t i = 0; i < b.size(); ++n) {
      ASSERT_EQ(std::memcmp(&b[i], "DFMS\x01", 5), 0);
      const uint32_t size = at<uint32_t>(b, i + 16);
      ASSERT_EQ(at<uint32_t>(b, i + 12), n) << "its place among the packets";
      ASSERT_EQ(at<uint32_t>(b, i + 20), 7u);
      longest = std::max<size_t>(longest, size);
      for (size_t c = i + 32; c < i + size;) {
        const uint32_t bytes = at<uint32_t>(b, c + 4);
        chunk(std::string(b.begin() + long(c), b.begin() + long(c) + 4),
              Bytes(b.begin() + long(c) + 8, b.begin() + long(c) + 8 + bytes));
        c += 8 + bytes;
      }
      i += size;
    }
    packets = n;
    for (size_t i = 0, k = 0; k < n; ++k, i += at<uint32_t>(b, i + 16)) EXPECT_EQ(at<uint32_t>(b, i + 8), n);
  }

  void chunk(const std::string &tag, const Bytes &c) {
    const auto u = [&](size_t k) { return at<uint32_t>(c, 4 * k); };
    const auto f = [&](size_t k) { return at<float>(c, 4 * k); };
    if (tag == "BODY" || tag == "OBST") {
      Mesh m;
      m.shape = u(1);
      const size_t letters = tag == "BODY" ? 4 : 10;
      m.name.assign(c.begin() + 4 * long(letters) + 4, c.begin() + 4 * long(letters) + 4 + u(letters));
      m.base.assign(3 * size_t{u(2)}, NAN);
      m.moved.assign(m.base.size(), 0);
      m.step.assign(m.base.size(), 0);
      m.tri.assign(3 * size_t{u(3)}, UINT32_MAX);
      m.missing = m.base.size() + m.tri.size();
      meshes[u(0)] = m;
    } else if (tag == "BASE" || tag == "TRIS") {
      Mesh &m = meshes.at(u(0));
      ASSERT_EQ(m.shape, u(1));
      for (size_t i = 0; i < 3 * size_t{u(3)}; ++i) {
        if (tag == "BASE") m.base.at(3 * size_t{u(2)} + i) = double{f(4 + i)};
        else m.tri.at(3 * size_t{u(2)} + i) = u(4 + i);
      }
      m.missing -= 3 * size_t{u(3)};
    } else if (tag == "LIST") {
      listed = u(0);
      for (size_t i = 0; i < c.size() / 8; ++i) present[u(2 * i + 1)] = u(2 * i + 2);
    } else if (tag == "POSE") {
      for (size_t i = 0; i < c.size() / 32; ++i)
        for (size_t k = 1; k < 8; ++k) poses[u(8 * i)].push_back(f(8 * i + k));
    } else if (tag == "SURF") {
      Mesh &m = meshes.at(u(0));
      ASSERT_EQ(m.shape, u(1));
      for (size_t i = 0; i < 3 * size_t{u(3)}; ++i) {
        const size_t to = 3 * size_t{u(2)} + i;
        if (u(4)) {
          m.moved.at(to) = double{f(5 + i)};
        } else {
          m.step.at(to) = double{f(8 + i % 3)};
          m.moved.at(to) = double{f(5 + i % 3)} + m.step[to] * at<uint16_t>(c, 48 + 2 * i);
        }
      }
    } else if (tag == "CONT") {
      for (size_t i = 0; i < c.size() / 28; ++i) {
        contacts.push_back({});
        for (size_t k = 0; k < 6; ++k) contacts.back().push_back(f(7 * i + k));
        contacts.back().push_back(float(u(7 * i + 6)));
      }
    }
  }

  // Of a body, against the library.
  void compare(dfm_body b) const {
    const Mesh &m = meshes.at(uint32_t(b));
    EXPECT_EQ(m.missing, 0u);
    EXPECT_EQ(present.at(uint32_t(b)), m.shape);
    uint32_t n = 0, nt = 0;
    test::ok(dfm_surface_positions(b, 0, nullptr, &n));
    std::vector<double> x(3 * size_t{n});
    test::ok(dfm_surface_positions(b, n, x.data(), &n));
    test::ok(dfm_surface_triangles(b, 0, nullptr, &nt));
    std::vector<uint32_t> tri(3 * size_t{nt});
    test::ok(dfm_surface_triangles(b, nt, tri.data(), &nt));
    EXPECT_EQ(m.tri, tri);
    ASSERT_EQ(m.base.size(), x.size());
    for (size_t i = 0; i < x.size(); ++i)
      ASSERT_NEAR(m.base[i] + m.moved[i], x[i], 0.5 * m.step[i] + 2e-7 * (1 + std::fabs(x[i]))) << i;
  }
};

TEST(Stream, SaysWhatTheLibraryHas_InPacketsOfAnySize) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  test::run(s.world, 30e-3, 1e-3);
  for (const uint32_t packet : {0u, 256u, 258u, 259u, 301u, 1188u, 65536u})
    for (const uint32_t flags : {0u, uint32_t{DFM_STREAM_FLOAT32}, uint32_t{DFM_STREAM_CONTACTS}}) {
      SCOPED_TRACE(testing::Message() << "packets of " << packet << ", flags " << flags);
      Viewer v;
      v.read(stream(s.world, DFM_STREAM_SCENE, 0, packet));
      v.read(stream(s.world, DFM_STREAM_FRAME, flags, packet));
      if (packet) EXPECT_LE(v.longest, packet);
      else EXPECT_EQ(v.packets, 1u);
      EXPECT_EQ(v.listed, v.present.size());
      v.compare(s.lower);
      v.compare(s.upper);
      EXPECT_EQ(v.meshes.at(uint32_t(s.floor)).name, "floor");
      EXPECT_EQ(v.poses.at(uint32_t(s.floor)), (std::vector<float>{0, 0, 0, 0, 0, 0, 1}));
      if (!(flags & DFM_STREAM_CONTACTS)) continue;
      // the floor carries what the contact list says
      double given = 0, sent = 0;
      for (const dfm_contact &k : test::listed(dfm_world_contacts, s.world))
        given += k.fn * k.normal[2] + k.ft[0] * k.tangent[2] +
                 k.ft[1] * (k.normal[0] * k.tangent[1] - k.normal[1] * k.tangent[0]);
      for (const auto &row : v.contacts) sent += double{row[5]};
      EXPECT_NEAR(sent, given, 1e-5 * std::fabs(given));
      EXPECT_GT(given, 0);
    }
}

TEST(Stream, ResolutionIsThatOfTheMotion) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  test::run(s.world, 5e-3, 1e-3);
  Viewer v;
  v.read(stream(s.world, DFM_STREAM_SCENE));
  v.read(stream(s.world, DFM_STREAM_FRAME));
  for (const double step : v.meshes.at(uint32_t(s.upper)).step) EXPECT_LT(step, 1e-7);
}

TEST(Stream, CutBody_HasAnotherShape) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  Viewer v;
  v.read(stream(s.world, DFM_STREAM_SCENE));
  v.read(stream(s.world, DFM_STREAM_FRAME));
  const uint32_t before = v.present.at(uint32_t(s.upper)), other = v.present.at(uint32_t(s.lower));
  test::split_upper(s);
  Viewer later;
  later.read(stream(s.world, DFM_STREAM_SCENE, 0, 0, s.upper));
  EXPECT_EQ(later.meshes.size(), 1u) << "that body alone";
  EXPECT_NE(later.meshes.at(uint32_t(s.upper)).shape, before);
  later.read(stream(s.world, DFM_STREAM_SCENE));
  later.read(stream(s.world, DFM_STREAM_FRAME));
  later.compare(s.upper);
  later.compare(s.lower);
  EXPECT_EQ(later.present.at(uint32_t(s.lower)), other);
}

// A linear model counts its displacements from where the body is when it gets it.
TEST(Stream, BodyThatCountsFromAnotherPlace_HasAnotherShape) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  uint32_t n = 0;
  test::ok(dfm_body_get_state(s.upper, 0, nullptr, nullptr, &n));
  std::vector<double> x(3 * size_t{n}), still(x.size(), 0.0);
  test::ok(dfm_body_get_state(s.upper, n, x.data(), nullptr, &n));
  for (size_t i = 0; i < x.size(); i += 3) x[i] += 0.5;
  test::ok(dfm_body_set_state(s.upper, n, x.data(), still.data()));
  Viewer v;
  v.read(stream(s.world, DFM_STREAM_SCENE));
  v.read(stream(s.world, DFM_STREAM_FRAME));
  const uint32_t before = v.present.at(uint32_t(s.upper));
  test::ok(dfm_body_set_model(s.upper, "linear_fem", nullptr));
  v.read(stream(s.world, DFM_STREAM_SCENE));
  v.read(stream(s.world, DFM_STREAM_FRAME));
  EXPECT_NE(v.present.at(uint32_t(s.upper)), before);
  v.compare(s.upper);
}

TEST(Stream, PackedLater_IsTheSame) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  test::run(s.world, 5e-3, 1e-3);
  const Bytes all[] = {stream(s.world, DFM_STREAM_SCENE),
                       stream(s.world, DFM_STREAM_FRAME, DFM_STREAM_FLOAT32 | DFM_STREAM_CONTACTS)};
  for (const uint32_t packet : {0u, 256u, 1188u})
    for (const uint32_t flags : {0u, uint32_t{DFM_STREAM_FLOAT32}})
      for (const Bytes &one : all) {
        dfm_stream_def d = dfm_stream_def_default();
        d.packet = packet;
        d.flags = flags;
        size_t n = 0;
        test::ok(dfm_stream_pack(one.data(), one.size(), &d, nullptr, &n));
        Bytes out(n);
        test::ok(dfm_stream_pack(one.data(), one.size(), &d, out.data(), &n));
        EXPECT_EQ(out, &one == all ? stream(s.world, DFM_STREAM_SCENE, flags, packet)
                                   : stream(s.world, DFM_STREAM_FRAME, flags | DFM_STREAM_CONTACTS, packet));
      }
  // what it did not write: refused, or packed, and no more
  std::mt19937 dice(1);
  size_t refused = 0;
  for (int i = 0; i < 20000; ++i) {
    Bytes bad = all[dice() % 2];
    const size_t at = dice() % (bad.size() / 4) * 4;
    for (size_t k = 0; k < 4; ++k) bad[at % 400 / 4 * 4 + k] = static_cast<unsigned char>(dice() >> 7);
    if (dice() % 4 == 0) bad.resize(dice() % bad.size());
    size_t n = 0;
    refused += dfm_stream_pack(bad.data(), bad.size(), nullptr, nullptr, &n) == DFM_E_ARG;
  }
  EXPECT_GT(refused, 5000u);
}

TEST(Stream, BadCalls_AreRefusedWithASentence) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  size_t n = 0;
  dfm_stream_def d = dfm_stream_def_default();
  const auto refused = [&](const char *words) {
    EXPECT_EQ(dfm_world_stream(s.world, &d, nullptr, &n), DFM_E_ARG);
    EXPECT_NE(std::string(dfm_last_error()).find(words), std::string::npos) << dfm_last_error();
    d = dfm_stream_def_default();
  };
  d.kind = 2;
  refused("kind is 2");
  d.flags = 8;
  refused("flags are 8");
  d.packet = 255;
  refused("at least 256");
  d.body = test::make_stack(c).floor;
  refused("'body'");
  test::ok(dfm_world_stream(s.world, nullptr, nullptr, &n));
  Bytes small(n - 1);
  size_t given = small.size();
  EXPECT_EQ(dfm_world_stream(s.world, nullptr, small.data(), &given), DFM_E_ARG);
  EXPECT_EQ(given, n);
}

}  // namespace
