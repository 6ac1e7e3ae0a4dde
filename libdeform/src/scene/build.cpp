#include "scene/build.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "body/obstacle_mesh.h"
#include "core/error.h"
#include "core/handle.h"
#include "core/names.h"
#include "dynamics/rigid/host.h"
#include "math/extent.h"
#include "math/turn.h"
#include "plugin/context.h"
#include "scene/jitter.h"
#include "scene/place.h"
#include "scene/rotation.h"
#include "scene/table.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "world/equilibrium.h"
#include "world/model_change.h"
#include "world/queries.h"

namespace dfm::scene {
namespace {

Vec3 center(const dfm::Body &b) {
  Vec3 sum{0, 0, 0};
  for (uint32_t i = 0; i < b.p.n; ++i) sum = sum + load3(&b.p.x[size_t{kStride} * i]);
  return (1.0 / b.p.n) * sum;
}

// Warns once per obstacle. An open mesh acts on the side that its triangles face; a file whose triangles face
// the other way looks the same in a picture, and a body that falls on its back sticks to it.
void warn_back_side(dfm_context *context, const World &world, Vec3 gravity) {
  if (!(norm(gravity) > 0)) return;
  for (const auto &o : world.obstacles) {
    if (!o || !o->mesh || o->mesh->closed || o->sensor || o->rigid) continue;
    const dfm::Triangles triangles = search(*o);
    const Vec3 down = rotate_back(o->pose.rotation, normalized(gravity));
    for (const auto &b : world.bodies) {
      if (!b) continue;
      const Vec3 from = rotate_back(o->pose.rotation, center(*b) - o->pose.position);
      const uint32_t first = first_on_ray(triangles, from, down, kFar).triangle;
      if (first == kNone || dot(normal_of(triangles, first), down) <= 0) continue;
      context->warn(*b,
                    " would fall on the back of obstacle '%s': its mesh is open and acts only on the side "
                    "that its triangles face; reverse the order of their corners in the file",
                    o->name.c_str());
      break;
    }
  }
}

// Share of its size that a body may fall in a step from rest. A ball of 3,000 cells of corotational_fem and
// 0.1 mm radius takes 3 s of processor time for 1/60 s at 3.9 sizes, and 0.4 s in steps of 0.014.
constexpr double kFall = 1;
// That it falls in the step that is proposed.
constexpr double kShort = 0.01;

// m, diagonal of the box around the points; 0 where some are held, so that it does not fall.
double size_of_free(const dfm::Body &b) {
  Extent box;
  for (uint32_t i = 0; i < b.p.n; ++i) {
    if (b.p.held[i]) return 0;
    box.add(load3(&b.p.x[size_t{kStride} * i]));
  }
  return box.diagonal();
}

// Explicit time cuts a step into stable sub-steps; implicit time takes it whole. A body that falls through
// many of its own sizes in it is far inside of what it lands on, and the search for the moment of contact
// takes most of the time. step: s, as the scene names it.
void warn_long_step(dfm_context *context, const World &world, double step) {
  const double g = norm(world.gravity.now), fall = 0.5 * g * step * step;
  if (!(fall > 0) || !world.plan.touches()) return;
  for (const auto &b : world.bodies) {
    if (!b || b->integrator.used == DFM_INTEGRATOR_SYMPLECTIC_EULER || b->model.stepper) continue;
    const double size = size_of_free(*b);
    if (!(size > 0) || fall <= kFall * size) continue;
    context->warn(*b,
                  " is %.3g m in size and falls %.3g m in a step of %.3g s: landing takes many sub-steps and "
                  "most of the time; take a time.step of %.2g s, or \"auto\"",
                  size, fall, step, std::sqrt(2 * kShort * size / g));
    return;  // one sentence for the scene
  }
}

// World positions of the points of a body that begins scrambled, flattened or inside out, [npoint,3]: a
// change of the rest positions about the center of their box, then the pose.
std::vector<double> start_positions(const Start &start, const BodyMesh &mesh, const dfm_pose &pose) {
  std::vector<double> x(mesh.points);
  Jitter random(start.seed);
  const Quat turn = load_quat(pose.rotation);
  for (size_t i = 0; i < x.size(); i += 3) {
    for (size_t k = 0; k < 3; ++k) {
      const double center = (mesh.lo[k] + mesh.hi[k]) / 2, half = (mesh.hi[k] - mesh.lo[k]) / 2;
      switch (start.kind) {
        case StartKind::scramble: x[i + k] = center + half * random.symmetric(); break;
        // the plane keeps x and y, the line x alone
        case StartKind::plane:
          if (k > 1) x[i + k] = center;
          break;
        case StartKind::line:
          if (k > 0) x[i + k] = center;
          break;
        case StartKind::point: x[i + k] = center; break;
        case StartKind::invert: x[i + k] = 2 * center - x[i + k]; break;
        case StartKind::rest:
        case StartKind::state: break;
      }
    }
    double turned[3];
    rotate(turn, &x[i], turned);
    for (size_t k = 0; k < 3; ++k) x[i + k] = turned[k] + pose.position[k];
  }
  return x;
}

class Builder {
 public:
  Builder(dfm_context *context, Definition &def, MeshFiles &files, uint64_t seed)
      : context_(context), def_(def), jittered_(seed != 0), jitter_(seed), files_(files) {}
  ~Builder() {
    if (world_) dfm_world_destroy(world_);
  }
  Builder(const Builder &) = delete;

