#include "scene/planner/planner.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "friction/pair_rules.h"
#include "math/extent.h"
#include "math/turn.h"
#include "plugin/context.h"
#include "plugin/quiet.h"
#include "scene/build.h"
#include "scene/device.h"
#include "scene/place.h"
#include "scene/table.h"
#include "state/motion.h"
#include "world/body_model.h"

namespace dfm::scene {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDefaultTolerance = 1e-6, kMinTolerance = 1e-9;  // m/s

double length(const double v[3]) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

// The box around a box that is placed.
Extent place(Vec3 lo, Vec3 hi, const dfm_pose &pose) {
  Extent out;
  for (int corner = 0; corner < 8; ++corner)
    out.add(dfm::place(to_pose(pose),
                       {corner & 1 ? hi.x : lo.x, corner & 2 ? hi.y : lo.y, corner & 4 ? hi.z : lo.z}));
  return out;
}

// m, how far a box may fall along `down` until it meets a plane; infinite: never.
double fall_to_plane(const Extent &box, const double down[3], const dfm_pose &plane) {
  const Vec3 n = rotate(unit_quat(plane.rotation), {0, 0, 1});
  const double toward = -dot(load3(down), n);
  double least = HUGE_VAL;
  for (int corner = 0; corner < 8; ++corner) {
    double above = 0;
    for (int k = 0; k < 3; ++k)
      above += ((corner >> k & 1 ? box.hi[k] : box.lo[k]) - plane.position[k]) * n[k];
    least = std::min(least, above);
  }
  if (least <= 0) return 0;
  return toward > 1e-9 ? least / toward : HUGE_VAL;
}

// The same distance to a box: along the axis closest to `down`, where the two overlap seen along it.
double fall_to_box(const Extent &box, const double down[3], const Extent &other) {
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::fabs(down[k]) > std::fabs(down[axis])) axis = k;
  for (int k = 0; k < 3; ++k)
    if (k != axis && (box.lo[k] > other.hi[k] || other.lo[k] > box.hi[k])) return HUGE_VAL;
  const double gap = down[axis] < 0 ? box.lo[axis] - other.hi[axis] : other.lo[axis] - box.hi[axis];
  const double through = down[axis] < 0 ? other.lo[axis] - box.hi[axis] : box.lo[axis] - other.hi[axis];
  if (through > 0) return HUGE_VAL;  // it is behind
  return std::max(gap, 0.0);
}

// m, across a contact with a round thing that enters a body by a depth: a circle on the face.
double round_width(double radius, double depth) {
  const double d = std::min(depth, radius);
  return 2 * std::sqrt(d * (2 * radius - d));
}
// m, width of a contact with a box of these sides: the middle one, since a slab touches with its face.
double flat_width(double a, double b, double c) {
  return std::max(std::min(a, b), std::min(std::max(a, b), c));
}
// m, depth by which a round thing at this place enters a box; 0: none.
double depth_in(const Extent &box, const double center[3], double radius) {
  double outside = 0, inside = HUGE_VAL;
  for (int k = 0; k < 3; ++k) {
    const double beyond = std::max(box.lo[k] - center[k], center[k] - box.hi[k]);
    outside += std::max(beyond, 0.0) * std::max(beyond, 0.0);
    inside = std::min(inside, -beyond);
  }
  return std::max(0.0, radius + (inside > 0 ? inside : -std::sqrt(outside)));
}

Extent box_of(const Obstacle &o, const std::vector<double> &scaled) {
  Extent own;
  const double r = o.def.radius;
  for (int k = 0; k < 3; ++k) {
    const double half = o.def.shape == DFM_SHAPE_BOX                 ? o.def.half_size[k]
                        : o.def.shape == DFM_SHAPE_CAPSULE && k == 2 ? r + o.def.half_length
                                                                     : r;
    own.lo[k] = -half;
    own.hi[k] = half;
  }
  if (o.def.npoint) {
    const double *points = scaled.empty() ? o.def.points : scaled.data();
    own = {};
    for (uint32_t i = 0; i < o.def.npoint; ++i) own.add(load3(points + 3 * size_t{i}));
  }
  return place(own.lo, own.hi, o.def.pose);
}

// Three, as a person would write it.
double round_to_digits(double x) {
  const std::string text = format("%.3g", x);
  std::from_chars(text.data(), text.data() + text.size(), x);
  return x;
}

