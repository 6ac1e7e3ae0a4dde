// Vertices in single precision: each the nearest float, without memory, into what the host has mapped.
#include <cstring>

#include "coupled.h"
#include "heap_calls.h"
#include "stack.h"

namespace {

struct Arrays {
  std::vector<double> x, v, normal;
  uint32_t n = 0;
  explicit Arrays(dfm_body b) {
    test::ok(dfm_surface_positions(b, 0, nullptr, &n));
    x.resize(3 * n);
    v.resize(3 * n);
    normal.resize(3 * n);
    test::ok(dfm_surface_positions(b, n, x.data(), &n));
    test::ok(dfm_surface_velocities(b, n, v.data(), &n));
    test::ok(dfm_surface_normals(b, n, normal.data(), &n));
  }
};

test::Stack resting(dfm_context *c) {
  const test::Stack s = test::make_stack(c);
  test::run(s.world, 20e-3, 1e-3);
  return s;
}

struct Vertex { float position[3], normal[3], uv[2], velocity[3], stick; };

dfm_vertex_layout layout() {
  dfm_vertex_layout l = dfm_vertex_layout_default();
  l.stride = sizeof(Vertex);
  l.normal = offsetof(Vertex, normal);
  l.velocity = offsetof(Vertex, velocity);
  l.stick = offsetof(Vertex, stick);
  return l;
}

}  // namespace

TEST(Vertices, EachValue_IsTheNearestFloat) {
  test::Context c;
  const test::Stack s = resting(c);
  const Arrays want(s.upper);
  uint32_t n = 0;
  test::ok(dfm_surface_vertices(s.upper, nullptr, 0, nullptr, &n));
  ASSERT_EQ(n, want.n);
  std::vector<Vertex> out(n + 1);
  for (Vertex &v : out) v.uv[0] = v.uv[1] = 0.25f;
  const Vertex untouched = out[n];
  const dfm_vertex_layout l = layout();
  test::ok(dfm_surface_vertices(s.upper, &l, n * sizeof(Vertex), out.data(), &n));
  for (uint32_t i = 0; i < n; ++i)
    for (uint32_t k = 0; k < 3; ++k) {
      ASSERT_EQ(out[i].position[k], float(want.x[3 * i + k]));
      ASSERT_EQ(out[i].normal[k], float(want.normal[3 * i + k]));
      ASSERT_EQ(out[i].velocity[k], float(want.v[3 * i + k]));
      ASSERT_EQ(out[i].uv[k % 2], 0.25f) << "what lies between the members is the host's";
    }
  EXPECT_EQ(std::memcmp(&out[n], &untouched, sizeof untouched), 0) << "nothing behind the last one";
  std::vector<float> plain(6 * n);
  test::ok(dfm_surface_vertices(s.upper, nullptr, plain.size() * sizeof(float), plain.data(), nullptr));
  for (uint32_t i = 0; i < 3 * n; ++i) {
    ASSERT_EQ(plain[6 * (i / 3) + i % 3], float(want.x[i]));
    ASSERT_EQ(plain[6 * (i / 3) + 3 + i % 3], float(want.normal[i]));
  }
}

TEST(Vertices, FarFromTheOrigin_AreAsExactAsNearIt) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  test::BodyOptions o;
  o.position = {1e6, -2e6, 3e5};
  const dfm_body b = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  const Arrays want(b);
  dfm_vertex_layout l = dfm_vertex_layout_default();
  for (size_t k = 0; k < 3; ++k) l.origin[k] = o.position[k];
  std::vector<float> out(6 * want.n);
  test::ok(dfm_surface_vertices(b, &l, out.size() * sizeof(float), out.data(), nullptr));
  for (uint32_t i = 0; i < want.n; ++i)
    for (uint32_t k = 0; k < 3; ++k) {
      ASSERT_EQ(out[6 * i + k], float(want.x[3 * i + k] - o.position[k]));
      ASSERT_LE(std::fabs(out[6 * i + k]), 0.11f);
    }
}