  Built run() {
    create_world();
    for (Material &m : def_.materials) create_material(m);
    create_things();
    warn_back_side(context_, world(), load3(def_.world.gravity));
    for (const Tool &t : def_.tools) set_cuts(t);
    for (Friction &f : def_.friction) add_friction(f);
    for (const Filter &f : def_.filters)
      def_.require(dfm_world_filter_pair(world_, f.between[0].c_str(), f.between[1].c_str(), f.collide),
                   f.pointer);
    for (const Body &b : def_.bodies) {
      const dfm_body body = find_body(b.name, b.pointer);
      for (const Attach &a : b.attach) add_attachment(body, a);
      if (b.separate) def_.require(dfm_body_set_separate(body, &*b.separate), b.pointer + "/separate");
      if (b.cut_delay > 0) def_.require(dfm_body_set_cut_delay(body, b.cut_delay), b.pointer + "/cut_delay");
    }
    // Makes the plan now, so that a missing effect is an error of the scene and not of its first step.
    double step = 0;
    def_.require(dfm_world_stable_step(world_, &step, nullptr, nullptr),
                 def_.effects_auto ? "/bodies" : "/effects");
    if (def_.equilibrium) def_.with_pointer("/time/mode", [&] { check_equilibrium(world()); });
    else if (def_.step > 0) warn_long_step(context_, world(), def_.step);
    // What a model that steps itself would refuse in the first step.
    for (const Body &b : def_.bodies)
      def_.with_pointer(b.pointer + "/model", [&] { check_first_step(world(), *world().find_body(b.name)); });
    for (const Cut &c : def_.cuts) plan_cut(c);  // before changes of models, which check them
    for (Body &b : def_.bodies) add_switches(b);
    return {std::exchange(world_, 0), std::move(probes_)};
  }

 private:
  World &world() const { return resolve<World>(Kind::world, world_); }

  dfm_body find_body(const std::string &name, const std::string &pointer) const {
    dfm_body body = 0;
    def_.require(dfm_world_find_body(world_, name.c_str(), &body), pointer);
    return body;
  }

  void create_world() {
    dfm_world_def w = def_.world;
    if (!def_.equilibrium) w.step = std::min(def_.step > 0 ? def_.step : kFrame, def_.duration);
    w.solver = def_.solver.c_str();
    std::vector<const char *> effects;
    for (const std::string &e : def_.effects) effects.push_back(e.c_str());
    effects.push_back(nullptr);
    if (!def_.effects_auto) w.effects = effects.data();
    def_.require(dfm_world_create(context_, &w, &world_), def_.effects_auto ? "/contact" : "/effects");
    world().time = def_.begin;
    if (def_.gravity_keys.empty()) return;
    def_.require(
        dfm_world_set_gravity_keys(world_, uint32_t(def_.gravity_keys.size()), def_.gravity_keys.data()),
        "/gravity/keyframes");
  }