std::string lattice_sentence(const Body &b, double size, const Way &lattice, const Way &own) {
  std::string out = format("body '%s': hexahedra (\"lattice\": {\"size\": %g}) take the place of its cells",
                           b.name.c_str(), size);
  if (!own.bodies.empty())
    out += format(": the error is %.3g %% at %.3g s of processor per second, with its own %.3g %% at %.3g s",
                  100 * lattice.error, lattice.cpu_s_per_s, 100 * own.error, own.cpu_s_per_s);
  return out + "; \"lattice\": null keeps them";
}

// Whether nothing of a closed surface lies beyond the plane of one of its triangles by more than `edge`.
bool convex(const Skin &s, double edge) {
  for (size_t t = 0; t < 3 * size_t{s.ntriangle}; t += 3) {
    const auto corner = [&](size_t k) { return load3(&s.points[3 * size_t{s.triangles[t + k]}]); };
    const Vec3 a = corner(0), across = cross(corner(1) - a, corner(2) - a);
    const double most = dot(across, a) + edge * norm(across);
    for (size_t p = 0; p < s.points.size(); p += 3)
      if (dot(across, load3(&s.points[p])) > most) return false;
  }
  return true;
}

// A card steps so, and mass is scaled for such steps.
bool explicit_alone(const Body &b) { return b.device == "gpu" || b.def.mass_scaling > 0; }

class Reader {
 public:
  Reader(dfm_context *context, const Definition &def, MeshFiles &files)
      : context_(context), def_(def), types_(context->registry), files_(files), tried_(context, def, &files) {
    const auto &keys = def.gravity_keys;
    Vec3 most = load3(def.world.gravity);
    for (const double t : turns_of(keys))
      if (const Vec3 g = vector_at(keys, t); norm2(g) > norm2(most) || t == def.begin) most = g;
    double g[3];
    store3(g, most);
    g_ = length(g);
    for (int k = 0; k < 3; ++k) down_[k] = g_ > 0 ? g[k] / g_ : 0;
    for (const Obstacle &o : def.obstacles) obstacles_.push_back(as_it_begins(o));
    for (const Tool &t : def.tools) obstacles_.push_back(as_it_begins(solid_of(t)));
  }

  std::vector<BodyRegime> run(const Measured &measured) {
    for (const Body &b : def_.bodies) {
      meshes_.push_back(files_.load(b));
      nodal_.push_back(def_.with_pointer(b.pointer + "/nodal_bc", [&]() -> std::vector<NodalRow> {
        if (b.nodal_bc.empty()) return {};
        return read_nodal(files_.path_of(b.nodal_bc), meshes_.back());
      }));
      const std::vector<uint8_t> axes = held_axes(b, meshes_.back(), nodal_.back(), def_.file);
      holds_.push_back({std::ssize(axes) - std::ranges::count(axes, 0), std::ranges::count(axes, 7)});
    }
    for (size_t i = 0; i < meshes_.size(); ++i) {
      const Body &b = def_.bodies[i];
      const dfm_pose pose = b.on.empty() ? b.def.pose : put_on(context_, def_, files_, b, meshes_[i]);
      boxes_.push_back(place(load3(meshes_[i].lo), load3(meshes_[i].hi), pose));
    }
    std::vector<BodyRegime> out;
    for (size_t i = 0; i < meshes_.size(); ++i) out.push_back(regime(i, measured));
    return out;
  }

  // Bodies that may have a lattice of so many cells for each of their tetrahedra have one in `out`, with its
  // edge in `sizes`, m. False: none has. `unmeasured`: one would, had its model measured costs.
  bool lattices(const std::vector<BodyRegime> &own, double times, const Measured &measured,
                std::vector<BodyRegime> &out, std::vector<double> &sizes, bool &unmeasured) {
    out = own;
    sizes.assign(own.size(), 0);
    bool any = false;
    for (size_t i = 0; i < own.size(); ++i) {
      if (!may_have_lattice(i) || !mesh_error_known(own[i])) continue;
      std::vector<std::string> models = candidates(measured, def_.bodies[i], DFM_CELL_HEX8);
      if (!own[i].model.empty()) std::erase_if(models, [&](auto &m) { return m != own[i].model; });
      if (models.empty()) continue;
      std::erase_if(models, [&](auto &id) {
        return std::ranges::none_of(measured.models,
                                    [&](auto &m) { return m.id == id && m.hexahedra.any(); });
      });
      unmeasured |= models.empty();
      if (models.empty()) continue;
      Body b = def_.bodies[i];
      b.fill.reset();
      b.lattice_size =
          round_to_digits(b.scale * std::cbrt(meshes_[i].info.volume / (times * meshes_[i].info.ntet)));
      const Quiet quiet;
      try {
        const BodyMesh mesh = tried_.load(b);
        if (!carries(b, mesh, meshes_[i])) continue;
        // others are not the blocks that are predicted, and large cells would join the sides of a gap
        const auto [found, first] = convex_.try_emplace(i);
        if (first) found->second = convex(mesh.skin, own[i].edge);
        if (!found->second) continue;
        set_mesh(b, mesh, out[i]);
      } catch (const Error &) {
        continue;  // its surface is open or crosses itself, or a box of the scene has none of its points
      }
      out[i].models = models;
      sizes[i] = b.lattice_size;
      any = true;
    }
    return any;
  }

