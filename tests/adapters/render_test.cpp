// The renderer by its pixels, on both backends. A machine may lack one of them (its tests say so and step
// aside), never both.
#include "render/render.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <cfenv>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <thread>

#include "support.h"

using namespace render;

namespace {

constexpr uint32_t kWide = 160, kHigh = 120;

struct Ball {
  std::vector<double> xyz;
  std::vector<uint32_t> tri;
  Ball(double x, double y, double z, double radius, bool inside_out = false) {
    constexpr uint32_t kRings = 16, kSides = 32;
    for (uint32_t i = 0; i <= kRings; ++i)
      for (uint32_t j = 0; j < kSides; ++j) {
        const double a = std::numbers::pi * i / kRings, b = 2 * std::numbers::pi * j / kSides;
        xyz.insert(xyz.end(), {x + radius * std::sin(a) * std::cos(b), y + radius * std::sin(a) * std::sin(b),
                               z + radius * std::cos(a)});
      }
    for (uint32_t i = 0; i < kRings; ++i)
      for (uint32_t j = 0; j < kSides; ++j) {
        const uint32_t k = (j + 1) % kSides;
        const uint32_t p = i * kSides + j;
        const uint32_t q = i * kSides + k;
        const uint32_t r = p + kSides;
        const uint32_t s = q + kSides;
        if (inside_out) tri.insert(tri.end(), {p, s, r, p, q, s});
        else tri.insert(tri.end(), {p, r, s, p, s, q});
      }
  }
  Surface surface(float r, float g, float b) const {
    Surface s;
    s.xyz = xyz.data();
    s.n = uint32_t(xyz.size() / 3);
    s.tri = tri.data();
    s.ntri = uint32_t(tri.size() / 3);
    s.rgb[0] = r;
    s.rgb[1] = g;
    s.rgb[2] = b;
    return s;
  }
};

const Camera kCamera{{0, -6, 2}, {0, 0, 1}, {0, 0, 1}, 40};
const Plane kFloor{{0, 0, 0}, {0, 0, 1}, {}};

Scene scene_of(std::vector<Surface> surfaces, bool floor = true) {
  Scene s;
  s.surfaces = std::move(surfaces);
  if (floor) s.planes = {kFloor};
  s.camera = kCamera;
  s.extent = Bounds{{-1, -1, 0}, {1, 1, 2}};
  return s;
}

const uint8_t *pixel(const Image &p, uint32_t x, uint32_t y) { return &p.rgb[(size_t(y) * p.width + x) * 3]; }
int brightness(const uint8_t *p) { return p[0] + p[1] + p[2]; }
bool reddish(const uint8_t *p) { return p[0] > 90 && p[0] > 2 * p[1] && p[0] > 2 * p[2]; }
bool bluish(const uint8_t *p) { return p[2] > 90 && p[2] > 1.5 * p[0]; }

double mean_difference(const Image &a, const Image &b) {
  if (a.rgb.size() != b.rgb.size() || a.rgb.empty()) return 1e9;
  double sum = 0;
  for (size_t i = 0; i < a.rgb.size(); ++i) sum += std::abs(int(a.rgb[i]) - int(b.rgb[i]));
  return sum / double(a.rgb.size());
}

int largest_difference(const Image &a, const Image &b) {
  if (a.rgb.size() != b.rgb.size()) return 1000;
  int most = 0;
  for (size_t i = 0; i < a.rgb.size(); ++i) most = std::max(most, std::abs(int(a.rgb[i]) - int(b.rgb[i])));
  return most;
}

// Pixels that differ by more than ten levels.
int changed(const Image &a, const Image &b) {
  int n = 0;
  for (uint32_t y = 0; y < a.height; ++y)
    for (uint32_t x = 0; x < a.width; ++x)
      n += std::abs(brightness(pixel(a, x, y)) - brightness(pixel(b, x, y))) > 30;
  return n;
}

class Pixels : public testing::TestWithParam<Backend> {
 protected:
  void SetUp() override {
    std::string why;
    renderer_ = Renderer::create(GetParam(), kWide, kHigh, &why);
    if (!renderer_) GTEST_SKIP() << why;
  }
  Image draw(const Scene &scene) {
    Image picture;
    std::string why;
    EXPECT_TRUE(renderer_->draw(scene, picture, &why)) << why;
    return picture;
  }
  std::unique_ptr<Renderer> renderer_;
};

INSTANTIATE_TEST_SUITE_P(Backends, Pixels, testing::Values(Backend::egl, Backend::osmesa),
                         [](const auto &which) { return which.param == Backend::egl ? "egl" : "osmesa"; });

TEST_P(Pixels, RedBallOnFloor_IsRedInTheMiddleOnTheBackground) {
  const Ball ball(0, 0, 1, 1);
  const Image with = draw(scene_of({ball.surface(0.9f, 0.1f, 0.1f)})), without = draw(scene_of({}));
  EXPECT_TRUE(reddish(pixel(with, kWide / 2, kHigh / 2))) << int(pixel(with, kWide / 2, kHigh / 2)[0]);
  EXPECT_FALSE(reddish(pixel(without, kWide / 2, kHigh / 2)));
  for (const uint32_t x : {0u, kWide - 1}) {
    EXPECT_GT(brightness(pixel(with, x, 0)), 600);
    for (int k = 0; k < 3; ++k) EXPECT_EQ(pixel(with, x, 0)[k], pixel(without, x, 0)[k]);
  }
  EXPECT_GT(pixel(with, 0, 0)[2], pixel(with, 0, 0)[0]) << "the background's top is blue-gray";
  const auto at = [&](int dx, int dy) {
    return brightness(pixel(with, uint32_t(int(kWide) / 2 + dx), uint32_t(int(kHigh) / 2 + dy)));
  };
  EXPECT_GT(at(0, -20), at(0, 20) + 60) << "lit from above";
  EXPECT_GT(at(-20, 0), at(20, 0) + 30) << "and from the left";
}

TEST_P(Pixels, ShadowOnFloor_IsDarkerThanLitFloor) {
  const Scene bare = scene_of({});
  Scene ball = bare, glass = bare;
  ball.spheres = {{{0, 0, 1}, 1, {{0.9f, 0.1f, 0.1f}, 1}}};
  glass.spheres = ball.spheres;
  // seen through and without shadow: what remains would not be the shadow's doing
  glass.spheres[0].look.alpha = 0;
  const Image lit = draw(bare), shaded = draw(ball), clear = draw(glass);
  int darker = 0;
  for (uint32_t y = 0; y < kHigh; ++y)
    for (uint32_t x = 0; x < kWide; ++x)
      if (!reddish(pixel(shaded, x, y)) && pixel(shaded, x, y)[0] < pixel(shaded, x, y)[1] + 12 &&
          brightness(pixel(shaded, x, y)) < brightness(pixel(lit, x, y)) - 120)
        ++darker;
  EXPECT_GT(darker, int(kWide * kHigh / 100));
  EXPECT_LE(largest_difference(lit, clear), 1);
}

TEST_P(Pixels, GroundBeforeAWall_ReceivesLessSkyButIsNoShadow) {
  Scene wall = scene_of({});
  const Image open = draw(wall);
  // its face at y = 0.5; the key light comes from the camera's side
  wall.boxes = {{{{0, 0.8, 1.5}, {}}, {2, 0.3, 1.5}, {}}};
  const Image half = draw(wall);
  const uint32_t row = 83;  // the floor at (0, 0.35, 0)
  const int less = brightness(pixel(open, kWide / 2, row)) - brightness(pixel(half, kWide / 2, row));
  EXPECT_GT(less, 25);
  EXPECT_LT(less, 120);
  const int front =
      brightness(pixel(open, kWide / 2, kHigh - 2)) - brightness(pixel(half, kWide / 2, kHigh - 2));
  EXPECT_LT(std::abs(front), less / 2) << "and the more open, the less of it";
}

TEST_P(Pixels, NearerBody_HidesTheFarther) {
  const Ball near(0, -2, 1.3, 0.4), far(0, 2, 0.8, 0.4);
  const Image red = draw(scene_of({near.surface(0.9f, 0.1f, 0.1f), far.surface(0.1f, 0.2f, 0.9f)}));
  const Image blue = draw(scene_of({far.surface(0.9f, 0.1f, 0.1f), near.surface(0.1f, 0.2f, 0.9f)}));
  EXPECT_TRUE(reddish(pixel(red, kWide / 2, kHigh / 2)));
  EXPECT_TRUE(bluish(pixel(blue, kWide / 2, kHigh / 2)));
}

TEST_P(Pixels, Scalars_TakeTheColorsOfTheMap) {
  const Ball ball(0, 0, 1, 1);
  for (const ColorMap map : {ColorMap::ember, ColorMap::lagoon})
    for (const float t : {0.f, 0.5f, 1.f}) {
      const Color c = map_color(map, t);
      const std::vector<float> values(ball.xyz.size() / 3, t);
      Scene mapped = scene_of({ball.surface(0, 1, 0)});
      mapped.surfaces[0].scalar = values.data();
      mapped.map = map;
      EXPECT_LE(largest_difference(draw(mapped), draw(scene_of({ball.surface(c.r, c.g, c.b)}))), 2)
          << int(map) << " at " << t;
    }
  const std::vector<float> none(ball.xyz.size() / 3, std::numeric_limits<float>::quiet_NaN());
  Scene plain = scene_of({ball.surface(0.2f, 0.6f, 0.3f)});
  const Image own = draw(plain);
  plain.surfaces[0].scalar = none.data();
  EXPECT_EQ(draw(plain), own);
}

TEST_P(Pixels, InsideOutMesh_LooksTheSame) {
  const Ball out(0, 0, 1, 1), in(0, 0, 1, 1, true);
  EXPECT_LT(mean_difference(draw(scene_of({out.surface(0.9f, 0.1f, 0.1f)})),
                            draw(scene_of({in.surface(0.9f, 0.1f, 0.1f)}))),
            0.5);
}

TEST_P(Pixels, Lines_AreHiddenUnlessOnTop) {
  const Ball ball(0, 0, 1, 1);
  const double behind[] = {-0.3, 2, 0.65, 0.3, 2, 0.65};
  Scene s = scene_of({ball.surface(0.9f, 0.9f, 0.9f)});
  const Image bare = draw(s);
  Lines line;
  line.xyz = behind;
  line.n = 1;
  line.width = 6;
  line.rgb[0] = 0;
  line.rgb[1] = 0;
  line.rgb[2] = 1;
  s.lines = {line};
  EXPECT_EQ(draw(s), bare);
  s.lines[0].on_top = true;
  const Image top = draw(s);
  EXPECT_TRUE(bluish(pixel(top, kWide / 2, kHigh / 2)));
  EXPECT_GT(mean_difference(top, bare), 0.1);
}

TEST_P(Pixels, PlaneWhoseBackFacesTheCamera_IsLeftOut) {
  Scene s = scene_of({}), away = s, facing = s, ramp = s;
  away.planes.push_back({{0, -2, 0}, {0, 1, 0}, {}});
  facing.planes.push_back({{0, 2, 0}, {0, -1, 0}, {}});
  ramp.planes = {{{0, 0, -0.1}, {0.4, 0, 0.9}, {}}};
  const Image bare = draw(s);
  EXPECT_EQ(draw(away), bare);
  EXPECT_GT(changed(draw(facing), bare), 1500) << "of 19200";
  EXPECT_GT(changed(draw(ramp), bare), 1500) << "of 19200";
}

TEST_P(Pixels, FloorFromBelow_IsAVeil) {
  const Ball ball(0, 0, 1, 1);
  Scene below = scene_of({ball.surface(0.9f, 0.1f, 0.1f)}, false);
  below.camera->eye[2] = -3;
  const Image without = draw(below);
  below.planes = {kFloor};
  const Image veiled = draw(below);
  EXPECT_GT(changed(veiled, without), 1500) << "of 19200";
  const uint8_t *const middle = pixel(veiled, kWide / 2, kHigh / 2);
  EXPECT_GT(middle[0], middle[1] + 20) << "the ball is seen through it";
}

TEST_P(Pixels, LevelSlab_HasARimWhereTheFloorHasNone) {
  Scene floor = scene_of({}), slab = floor;
  slab.planes[0].slab = true;
  const Image bare = draw(scene_of({}, false)), whole = draw(floor), cut = draw(slab);
  EXPECT_GT(changed(whole, bare), changed(cut, bare));
  EXPECT_GT(changed(cut, bare), 500) << "of 19200";
}

TEST_P(Pixels, HiddenValues_AreSeenThroughAsFarAsRequested) {
  const Ball front(0, -1, 1, 0.9), behind(0, 2, 2.0 / 3, 0.3);
  const std::vector<float> values(behind.xyz.size() / 3, 0.5f);
  Scene s = scene_of({front.surface(0.8f, 0.8f, 0.8f), behind.surface(0.8f, 0.8f, 0.8f)}, false);
  s.surfaces[1].scalar = values.data();
  const Image hidden = draw(s);
  s.surfaces[1].through = 0.5f;
  const Image seen = draw(s);
  const uint8_t *const gray = pixel(hidden, kWide / 2, kHigh / 2), *const shown =
                                                                       pixel(seen, kWide / 2, kHigh / 2);
  const Color c = map_color(s.map, 0.5f);
  // through its front and its back
  EXPECT_NEAR(shown[0], 0.25 * gray[0] + 0.75 * 255 * c.r, 6);
  EXPECT_NEAR(shown[2], 0.25 * gray[2] + 0.75 * 255 * c.b, 6);
}

TEST_P(Pixels, SolidThatHidesABody_IsSeenThroughAndNoOther) {
  const Ball ball(0, 0, 1, 0.6);
  const auto behind = [&](double x, char shape) {
    Scene s = scene_of({ball.surface(0.9f, 0.1f, 0.1f)}, false);
    const double y = -3, z = 1.5, half = 0.7;
    if (shape == 'b') s.boxes = {{{{x, y, z}, {}}, {half, 0.05, half}, {}}};
    if (shape == 's') s.spheres = {{{x, y, z}, half, {}}};
    if (shape == 'c') s.capsules = {{{x, y, z - 1}, {x, y, z + 1}, half, {}}};
    const Image p = draw(s);
    const uint8_t *const at = pixel(p, kWide / 2, kHigh / 2);
    return at[0] - at[1];
  };
  for (const char shape : {'b', 's', 'c'}) {
    EXPECT_GT(behind(0, shape), 40) << shape;
    EXPECT_LT(behind(0.65, shape), 10) << shape << ": half of the ball is seen beside it";
  }
}

TEST_P(Pixels, SolidShapes_AreDrawnAtTheGivenPose) {
  for (const char shape : {'b', 's', 'c'}) {
    Scene s = scene_of({});
    const Look red{{0.9f, 0.1f, 0.1f}, 1};
    const double half_turn[4] = {0, 0, 0.7071067811865476, 0.7071067811865476};
    Box box{{{0.9, 0, 1}, {}}, {0.2, 1.2, 0.2}, red};  // turned a quarter about z it reaches from -0.3 to 2.1
    std::copy_n(half_turn, 4, box.pose.rotation);
    if (shape == 'b') s.boxes = {box};
    if (shape == 's') s.spheres = {{{0.9, 0, 1}, 1, red}};
    if (shape == 'c') s.capsules = {{{-0.1, 0, 1}, {1.9, 0, 1}, 0.3, red}};
    const Image p = draw(s);
    EXPECT_TRUE(reddish(pixel(p, kWide / 2 + 1, kHigh / 2))) << shape;
    EXPECT_FALSE(reddish(pixel(p, kWide / 2 - 25, kHigh / 2))) << shape;
    EXPECT_TRUE(reddish(pixel(p, kWide / 2 + 40, kHigh / 2))) << shape;
  }
}

TEST_P(Pixels, SameScene_GivesTheSameBytesAndKeepsTheHostsRounding) {
  const Ball ball(0, 0, 1, 1);
  const Scene s = scene_of({ball.surface(0.9f, 0.1f, 0.1f)});
  const Image first = draw(s);
  ASSERT_EQ(std::fesetround(FE_UPWARD), 0);
  const Image second = draw(s);
  EXPECT_EQ(std::fegetround(), FE_UPWARD);
  std::fesetround(FE_TONEAREST);
  EXPECT_EQ(first, second);
}

TEST_P(Pixels, SceneFarFromTheOrigin_LooksTheSame) {
  const double away = 4e6;  // single precision alone would be off by half a meter
  const Ball here(0, 0, 1, 1), there(away, 0, 1, 1);
  Scene s = scene_of({there.surface(0.9f, 0.1f, 0.1f)});
  s.camera->eye[0] += away;
  s.camera->look_at[0] += away;
  s.extent->lo[0] += away;
  s.extent->hi[0] += away;
  EXPECT_LT(mean_difference(draw(s), draw(scene_of({here.surface(0.9f, 0.1f, 0.1f)}))), 0.5);
}

TEST_P(Pixels, BrokenNumbers_AreLeftOutOfThePicture) {
  Ball ball(0, 0, 1, 1);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    ball.xyz[3 * 200] = bad;
    Scene s = scene_of({ball.surface(0.9f, 0.1f, 0.1f)});
    EXPECT_TRUE(reddish(pixel(draw(s), kWide / 2, kHigh / 2)));
    s.camera.reset();
    s.extent.reset();
    EXPECT_TRUE(reddish(pixel(draw(s), kWide / 2, kHigh / 2)));
  }
}