  // Bodies, obstacles, rigid bodies, tools, in the order of the scene, or of their ids.
  void create_things() {
    struct Made {
      const Thing *thing;
      std::function<void()> create;
      uint64_t rank() const { return thing->id ? thing->id : UINT64_MAX; }
    };
    std::vector<Made> things;
    for (Body &b : def_.bodies) things.push_back({&b, [this, &b] { create_body(b); }});
    for (Obstacle &o : def_.obstacles) things.push_back({&o, [this, &o] { create_obstacle(o); }});
    const Thing none;
    const Thing *const first = def_.rigid.bodies.empty() ? &none : &def_.rigid.bodies[0];
    things.push_back({first, [this] { create_rigid(def_.rigid); }});
    for (Tool &t : def_.tools) things.push_back({&t.solid, [this, &t] { create_tool(t); }});
    std::stable_sort(things.begin(), things.end(),
                     [](const Made &a, const Made &b) { return a.rank() < b.rank(); });
    World &w = world();
    for (const auto &[thing, create] : things) {
      if (thing->id && thing->id < w.next_id)
        fail(DFM_E_ARG,
             "%s: %s/id: %llu is taken; ids of bodies, obstacles, rigid bodies and tools are unique",
             def_.file.c_str(), thing->pointer.c_str(), static_cast<unsigned long long>(thing->id));
      if (thing->id) w.next_id = thing->id;
      create();
    }
  }

  void create_material(Material &m) {
    m.def.name = m.title.empty() ? nullptr : m.title.c_str();
    m.def.extra = m.extra.view();
    def_.require(dfm_material_create(world_, &m.def, &materials_[m.name]), m.pointer);
  }

  dfm_material material(const std::string &name) const { return name.empty() ? 0 : materials_.at(name); }

  // Material of each cell; empty if no group has its own material.
  std::vector<dfm_material> materials_by_group(const Body &b, const BodyMesh &mesh) const {
    std::vector<dfm_material> of_group(mesh.info.ngroup, material(b.material)), out;
    if (b.by_group.empty()) return out;
    std::vector<std::string> names;
    std::vector<uint32_t> cells(mesh.info.ngroup, 0);
    for (uint32_t t = 0; t < mesh.info.ntet; ++t)
      if (mesh.info.cell_group[t] != UINT32_MAX) ++cells[mesh.info.cell_group[t]];
    for (uint32_t g = 0; g < mesh.info.ngroup; ++g)
      if (cells[g]) names.push_back(mesh.info.group_names[g]);
    for (const GroupMaterial &m : b.by_group) {
      if (std::find(names.begin(), names.end(), m.group) == names.end())
        fail(DFM_E_ARG, "%s: %s: the mesh has no physical group of cells \"%s\"%s%s", def_.file.c_str(),
             m.pointer.c_str(), m.group.c_str(),
             names.empty() ? "; it has none at all" : ("; it has: " + join(names)).c_str(),
             did_you_mean(m.group, names).c_str());
      for (uint32_t g = 0; g < mesh.info.ngroup; ++g)
        if (cells[g] && m.group == mesh.info.group_names[g]) of_group[g] = material(m.material);
    }
    for (uint32_t t = 0; t < mesh.info.ntet; ++t)
      out.push_back(mesh.info.cell_group[t] == UINT32_MAX ? material(b.material)
                                                          : of_group[mesh.info.cell_group[t]]);
    return out;
  }

  // Named parts of the surface: the skin's, or the file's groups of triangles.
  static dfm_surface_groups groups_of(const BodyMesh &mesh) {
    const uint32_t size = sizeof(dfm_surface_groups);
    if (mesh.wears_skin)
      return {size, mesh.skin.ngroup, mesh.skin.group_names,   mesh.skin.ntriangle,
              0,    nullptr,          mesh.skin.triangle_group};
    return {size,
            mesh.info.nface ? mesh.info.ngroup : 0,
            mesh.info.group_names,
            mesh.info.nface,
            0,
            mesh.info.faces,
            mesh.info.face_group};
  }

  // Weights of forces that are divided by mass: density times share.
  std::vector<double> cell_weights(const BodyMesh &mesh, const std::vector<dfm_material> &materials) const {
    std::vector<double> out;
    if (!mesh.info.share && !mesh.info.inside && materials.empty()) return out;
    std::map<dfm_material, double> density = {{0, dfm_material_def_default().density}};
    for (const Material &m : def_.materials) density[materials_.at(m.name)] = m.def.density;
    for (uint32_t t = 0; t < mesh.info.ntet; ++t)
      out.push_back(mesh.share_of(t) * (materials.empty() ? 1 : density.at(materials[t])));
    return out;
  }