  // The plan of these bodies. Where the scene asks for more than motion, or hinges a body, each is built
  // alone with the model that is chosen for it, and planned again without one that does not take it. The last
  // one stays: building the scene says why not.
  PlannedWay plan(std::vector<BodyRegime> &bodies, const Measured &measured, const Wish &wish) {
    for (;;) {
      PlannedWay out = plan_accuracy(bodies, measured, wish);
      bool refused = false;
      for (size_t i = 0; i < out.way.bodies.size(); ++i) {
        std::vector<std::string> &models = bodies[i].models;
        if (models.size() < 2 || takes(i, out.way.bodies[i].model)) continue;
        std::erase(models, out.way.bodies[i].model);
        refused = true;
      }
      if (!refused) return out;
    }
  }

  // What acts on a body and is no part of its estimate.
  std::vector<std::string> left_out(size_t i, const BodyRegime &r) const {
    const Body &b = def_.bodies[i];
    std::vector<std::string> out;
    const auto add = [&](bool acts, const char *what) {
      if (acts) out.push_back(what);
    };
    const auto to_it = [&](const Attach &a) { return a.to == b.name; };
    add(!b.springs.empty(), "its springs");
    add(std::ranges::any_of(b.fixes, [](const Fix &f) { return f.motion.any(); }),
        "the motion of what is held");
    add(holds_[i].any && !holds_[i].all, "points that are held along some axes only");
    add(std::ranges::any_of(b.forces, [](const Force &f) { return f.sine.amplitude[0] != 0; }),
        "resonance with a force that oscillates");
    add(!r.held && r.load > g_, "the motion that its forces cause");
    add(std::ranges::any_of(b.attach, [&](const Attach &a) { return !holds(a, false); }) ||
            std::ranges::any_of(def_.bodies,
                                [&](const Body &o) { return std::ranges::any_of(o.attach, to_it); }),
        "what it is attached to");
    add(b.start.kind != StartKind::rest, "a start in another shape");
    add(def_.world.self_contact != DFM_SELF_OFF, "contact with itself");
    add(std::ranges::any_of(def_.rigid.bodies, [&](const RigidBody &o) { return may_meet(b, o); }),
        "the motion of rigid bodies");
    add(std::ranges::any_of(def_.tools,
                            [&](const Tool &t) { return t.keys.empty() && may_meet(b, t.solid); }),
        "the motion of tools without keyframes");
    add(r.touches && !mesh_error_known(r), "what its mesh does to its contacts");
    return out;
  }

 private:
  bool takes(size_t i, const std::string &model) {
    const Body &b = def_.bodies[i];
    const bool hinged = holds_[i].any > 0 && holds_[i].all < 3;
    if (b.springs.empty() && !may_be_cut() && !(b.def.mass_scaling > 0) && !hinged) return true;
    const auto [found, first] = takes_.try_emplace({b.name, model});
    if (!first) return found->second;
    const Quiet quiet;
    try {
      dfm_world_destroy(build_alone(context_, def_, b, model, {}).world);
      found->second = true;
    } catch (const Error &) {
      found->second = false;
    }
    return found->second;
  }

  // Only first-order tetrahedra can be cut or torn.
  bool may_be_cut() const {
    return !def_.cuts.empty() ||
           std::ranges::any_of(def_.tools, [](const Tool &t) { return !t.cuts.pointer.empty(); }) ||
           std::ranges::any_of(def_.bodies, [](const Body &b) { return b.separate || b.cut_delay > 0; }) ||
           std::ranges::any_of(def_.materials, [](const Material &m) {
             return std::ranges::find(m.extra.keys, "tear") != m.extra.keys.end();
           });
  }