TEST(Vertices, Stick_MarksVerticesWhereContactsStick) {
  test::Context c;
  const test::Stack s = resting(c);
  const Arrays a(s.lower);
  dfm_vertex_layout l = layout();
  std::vector<Vertex> out(a.n);
  test::ok(dfm_surface_vertices(s.lower, &l, a.n * sizeof(Vertex), out.data(), nullptr));
  std::vector<float> want(a.n, 0);
  for (const bool sticks : {false, true})
    for (const dfm_contact &k : test::contacts(s.world))
      if (k.body_a == s.lower && !(k.flags & (DFM_CONTACT_EDGE_A | DFM_CONTACT_TRIANGLE_A)) && k.fn > 0 &&
          bool(k.flags & DFM_CONTACT_STICKING) == sticks)
        want[k.feature_a] = std::max(want[k.feature_a], sticks ? 1.0f : 0.5f);
  int held = 0, free = 0;
  for (uint32_t i = 0; i < a.n; ++i) {
    ASSERT_GE(out[i].stick, want[i]);
    held += out[i].stick == 1;
    free += out[i].stick == 0;
  }
  EXPECT_GT(held, 0) << "it stands on the floor";
  EXPECT_GT(free, 0) << "its sides touch nothing";
}

TEST(Vertices, OfACoupledSurface_AreExactToo) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  const test::Skin skin = test::ball_skin(0.05, 2);
  for (const int32_t coupling : {DFM_COUPLING_BARYCENTRIC, DFM_COUPLING_MLS}) {
    const dfm_surface_def def = skin.def(coupling);
    test::BodyOptions o;
    o.surface = &def;
    const dfm_body b = test::make_body(c, w, "ball", {0.05, 0, 0}, 300, o);
    const Arrays want(b);
    std::vector<float> out(6 * want.n);
    test::ok(dfm_surface_vertices(b, nullptr, out.size() * sizeof(float), out.data(), nullptr));
    for (uint32_t i = 0; i < 3 * want.n; ++i) {
      ASSERT_EQ(out[6 * (i / 3) + i % 3], float(want.x[i]));
      ASSERT_EQ(out[6 * (i / 3) + 3 + i % 3], float(want.normal[i]));
    }
  }
}

TEST(Vertices, TakeNoMemory) {
  test::Context c;
  const test::Stack s = resting(c);
  const Arrays a(s.upper);
  std::vector<Vertex> out(a.n);
  const dfm_vertex_layout l = layout();
  const uint64_t heap = test::heap_calls;
  test::ok(dfm_surface_vertices(s.upper, &l, a.n * sizeof(Vertex), out.data(), nullptr));
  EXPECT_EQ(test::heap_calls - heap, 0u);
}

TEST(Vertices, LayoutsThatCannotBe_AreRefused) {
  test::Context c;
  const test::Stack s = test::make_stack(c);
  const Arrays a(s.upper);
  std::vector<Vertex> out(a.n);
  const auto refused = [&](auto change, std::initializer_list<const char *> parts) {
    dfm_vertex_layout l = layout();
    change(l);
    EXPECT_EQ(dfm_surface_vertices(s.upper, &l, a.n * sizeof(Vertex), out.data(), nullptr), DFM_E_ARG);
    test::says(parts);
  };
  refused([](dfm_vertex_layout &l) { l.stride = 0; }, {"stride is 0"});
  refused([](dfm_vertex_layout &l) { l.stride = 49; }, {"stride is 49"});
  refused([](dfm_vertex_layout &l) { l.stride = 44; }, {"stick", "beyond the stride of 44"});
  refused([](dfm_vertex_layout &l) { l.normal = 14; }, {"normal", "multiple of 4"});
  refused([](dfm_vertex_layout &l) { l.normal = 8; }, {"position", "normal", "share"});
  refused([](dfm_vertex_layout &l) { l.normal = UINT32_MAX - 3; }, {"normal", "beyond"});
  refused([](dfm_vertex_layout &l) { l.origin[1] = NAN; }, {"origin"});
  refused([](dfm_vertex_layout &l) { l.size = 3; }, {"size is 3"});
  uint32_t n = 0;
  const dfm_vertex_layout l = layout();
  EXPECT_EQ(dfm_surface_vertices(s.upper, &l, a.n * sizeof(Vertex) - 1, out.data(), &n), DFM_E_ARG);
  EXPECT_EQ(n, a.n);
  EXPECT_EQ(dfm_surface_vertices(s.upper, &l, 4000, reinterpret_cast<char *>(out.data()) + 1, &n), DFM_E_ARG);
  test::ok(dfm_body_destroy(s.upper));
  EXPECT_EQ(dfm_surface_vertices(s.upper, &l, 0, nullptr, &n), DFM_E_HANDLE);
}
