// Structs of callers whose header is older or newer than the library: defaults, defs, reports (base.h,
// "structs of another version"). Lists are in list_rows_test.
#include <dlfcn.h>

#include <cmath>
#include <cstring>

#include "world.h"

namespace {

constexpr unsigned char kUntouched = 0xa5;
using Bytes = std::vector<unsigned char>;

// Each def with the bytes that it had in 0.1.
template <class F>
void each_default(F f) {
  f(dfm_attach_def_default(), dfm_attach_def_default_sized, 96, "dfm_attach_def_default");
  f(dfm_context_def_default(), dfm_context_def_default_sized, 72, "dfm_context_def_default");
  f(dfm_world_def_default(), dfm_world_def_default_sized, 184, "dfm_world_def_default");
  f(dfm_equilibrium_def_default(), dfm_equilibrium_def_default_sized, 48, "dfm_equilibrium_def_default");
  f(dfm_material_def_default(), dfm_material_def_default_sized, 72, "dfm_material_def_default");
  f(dfm_obstacle_def_default(), dfm_obstacle_def_default_sized, 248, "dfm_obstacle_def_default");
  f(dfm_rigid_def_default(), dfm_rigid_def_default_sized, 224, "dfm_rigid_def_default");
  f(dfm_tool_def_default(), dfm_tool_def_default_sized, 264, "dfm_tool_def_default");
  f(dfm_body_def_default(), dfm_body_def_default_sized, 256, "dfm_body_def_default");
  f(dfm_switch_default(), dfm_switch_default_sized, 48, "dfm_switch_default");
  f(dfm_switch_rule_default(), dfm_switch_rule_default_sized, 160, "dfm_switch_rule_default");
  f(dfm_query_shape_default(), dfm_query_shape_default_sized, 120, "dfm_query_shape_default");
  f(dfm_query_filter_default(), dfm_query_filter_default_sized, 32, "dfm_query_filter_default");
  f(dfm_scene_write_def_default(), dfm_scene_write_def_default_sized, 48, "dfm_scene_write_def_default");
  f(dfm_stream_def_default(), dfm_stream_def_default_sized, 40, "dfm_stream_def_default");
  f(dfm_vertex_layout_default(), dfm_vertex_layout_default_sized, 56, "dfm_vertex_layout_default");
}

template <class T>
Bytes bytes_of(const T &def) {
  Bytes out(sizeof def);
  std::memcpy(out.data(), &def, sizeof def);
  return out;
}

// What a caller with a struct of that size must find in it.
Bytes expected_of(Bytes defaults, uint32_t size) {
  defaults.resize(size, 0);
  std::memcpy(defaults.data(), &size, std::min<size_t>(size, sizeof size));
  return defaults;
}

// A def as a caller with another header has it, size included.
template <class T>
struct Aged {
  Bytes bytes;
  Aged(const T &def, uint32_t size) : bytes(expected_of(bytes_of(def), size)) {}
  const T *get() const { return reinterpret_cast<const T *>(bytes.data()); }
};

TEST(DefSizes, DefaultsOfAnOlderOrANewerHeader_FillItsStructAndNothingBehind) {
  each_default(
      [](const auto &defaults, auto sized, uint32_t first, const char *name) {
        SCOPED_TRACE(name);
        using T = std::remove_cvref_t<decltype(defaults)>;
        const uint32_t known = sizeof(T);
        uint32_t grown = 0;  // the cookie, of those that began without one, and later members
        if constexpr (requires { defaults.cookie; } && !std::is_same_v<T, dfm_attach_def> &&
                      !std::is_same_v<T, dfm_scene_write_def> && !std::is_same_v<T, dfm_stream_def> &&
                      !std::is_same_v<T, dfm_tool_def>)
          grown = sizeof defaults.cookie;
        if constexpr (requires { defaults.mass_scaling; })
          grown += sizeof defaults.mass_scaling + sizeof defaults.cells + sizeof defaults.cell +
                   sizeof defaults.reserved2 + sizeof defaults.cell_inside + sizeof defaults.smooth;
        if constexpr (requires { defaults.only; }) grown += sizeof defaults.only;
        EXPECT_EQ(first + grown, known)
            << "it has grown: this number stays, and the line above takes the new size";
        EXPECT_EQ(defaults.size, known);
        for (const uint32_t size : {0u, 4u, 8u, first - 8, first, known + 8, known + 256}) {
          SCOPED_TRACE(size);
          Bytes out(size_t{size} + 64, kUntouched);
          sized(size, reinterpret_cast<T *>(out.data()));
          for (size_t i = size; i < out.size(); ++i) ASSERT_EQ(out[i], kUntouched) << "byte " << i;
          out.resize(size);
          EXPECT_EQ(out, expected_of(bytes_of(defaults), size));
        }
        sized(known, nullptr);
      });
}

TEST(DefSizes, DefaultsBySymbolAlone_AreThoseOfTheFirstVersion) {
  each_default([](const auto &defaults, auto, uint32_t first, const char *name) {
    SCOPED_TRACE(name);
    // the symbol, past the inline function of the header
    using T = std::remove_cvref_t<decltype(defaults)>;
    const auto symbol = reinterpret_cast<T (*)()>(dlsym(RTLD_DEFAULT, name));
    ASSERT_NE(symbol, nullptr);
    const T found = symbol();
    EXPECT_EQ(found.size, first);
    const Bytes mine = bytes_of(found), all = bytes_of(defaults);  // but for the sizes
    EXPECT_TRUE(
        std::equal(mine.begin() + sizeof found.size, mine.begin() + first, all.begin() + sizeof found.size));
  });
}

// In place of members that it does not have, a program that is older than the library has their defaults: a
// world of a def that ends before max_sweeps does not solve contact with none.
TEST(DefSizes, DefOfAnOlderHeader_HasTheDefaultsOfWhatItLacks) {
  test::Context c;
  const auto falls = [&](const dfm_world_def *def) {
    dfm_world w = 0;
    EXPECT_EQ(dfm_world_create(c, def, &w), DFM_OK) << dfm_last_error();
    test::add_plane(w, "floor", {0, 0, 0});
    const dfm_body b = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 30, {});
    test::run(w, 0.2, 1e-3);
    return test::measure(b).com[2];
  };
  const dfm_world_def whole = dfm_world_def_default();
  const Aged<dfm_world_def> older(whole, offsetof(dfm_world_def, max_sweeps)),
      newer(whole, sizeof whole + 64);
  const double expected = falls(&whole);
  EXPECT_EQ(falls(older.get()), expected);
  EXPECT_EQ(falls(newer.get()), expected);
}