TEST_P(Pixels, TriangleOfNoVertex_IsRefusedWithASentence) {
  Ball ball(0, 0, 1, 1);
  ball.tri[7] = 9999;
  Image picture;
  std::string why;
  EXPECT_FALSE(renderer_->draw(scene_of({ball.surface(1, 0, 0)}), picture, &why));
  EXPECT_EQ(why, "surface 0: triangle 2 names vertex 9999 of 544");
  EXPECT_TRUE(picture.rgb.empty());
}

TEST_P(Pixels, EmptyScene_IsABackground) {
  const Image p = draw(Scene{});
  EXPECT_EQ(p.rgb.size(), size_t(kWide) * kHigh * 3);
  EXPECT_GT(std::set<uint8_t>(p.rgb.begin(), p.rgb.end()).size(), 10u) << "a gradient";
}

TEST_P(Pixels, TwoThreads_DrawTheSamePicture) {
  const Ball ball(0, 0, 1, 1);
  const Scene s = scene_of({ball.surface(0.9f, 0.1f, 0.1f)});
  const Image here = draw(s);
  Image there[2];
  std::vector<std::thread> threads;
  for (Image &image : there)
    threads.emplace_back([&] {
      std::string why;
      const auto own = Renderer::create(GetParam(), kWide, kHigh, &why);
      for (int i = 0; own && i < 3; ++i) own->draw(s, image);
    });
  for (std::thread &t : threads) t.join();
  EXPECT_EQ(there[0], here);
  EXPECT_EQ(there[1], here);
}