  void create_body(Body &b) {
    BodyMesh mesh = files_.load(b, true);
    const std::vector<dfm_material> materials = materials_by_group(b, mesh);
    mesh.cell_weight = cell_weights(mesh, materials);
    std::vector<NodalRow> nodal;
    if (!b.nodal_bc.empty())
      nodal = def_.with_pointer(b.pointer + "/nodal_bc",
                                [&] { return read_nodal(files_.path_of(b.nodal_bc), mesh); });
    std::vector<std::vector<double>> values;
    std::vector<dfm_cell_field> fields;
    for (const FieldFile &f : b.fields) {
      values.push_back(
          def_.with_pointer(f.pointer, [&] { return read_field(files_.path_of(f.path), f, mesh); }));
      fields.push_back({f.key.c_str(), values.back().data(), f.width});
    }
    const std::vector<uint8_t> fixed = held_axes(b, mesh, nodal, def_.file);

    dfm_body_def &d = b.def;
    d.name = b.name.c_str();
    d.npoint = mesh.info.npoint;
    d.ntet = mesh.info.ntet;
    d.points = mesh.points.data();
    d.tets = mesh.info.tets;
    d.cell = mesh.info.cell;
    d.cells = mesh.info.cells;
    d.material = material(b.material);
    d.model = b.model.empty() ? nullptr : b.model.c_str();
    d.model_params = b.params.view();
    d.fixed = fixed.data();
    d.nfield = uint32_t(fields.size());
    d.fields = fields.data();
    if (!materials.empty()) d.cell_materials = materials.data();
    d.cell_share = mesh.info.share;
    d.cell_inside = mesh.info.inside;
    const Skin &skin = mesh.skin;
    const dfm_surface_def surface = {sizeof(dfm_surface_def), b.surface.coupling, skin.npoint,
                                     skin.ntriangle,          skin.points.data(), skin.triangles,
                                     b.surface.support};
    if (mesh.wears_skin) d.surface = &surface;
    const dfm_surface_groups groups = groups_of(mesh);
    if (groups.ngroup) d.groups = &groups;
    if (jittered_ && b.start.kind != StartKind::state) {
      const double center[3] = {(mesh.lo[0] + mesh.hi[0]) / 2, (mesh.lo[1] + mesh.hi[1]) / 2,
                                (mesh.lo[2] + mesh.hi[2]) / 2};
      jitter_.apply(mesh.size, center, d.pose, d.velocity, d.spin);
    }
    if (!b.on.empty()) d.pose = put_on(context_, def_, files_, b, mesh);
    dfm_body body = 0;
    def_.require(dfm_body_create(world_, &d, &body), b.pointer);
    if (b.sensor) def_.require(dfm_body_set_sensor(body, true), b.pointer);
    if (b.start.kind != StartKind::rest && b.start.kind != StartKind::state)
      def_.require(
          dfm_body_set_state(body, mesh.info.npoint, start_positions(b.start, mesh, d.pose).data(), nullptr),
          b.start.pointer);
    for (const Fix &f : b.fixes) move_held(body, f, mesh);
    add_loads(body, b, mesh, nodal);
    for (const Spring &s : b.springs) add_spring(body, s, b.name, mesh);
    if (b.start.kind == StartKind::state) set_state(body, b, mesh);
    for (Attach &a : b.attach) {
      if (mesh.wears_skin) a.surfels = select_skin(a.where, mesh, def_.file);
      else a.points = select(a.where, mesh, def_.file);
    }
    for (const Probe &p : def_.probes)
      if (p.body == b.name) add_probe(body, p, mesh);
  }