// A def that its default function has not made says so in every call that takes one. One of a header before
// there were cookies is taken as it is.
TEST(DefSizes, DefWithoutDefaults_IsRefused) {
  test::Context c;
  const dfm_world made = test::make_world(c);
  uint64_t out = 0;
  const auto refused = [&](dfm_status status, const char *from) {
    EXPECT_EQ(status, DFM_E_ARG) << from;
    test::says({from});
  };
  const auto bare = [](auto def) {
    const uint32_t size = sizeof def;
    def = {};
    def.size = size;
    return def;
  };
  dfm_context *context = nullptr;
  const auto context_def = bare(dfm_context_def{});
  refused(dfm_context_create(&context_def, &context), "dfm_context_def_default()");
  const auto world = bare(dfm_world_def{});
  refused(dfm_world_create(c, &world, &out), "dfm_world_def_default()");
  const auto equilibrium = bare(dfm_equilibrium_def{});
  refused(dfm_world_equilibrium(made, &equilibrium, nullptr), "dfm_equilibrium_def_default()");
  const auto material = bare(dfm_material_def{});
  refused(dfm_material_create(made, &material, &out), "dfm_material_def_default()");
  const auto obstacle = bare(dfm_obstacle_def{});
  refused(dfm_obstacle_create(made, &obstacle, &out), "dfm_obstacle_def_default()");
  const auto rigid = bare(dfm_rigid_def{});
  const dfm_rigid_set_def set = {sizeof set, 1, 0, 0, &rigid, nullptr, nullptr};
  refused(dfm_rigid_create(made, nullptr, &set, &out), "dfm_rigid_def_default()");
  const auto tool = bare(dfm_tool_def{});
  refused(dfm_tool_create(made, &tool, &out), "dfm_tool_def_default()");
  const auto body = bare(dfm_body_def{});
  refused(dfm_body_create(made, &body, &out), "dfm_body_def_default()");
  const dfm_body ball = test::make_body(c, made, "ball", {0.1, 0, 0}, 30, {});
  const auto to = bare(dfm_switch{});
  refused(dfm_body_set_switches(ball, 1, &to), "dfm_switch_default()");
  const auto rule = bare(dfm_switch_rule{});
  refused(dfm_body_set_switch_rule(ball, &rule), "dfm_switch_rule_default()");
  const auto attach = bare(dfm_attach_def{});
  refused(dfm_body_attach(ball, &attach, nullptr), "dfm_attach_def_default()");
  const Aged<dfm_material_def> older(dfm_material_def_default(), sizeof(dfm_material_def) - 8);
  EXPECT_EQ(dfm_material_create(made, older.get(), &out), DFM_OK) << dfm_last_error();
}