TEST(Renderer, AtLeastOneBackend_IsThere) {
  std::string why;
  const auto renderer = Renderer::create(Backend::automatic, 16, 16, &why);
  ASSERT_TRUE(renderer) << why;
  EXPECT_FALSE(std::string(renderer->device()).empty());
}

TEST(Renderer, BothBackends_Agree) {
  std::string why;
  const auto egl = Renderer::create(Backend::egl, kWide, kHigh, &why);
  if (!egl) GTEST_SKIP() << why;
  const auto osmesa = Renderer::create(Backend::osmesa, kWide, kHigh, &why);
  if (!osmesa) GTEST_SKIP() << why;
  EXPECT_STREQ(egl->backend(), "egl");
  EXPECT_STREQ(osmesa->backend(), "osmesa");
  const Ball red(0, 0, 1, 1), blue(1.4, 1, 0.5, 0.5);
  const Scene s = scene_of({red.surface(0.9f, 0.1f, 0.1f), blue.surface(0.1f, 0.2f, 0.9f)});
  for (int turn = 0; turn < 2; ++turn) {  // taking turns on one thread
    Image a, b;
    ASSERT_TRUE(egl->draw(s, a) && osmesa->draw(s, b));
    EXPECT_LT(mean_difference(a, b), 1.0);
  }
}