  // m, by how much what a mesh holds ends elsewhere than what the scene selects: of a box the part in the
  // body, whose surface has the box of `lattice`; else what the own mesh holds.
  double held_off(const Selection &where, const BodyMesh &mesh, const BodyMesh &own,
                  const BodyMesh &lattice) const {
    const auto held = [&](const BodyMesh &by) {
      Extent out;
      for (const uint32_t p : select(where, by, def_.file)) out.add(load3(&by.points[3 * size_t{p}]));
      return out;
    };
    const Extent there = held(mesh);
    Extent here = held(own);
    double off = 0;
    for (int k = 0; k < 3; ++k) {
      if (where.group.empty() && where.points.empty()) {
        here.lo[k] = std::max(where.lo[k], lattice.lo[k]);
        here.hi[k] = std::min(where.hi[k], lattice.hi[k]);
      }
      off = std::max({off, std::fabs(there.lo[k] - here.lo[k]), std::fabs(there.hi[k] - here.hi[k])});
    }
    return off;
  }

  // Whether these cells are held and attached where the scene says as exactly as the body's own are. Throws
  // Error where they have nothing that a force, a spring or an attachment selects.
  bool carries(const Body &b, const BodyMesh &mesh, const BodyMesh &own) const {
    for (const Force &f : b.forces) share(f, mesh, def_.file);
    for (const Spring &s : b.springs)
      if (!s.at_point) select_skin(s.where, mesh, def_.file);
    for (const Attach &a : b.attach) select_skin(a.where, mesh, def_.file);
    const auto stays = [&](const auto &entry) {
      return held_off(entry.where, mesh, own, mesh) <=
             held_off(entry.where, own, own, mesh) + 1e-9 * own.size;
    };
    // points of an attachment may be those of the surface, which `select` does not know
    return std::ranges::all_of(b.fixes, stays) &&
           std::ranges::all_of(b.attach, [&](const Attach &a) { return a.where.points.empty() && stays(a); });
  }

  // Nothing in the scene is about the body's own cells or points.
  bool may_have_lattice(size_t i) const {
    const Body &b = def_.bodies[i];
    const auto own_parts = [&](const auto &list) {
      return !meshes_[i].filled && std::ranges::any_of(list, [](const auto &entry) {
        return !entry.where.group.empty() || !entry.where.points.empty();
      });
    };
    return b.lattice_open && b.fill.value_or(1) && meshes_[i].info.cell != DFM_CELL_HEX8 && !may_be_cut() &&
           b.by_group.empty() && b.fields.empty() && b.nodal_bc.empty() && b.surface.mesh.empty() &&
           !b.surface.boundary && !b.device && b.switches.empty() && b.rule.far.type.empty() &&
           b.start.kind != StartKind::state && !own_parts(b.fixes) && !own_parts(b.forces) &&
           !own_parts(b.springs) && !own_parts(b.attach);
  }

  const Material &material(const Thing &t) const {
    static const Material kNone = {};
    const auto m = std::ranges::find(def_.materials, t.material, &Material::name);
    return m == def_.materials.end() ? kNone : *m;
  }

  static bool moves(const Obstacle &o) { return !o.keys.empty() || o.def.sine.frequency > 0; }
  static bool thrown(const Body &b) { return length(b.def.velocity) > 0 || length(b.def.spin) > 0; }

  // Points that are held, and those that are held along all axes.
  struct Hold { ptrdiff_t any = 0, all = 0; };
  // Whether the attachment holds the body, to an obstacle or to a body that is held; `moving`: to one that
  // moves, too.
  bool holds(const Attach &a, bool moving) const {
    for (size_t k = 0; k < holds_.size(); ++k)
      if (def_.bodies[k].name == a.to) return holds_[k].all > 0;
    for (size_t k = 0; k < def_.obstacles.size(); ++k)
      if (obstacles_[k].name == a.to) return moving || !moves(obstacles_[k]);
    return false;
  }
  bool held(size_t i) const {
    return holds_[i].all > 0 ||
           std::ranges::any_of(def_.bodies[i].attach, [&](const Attach &a) { return holds(a, true); });
  }

  // The times at which what is linear between keys may be at its greatest in the run.
  template <class Key>
  std::vector<double> turns_of(const std::vector<Key> &keys) const {
    if (keys.empty()) return {};
    const double end = def_.begin + def_.duration;
    std::vector<double> out = {def_.begin, end};
    for (const Key &k : keys)
      if (k.t > def_.begin && k.t < end) out.push_back(k.t);
    return out;
  }
  // N, the greatest in the run.
  double greatest(const Force &f) const {
    double scale = f.keys.empty() ? 1 : 0;
    for (const double t : turns_of(f.keys)) scale = std::max(scale, std::fabs(scale_at(f.keys, t)));
    return scale * (1 + std::fabs(f.sine.amplitude[0])) * length(f.total);
  }

