// The scene of a row (cover_rows.h): something falls a short way, slides, is tilted below and then beyond
// what friction holds.
//
//   plane box mesh voxels   a soft block on an obstacle that does not move
//   soft:MODEL              a soft block on a soft slab of that model; the slab lies on a floor that holds it
//   rigid                   a rigid block on the soft slab of the row's model
//   self                    two soft prongs of one body, the upper one sags onto the lower one, on that floor
#pragma once
#include "cells.h"
#include "coupled.h"
#include "cover_rows.h"
#include "hold.h"
#include "obstacle.h"

namespace test::cover {

constexpr double kG = 9.81;
constexpr double kMu = 0.5;        // of the row's law
constexpr double kFloorMu = 2.0;   // of what only carries, Coulomb's
constexpr double kSpeed = 0.1;     // m/s, along the slide at the start
constexpr double kDrop = 1e-3;     // m
constexpr double kDamping = 1e-3;  // s, over stiffness

struct Refused { std::string sentence; };
inline void must(dfm_status s) {
  if (s != DFM_OK) throw Refused{dfm_last_error()};
}

// A grid of boxes, six tetrahedra each, where `filled` says so.
inline Cells grid(const std::vector<double> &x, const std::vector<double> &y, const std::vector<double> &z,
                  const std::function<bool(size_t, size_t, size_t)> &filled) {
  Cells out;
  std::map<std::array<size_t, 3>, uint32_t> seen;
  const auto point = [&](std::array<size_t, 3> i) {
    const auto [at, fresh] = seen.emplace(i, out.npoint());
    if (fresh) out.points.insert(out.points.end(), {x[i[0]], y[i[1]], z[i[2]]});
    return at->second;
  };
  constexpr size_t kWays[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}};
  for (size_t k = 0; k + 1 < z.size(); ++k)
    for (size_t j = 0; j + 1 < y.size(); ++j)
      for (size_t i = 0; i + 1 < x.size(); ++i) {
        if (!filled(i, j, k)) continue;
        for (size_t way = 0; way < 6; ++way) {
          std::array<size_t, 3> at{i, j, k};
          uint32_t q[4] = {point(at)};
          for (size_t step = 0; step < 3; ++step) {
            ++at[kWays[way][step]];
            q[step + 1] = point(at);
          }
          if (way >= 3) std::swap(q[2], q[3]);
          out.tets.insert(out.tets.end(), {q[0], q[1], q[2], q[3]});
        }
      }
  return out;
}

// Two prongs of `cells` times 10 mm along x, `gap` apart, joined at x = 0.
inline Cells fork(size_t cells, double gap) {
  std::vector<double> x;
  for (size_t i = 0; i <= cells; ++i) x.push_back(0.01 * double(i));
  return grid(x, {0, 0.02, 0.04}, {0, 0.006, 0.012, 0.012 + gap, 0.018 + gap, 0.024 + gap},
              [](size_t i, size_t, size_t k) { return k != 2 || i == 0; });
}

// Each triangle in four.
inline Skin finer(const Skin &from) {
  Skin out{from.points, {}};
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> seen;
  const auto middle = [&](uint32_t a, uint32_t b) {
    const auto [at, fresh] = seen.emplace(std::minmax(a, b), out.npoint());
    for (size_t k = 0; fresh && k < 3; ++k)
      out.points.push_back((from.points[3 * size_t{a} + k] + from.points[3 * size_t{b} + k]) / 2);
    return at->second;
  };
  for (size_t t = 0; t < from.triangles.size(); t += 3) {
    const uint32_t a = from.triangles[t], b = from.triangles[t + 1], c = from.triangles[t + 2];
    const uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    out.triangles.insert(out.triangles.end(), {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca});
  }
  return out;
}

class Scene {
 public:
  Context context;
  dfm_world world = 0;
  std::vector<dfm_body> bodies;
  dfm_obstacle ground = 0;  // what carries the lowest body
  Triangles triangles;      // its triangles, in the world, where it has some
  uint32_t ground_shape = DFM_SHAPE_PLANE;
  dfm_rigid rigid = 0;  // the upper one, where it is rigid
  uint64_t upper = 0;   // of the pair with the row's law: what slides,
  uint64_t lower = 0;   // and what it slides on
  size_t along = 0;     // axis of the slide: x, y