TEST(Renderer, SwitchedOff_ReportsHowToSwitchOn) {
  std::string why;
  setenv("DEFORM_RENDER_BACKEND", "none", 1);
  EXPECT_FALSE(Renderer::create(Backend::automatic, 16, 16, &why));
  EXPECT_NE(why.find("DEFORM_RENDER_BACKEND=none"), std::string::npos) << why;
  setenv("DEFORM_RENDER_BACKEND", "vulkan", 1);
  EXPECT_FALSE(Renderer::create(Backend::automatic, 16, 16, &why));
  EXPECT_NE(why.find("auto, egl, osmesa or none"), std::string::npos) << why;
  unsetenv("DEFORM_RENDER_BACKEND");
}

TEST(RendererDeathTest, MissingLibraries_NameTheirPackages) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // a fresh process, in which nothing is loaded yet
  EXPECT_EXIT(
      {
        setenv("DEFORM_RENDER_EGL", "libEGL.absent.so", 1);
        setenv("DEFORM_RENDER_OSMESA", "libOSMesa.absent.so", 1);
        std::string why;
        const auto none = Renderer::create(Backend::automatic, 16, 16, &why);
        std::fprintf(stderr, "%s\n", why.c_str());
        std::exit(none ? 1 : 7);
      },
      testing::ExitedWithCode(7), "EGL.*libegl1 and libegl-mesa0; OSMesa.*libosmesa6");
}