  bool may_meet(const Thing &a, const Thing &b) const {
    const auto side = [&](const Thing &t) { return PairSide{t.name, {}, material(t).title}; };
    const Filter *const rule = best_rule(def_.filters, side(a), side(b));
    return !a.sensor && !b.sensor && (!rule || rule->collide);
  }

  // Jaws, blades and ellipsoids count as boxes. Without keys it is not known where the tool comes to.
  static Obstacle solid_of(const Tool &t) {
    constexpr int32_t kShapes[] = {DFM_SHAPE_SPHERE, DFM_SHAPE_CAPSULE, DFM_SHAPE_BOX, DFM_SHAPE_MESH};
    Obstacle o = t.solid;
    o.def.shape = t.def.shape <= DFM_TOOL_MESH ? kShapes[t.def.shape] : DFM_SHAPE_BOX;
    o.def.radius = t.def.radius;
    o.def.half_length = t.def.half_length;
    std::copy_n(t.def.half_size, 3, o.def.half_size);
    o.def.pose = t.def.pose;
    o.keys = t.keys;
    return o;
  }
  Obstacle as_it_begins(Obstacle o) const {
    if (!o.keys.empty()) store_pose(o.def.pose, pose_at(o.keys, def_.begin));
    if (!o.start) return o;
    o.def.pose = *o.start;  // which ends its motion
    o.def.sine = {};
    o.keys.clear();
    return o;
  }

  bool one_is_thrown() const { return std::any_of(def_.bodies.begin(), def_.bodies.end(), thrown); }