  // Also moves held points, which dfm_body_set_state does not move.
  void set_state(dfm_body body, const Body &b, const BodyMesh &mesh) {
    const std::string pointer = b.start.pointer + "/state";
    StartState state =
        def_.with_pointer(pointer, [&] { return read_start_state(files_.path_of(b.start.state), mesh); });
    dfm::Body &made = resolve<dfm::Body>(Kind::body, body);
    if (jittered_ && made.motions.empty()) jitter(state, mesh.size);  // else its points are placed by these
    if (!made.dynamics->abilities().placed)
      def_.refuse(
          pointer,
          format("the model '%s' moves the body as a whole, so its points cannot be placed one by one",
                 made.model.type->id),
          DFM_E_UNSUPPORTED);
    for (uint32_t i = 0; i < mesh.info.npoint; ++i)
      for (size_t k = 0; k < 3; ++k)
        if (made.p.held[i] & (1u << k)) {
          made.p.x[kStride * size_t{i} + k] = state.x[3 * size_t{i} + k];
          made.p.v[kStride * size_t{i} + k] = state.v[3 * size_t{i} + k];
        }
    def_.require(dfm_body_set_state(body, mesh.info.npoint, state.x.data(), state.v.data()), pointer);
  }

  // Moves a state as a rigid body, about the center of its points.
  void jitter(StartState &state, double size) {
    Extent box;
    for (size_t i = 0; i < state.x.size(); i += 3) box.add(load3(&state.x[i]));
    double center[3], velocity_scale[3] = {1, 1, 1}, none[3] = {};
    store3(center, 0.5 * (box.lo + box.hi));
    dfm_pose moved{};
    jitter_.apply(size, center, moved, velocity_scale, none);
    const Pose by = load_pose(moved);
    for (size_t i = 0; i < state.x.size(); i += 3) {
      store3(&state.x[i], place(by, load3(&state.x[i])));
      store3(&state.v[i], velocity_scale[0] * rotate(by.rotation, load3(&state.v[i])));
    }
  }

  // Checks the complete world, so that an impossible change is an error of the scene.
  void add_switches(Body &b) const {
    if (b.switches.empty() && b.rule.far.type.empty()) return;
    const std::string pointer = b.pointer + "/switch";
    const dfm_body body = find_body(b.name, pointer);
    std::vector<dfm_switch> switches;
    for (Switch &s : b.switches) {
      dfm_switch to = dfm_switch_default();
      to.integrator = s.model.integrator;
      to.t = s.t;
      to.type = s.model.type.c_str();
      to.params = s.model.params.view();
      to.max_jump = s.max_jump;
      switches.push_back(to);
      if (s.t > 0 && s.t >= def_.begin + end_of_changes())
        context_->warn(b,
                       ": its change to '%s' at %g s (%s/t) is never made, because no step begins then or "
                       "later; give an earlier time, or a longer /time/duration",
                       s.model.type.c_str(), s.t, s.pointer.c_str());
    }
    if (!switches.empty())
      def_.require(dfm_body_set_switches(body, uint32_t(switches.size()), switches.data()), pointer);
    if (!b.rule.far.type.empty()) {
      dfm_switch_rule rule = b.rule.values;
      rule.touching = b.rule.touching.view();
      rule.near_by = b.rule.near.view();
      rule.otherwise = b.rule.far.view();
      def_.require(dfm_body_set_switch_rule(body, &rule), pointer);
    }
    warn_idle_changes(resolve<dfm::Body>(Kind::body, body), pointer);
    if (!def_.equilibrium) return;
    def_.with_pointer(pointer, [&] {
      dfm::Body &made = resolve<dfm::Body>(Kind::body, body);
      rehearse(made, made.switches, made.rule, true);
    });
  }

  // Changes to the model that the body already has.
  void warn_idle_changes(const dfm::Body &b, const std::string &pointer) const {
    const ModelChoice *last = nullptr;
    for (size_t i = 0; i < b.switches.size(); ++i) {
      const ModelChoice &to = b.switches[i].to;
      if (last ? alike(*last, to) : is_made_so(b, to))
        context_->warn(
            b,
            ": its change at %g s (%s/%zu) is to the model that the body already has then, '%s' with the "
            "same parameters: it only resets the state of the model (plastic strain, for example)",
            b.switches[i].t, pointer.c_str(), i, to.type.c_str());
      last = &to;
    }
    for (const dfm::SwitchRule &r : b.rule)
      for (const ModelChoice *other : {&r.touching, &r.near})
        if (!other->type.empty() && alike(*other, r.far))
          context_->warn(b,
                         ": the rule at %s names '%s' with the same parameters for \"far\" and for \"%s\", "
                         "so it changes nothing between them",
                         pointer.c_str(), r.far.type.c_str(), other == &r.near ? "near" : "touching");
  }
  static bool alike(const ModelChoice &a, const ModelChoice &b) {
    return a.type == b.type && a.params == b.params &&
           (a.integrator == b.integrator || b.integrator == kSameIntegrator);
  }