TEST(RendererDeathTest, MissingEgl_FallsBackToOsMesa) {
  std::string why;
  if (!Renderer::create(Backend::osmesa, 16, 16, &why)) GTEST_SKIP() << why;
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        setenv("DEFORM_RENDER_EGL", "libEGL.absent.so", 1);
        const auto renderer = Renderer::create(Backend::automatic, 16, 16, nullptr);
        std::fprintf(stderr, "drawn by %s\n", renderer ? renderer->backend() : "nobody");
        std::exit(0);
      },
      testing::ExitedWithCode(0), "drawn by osmesa");
}

TEST(Renderer, ImpossibleSize_IsRefusedWithASentence) {
  for (const auto &[w, h] : {std::pair{0u, 10u}, std::pair{10u, 0u}, std::pair{10u, 100000u}}) {
    std::string why;
    EXPECT_FALSE(Renderer::create(Backend::automatic, w, h, &why));
    EXPECT_NE(why.find("1 to 8192"), std::string::npos) << why;
  }
}

namespace {

// Where a point lies in the picture, -1 to 1 from edge to edge, and how far ahead of the camera it is.
std::array<double, 3> seen(const Camera &c, const double *p, double aspect) {
  const std::array<double, 3> b{c.eye[0] - c.look_at[0], c.eye[1] - c.look_at[1], c.eye[2] - c.look_at[2]};
  const double n = std::sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]),
               m = std::sqrt(b[0] * b[0] + b[1] * b[1]);
  const double back[3] = {b[0] / n, b[1] / n, b[2] / n}, right[3] = {-b[1] / m, b[0] / m, 0};
  const double above[3] = {-back[2] * right[1], back[2] * right[0], back[0] * right[1] - back[1] * right[0]};
  double x = 0, y = 0, z = 0;
  for (int k = 0; k < 3; ++k) {
    const double d = p[k] - c.eye[k];
    x += d * right[k];
    y += d * above[k];
    z -= d * back[k];
  }
  const double half = std::tan(15 * 3.14159265358979 / 180);
  return {x / (z * half * aspect), y / (z * half), z};
}

}  // namespace

