// Lists of structs: rows of the caller's size, whether its header is older or newer than the library, and by
// the symbol's name alone.
#include <cstring>

#include "rigid.h"
#include "stack.h"

// The symbols, past the inline functions of the headers.
extern "C" {
dfm_status contacts_symbol(dfm_world, uint32_t, dfm_contact *, uint32_t *) __asm__("dfm_world_contacts");
dfm_status pairs_symbol(dfm_world, uint32_t, dfm_pair_report *, uint32_t *) __asm__("dfm_world_pairs");
dfm_status impulses_symbol(dfm_world, uint32_t, dfm_pair_impulse *,
                           uint32_t *) __asm__("dfm_world_pair_impulses");
dfm_status events_symbol(dfm_world, uint32_t, dfm_contact_event *, uint32_t *) __asm__("dfm_world_events");
dfm_status overlaps_symbol(dfm_world, uint32_t, dfm_overlap *, uint32_t *) __asm__("dfm_world_overlaps");
dfm_status profile_symbol(dfm_world, uint32_t, dfm_stage_time *, uint32_t *) __asm__("dfm_world_profile");
}

namespace {

constexpr unsigned char kUntouched = 0xa5;
using Bytes = std::vector<unsigned char>;

// A world in which every list has rows: the upper cube starts in the lower one, by less than
// contact leads out.
test::Stack busy_stack(dfm_context *c) {
  const test::Stack s = test::make_stack(c, -1.5e-3);
  test::run(s.world, 10e-3, 1e-3);
  return s;
}

template <class T>
using Sized = dfm_status (*)(dfm_world, uint32_t, uint32_t, T *, uint32_t *);

struct Range { size_t begin, end; };
constexpr size_t kTwo = 2 * sizeof(uint64_t);  // handles
Range differing(const dfm_contact *) {
  return {offsetof(dfm_contact, body_a), offsetof(dfm_contact, body_a) + kTwo};
}
Range differing(const dfm_pair_report *) {
  return {offsetof(dfm_pair_report, a), offsetof(dfm_pair_report, a) + kTwo};
}
Range differing(const dfm_pair_impulse *) {
  return {offsetof(dfm_pair_impulse, a), offsetof(dfm_pair_impulse, a) + kTwo};
}
Range differing(const dfm_contact_event *) {
  return {offsetof(dfm_contact_event, a), offsetof(dfm_contact_event, a) + kTwo};
}
Range differing(const dfm_overlap *) { return {offsetof(dfm_overlap, a), offsetof(dfm_overlap, a) + kTwo}; }
Range differing(const dfm_stage_time *) {
  return {offsetof(dfm_stage_time, seconds), offsetof(dfm_stage_time, calls)};
}

// What differs between two worlds of equal content reads zero.
template <class T>
void blank(T *out, uint32_t row_size, uint32_t n) {
  const Range range = differing(out);
  unsigned char *row = reinterpret_cast<unsigned char *>(out);
  for (uint32_t i = 0; out && i < n; ++i, row += row_size)
    for (size_t k = range.begin; k < range.end && k < row_size; ++k) row[k] = 0;
}

template <class T>
dfm_status alike(Sized<T> list, dfm_world w, uint32_t row_size, uint32_t capacity, T *out, uint32_t *n) {
  const dfm_status s = list(w, row_size, capacity, out, n);
  if (s == DFM_OK) blank(out, row_size, *n);
  return s;
}

// Rows of row_size bytes, with a row's room behind them that nothing may write to.
template <class T>
Bytes rows_of(Sized<T> list, dfm_world w, uint32_t row_size, uint32_t *n) {
  test::ok(list(w, row_size, 0, nullptr, n));
  Bytes out(size_t{row_size} * (*n + 1), kUntouched);
  test::ok(alike(list, w, row_size, *n, reinterpret_cast<T *>(out.data()), n));
  for (size_t i = size_t{row_size} * *n; i < out.size(); ++i) EXPECT_EQ(out[i], kUntouched) << "byte " << i;
  return out;
}

// Worlds of equal content give equal lists but for handles and times of the machine. Events, which empty
// their list, need a world for each call.
template <class T>
void check_rows(Sized<T> list, const char *name) {
  SCOPED_TRACE(name);
  test::Context c;
  uint32_t n = 0;
  const Bytes today = rows_of(list, busy_stack(c).world, sizeof(T), &n);
  ASSERT_GT(n, 0u);
  for (const uint32_t row_size : {uint32_t{8}, uint32_t{16}, uint32_t(sizeof(T) - 8), uint32_t(sizeof(T) + 8),
                                  uint32_t(sizeof(T) + 64)}) {
    SCOPED_TRACE(row_size);
    uint32_t m = 0;
    const Bytes rows = rows_of(list, busy_stack(c).world, row_size, &m);
    ASSERT_EQ(m, n);
    const uint32_t known = row_size < sizeof(T) ? row_size : uint32_t(sizeof(T));
    constexpr bool has_size = requires(T row) { row.size; };
    const size_t head = has_size ? sizeof(uint32_t) : 0;
    for (uint32_t i = 0; i < n; ++i) {
      const unsigned char *const row = &rows[size_t{row_size} * i];
      const unsigned char *const expected = &today[sizeof(T) * i];
      uint32_t size = known;
      if (has_size) std::memcpy(&size, row, sizeof size);
      EXPECT_EQ(size, known) << "row " << i;
      EXPECT_EQ(std::memcmp(row + head, expected + head, known - head), 0) << "row " << i;
      for (uint32_t k = known; k < row_size; ++k) EXPECT_EQ(row[k], 0) << "row " << i << ", byte " << k;
    }
  }
}

template <class T>
void check_refused(Sized<T> list, dfm_world w, const char *type) {
  for (const uint32_t row_size : {0u, 4u, 12u, uint32_t(sizeof(T)) + 1}) {
    uint32_t n = 77;
    EXPECT_EQ(list(w, row_size, 0, nullptr, &n), DFM_E_ARG) << type;
    EXPECT_EQ(n, 77u) << type;
    const std::string said = dfm_last_error();
    for (const std::string &part : {"row_size " + std::to_string(row_size),
                                    "sizeof(" + std::string(type) + ")", std::to_string(sizeof(T))})
      EXPECT_NE(said.find(part), std::string::npos) << said;
  }
}

// By the symbol alone the rows are those of 0.1, which is what the headers have until one grows.
template <class T>
void check_symbol(Sized<T> list, dfm_status (*symbol)(dfm_world, uint32_t, T *, uint32_t *), uint32_t first,
                  const char *name) {
  SCOPED_TRACE(name);
  test::Context c;
  uint32_t n = 0, m = 0;
  const Bytes expected = rows_of(list, busy_stack(c).world, first, &n);
  const dfm_world again = busy_stack(c).world;
  Bytes rows(expected.size(), kUntouched);
  T *const out = reinterpret_cast<T *>(rows.data());
  test::ok(symbol(again, n, out, &m));
  blank(out, first, m);
  EXPECT_EQ(m, n);
  EXPECT_EQ(rows, expected);
}

// A def as an older or a newer header has it: the same members, another distance to the next one, zero in
// what this version does not know.
template <class T>
Bytes spread(const std::vector<T> &defs, uint32_t size) {
  Bytes out(defs.size() * size, 0);
  for (size_t i = 0; i < defs.size(); ++i) {
    std::memcpy(&out[i * size], &defs[i], size < sizeof(T) ? size : sizeof(T));
    std::memcpy(&out[i * size], &size, sizeof size);
  }
  return out;
}

// Each list with its symbol, the bytes of its row in 0.1 and the row's type.
template <class F>
void each_list(F f) {
  f(dfm_world_contacts_sized, contacts_symbol, 192, "dfm_contact");
  f(dfm_world_pairs_sized, pairs_symbol, 128, "dfm_pair_report");
  f(dfm_world_pair_impulses_sized, impulses_symbol, 104, "dfm_pair_impulse");
  f(dfm_world_events_sized, events_symbol, 40, "dfm_contact_event");
  f(dfm_world_overlaps_sized, overlaps_symbol, 40, "dfm_overlap");
  f(dfm_world_profile_sized, profile_symbol, 24, "dfm_stage_time");
}

}  // namespace