  // s after the start: no step of the scene's duration, or search for an equilibrium, begins then or later.
  double end_of_changes() const {
    const double step = def_.equilibrium && !(def_.step > 0) ? def_.duration : def_.step;
    if (!(step > 0)) return def_.duration;
    const double steps = std::max(1.0, std::ceil(def_.duration / step - 1e-3));
    return (steps - 1) * step + 2e-6 * step;
  }

  void move_held(dfm_body body, const Fix &f, const BodyMesh &mesh) const {
    if (!f.motion.any()) return;
    const std::vector<uint32_t> points = select(f.where, mesh, def_.file);
    def_.require(dfm_body_move_held(body, uint32_t(points.size()), points.data(),
                                    uint32_t(f.motion.keys.size()), f.motion.keys.data(), &f.motion.sine),
                 f.where.pointer + "/motion");
  }

  void add_loads(dfm_body body, const Body &b, const BodyMesh &mesh,
                 const std::vector<NodalRow> &nodal) const {
    std::vector<uint32_t> points;
    std::vector<double> forces;
    for (const NodalRow &row : nodal) {
      if (row.force[0] == 0 && row.force[1] == 0 && row.force[2] == 0) continue;
      points.push_back(row.point);
      forces.insert(forces.end(), row.force, row.force + 3);
    }
    if (!points.empty())
      def_.require(dfm_body_add_load(body, uint32_t(points.size()), points.data(), forces.data(), 0, nullptr,
                                     nullptr, nullptr),
                   b.pointer + "/nodal_bc");
    for (const Force &f : b.forces) {
      const Shared shared = share(f, mesh, def_.file);
      forces.clear();
      for (double w : shared.weights)
        for (double t : f.total) forces.push_back(w * t);
      const bool sine = f.sine.amplitude[0] != 0;
      def_.require(
          dfm_body_add_load(body, uint32_t(shared.points.size()), shared.points.data(), forces.data(),
                            uint32_t(f.keys.size()), f.keys.data(), sine ? &f.sine : nullptr, nullptr),
          f.where.pointer);
    }
  }

  // The tetrahedron that contains a point of the body at rest, or the nearest one if the point is close to
  // it.
  uint32_t find_near(const double point[3], const std::string &pointer, const std::string &name,
                     const BodyMesh &mesh) const {
    double away;
    const uint32_t tet = mesh.finder().find(mesh.finder().local(point), away);
    if (!(away <= 0.25 * mesh.size))
      def_.refuse(pointer + "/point",
                  format("lies %g m away from \"%s\"; ", away, name.c_str()) + span_of(mesh));
    return tet;
  }

  void add_spring(dfm_body body, const Spring &s, const std::string &name, const BodyMesh &mesh) const {
    std::vector<uint32_t> points;
    std::vector<double> weights(4);
    if (s.at_point) {
      const uint32_t tet = find_near(s.point, s.pointer, name, mesh);
      points.assign(mesh.info.tets + 4 * size_t{tet}, mesh.info.tets + 4 * size_t{tet} + 4);
      mesh.finder().corner_weights(mesh.finder().local(s.point), tet, weights.data());
      // a point outside the body acts on the nearest place of the cell
      for (double &w : weights) w = std::max(w, 0.0);
    } else {
      points = select(s.where, mesh, def_.file);
    }
    dfm_spring_def d = s.def;
    d.size = sizeof d;
    d.npoint = uint32_t(points.size());
    d.points = points.data();
    d.weights = s.at_point ? weights.data() : nullptr;
    d.keys = s.keys.data();
    d.nkey = uint32_t(s.keys.size());
    def_.require(dfm_body_add_spring(body, &d, nullptr), s.pointer);
  }

  // A body, an obstacle or a rigid body by its name.
  uint64_t find_thing(const Attach &a) const {
    const World &w = world();
    std::vector<std::string> names;
    for (const auto &b : w.bodies) {
      if (b->name == a.to) return b->handle;
      names.push_back(b->name);
    }
    for (const auto &o : w.obstacles) {
      if (o->name == a.to) return o->handle;
      names.push_back(o->name);
    }
    fail(DFM_E_ARG, "%s: %s/to: there is no body, obstacle or rigid body \"%s\"%s", def_.file.c_str(),
         a.pointer.c_str(), a.to.c_str(), did_you_mean(a.to, names).c_str());
  }