// What stays in the frame moves no camera; what leaves it in any direction is kept inside, at about the
// distance of the first picture, by moves as small as its own.
TEST(Camera, Follow_KeepsABoxInside) {
  const double aspect = 4.0 / 3, up[3] = {0, 0, 1};
  const Bounds start{{-0.1, -0.1, 0}, {0.1, 0.1, 0.2}};
  const Camera first = auto_camera(start, aspect, up);
  double square = 0;
  for (int k = 0; k < 3; ++k) square += std::pow(first.eye[k] - first.look_at[k], 2);
  const double distance = std::sqrt(square);
  Bounds near = start;
  near.hi[0] += 0.001;
  const Camera still = render::follow(first, distance, near, aspect);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(still.eye[k], first.eye[k]);
  for (const auto &way :
       {std::array{1.0, 0.0, 0.0}, std::array{-1.0, 0.0, 0.0}, std::array{0.0, 1.0, 0.0},
        std::array{0.0, -1.0, 0.0}, std::array{0.0, 0.0, -1.0}, std::array{0.5, 0.5, 1.0}}) {
    Camera c = first;
    for (int step = 1; step <= 100; ++step) {
      Bounds box = start;
      for (int k = 0; k < 3; ++k) {
        box.lo[k] += 0.05 * step * way[size_t(k)];
        box.hi[k] += 0.05 * step * way[size_t(k)];
      }
      const Camera next = render::follow(c, distance, box, aspect);
      double moved = 0;
      for (int k = 0; k < 3; ++k) moved += std::pow(next.eye[k] - c.eye[k], 2);
      EXPECT_LT(std::sqrt(moved), 0.25) << "smoothly";
      c = next;
      for (const double *corner : {box.lo, box.hi}) {
        const auto [x, y, z] = seen(c, corner, aspect);
        EXPECT_LT(std::max(std::fabs(x), std::fabs(y)), 0.93);
        EXPECT_GT(z, 0.5 * distance);
        EXPECT_LT(z, 1.6 * distance);
      }
    }
  }
  Bounds wide = start;
  wide.hi[0] = 50;
  const Camera back = render::follow(first, distance, wide, aspect);
  for (const double *corner : {wide.lo, wide.hi})
    EXPECT_LT(std::max(std::fabs(seen(back, corner, aspect)[0]), std::fabs(seen(back, corner, aspect)[1])),
              0.93);
}

