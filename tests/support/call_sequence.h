// A world whose calls a seed chooses: what they are given, and what must hold between them.
#pragma once
#include <algorithm>
#include <limits>
#include <set>

#include "rigid.h"

namespace test {

class Random {
 public:
  Random(uint64_t seed, uint64_t call) : state_(seed * 0x9e3779b97f4a7c15u + call * 0xd1b54a32d192ed03u) {}
  uint64_t bits() {  // splitmix64
    uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  uint32_t below(size_t n) { return n ? uint32_t(bits() % n) : 0; }
  bool one_in(uint32_t n) { return below(n) == 0; }
  double plain(double lo, double hi) { return lo + (hi - lo) * (double(bits() >> 11) / 9007199254740992.0); }
  // Now and then one that a call must refuse, or must not mind.
  double number(double lo, double hi) {
    constexpr double odd[] = {NAN, INFINITY, -INFINITY, 0, -1, 1e-300, 1e6};
    return one_in(200) ? odd[below(std::size(odd))] : plain(lo, hi);
  }
  double power(double lo, double hi) { return std::pow(10, number(lo, hi)); }
  uint32_t count(uint32_t n) { return one_in(100) ? UINT32_MAX - below(3) : below(size_t{n} + 1); }
  template <class List>
  auto of(const List &list) {
    return std::size(list) ? list[below(std::size(list))] : std::decay_t<decltype(list[0])>{};
  }

 private:
  uint64_t state_;
};

// Some of a type's parameters.
struct RandomParams {
  std::vector<std::array<double, 16>> numbers;
  std::vector<dfm_param_value> values;
  RandomParams(Random &r, const dfm_type *type, uint32_t most)
      : numbers(type->nparam ? r.below(most + 1) : 0) {
    std::set<std::string> keys;
    for (std::array<double, 16> &list : numbers) {
      const dfm_param &p = *reinterpret_cast<const dfm_param *>(
          reinterpret_cast<const char *>(type->params) + size_t{type->param_size} * r.below(type->nparam));
      if (!keys.insert(p.key).second) continue;
      for (double &x : list) {
        x = r.one_in(3) ? p.def : r.number(p.min, std::min(p.max, 3 * std::abs(p.def) + 1));
        if (p.flags & DFM_PARAM_INTEGER) x = std::round(x);
      }
      values.push_back({r.one_in(60) ? "no_such_key" : p.key, list.data(), p.width});
    }
  }
  dfm_params params() const { return {sizeof(dfm_params), uint32_t(values.size()), values.data()}; }
};

struct Sequence {
  dfm_context *const context;
  dfm_world world = 0, elsewhere = 0;
  std::vector<const dfm_type *> models, laws;
  std::vector<dfm_mesh_handle> meshes;
  dfm_mesh_handle ball = 0, shell = 0;
  std::vector<uint64_t> ever, materials;  // ever: every handle that there has been, here or in another world
  std::vector<std::string> snapshots;
  std::vector<dfm_status> callbacks;  // what calls from inside a step gave

  Sequence(dfm_context *c, Random r) : context(c) {
    ok(dfm_plugin_visit(c, take_type, this));
    const double beam[] = {0.1, 0.05, 0.05}, plate[] = {0.08, 0.08, 0.04}, tube[] = {0.02, 0.04, 0.06},
                 sphere[] = {0.04, 0, 0}, larger[] = {0.041, 0, 0};
    const auto make = [&](const char *kind, const double *size, uint32_t what, uint32_t cells) {
      dfm_mesh_handle m = 0;
      ok(dfm_mesh_make(c, kind, size, what, cells, &m));
      return m;
    };
    meshes = {make("beam", beam, DFM_MESH_CELLS, 12),
              make("beam", plate, DFM_MESH_CELLS, 40),
              make("ball", sphere, DFM_MESH_CELLS, 30),
              make("bricks", plate, DFM_MESH_CELLS, 60),
              make("tube", tube, DFM_MESH_CELLS, 60),
              0,
              0};
    ball = make("ball", sphere, DFM_MESH_SURFACE, 40);
    shell = make("ball", larger, DFM_MESH_SURFACE, 60);
    ok(dfm_mesh_second_order(meshes[0], &meshes[5]));
    ok(dfm_mesh_fill(ball, 0, &meshes[6]));
    dfm_world_def d = dfm_world_def_default();
    d.integrator = int32_t(r.below(4));
    d.sleep = r.below(2);
    d.sleep_speed = 0.05;
    d.sleep_time = 0.01;
    d.self_contact = r.below(3);
    d.flags = r.one_in(3) ? DFM_WORLD_UNTANGLE : 0;
    d.max_substeps = 100;
    d.max_work = 5000;  // what two things closed on each other take is not the subject
    d.newton_iterations = r.one_in(4) ? 1 : 0;
    d.step = r.one_in(4) ? 2e-3 : 0;
    const char *const solvers[] = {"auto", "ldlt", "pcg"};
    d.solver = r.of(solvers);
    ok(dfm_world_create(c, &d, &world));
    ok(dfm_world_create(c, nullptr, &elsewhere));
    ever = {
        world, elsewhere, add_plane(world, "floor"), add_plane(elsewhere, "floor"), 0, 0xdeadbeefdeadbeefu,
        0};
    const Tet tet;
    ok(dfm_body_create(elsewhere, &tet.def, &ever.back()));
  }
  ~Sequence() {
    ok(dfm_world_destroy(world));
    ok(dfm_world_destroy(elsewhere));
    for (const dfm_mesh_handle m : meshes) ok(dfm_mesh_destroy(m));
    ok(dfm_mesh_destroy(ball));
    ok(dfm_mesh_destroy(shell));
  }
  Sequence(const Sequence &) = delete;
  Sequence &operator=(const Sequence &) = delete;