  // m, across the contact that a body has with an obstacle. Of a round one by how deep its poses enter the
  // box around the body; where none does, as wide as its radius.
  double width_of(size_t i, const Obstacle &o, const std::vector<double> &scaled) const {
    if (o.def.shape == DFM_SHAPE_PLANE) return HUGE_VAL;
    if (o.def.shape == DFM_SHAPE_SPHERE || o.def.shape == DFM_SHAPE_CAPSULE) {
      double depth = 0;
      for (const dfm_pose_key &key : o.keys)
        depth = std::max(depth, depth_in(boxes_[i], key.pose.position, o.def.radius));
      return depth > 0 ? round_width(o.def.radius, depth) : o.def.radius;
    }
    Obstacle straight = o;
    straight.def.pose = {};
    const Extent box = box_of(straight, scaled);
    return flat_width(box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]);
  }

  // The effect of a moving obstacle on a body: its speed, and the depth to which it enters.
  void add_approach(size_t i, const Obstacle &o, BodyRegime &r) const {
    const bool round = o.def.shape == DFM_SHAPE_SPHERE || o.def.shape == DFM_SHAPE_CAPSULE;
    double way = 0, depth = 0, comes = 0;
    for (size_t k = 0; k < o.keys.size(); ++k) {
      if (round) depth = std::max(depth, depth_in(boxes_[i], o.keys[k].pose.position, o.def.radius));
      if (k == 0) continue;
      double by[3];
      for (int c = 0; c < 3; ++c) by[c] = o.keys[k].pose.position[c] - o.keys[k - 1].pose.position[c];
      way += length(by);
      comes += length(by) > 0;
      r.approach = std::max(r.approach, length(by) / (o.keys[k].t - o.keys[k - 1].t));
    }
    if (o.def.sine.frequency > 0 || o.keys.empty()) comes = HUGE_VAL;
    r.presses += comes;
    const double swing = length(o.def.sine.amplitude);
    r.approach = std::max(r.approach, 2 * kPi * o.def.sine.frequency * swing);
    r.depth = std::max(r.depth, depth > 0 ? depth : way + swing);
  }

  // How far a body falls until it touches something, and its narrowest contact.
  void find_contacts(size_t i, double falls, double &fall, BodyRegime &r) {
    const Body &b = def_.bodies[i];
    const auto narrow = [&](double width, const std::string &name) {
      if (!(width < r.contact)) return;
      r.contact = width;
      r.met = "'" + name + "'";
    };
    const bool flies = one_is_thrown();
    bool met = false;  // by what comes without gravity
    for (size_t k = 0; k < obstacles_.size(); ++k) {
      Obstacle copy = obstacles_[k];
      if (!may_meet(b, copy)) continue;
      const bool comes = k >= def_.obstacles.size() || moves(copy);
      met |= comes || flies;
      std::vector<double> scaled;
      if (!copy.mesh.empty()) files_.load(copy, scaled);
      const bool plane = copy.def.shape == DFM_SHAPE_PLANE;
      const double least = plane ? fall_to_plane(boxes_[i], down_, copy.def.pose)
                                 : fall_to_box(boxes_[i], down_, box_of(copy, scaled));
      fall = std::min(fall, least);
      if ((!r.held && least <= falls) || comes || flies) narrow(width_of(i, copy, scaled), copy.name);
      if (comes) add_approach(i, copy, r);
    }
    for (const RigidBody &body : def_.rigid.bodies) {
      if (!may_meet(b, body)) continue;
      met = true;
      r.presses = HUGE_VAL;
      const dfm_rigid_def &d = body.def;
      const bool round = d.shape == DFM_SHAPE_SPHERE || d.shape == DFM_SHAPE_CAPSULE;
      if (round) narrow(d.radius, body.name);
      if (d.shape == DFM_SHAPE_BOX)
        narrow(flat_width(2 * d.half_size[0], 2 * d.half_size[1], 2 * d.half_size[2]), body.name);
    }
    for (size_t k = 0; k < boxes_.size(); ++k) {
      if (k == i || !may_meet(b, def_.bodies[k])) continue;
      met |= flies;
      const double down = fall_to_box(boxes_[i], down_, boxes_[k]),
                   up = fall_to_box(boxes_[k], down_, boxes_[i]);
      fall = std::min(fall, down);
      r.meets_body = r.meets_body || flies || (!r.held && down <= falls) || (!held(k) && up <= falls);
    }
    r.touches = met || r.meets_body || (!r.held && fall <= falls);
  }

  // Models that take cells of this kind, and that the processor computes: "device" leaves it (device.h).
  // "gpu" asks for one that a card computes, too, with its defaults.
  std::vector<std::string> candidates(const Measured &measured, const Body &b, uint32_t cell) const {
    std::vector<std::string> out;
    for (const MeasuredModel &m : measured.models) {
      const dfm_type *const type = types_.try_find(DFM_KIND_MODEL, m.id);
      if (!type || off_card(types_, *type) || !(model_of(*type).cells & cell)) continue;
      if (b.device == "gpu" && !whole_on_card(context_, def_, b, *type)) continue;
      out.push_back(m.id);
    }
    return out;
  }

  // The edges of cells that are seen as several tetrahedra each are not those of these.
  void set_mesh(const Body &b, const BodyMesh &mesh, BodyRegime &r) const {
    const dfm_mesh_info &info = mesh.info;
    r.points = mesh.info.npoint;
    double side[3];
    for (int k = 0; k < 3; ++k) side[k] = mesh.hi[k] - mesh.lo[k];
    r.length = *std::max_element(side, side + 3);
    r.thickness = *std::min_element(side, side + 3);
    r.edge = info.edge_median;
    r.stiffens = bending_of_tetrahedra(std::clamp(material(b).def.poisson, 0.0, 0.49));
    r.hexahedra = info.cell == DFM_CELL_HEX8;
    if (info.cell == DFM_CELL_TET10) r.edge *= 2;
    else if (info.cell != DFM_CELL_TET) r.edge = std::cbrt(info.volume / info.ncell);
    if (info.cell != DFM_CELL_TET) r.stiffens = r.hexahedra ? kBendingOfHexahedra : kBendingOfSecondOrder;
    r.edge *= b.scale;
    r.cell_size = info.wave_path * b.scale;
  }

  BodyRegime regime(size_t i, const Measured &measured) {
    const Body &b = def_.bodies[i];
    const BodyMesh &mesh = meshes_[i];
    const Material &m = material(b);
    const dfm_mesh_info &info = mesh.info;
    BodyRegime r;
    r.name = b.name;
    set_mesh(b, mesh, r);
    r.young = m.def.young;
    r.poisson = m.def.poisson;
    r.density = m.def.density;
    r.damping_mass = m.def.damping_mass;
    r.damping_stiffness = m.def.damping_stiffness;
    r.load = g_;
    double force = 0;  // N
    for (const Force &f : b.forces) force += greatest(f);
    for (const NodalRow &row : nodal_[i]) force += length(row.force);
    r.load += force / (m.def.density * info.volume * std::pow(b.scale, 3));
    r.held = held(i);
    const double thrown = length(b.def.velocity);
    const double falls = g_ > 0 ? 0.5 * g_ * def_.duration * def_.duration : 0;
    double fall = HUGE_VAL;
    r.presses = one_is_thrown() ? HUGE_VAL : 0;
    find_contacts(i, falls, fall, r);
    r.below = fall;
    const double s = r.held ? HUGE_VAL : fall;
    r.speed = thrown + 0.5 * length(b.def.spin) * r.length;
    if (!r.held) {
      const double way = std::min(s, falls);
      r.travel = thrown * def_.duration + way;
      const double meets = g_ > 0 ? std::sqrt(2 * way / g_) : 0;
      if (r.touches && r.speed + g_ * meets > 0) r.after = std::max(0.0, 1 - meets / def_.duration);
      r.speed = std::sqrt(r.speed * r.speed + 2 * g_ * way);
    }
    r.turns = !r.held && (r.touches || length(b.def.spin) > 0);
    if (!b.model_open)
      r.model = short_name(b.model.empty() ? default_model(types_, info.cell)
                                           : types_.find(DFM_KIND_MODEL, b.model));
    const int32_t named = b.def.integrator != DFM_INTEGRATOR_AUTO ? b.def.integrator : def_.world.integrator;
    if (named != DFM_INTEGRATOR_AUTO) r.scheme = named - DFM_INTEGRATOR_SYMPLECTIC_EULER;
    if (explicit_alone(b) && named == DFM_INTEGRATOR_AUTO) r.scheme = 0;
    r.models = b.model_open ? candidates(measured, b, mesh.info.cell) : std::vector<std::string>{};
    return r;
  }

  dfm_context *context_;
  const Definition &def_;
  const Registry &types_;
  MeshFiles &files_;
  MeshFiles tried_;                  // lattices that are compared; the scene makes those that it takes
  double g_ = 0, down_[3] = {};      // the greatest gravity in the run
  std::vector<Obstacle> obstacles_;  // as they begin, those of tools last
  // by body
  std::vector<BodyMesh> meshes_;
  std::vector<std::vector<NodalRow>> nodal_;
  std::vector<Hold> holds_;
  std::vector<Extent> boxes_;
  std::map<size_t, bool> convex_;                              // bodies
  std::map<std::pair<std::string, std::string>, bool> takes_;  // body, model
};