TEST(ListRows, OfAnOlderOrANewerHeader_HaveItsSize) {
  each_list([](auto list, auto, uint32_t, const char *name) { check_rows(list, name); });
}

TEST(ListRows, OfASizeThatNoRowHas_AreRefused) {
  test::Context c;
  const dfm_world w = test::make_world(c);
  each_list([&](auto list, auto, uint32_t, const char *name) { check_refused(list, w, name); });
}

TEST(ListRows, BySymbolAlone_AreThoseOfTheFirstVersion) {
  each_list([](auto list, auto symbol, uint32_t first, const char *name) {
    check_symbol(list, symbol, first, name);
  });
}

TEST(ListRows, OfRigidDefs_HaveTheSizeOfTheFirst) {
  test::Context c;
  std::vector<dfm_rigid_def> bodies(3, dfm_rigid_def_default());
  const char *const names[] = {"one", "two", "three"};
  for (size_t i = 0; i < bodies.size(); ++i) {
    bodies[i].name = names[i];
    bodies[i].pose.position[0] = 3.0 * double(i);
    bodies[i].mass = 1.0 + double(i);
  }
  std::vector<dfm_joint_def> joints(2);
  for (uint32_t k = 0; k < 2; ++k) {
    joints[k] = {};
    joints[k].size = sizeof(dfm_joint_def);
    joints[k].type = DFM_JOINT_BALL;
    joints[k].body = k;
    joints[k].with = k + 1;
  }
  for (const int more : {0, 16, -8}) {  // -8: of a rigid body without its user pointer
    SCOPED_TRACE(more);
    const dfm_world w = test::make_world(c);
    const Bytes bytes = spread(bodies, uint32_t(int(sizeof(dfm_rigid_def)) + more));
    const Bytes ties = spread(joints, uint32_t(sizeof(dfm_joint_def) + (more > 0 ? 16 : 0)));
    const dfm_rigid_set_def set = {sizeof set,
                                   3,
                                   2,
                                   0,
                                   reinterpret_cast<const dfm_rigid_def *>(bytes.data()),
                                   reinterpret_cast<const dfm_joint_def *>(ties.data()),
                                   nullptr};
    dfm_rigid out[3] = {};
    ASSERT_EQ(dfm_rigid_create(w, nullptr, &set, out), DFM_OK) << dfm_last_error();
    for (int i = 0; i < 3; ++i) {
      dfm_rigid_def d = {};
      d.size = sizeof d;
      test::ok(dfm_rigid_get_def(out[i], &d));
      EXPECT_STREQ(d.name, names[i]);
      EXPECT_EQ(d.mass, 1.0 + i);
      EXPECT_EQ(d.user, nullptr);
    }
    if (more <= 0) continue;
    Bytes wish = bytes;
    wish.back() = 1;  // of the last row, in a member that this version does not know
    dfm_rigid_set_def asks = set;
    asks.bodies = reinterpret_cast<const dfm_rigid_def *>(wish.data());
    EXPECT_EQ(dfm_rigid_create(test::make_world(c), nullptr, &asks, out), DFM_E_UNSUPPORTED);
  }
  const dfm_world w = test::make_world(c);
  dfm_rigid out[3] = {};
  const dfm_rigid_set_def set = {sizeof set, 3, 0, 0, bodies.data(), nullptr, nullptr};
  bodies[1].size -= 8;
  EXPECT_EQ(dfm_rigid_create(w, nullptr, &set, out), DFM_E_ARG);
  EXPECT_NE(std::string(dfm_last_error()).find("rigid body 1: size is"), std::string::npos)
      << dfm_last_error();
  bodies[0].size = 0;
  EXPECT_EQ(dfm_rigid_create(w, nullptr, &set, out), DFM_E_ARG);
  EXPECT_NE(std::string(dfm_last_error()).find("rigid body 0: size is 0"), std::string::npos)
      << dfm_last_error();
  EXPECT_EQ(out[0], 0u);
}