TEST(Camera, AutoCamera_HoldsTheBox) {
  for (const double aspect : {0.5, 1.0, 2.0})
    for (const auto &size :
         {std::array{1.0, 1.0, 1.0}, std::array{10.0, 0.1, 0.1}, std::array{0.01, 0.02, 3.0}}) {
      const Bounds box{{5, 6, 7}, {5 + size[0], 6 + size[1], 7 + size[2]}};
      for (const auto &up : {std::array{0.0, 0.0, 1.0}, std::array{0.0, 1.0, 0.0}}) {
        const Camera c = auto_camera(box, aspect, up.data());
        double back[3], right[3], above[3], n = 0, m = 0;
        for (int k = 0; k < 3; ++k) {
          back[k] = c.eye[k] - c.look_at[k];
          n += back[k] * back[k];
        }
        for (int k = 0; k < 3; ++k) back[k] /= std::sqrt(n);
        EXPECT_GT(back[0] * up[0] + back[1] * up[1] + back[2] * up[2], 0.1) << "from above";
        for (int k = 0; k < 3; ++k) {
          const int i = (k + 1) % 3, j = (k + 2) % 3;
          right[k] = c.up[i] * back[j] - c.up[j] * back[i];
          m += right[k] * right[k];
        }
        for (int k = 0; k < 3; ++k) right[k] /= std::sqrt(m);
        for (int k = 0; k < 3; ++k)
          above[k] = back[(k + 1) % 3] * right[(k + 2) % 3] - back[(k + 2) % 3] * right[(k + 1) % 3];
        double widest = 0;
        for (int corner = 0; corner < 8; ++corner) {
          double x = 0, y = 0, z = 0;
          for (int k = 0; k < 3; ++k) {
            const double d = (corner >> k & 1 ? box.hi[k] : box.lo[k]) - c.eye[k];
            x += d * right[k];
            y += d * above[k];
            z -= d * back[k];
          }
          ASSERT_GT(z, 0);
          const double half = std::tan(c.fov_deg * std::numbers::pi / 360) * z;
          widest = std::max({widest, std::abs(x) / (half * aspect), std::abs(y) / half});
        }
        EXPECT_LT(widest, 1);
        EXPECT_GT(widest, 0.5);
      }
    }
}

TEST(Colors, Maps_GrowLighterSteadily) {
  const auto lightness = [](Color c) {  // CIE L*
    const auto linear = [](double x) {
      return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
    };
    const double y = 0.2126 * linear(c.r) + 0.7152 * linear(c.g) + 0.0722 * linear(c.b);
    return y > 0.008856 ? 116 * std::cbrt(y) - 16 : 903.3 * y;
  };
  for (const ColorMap map : {ColorMap::ember, ColorMap::lagoon}) {
    const double span = lightness(map_color(map, 1)) - lightness(map_color(map, 0));
    EXPECT_GT(span, 60);
    for (int i = 0; i < 32; ++i) {
      const double step =
          lightness(map_color(map, float(i + 1) / 32)) - lightness(map_color(map, float(i) / 32));
      EXPECT_GT(step, 0.3 * span / 32) << i;
      EXPECT_LT(step, 2.0 * span / 32) << i;
    }
  }
  EXPECT_EQ(map_color(ColorMap::ember, -3).r, map_color(ColorMap::ember, 0).r);
  EXPECT_EQ(map_color(ColorMap::ember, 3).r, map_color(ColorMap::ember, 1).r);
}

TEST(Colors, Palette_IsDistinct) {
  for (uint32_t i = 0; i < 10; ++i)
    for (uint32_t j = 0; j < i; ++j) {
      const Color a = palette(i), b = palette(j);
      EXPECT_GT(std::hypot(a.r - b.r, a.g - b.g, a.b - b.b), 0.12f) << i << ' ' << j;
    }
}

Image blank(uint32_t w, uint32_t h, uint8_t value) {
  return {w, h, std::vector<uint8_t>(size_t(w) * h * 3, value)};
}