json way_json(const Way &way, const Definition &def) {
  json bodies = json::array();
  for (size_t i = 0; i < way.bodies.size(); ++i) {
    const BodyWay &b = way.bodies[i];
    bodies.push_back({{"name", def.bodies[i].name},
                      {"model", b.model},
                      {"integrator", scheme_name(b.scheme)},
                      {"model_error", b.model_error},
                      {"time_error", b.time_error},
                      {"mesh_error", b.mesh_error},
                      {"cpu_s_per_s", b.cpu_s_per_s}});
  }
  return {{"step", way.step > 0 ? json(way.step) : json("auto")},
          {"substep_s", way.substep},
          {"error", way.error},
          {"cpu_s_per_s", way.cpu_s_per_s},
          {"frame_s", way.frame},
          {"ms_per_step", ms_per_step(way)},
          {"bodies", bodies}};
}

}  // namespace

std::vector<BodyRegime> regimes(dfm_context *context, const Definition &def, MeshFiles &files,
                                const Measured &measured) {
  return Reader(context, def, files).run(measured);
}

json plan_scene(dfm_context *context, const Definition &def, MeshFiles &files, json &tree) {
  Wish wish = def.wanted;
  wish.duration = def.duration;
  wish.step = def.step;
  const Measured measured = read_costs();
  Reader reader(context, def, files);
  std::vector<BodyRegime> own = reader.run(measured);
  PlannedWay plan = reader.plan(own, measured, wish);
  std::vector<BodyRegime> bodies = own;
  const Way of_own = plan.way;
  std::vector<double> lattice(own.size(), 0);
  bool unmeasured = false;
  for (const double larger : {16.0, 4.0, 1.0}) {  // as many points as the tetrahedra have, or fewer
    std::vector<BodyRegime> others;
    std::vector<double> sizes;
    if (!reader.lattices(own, 1 / (larger * kTetsOfHexahedron), measured, others, sizes, unmeasured))
      continue;
    PlannedWay other = reader.plan(others, measured, wish);
    if (!wins(other, plan, wish)) continue;
    plan = std::move(other);
    bodies = std::move(others);
    lattice = std::move(sizes);
  }
  const char *const key = wish.target > 0 ? "accuracy" : "budget";
  const auto named = [](const BodyRegime &b) { return b.scheme >= 0; };
  const auto first = std::ranges::find_if(bodies, named);
  const auto differs = [&](const BodyRegime &b) { return named(b) && b.scheme != first->scheme; };
  if (!plan.found && std::ranges::any_of(bodies, differs))
    fail(DFM_E_UNSUPPORTED,
         "%s: /%s: bodies that name different integrators are not planned; name one for all of them, or name "
         "models and step and remove \"%s\"",
         def.file.c_str(), key, key);
  if (!plan.found)
    fail(DFM_E_UNSUPPORTED,
         "%s: /%s: there are no measured costs for the models and integrators that this scene names; run "
         "deform calibrate, which measures all that are loaded, or name model, integrator and step and "
         "remove \"%s\"",
         def.file.c_str(), key, key);
  json set = json::object();
  const auto write = [&](const std::string &pointer, const json &value) {
    tree[json::json_pointer(pointer)] = value;
    set[pointer] = value;
  };
  if (unmeasured)
    plan.assumed.push_back(
        "no lattice is proposed where the costs of its hexahedra are not measured: run deform calibrate");
  bool implicit = false;
  for (size_t i = 0; i < bodies.size(); ++i) {
    const BodyWay &way = plan.way.bodies[i];
    const Body &b = def.bodies[i];
    if (explicit_alone(b) && b.def.integrator == DFM_INTEGRATOR_AUTO)
      write(b.pointer + "/integrator", scheme_name(way.scheme));
    if (b.model_open) write(b.pointer + "/model/type", way.model);
    if (lattice[i] > 0) {
      if (b.fill) write(b.pointer + "/fill", nullptr);
      write(b.pointer + "/lattice/size", lattice[i]);
      plan.assumed.push_back(lattice_sentence(b, lattice[i], plan.way, of_own));
    }
    if (way.scheme != Scheme::explicit_euler && def.world.integrator == DFM_INTEGRATOR_AUTO && !implicit) {
      write("/time/integrator", scheme_name(way.scheme));
      implicit = true;
    }
  }
  if (!implicit && def.world.integrator == DFM_INTEGRATOR_AUTO)
    write("/time/integrator", scheme_name(Scheme::explicit_euler));
  if (!(def.step > 0) && plan.way.step > 0) write("/time/step", plan.way.step);
  // The allowed creep of a resting contact over the whole time is a tenth of the error.
  double scale = HUGE_VAL;
  for (const BodyRegime &b : bodies)
    if (b.touches) scale = std::min(scale, std::max({estimate(b, def.duration).sag, b.travel, b.depth}));
  const double creep = 0.1 * wish.target * scale / def.duration;
  if (creep > 0 && !(def.world.contact_tolerance > 0) && creep < kDefaultTolerance) {
    const double tolerance = std::max(creep, kMinTolerance);
    write("/contact/tolerance", tolerance);
    plan.assumed.push_back(
        format("contact tolerance %.2g m/s: what rests creeps in %g s by at most a tenth of the target, of a "
               "displacement of %.3g m",
               tolerance, def.duration, scale));
  }
  json considered = json::array();
  for (const Way &w : plan.considered) considered.push_back(way_json(w, def));
  // What is not predicted is not claimed.
  std::vector<std::string> unknown;
  for (size_t i = 0; i < bodies.size(); ++i)
    if (const std::vector<std::string> what = reader.left_out(i, bodies[i]); !what.empty())
      unknown.push_back(format("body '%s': the prediction leaves out %s", bodies[i].name.c_str(),
                               join(what, ", ").c_str()));
  plan.assumed.insert(plan.assumed.end(), unknown.begin(), unknown.end());
  const bool claims = unknown.empty() || !(wish.target > 0) || !plan.meets;
  if (!claims)
    plan.missed = format("whether the target of %.3g %% is met is not known: ", 100 * wish.target) +
                  join(unknown, "; ");
  json out = {{"costs", measured.machine},
              {"meets", claims ? json(plan.meets) : json()},
              {"set", set},
              {"predicted", way_json(plan.way, def)},
              {"assumed", plan.assumed},
              {"considered", considered}};
  if (!plan.missed.empty()) out["missed"] = plan.missed;
  return out;
}

}  // namespace dfm::scene