TEST(DefSizes, UnknownFlags_AreRefused) {
  test::Context c;
  const dfm_world made = test::make_world(c);
  uint64_t out = 0;
  dfm_world_def world = dfm_world_def_default();
  world.flags = 64;
  EXPECT_EQ(dfm_world_create(c, &world, &out), DFM_E_ARG);
  test::says({"0x40"});
  dfm_material_def material = dfm_material_def_default();
  material.flags = 2;
  EXPECT_EQ(dfm_material_create(made, &material, &out), DFM_E_ARG);
  test::says({"dfm_material_def", "0x2"});
  test::Tet tet;
  tet.def.flags = 1;
  EXPECT_EQ(dfm_body_create(made, &tet.def, &out), DFM_E_ARG);
  test::says({"dfm_body_def", "0x1"});
  dfm_friction_def friction{};
  friction.size = sizeof friction;
  friction.flags = 8;
  friction.between[0] = friction.between[1] = "*";
  friction.law = "coulomb";
  EXPECT_EQ(dfm_world_add_friction(made, &friction), DFM_E_ARG);
  test::says({"dfm_friction_def", "0x8"});
  friction.size = 0;  // there is no default function to start from
  EXPECT_EQ(dfm_world_add_friction(made, &friction), DFM_E_ARG);
  test::says({"size is 0", "sizeof"});
}

// What a newer program asks for and this library does not know is not passed over in silence.
TEST(DefSizes, UnknownMemberOfANewerHeader_IsRefused) {
  test::Context c;
  const dfm_world_def whole = dfm_world_def_default();
  Aged<dfm_world_def> newer(whole, sizeof whole + 16);
  newer.bytes[sizeof whole + 11] = 1;
  dfm_world w = 0;
  EXPECT_EQ(dfm_world_create(c, newer.get(), &w), DFM_E_UNSUPPORTED);
  test::says({"208 bytes", "knows 192", "byte 203 is set", "newer"});
  EXPECT_EQ(w, 0u);
  newer = Aged<dfm_world_def>(whole, 4096 + 8);
  EXPECT_EQ(dfm_world_create(c, newer.get(), &w), DFM_E_ARG) << "no def is so long: a size that nobody set";
  const double point[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const uint32_t cell[] = {0, 1, 2, 3}, skin[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  const dfm_surface_def surface = {sizeof surface, DFM_COUPLING_BARYCENTRIC, 4, 4, point, skin, 0};
  dfm_body_def def = dfm_body_def_default();
  def.npoint = 4;
  def.points = point;
  def.ntet = 1;
  def.tets = cell;
  Aged<dfm_surface_def> own(surface, sizeof surface + 8);
  def.surface = own.get();
  dfm_body b = 0;
  const dfm_world made = test::make_world(c);
  EXPECT_EQ(dfm_body_create(made, &def, &b), DFM_OK) << dfm_last_error();
  own.bytes.back() = 1;
  EXPECT_EQ(dfm_body_create(made, &def, &b), DFM_E_UNSUPPORTED);
  test::says({"byte 47 is set"});
}

template <class T, class F>
void check_report(F query, uint32_t first, const char *name) {
  SCOPED_TRACE(name);
  uint32_t grown = 0;
  if constexpr (requires(T t) { t.cookie; }) grown = sizeof(T::cookie);
  if constexpr (requires(T t) { t.shortened; }) grown = sizeof(T::shortened);
  if constexpr (requires(T t) { t.mass_moved; }) grown = sizeof(T::mass_moved) + sizeof(T::frequency_change);
  EXPECT_EQ(first + grown, sizeof(T))
      << "it has grown: this number stays, and the line above takes the new size";
  for (const uint32_t requested : {0u, 8u, first - 8, first, uint32_t(sizeof(T)) + 32}) {
    SCOPED_TRACE(requested);
    Bytes out(sizeof(T) + 128, kUntouched);
    std::memcpy(out.data(), &requested, sizeof requested);
    test::ok(query(reinterpret_cast<T *>(out.data())));
    uint32_t filled = 0;
    std::memcpy(&filled, out.data(), sizeof filled);
    EXPECT_EQ(filled, requested == 0 ? first : std::min<uint32_t>(requested, sizeof(T)));
    for (size_t i = filled; i < out.size(); ++i) ASSERT_EQ(out[i], kUntouched) << "byte " << i;
  }
}

// A caller that says no size has a struct of 0.1, however long the library's own has become.
TEST(DefSizes, ReportsOfAnOlderOrANewerHeader_ContainTheFilledSize) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  const dfm_body b = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 30, {});
  const dfm_obstacle floor = test::add_plane(w, "floor", {0, 0, -1});
  check_report<dfm_body_measure>([&](auto *out) { return dfm_body_get_measure(b, out); }, 176, "measure");
  check_report<dfm_body_info>([&](auto *out) { return dfm_body_get_info(b, out); }, 72, "info");
  check_report<dfm_world_stats>([&](auto *out) { return dfm_world_get_stats(w, out); }, 280, "stats");
  check_report<dfm_obstacle_def>([&](auto *out) { return dfm_obstacle_get_def(floor, out); }, 248,
                                 "obstacle");
}

}  // namespace