  // Throws Refused.
  explicit Scene(const Row &row) : row_(row) {
    dfm_world_def d = dfm_world_def_default();
    const std::string &integrator = level(row, kIntegrator);
    d.integrator = integrator == "implicit_euler" ? DFM_INTEGRATOR_IMPLICIT_EULER
                   : integrator == "tr_bdf2"      ? DFM_INTEGRATOR_TR_BDF2
                                                  : DFM_INTEGRATOR_SYMPLECTIC_EULER;
    const std::string &partner = level(row, kPartner);
    if (partner == "self") d.self_contact = DFM_SELF_ON;
    must(dfm_world_create(context, &d, &world));
    if (partner == "self") prongs();
    else if (partner == "rigid") rigid_on_slab();
    else if (partner.rfind("soft:", 0) == 0) block_on_slab(partner.substr(5));
    else block_on(partner);
  }
  Scene(const Scene &) = delete;
  Scene &operator=(const Scene &) = delete;

  std::string law() const { return level(row_, kLaw); }

 private:
  static constexpr double kTurn = 0.1;  // rad about z: meshes have no common axis

  struct Shape {
    Cells cells;
    Skin skin;  // of its own, where the coupling asks for one
    double young = 2e5;
  };
  dfm_body soft(const std::string &name, const std::string &model, const std::string &coupling,
                const Shape &shape, Vec position, double speed, double turn) {
    const Cells &cells = shape.cells;
    BodyOptions o;
    o.young = shape.young;
    o.damping_stiffness = kDamping;
    dfm_body_def d = dfm_body_def_default();
    d.name = name.c_str();
    d.model = model.c_str();
    d.npoint = cells.npoint();
    d.ntet = cells.ntet();
    d.points = cells.points.data();
    d.tets = cells.tets.data();
    d.material = make_material(world, o);
    // how soft and how damped it is is no matter of its material: prongs sag by 2 mm
    const double stiffness = 0.5, ratio = 1;
    const dfm_param_value softer[] = {{"stiffness", &stiffness, 1}, {"damping_ratio", &ratio, 1}};
    if (model == "shape_matching" && level(row_, kPartner) == "self")
      d.model_params = {sizeof(dfm_params), 2, softer};
    for (size_t k = 0; k < 3; ++k) d.pose.position[k] = position[k];
    d.pose.rotation[2] = std::sin(turn / 2);
    d.pose.rotation[3] = std::cos(turn / 2);
    d.velocity[along] = speed;
    dfm_surface_def surface{};
    if (coupling != "identity") {
      surface = shape.skin.def(coupling == "mls"      ? DFM_COUPLING_MLS
                               : coupling == "thesis" ? DFM_COUPLING_THESIS
                                                      : DFM_COUPLING_BARYCENTRIC,
                               coupling == "barycentric" ? 0 : 1.5);
      d.surface = &surface;
    }
    dfm_body body = 0;
    must(dfm_body_create(world, &d, &body));
    bodies.push_back(body);
    return body;
  }
  // The surface of the cells, as a body of them has it.
  Skin boundary(const Cells &cells) const {
    dfm_world scratch = make_world(context);
    const Skin skin = boundary_skin(make_body(scratch, cells, {}));
    ok(dfm_world_destroy(scratch));
    return skin;
  }
  // The row's body.
  dfm_body mine(const std::string &name, const Shape &cells, Vec position, double speed, double turn) {
    return soft(name, level(row_, kModel), level(row_, kCoupling), cells, position, speed, turn);
  }
  Shape block() const {
    Shape out{grid({-0.03, -0.01, 0.01, 0.03}, {-0.03, -0.01, 0.01, 0.03}, {0, 0.015, 0.03}, full), {}};
    // what `thesis` shrinks has bumps (doc/concepts/couplings.md); surfels on phyxels stay, as so many feet
    if (level(row_, kCoupling) == "thesis") {
      out.skin = finer(boundary(out.cells));
    } else {
      out.skin = box_skin({0.06, 0.06, 0.03}, 5);
      for (size_t i = 0; i < out.skin.points.size(); ++i) out.skin.points[i] -= i % 3 == 2 ? 0 : 0.03;
    }
    return out;
  }
  Shape slab() const {
    Shape out{grid({-0.05, -0.03, -0.01, 0.01, 0.03, 0.05, 0.07, 0.09, 0.11, 0.13},
                   {-0.04, -0.02, 0, 0.02, 0.04}, {0, 0.015, 0.03}, full),
              {}};
    if (level(row_, kCoupling) == "thesis") {
      out.skin = finer(boundary(out.cells));
    } else {
      out.skin = box_skin({0.18, 0.08, 0.03}, 7);
      for (size_t i = 0; i < out.skin.points.size(); i += 3) {
        out.skin.points[i] -= 0.05;
        out.skin.points[i + 1] -= 0.04;
      }
    }
    return out;
  }
  static bool full(size_t, size_t, size_t) { return true; }