TEST(Png, RoundTrip_KeepsEveryPixel) {
  Image p = blank(37, 21, 0), q;
  for (size_t i = 0; i < p.rgb.size(); ++i) p.rgb[i] = uint8_t(i * 7 + i / 31);
  const std::string folder = test::scratch("png"), path = folder + "/picture.png";
  std::string why;
  ASSERT_TRUE(write_png(path, p, &why)) << why;
  const std::string file = test::read_file(path);
  EXPECT_EQ(file.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(file.substr(16, 8), std::string("\0\0\0\x25\0\0\0\x15", 8));
  ASSERT_TRUE(read_png(path, q, &why)) << why;
  EXPECT_EQ(p, q);
  test::write_file(path, file.substr(0, file.size() / 2));
  EXPECT_FALSE(read_png(path, q, &why));
  EXPECT_NE(why.find(path), std::string::npos);
}

TEST(Png, UnwritablePlace_IsReportedAndNoFileIsWritten) {
  std::string why;
  EXPECT_FALSE(write_png("/nowhere/picture.png", blank(2, 2, 0), &why));
  EXPECT_EQ(why, "cannot write /nowhere/picture.png: No such file or directory");
  const std::string folder = test::scratch("png_taken");
  ASSERT_EQ(mkdir((folder + "/taken.png").c_str(), 0755), 0);
  EXPECT_FALSE(write_png(folder + "/taken.png", blank(2, 2, 0), &why));
  EXPECT_EQ(rmdir((folder + "/taken.png").c_str()), 0);
  EXPECT_EQ(rmdir(folder.c_str()), 0) << "something was left behind";
  EXPECT_FALSE(write_png(folder + "/empty.png", Image{}, &why));
}

// As on a full disk: libpng alone says "Write Error".
TEST(Png, WriteThatFails_IsReportedWithItsReason) {
  const std::string folder = test::scratch("png_full");
  Image noise = blank(64, 64, 0);
  std::mt19937 random(1);
  for (uint8_t &value : noise.rgb) value = uint8_t(random());
  struct rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const struct rlimit small = {4096, before.rlim_max};
  const auto handler = signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  std::string why;
  const bool written = write_png(folder + "/noise.png", noise, &why);
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, handler);
  EXPECT_FALSE(written);
  EXPECT_EQ(why, "cannot write " + folder + "/noise.png: File too large");
  EXPECT_EQ(rmdir(folder.c_str()), 0) << "something was left behind";
}

TEST(Text, EverySign_IsItsOwn) {
  std::set<std::string> seen;
  const std::string signs =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijkmnopqrstuvwxyz0123456789.,:;-_+=/()[]<>%*^!?'\"#&";
  for (const char c : signs) {
    Image p = blank(40, 40, 255);
    draw_text(p, 8, 28, 18, std::string(1, c), {0, 0, 0});
    EXPECT_TRUE(seen.insert(std::string(p.rgb.begin(), p.rgb.end())).second) << c;
    EXPECT_NE(p, blank(40, 40, 255)) << c;
  }
  Image blanks = blank(40, 40, 255);
  draw_text(blanks, 8, 28, 18, "  ", {0, 0, 0});
  EXPECT_EQ(blanks, blank(40, 40, 255));
}

TEST(Text, Words_FillTheirWidthAndAreCutAtTheBorder) {
  Image p = blank(300, 60, 255);
  draw_text(p, 20, 40, 20, "stays", {0, 0, 0});
  uint32_t first = 1000, last = 0;
  for (uint32_t y = 0; y < p.height; ++y)
    for (uint32_t x = 0; x < p.width; ++x)
      if (pixel(p, x, y)[0] < 128) {
        first = std::min(first, x);
        last = std::max(last, x);
      }
  EXPECT_NEAR(first, 20, 3);
  EXPECT_NEAR(last, 20 + text_width(20, "stays"), 3);
  draw_text(p, -30, 10, 40, "beyond every border", {0, 0, 0});
}

TEST(Montage, Grid_HoldsEveryPictureAndItsLabels) {
  const std::vector<std::vector<Image>> rows{{blank(60, 40, 10), blank(60, 40, 20)}, {blank(60, 40, 30)}};
  const Image bare = montage(rows, {}, {});
  const Image labeled = montage(rows, {"with friction", "without"}, {"0 s", "1 s"}, "two cylinders");
  for (const Image *m : {&bare, &labeled}) {
    std::map<uint8_t, int> count;
    for (uint32_t i = 0; i < m->width * m->height; ++i) ++count[m->rgb[3 * i]];
    for (const uint8_t gray : {10, 20, 30}) EXPECT_GE(count[gray], 60 * 40) << int(gray);
  }
  EXPECT_GT(labeled.width, bare.width);
  EXPECT_GT(labeled.height, bare.height);
  EXPECT_TRUE(montage({}, {}, {}).rgb.empty());
}

TEST(Legend, Bar_RunsFromEndToEndOfTheMap) {
  Image p = blank(1600, 900, 128);
  legend(p, ColorMap::ember, 0, 1.5, "speed", "m/s");
  const auto holds = [&](float t) {
    const Color c = map_color(ColorMap::ember, t);
    for (uint32_t i = 0; i < p.width * p.height; ++i) {
      const uint8_t *q = &p.rgb[3 * size_t(i)];
      if (std::abs(q[0] - 255 * c.r) + std::abs(q[1] - 255 * c.g) + std::abs(q[2] - 255 * c.b) < 3)
        return true;
    }
    return false;
  };
  for (const float t : {0.f, 0.5f, 1.f}) EXPECT_TRUE(holds(t)) << t;
  EXPECT_EQ(pixel(p, 0, 0)[0], 128);
}

}  // namespace