  void add_attachment(dfm_body body, const Attach &a) const {
    dfm_attach_def d = a.def;
    d.to = find_thing(a);
    d.points = a.points.data();
    d.npoint = uint32_t(a.points.size());
    d.surfels = a.surfels.data();
    d.nsurfel = uint32_t(a.surfels.size());
    def_.require(dfm_body_attach(body, &d, nullptr), a.pointer);
  }

  void add_probe(dfm_body body, const Probe &p, const BodyMesh &mesh) {
    ProbePoint probe;
    probe.name = p.name;
    probe.body = body;
    probe.tet = find_near(p.point, p.pointer, p.body, mesh);
    double w[kMaxNodes];
    probe.weights.assign(w, w + mesh.finder().weights(mesh.finder().local(p.point), probe.tet, w).size());
    // Probes are reported in the scene's order, whatever the order of their bodies.
    if (probes_.size() < def_.probes.size()) probes_.resize(def_.probes.size());
    probes_[size_t(&p - def_.probes.data())] = std::move(probe);
  }

  void create_obstacle(Obstacle &o) {
    o.def.name = o.name.c_str();
    o.def.nkey = uint32_t(o.keys.size());
    o.def.keys = o.keys.data();
    o.def.material = material(o.material);
    std::vector<double> points;
    if (!o.mesh.empty()) files_.load(o, points);
    dfm_obstacle obstacle = 0;
    def_.require(dfm_obstacle_create(world_, &o.def, &obstacle), o.pointer);
    if (o.sensor) def_.require(dfm_obstacle_set_sensor(obstacle, true), o.pointer);
    if (o.start) def_.require(dfm_obstacle_teleport(obstacle, &*o.start), o.pointer + "/start");
  }

  void create_rigid(Rigid &rigid) {
    if (rigid.bodies.empty()) {
      // a missing host is an error in any case
      return def_.with_pointer(rigid.pointer + "/host", [&] { find_host(rigid.host); });
    }
    std::vector<dfm_rigid_def> bodies;
    std::vector<dfm_joint_def> joints;
    for (RigidBody &b : rigid.bodies) {
      b.def.name = b.name.c_str();
      b.def.material = material(b.material);
      const uint32_t number = uint32_t(bodies.size());
      if (const uint64_t id = world().next_id + number; b.id && b.id != id)
        fail(DFM_E_ARG, "%s: %s/id: expected %llu, since ids of rigid bodies follow the first; omit it",
             def_.file.c_str(), b.pointer.c_str(), static_cast<unsigned long long>(id));
      bool tied = b.def.fixed != 0;
      for (const RigidBody &other : rigid.bodies)
        for (const Joint &j : other.joints) tied = tied || &other == &b || j.with == b.name;
      if (jittered_ && !tied) {  // jointed bodies are placed by their joints
        const double center[3] = {0, 0, 0}, *const a = b.def.half_size;
        const double size = b.def.shape == DFM_SHAPE_BOX ? 2 * std::max({a[0], a[1], a[2]})
                                                         : 2 * (b.def.radius + b.def.half_length);
        if (b.start) {
          dfm_pose now{};
          store_pose(now, load_pose(*b.start));
          jitter_.apply(size, center, now, b.start->velocity, b.start->spin);
          store_pose(*b.start, load_pose(now));
        } else {
          jitter_.apply(size, center, b.def.pose, b.def.velocity, b.def.spin);
        }
      }
      bodies.push_back(b.def);
      for (Joint &j : b.joints) {
        j.def.body = number;
        j.def.with = DFM_RIGID_WORLD;
        for (uint32_t k = 0; k < rigid.bodies.size(); ++k)
          if (rigid.bodies[k].name == j.with) j.def.with = k;
        joints.push_back(j.def);
      }
    }
    const dfm_rigid_set_def set = {sizeof set, uint32_t(bodies.size()), uint32_t(joints.size()),
                                   0,          bodies.data(),           joints.data(),
                                   nullptr};
    std::vector<dfm_rigid> made(bodies.size());
    def_.require(dfm_rigid_create(world_, rigid.host.c_str(), &set, made.data()), rigid.pointer);
    for (size_t i = 0; i < made.size(); ++i)
      if (rigid.bodies[i].sensor)
        def_.require(dfm_obstacle_set_sensor(made[i], true), rigid.bodies[i].pointer);
    for (size_t i = 0; i < made.size(); ++i)
      if (rigid.bodies[i].start)
        def_.require(dfm_rigid_set_state(made[i], &*rigid.bodies[i].start),
                     rigid.bodies[i].pointer + "/start");
  }