  void block_on(const std::string &partner) {
    upper = mine("upper", block(), {0, 0, kDrop}, kSpeed, kTurn);
    dfm_obstacle_def d = dfm_obstacle_def_default();
    if (partner == "box") {
      d.shape = DFM_SHAPE_BOX;
      triangles = box_surface({0.3, 0.3, 0.05}, 1);
      d.half_size[0] = d.half_size[1] = 0.3;
      d.half_size[2] = 0.05;
      d.pose.position[2] = -0.05;
    } else if (partner == "mesh") {
      triangles = height_field(0.3, 11, [](double, double) { return 0.0; });
      d = mesh_def("ground", triangles);
    } else if (partner == "voxels") {
      triangles = box_surface({0.3, 0.3, 0.05}, 1);
      d = mesh_def("ground", triangles, DFM_SHAPE_VOXELS, 30000);
      d.pose.position[2] = -0.05;
    }
    d.name = "ground";
    ground_shape = d.shape;
    must(dfm_obstacle_create(world, &d, &ground));
    lower = ground;
    set_law("ground");
  }
  void carry(const char *what) {
    ground = add_plane(world, "ground");
    must(add_friction(world, "coulomb", {{"mu", kFloorMu}}, what, "ground"));
  }
  void block_on_slab(const std::string &model) {
    upper = mine("upper", block(), {0, 0, 0.03 + 2 * kDrop}, kSpeed, kTurn);
    lower = soft("lower", model, "identity", slab(), {0, 0, kDrop / 10}, 0, 0);
    carry("lower");
    set_law("lower");
  }
  void rigid_on_slab() {
    lower = mine("lower", slab(), {0, 0, kDrop / 10}, 0, 0);
    dfm_rigid_def d = box("upper", {0.03, 0.03, 0.015}, 0.108, {0, 0, 0.045 + 2 * kDrop});
    d.pose.rotation[2] = std::sin(kTurn / 2);
    d.pose.rotation[3] = std::cos(kTurn / 2);
    d.velocity[0] = kSpeed;
    rigid = create(world, {d})[0];
    upper = rigid;
    carry("lower");
    set_law("lower");
  }
  void prongs() {
    along = 1;
    // points of a meshless body see each other across gaps (doc/models/meshless.md, errors): a wide one, and
    // prongs long enough to close it. What thesis shrinks needs longer ones, too.
    const bool meshless = level(row_, kModel) == "meshless", shrinks = level(row_, kCoupling) == "thesis";
    Shape shape{meshless ? fork(10, 0.02) : fork(shrinks ? 7 : 5, 0.001), {}, 1e5};
    shape.skin = finer(boundary(shape.cells));
    upper = lower = mine("upper", shape, {0, 0, kDrop}, kSpeed, kTurn);
    carry("upper");
    set_law("upper");
  }
  void set_law(const char *partner) {
    const std::string name = law();
    LawValues v;
    if (name != "none") v = hold::values_of(name, kMu);
    // slipping elements follow the normal force within mu p / C = 20 us (doc/laws/gms.md, limits)
    if (name == "gms") v.push_back({"C", 1e7});
    must(add_friction(world, name.c_str(), v, "upper", partner));
  }

  Row row_;
};

}  // namespace test::cover