  // ---- what a call is given ------------------------------------------------------------------------------
  uint64_t any(Random &r, const std::vector<uint64_t> &live) const {
    return r.one_in(25) || live.empty() ? r.of(ever) : r.of(live);
  }
  dfm_body body(Random &r) const { return any(r, listed(dfm_world_bodies, world)); }
  dfm_obstacle obstacle(Random &r) const { return any(r, listed(dfm_world_obstacles, world)); }
  dfm_tool tool(Random &r) const { return any(r, listed(dfm_world_tools, world)); }
  dfm_rigid rigid(Random &r) const { return any(r, listed(dfm_world_rigids, world)); }
  uint64_t thing(Random &r) const { return r.one_in(2) ? body(r) : obstacle(r); }
  dfm_material material(Random &r) const { return r.one_in(3) || materials.empty() ? 0 : any(r, materials); }
  dfm_status made(dfm_status s, uint64_t handle) {
    if (s == DFM_OK) ever.push_back(handle);
    return s;
  }
  static void vector(Random &r, double *v, double size) {
    for (int k = 0; k < 3; ++k) v[k] = r.number(-size, size);
  }
  static dfm_pose pose(Random &r) {
    dfm_pose p{};
    vector(r, p.position, 0.1);
    p.position[2] += 0.1;
    if (r.one_in(2))
      for (double &q : p.rotation) q = r.number(-1, 1);
    return p;
  }
  std::vector<dfm_pose_key> pose_keys(Random &r) const {
    std::vector<dfm_pose_key> keys(r.one_in(2) ? 0 : r.below(4));
    double t = dfm_world_time(world);
    for (dfm_pose_key &k : keys) k = {t += r.number(0.01, 0.1), pose(r)};
    return keys;
  }
  std::vector<dfm_scale_key> scale_keys(Random &r) const {
    std::vector<dfm_scale_key> keys(r.one_in(2) ? 0 : r.below(4));
    double t = dfm_world_time(world);
    for (dfm_scale_key &k : keys) k = {t += r.number(0.01, 0.1), r.number(0, 2)};
    return keys;
  }
  std::vector<dfm_vector_key> vector_keys(Random &r, double size) const {
    std::vector<dfm_vector_key> keys(r.one_in(2) ? 0 : r.below(4));
    double t = dfm_world_time(world);
    for (dfm_vector_key &k : keys) {
      k.t = t += r.number(0.01, 0.1);
      vector(r, k.value, size);
    }
    return keys;
  }
  static dfm_sine sine(Random &r) {
    dfm_sine s{};
    vector(r, s.amplitude, 0.005);
    s.frequency = r.number(0, 50);
    return s;
  }
  std::string name(Random &r) const {
    static const char *const others[] = {"*", "*", "material=one", "material=two", "nobody", ""};
    if (r.one_in(3)) return r.of(others);
    dfm_obstacle_def o{};
    o.size = sizeof o;
    if (r.one_in(2) && dfm_obstacle_get_def(obstacle(r), &o) == DFM_OK) return o.name;
    dfm_body_info b{};
    b.size = sizeof b;
    if (dfm_body_get_info(body(r), &b) != DFM_OK) return "*";
    return b.name + std::string(r.one_in(4) ? ":part" : "");
  }
  dfm_body_info info(dfm_body b) const {
    dfm_body_info i{};
    i.size = sizeof i;
    return dfm_body_get_info(b, &i) == DFM_OK ? i : dfm_body_info{};
  }
  static std::vector<uint32_t> indices(Random &r, uint32_t n, uint32_t most) {
    std::vector<uint32_t> out(r.below(most + 1));
    for (uint32_t &i : out) i = r.one_in(150) ? r.count(n) : r.below(n);
    return out;
  }
  // A number of a load, a spring or an attachment of the body.
  static uint32_t joined(Random &r, dfm_body b) {
    uint32_t n = 0;
    if (dfm_body_attachments(b, 0, nullptr, &n) == DFM_OK && n && r.one_in(2))
      return r.of(listed(dfm_body_attachments, b));
    return r.count(6);
  }
  static void near_center(Random &r, dfm_body b, double *p) {
    dfm_body_measure m{};
    m.size = sizeof m;
    if (dfm_body_get_measure(b, &m) != DFM_OK) m = {};
    for (int k = 0; k < 3; ++k) p[k] = m.com[k] + r.number(-0.02, 0.02);
  }