  void create_tool(Tool &t) {
    t.def.name = t.solid.name.c_str();
    t.def.material = material(t.solid.material);
    if (!t.hand.empty())
      def_.with_pointer(t.solid.pointer + "/motion/file", [&] { read_hand(files_.path_of(t.hand), t); });
    t.def.nkey = uint32_t(t.keys.size());
    t.def.keys = t.keys.data();
    t.def.nopening = uint32_t(t.opening_keys.size());
    t.def.opening_keys = t.opening_keys.data();
    std::vector<double> points;
    if (!t.solid.mesh.empty()) {
      files_.load(t.solid, points);
      t.def.npoint = t.solid.def.npoint;
      t.def.ntriangle = t.solid.def.ntriangle;
      t.def.points = t.solid.def.points;
      t.def.triangles = t.solid.def.triangles;
    }
    dfm_tool tool = 0;
    def_.require(dfm_tool_create(world_, &t.def, &tool), t.solid.pointer);
  }

  void set_cuts(const Tool &t) const {
    if (t.cuts.bodies.empty()) return;
    dfm_tool tool = 0;
    def_.require(dfm_world_find_tool(world_, t.solid.name.c_str(), &tool), t.cuts.pointer);
    std::vector<dfm_body> bodies;
    for (const std::string &name : t.cuts.bodies) bodies.push_back(find_body(name, t.cuts.pointer));
    def_.require(dfm_tool_set_cuts(tool, t.cuts.how, t.cuts.most, uint32_t(bodies.size()), bodies.data()),
                 t.cuts.pointer);
  }

  void plan_cut(const Cut &c) const {
    def_.require(dfm_body_plan_cut(find_body(c.body, c.pointer), c.t, &c.def), c.pointer);
    if (c.t > def_.begin + def_.duration)
      context_->warn(
          "body '%s': its cut at %g s (%s/t) is never made, because the run ends before; give an earlier "
          "time, or a longer /time/duration",
          c.body.c_str(), c.t, c.pointer.c_str());
  }

  void add_friction(Friction &f) {
    dfm_friction_def &d = f.def;
    d.size = sizeof d;
    d.between[0] = f.between[0].c_str();
    d.between[1] = f.between[1].c_str();
    d.law = f.law.c_str();
    d.params = f.params.view();
    def_.require(dfm_world_add_friction(world_, &d), f.pointer);
  }

  dfm_context *context_;
  Definition &def_;
  bool jittered_;
  Jitter jitter_;
  dfm_world world_ = 0;
  std::map<std::string, dfm_material> materials_;
  MeshFiles &files_;
  std::vector<ProbePoint> probes_;
};

}  // namespace

Built build(dfm_context *context, Definition &def, MeshFiles &files, uint64_t jitter_seed) {
  return Builder(context, def, files, jitter_seed).run();
}

Built build_alone(dfm_context *context, const Definition &def, const Body &body, const std::string &model,
                  Params params) {
  Definition alone = def;
  alone.bodies = {body};
  alone.bodies[0].model = model;
  alone.bodies[0].params = std::move(params);
  alone.bodies[0].on.clear();
  alone.bodies[0].attach.clear();
  alone.effects_auto = true;  // others in the scene may provide what the list names
  alone.obstacles.clear();
  alone.rigid = {};
  alone.friction.clear();
  alone.filters.clear();
  alone.probes.clear();
  std::erase_if(alone.cuts, [&](const Cut &c) { return c.body != body.name; });
  for (Tool &t : alone.tools)
    std::erase_if(t.cuts.bodies, [&](const std::string &name) { return name != body.name; });
  std::erase_if(alone.tools, [](const Tool &t) { return t.cuts.bodies.empty(); });
  MeshFiles files(context, alone);  // what it warns of is not heard, and those of the scene warn once
  return build(context, alone, files, 0);
}

}  // namespace dfm::scene