  // ---- what must hold ------------------------------------------------------------------------------------
  static void finite(const double *x, size_t n, const char *what) {
    const double *const bad = std::find_if_not(x, x + n, [](double y) { return std::isfinite(y); });
    EXPECT_EQ(bad, x + n) << what << ", number " << bad - x << " of " << n << ": " << *bad;
  }
  // From `first` to the end of a row.
  template <class Row>
  static void rest_finite(const Row &row, const double &first, const char *what) {
    finite(&first, size_t(reinterpret_cast<const double *>(&row + 1) - &first), what);
  }
  static void check_body(dfm_body b) {
    dfm_body_info i{};
    i.size = sizeof i;
    ok(dfm_body_get_info(b, &i));
    SCOPED_TRACE(i.name);
    dfm_body_measure m{};
    m.size = sizeof m;
    const dfm_status s = dfm_body_get_measure(b, &m);
    if (s == DFM_E_STATE && i.ntriangle == 0) return;  // its cells are cut away
    ok(s);
    finite(&m.mass, 14, "measure");  // up to the kinetic energy
    EXPECT_GE(m.kinetic, 0);
    rest_finite(m, m.volume, "volume");
    std::vector<double> x(3 * size_t{i.npoint}), v(x), cells(6 * size_t{i.ntet});
    uint32_t n = 0;
    ok(dfm_body_get_state(b, i.npoint, x.data(), v.data(), &n));
    EXPECT_EQ(n, i.npoint);
    finite(x.data(), x.size(), "positions");
    finite(v.data(), v.size(), "velocities");
    if (dfm_body_energy_density(b, i.ntet, cells.data()) == DFM_OK) finite(cells.data(), i.ntet, "densities");
    if (dfm_body_stress(b, i.ntet, cells.data()) == DFM_OK) finite(cells.data(), cells.size(), "stress");
    for (const auto list : {dfm_surface_positions, dfm_surface_velocities, dfm_surface_normals,
                            dfm_surface_forces, dfm_debug_displacements, dfm_debug_surface_displacements}) {
      x = listed(list, b, 3);
      finite(x.data(), x.size(), "a list of the surface");
    }
    for (const uint32_t a : listed(dfm_body_attachments, b)) {
      dfm_attachment at{};
      at.size = sizeof at;
      ok(dfm_body_get_attachment(b, a, &at));
      rest_finite(at, at.stiffness, "attachment");
    }
  }
  void check() const {
    for (const dfm_body b : listed(dfm_world_bodies, world)) check_body(b);
    for (const dfm_contact &c : contacts(world)) rest_finite(c, c.point[0], "contact");
    for (const dfm_pair_report &p : listed(dfm_world_pairs, world)) rest_finite(p, p.normal, "pair");
    for (const dfm_pair_impulse &p : listed(dfm_world_pair_impulses, world))
      rest_finite(p, p.impulse[0], "impulse");
    for (const dfm_rigid r : listed(dfm_world_rigids, world)) {
      const dfm_rigid_state s = state(r);
      rest_finite(s, s.position[0], "rigid body");
    }
    for (const dfm_tool t : listed(dfm_world_tools, world)) {
      dfm_tool_state s{};
      s.size = sizeof s;
      ok(dfm_tool_get_state(t, &s));
      rest_finite(s, s.pose.position[0], "tool");
    }
    const dfm_world_stats s = stats(world);
    const double numbers[] = {s.time,       s.residual,     s.residual_max, s.contacts_mean, s.sleep_energy,
                              s.guard_lost, s.energy_start, s.energy_max,   s.energy_gain};
    finite(numbers, std::size(numbers), "statistics");
    dfm_memory m{};
    m.size = sizeof m;
    ok(dfm_world_memory(world, &m));
    EXPECT_EQ(m.total, m.bodies + m.dynamics + m.obstacles + m.detection + m.contacts + m.steps);
  }

 private:
  static void take_type(void *self, const dfm_type *t, const char *) {
    Sequence &s = *static_cast<Sequence *>(self);
    if (std::string(t->id).find("gpu") != std::string::npos) return;  // needs a driver
    if (t->kind == DFM_KIND_MODEL) s.models.push_back(t);
    if (t->kind == DFM_KIND_FRICTION) s.laws.push_back(t);
  }
};

}  // namespace test
