#include "calibrate.h"

// deform calibrate: what the loaded models cost on this machine, and what they leave out, for the planner.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <utility>

#include "arguments.h"
#include "become.h"
#include "costs_file.h"
#include "file.h"
#include "json_text.h"
#include "messages.h"
#include "progress.h"
#include "scene_file.h"
#include "run_folder.h"
#include "shipped_costs.h"
#include "system.h"

namespace cli {
namespace {

constexpr double kFrame = 1.0 / 60, kShort = kFrame / 16;  // s
constexpr double kYoung = 1e5, kPoisson = 0.3, kDensity = 1000, kGravity = 9.81;
constexpr double kUsed = 0.9;                  // of the proven step
constexpr double kShare = 0.2, kMaxShare = 1;  // s of processor time for one figure
// cells of a body in a stack, where contact takes most of the time
constexpr uint32_t kMaxStacked = 2000;
// cells of a body that the processor moves; on a card the cost per point falls up to larger ones
constexpr uint32_t kMaxHere = 8000;

double processor_time() { return double(std::clock()) / CLOCKS_PER_SEC; }
double clock_time() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// "hardware" among the words of a model's parameter "device", which is no driver that computes on the
// processor; -1: the model has none.
double hardware_of(dfm_context *context, const std::string &model) {
  struct Requests {
    const std::string *id;
    double found;
  } requested = {&model, -1};
  need(dfm_plugin_visit(
      context,
      [](void *user, const dfm_type *type, const char *) {
        Requests &of = *static_cast<Requests *>(user);
        if (type->kind != DFM_KIND_MODEL || *of.id != type->id) return;
        for (const dfm_param &row : params_of(*type)) {
          if (std::string_view(row.key) != "device" || !row.names) continue;
          for (int k = 0; row.names[k]; ++k)
            if (std::string_view(row.names[k]) == "hardware") of.found = k;
        }
      },
      &requested));
  return requested.found;
}
bool on_card(dfm_context *context, const std::string &model) { return hardware_of(context, model) >= 0; }

// What the bar touches, as the planner calls it; stacked: a second bar lies across it.
enum class Touch { free, touching, pressed, stacked };
constexpr std::pair<Touch, const char *> kTouches[] = {{Touch::free, "free"},
                                                       {Touch::touching, "touching"},
                                                       {Touch::pressed, "pressed"},
                                                       {Touch::stacked, "stacked"}};

struct Setting {
  std::string model;
  int32_t integrator = DFM_INTEGRATOR_AUTO;
  double size[3] = {0.4, 0.1, 0.1};  // m
  uint32_t cells = 1000;
  double young = kYoung, damping_mass = 0, damping_stiffness = 1e-3, gravity = kGravity, spin = 0;
  bool held = false;     // at its end x = 0; where it is pressed, at its base z = 0
  bool lattice = false;  // of hexahedra as large as 12 tetrahedra, under triangles as fine as theirs
  Touch touch = Touch::free;
};

// A block that a sphere dents: held at its base, as thick as the sphere is.
constexpr double kBlock[3] = {0.2, 0.2, 0.1}, kProbe = 0.05, kDent = 0.008;  // m

// One bar of one model, or two.
class Bar {
 public:
  Bar(dfm_context *context, const Setting &s) : context_(context) {
    try {
      make(s);
    } catch (...) {
      close();
      throw;
    }
  }
  ~Bar() { close(); }
  Bar(const Bar &) = delete;
  Bar &operator=(const Bar &) = delete;

  dfm_world world() const { return world_; }
  uint32_t points() const { return info_.npoint; }  // of a body
  uint32_t bodies() const { return nbody_; }
  // s, +infinity where nothing bounds the step
  double stable_step() const {
    double h = 0;
    need(dfm_world_stable_step(world_, &h, nullptr, nullptr));
    return h;
  }
  // s, what the step is proven for; the plan has the part that is used (doc/concepts/step.md)
  double bound() const {
    JsonValue plan;
    const bool good = parse_json(explain_text(world_), plan);
    const JsonValue *const step = good ? plan.find("step") : nullptr;
    if (!step) throw Failure(kBadInput, "the plan of a bar has no step");
    return step->scalar("stable_s") / kUsed;
  }
  // s, in which a pressure wave goes by the size that the planner takes for that of cells
  double wave_time() const {
    const double modulus = kYoung * (1 - kPoisson) / ((1 + kPoisson) * (1 - 2 * kPoisson));
    return info_.wave_path / std::sqrt(modulus / kDensity);
  }
  void step(double h) const {
    const dfm_status status = dfm_world_step(world_, h, nullptr);
    need(status);
    if (status != DFM_OK) throw Failure(kBadInput, "a step is discarded");
  }
  void run(double h, double seconds) const {
    for (double t = 0; t < seconds; t += h) step(h);
  }
  // The same with the sphere at a depth, m beside the block's middle.
  void press(double h, double depth, double beside_x, double beside_y) const {
    dfm_pose pose = {};
    pose.rotation[3] = 1;
    pose.position[0] = 0.5 * kBlock[0] + beside_x;
    pose.position[1] = 0.5 * kBlock[1] + beside_y;
    pose.position[2] = kBlock[2] + kProbe - depth;
    need(dfm_obstacle_move_to(probe_, &pose));
    step(h);
  }
  // N, mean over the last step
  double force(double h) const {
    dfm_pair_impulse pair = {};
    pair.size = sizeof pair;
    uint32_t n = 0;
    need(dfm_world_pair_impulses(world_, 1, &pair, &n));
    return n ? pair.normal_impulse / h : 0;
  }
  std::vector<double> displacements() const {
    std::vector<double> x(3 * size_t(info_.npoint));
    uint32_t n = 0;
    need(dfm_body_get_state(body_, info_.npoint, x.data(), nullptr, &n));
    for (size_t i = 0; i < x.size(); ++i) x[i] -= start_[i];
    return x;
  }

 private:
  void make(const Setting &s) {
    dfm_world_def w = dfm_world_def_default();
    w.gravity[2] = -s.gravity;
    w.integrator = s.integrator;
    w.step = kFrame;
    need(dfm_world_create(context_, &w, &world_));
    const bool pressed = s.touch == Touch::pressed;
    make_mesh(pressed ? kBlock : s.size, s);
    dfm_material_def m = dfm_material_def_default();
    m.density = kDensity;
    m.young = s.young;
    m.poisson = kPoisson;
    m.damping_mass = s.damping_mass;
    m.damping_stiffness = s.damping_stiffness;
    dfm_body_def b = dfm_body_def_default();
    need(dfm_material_create(world_, &m, &b.material));
    b.points = info_.points;
    b.tets = info_.tets;
    b.cell = info_.cell;
    b.cells = info_.cells;
    b.cell_inside = info_.inside;
    dfm_surface_def skin = {sizeof(dfm_surface_def), DFM_COUPLING_BARYCENTRIC, 0, 0, nullptr, nullptr, 0};
    if (surface_) {
      dfm_mesh_info triangles = {};
      triangles.size = sizeof triangles;
      need(dfm_mesh_get_info(surface_, &triangles));
      skin.npoint = triangles.npoint;
      skin.ntriangle = triangles.ntriangle;
      skin.points = triangles.points;
      skin.triangles = triangles.faces;
      b.surface = &skin;
    }
    std::vector<uint8_t> fixed(info_.npoint, 0);
    for (uint32_t i = 0; s.held && i < info_.npoint; ++i)
      if (b.points[3 * size_t(i) + (pressed ? 2 : 0)] < 1e-9) fixed[i] = 7;
    b.npoint = info_.npoint;
    b.ntet = info_.ntet;
    b.fixed = fixed.data();
    b.model = s.model.c_str();
    const double hardware = hardware_of(context_, s.model);
    const dfm_param_value card = {"device", &hardware, 1};
    if (hardware >= 0) b.model_params = {sizeof(dfm_params), 1, &card};
    b.spin[1] = s.spin;
    need(dfm_body_create(world_, &b, &body_));
    if (s.touch == Touch::stacked) {
      dfm_body upper = 0;
      // across the middle of the lower one
      b.pose.rotation[2] = b.pose.rotation[3] = std::sqrt(0.5);
      b.pose.position[0] = 0.5 * (s.size[0] + s.size[1]);
      b.pose.position[1] = 0.5 * (s.size[1] - s.size[0]);
      b.pose.position[2] = s.size[2] + kGap;
      need(dfm_body_create(world_, &b, &upper));
      nbody_ = 2;
    }
    if (s.touch != Touch::free) add_obstacle(pressed);
    start_.resize(3 * size_t(info_.npoint));
    uint32_t n = 0;
    need(dfm_body_get_state(body_, info_.npoint, start_.data(), nullptr, &n));
  }
  void make_mesh(const double size[3], const Setting &s) {
    need(dfm_mesh_make(context_, "beam", size, DFM_MESH_CELLS, s.cells, &mesh_));
    info_.size = sizeof info_;
    need(dfm_mesh_get_info(mesh_, &info_));
    if (!s.lattice) return;
    need(dfm_mesh_make(context_, "beam", size, DFM_MESH_SURFACE, 4 * info_.ntriangle, &surface_));
    need(dfm_mesh_destroy(std::exchange(mesh_, 0)));
    need(dfm_mesh_lattice(surface_, s.cells / 12, 0, &mesh_));
    need(dfm_mesh_get_info(mesh_, &info_));
  }
  void add_obstacle(bool pressed) {
    dfm_obstacle_def d = dfm_obstacle_def_default();
    if (pressed) {
      d.shape = DFM_SHAPE_SPHERE;
      d.radius = kProbe;
      d.pose.position[0] = 0.5 * kBlock[0];
      d.pose.position[1] = 0.5 * kBlock[1];
      d.pose.position[2] = kBlock[2] + kProbe + kGap;
    }
    need(dfm_obstacle_create(world_, &d, &probe_));
  }
  void close() {
    if (mesh_) dfm_mesh_destroy(mesh_);
    if (surface_) dfm_mesh_destroy(surface_);
    if (world_) dfm_world_destroy(world_);
  }

  static constexpr double kGap = 1e-5;  // m
  dfm_context *context_;
  dfm_world world_ = 0;
  dfm_mesh_handle mesh_ = 0, surface_ = 0;  // surface_: of a lattice
  dfm_mesh_info info_ = {};
  dfm_body body_ = 0;
  uint32_t nbody_ = 1;
  dfm_obstacle probe_ = 0;  // or the floor
  std::vector<double> start_;
};

// Mean distance over the mean displacement of the reference.
double difference(const std::vector<double> &a, const std::vector<double> &reference) {
  double away = 0, scale = 0;
  for (size_t i = 0; i < a.size(); i += 3) {
    away += std::hypot(a[i] - reference[i], a[i + 1] - reference[i + 1], a[i + 2] - reference[i + 2]);
    scale += std::hypot(reference[i], reference[i + 1], reference[i + 2]);
  }
  return away / scale;
}

// Root mean square over that of the reference.
double force_difference(const std::vector<double> &a, const std::vector<double> &reference) {
  double away = 0, scale = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    away += (a[i] - reference[i]) * (a[i] - reference[i]);
    scale += reference[i] * reference[i];
  }
  return std::sqrt(away / scale);
}

// Young's modulus at which a bar of 1 m x 0.1 m x 0.1 m sags by this share of its length, by linear theory.
double young_for(double sag) { return 1.5 * kDensity * kGravity * 100 / sag; }

// The cases in which models differ; each gives displacements at rest, or at the end of a turn.
std::vector<double> bent(dfm_context *context, const std::string &model, int32_t integrator, double sag) {
  Setting s;
  s.model = model;
  s.integrator = integrator;
  const double size[3] = {1, 0.1, 0.1};
  std::copy_n(size, 3, s.size);
  s.cells = 1500;
  s.young = young_for(sag);
  const double lowest = 3.516 * 0.1 / std::sqrt(12.0) * std::sqrt(s.young / kDensity);  // rad/s
  s.damping_mass = 2 * lowest;
  s.held = true;
  const Bar bar(context, s);
  bar.run(kFrame, 12 / lowest);
  return bar.displacements();
}

std::vector<double> turned(dfm_context *context, const std::string &model) {
  constexpr double kTime = 0.25;  // s
  Setting s;
  s.model = model;
  s.gravity = 0;
  s.young = 1e6;
  s.spin = 1.5707963 / kTime;
  const Bar bar(context, s);
  bar.run(1.0 / 960, kTime);
  return bar.displacements();
}

std::vector<double> lying(dfm_context *context, const std::string &model, int32_t integrator) {
  Setting s;
  s.model = model;
  s.integrator = integrator;
  const double size[3] = {0.1, 0.1, 0.1};
  std::copy_n(size, 3, s.size);
  s.young = 0.5 * kDensity * kGravity * 0.1 / 0.02;  // sags by 2 %
  s.damping_mass = 50;
  s.touch = Touch::touching;
  const Bar bar(context, s);
  bar.run(kFrame, 1);
  return bar.displacements();
}

// A sphere goes into the block in four strokes, each until rest: the forces then, and the last positions.
struct Dent { std::vector<double> force, displacements; };
Dent dented(dfm_context *context, const std::string &model, int32_t integrator) {
  constexpr int kStrokes = 4, kMoves = 2, kRests = 10;  // steps
  Setting s;
  s.model = model;
  s.integrator = integrator;
  s.cells = 1500;
  s.gravity = 0;
  s.damping_mass = 50;
  s.held = true;
  s.touch = Touch::pressed;
  const Bar block(context, s);
  Dent out;
  for (int stroke = 0; stroke < kStrokes; ++stroke) {
    for (int i = 1; i <= kMoves + kRests; ++i)
      block.press(kFrame, kDent / kStrokes * (stroke + std::min(1.0, double(i) / kMoves)), 0, 0);
    out.force.push_back(block.force(kFrame));
  }
  out.displacements = block.displacements();
  return out;
}

class Calibration {
 public:
  // wanted: a terminal shows the progress
  Calibration(dfm_context *context, bool wanted, const std::vector<std::string> &only)
      : context_(context), wanted_(wanted) {
    need(dfm_plugin_visit(
        context,
        [](void *user, const dfm_type *type, const char *) {
          if (type->kind != DFM_KIND_MODEL) return;
          const dfm_model &ops = *static_cast<const dfm_model *>(type->ops);
          static_cast<std::vector<Model> *>(user)->push_back(
              {type->id, (ops.cells & DFM_CELL_HEX8) && (ops.caps & DFM_CAP_INSIDE)});
        },
        &models_));
    if (only.empty()) return;
    for (const std::string &name : only)
      if (std::ranges::none_of(models_, [&](auto &m) { return named(m.id, name); }))
        throw Failure(kBadInput,
                      "--model: no loaded plugin offers the model \"" + name + "\"; see: deform plugin list");
    std::erase_if(models_, [&](const Model &m) {
      return std::ranges::none_of(only, [&](auto &name) { return named(m.id, name); });
    });
  }

  std::vector<std::string> left_out;  // sentences

  // Costs as JSON. `out`: the file that will have them, whose rows of other models stay, if this machine has
  // measured them.
  std::string run(const std::string &machine, const std::string &out) {
    reference_ = {bent(context_, kReference, DFM_INTEGRATOR_IMPLICIT_EULER, kLittle),
                  bent(context_, kReference, DFM_INTEGRATOR_IMPLICIT_EULER, kFar),
                  turned(context_, kReference), lying(context_, kReference, DFM_INTEGRATOR_IMPLICIT_EULER),
                  dented(context_, kReference, DFM_INTEGRATOR_IMPLICIT_EULER)};
    std::vector<std::string> rows, measured;
    for (const Model &m : models_) {
      const Patience patience(wanted_, "measuring " + m.id);
      try {
        rows.push_back(model_row(m));
        measured.push_back(short_name(m.id));
      } catch (const Failure &why) {
        left_out.push_back("the model " + m.id + " is not measured, earlier costs of it stay: " + why.what());
      }
    }
    if (rows.empty()) throw Failure(kBadInput, "no model could be measured, so no costs are written");
    for (std::string &row : kept_rows(out, machine, measured)) rows.push_back(std::move(row));
    return json_object("format", quoted("deform-costs"), "version", "4", "machine", quoted(machine), "models",
                       json_array(rows));
  }

 private:
  static constexpr const char *kReference = "org.deform.corotational_fem";
  static constexpr double kLittle = 0.02, kFar = 0.8;  // sag over length of the linear bar

  using Clock = double (*)();
  struct Model {
    std::string id;
    bool lattices;  // it takes their cells
  };

  static std::string short_name(const std::string &id) { return id.substr(id.rfind('.') + 1); }
  static bool named(const std::string &id, const std::string &name) {
    return id == name || short_name(id) == name;
  }

  struct Reference {
    std::vector<double> little, far, turned, lying;
    Dent dented;
  };

  // The longest explicit step and the costs, on cells of one kind.
  void add_cells(const std::string &id, bool lattice, bool itself, JsonObject &out) {
    Setting s = bound_of(id);
    s.lattice = lattice;
    const Bar bar(context_, s);
    JsonObject costs;
    costs.add("symplectic_euler", sizes(id, lattice, DFM_INTEGRATOR_SYMPLECTIC_EULER, itself));
    if (!itself) {
      costs.add("implicit_euler", sizes(id, lattice, DFM_INTEGRATOR_IMPLICIT_EULER, false));
      costs.add("tr_bdf2", sizes(id, lattice, DFM_INTEGRATOR_TR_BDF2, false));
    }
    out.add("wave_steps", itself ? 0 : bar.bound() / bar.wave_time(), "costs", costs.text());
  }

  static Setting bound_of(const std::string &id) {
    Setting s;
    s.model = id;
    s.integrator = DFM_INTEGRATOR_SYMPLECTIC_EULER;
    s.damping_stiffness = 0;
    return s;
  }

  std::string model_row(const Model &m) {
    const std::string &id = m.id;
    const bool itself = !std::isfinite(Bar(context_, bound_of(id)).stable_step());
    const int32_t still = itself ? DFM_INTEGRATOR_AUTO : DFM_INTEGRATOR_IMPLICIT_EULER;
    JsonObject errors;
    errors.add("bends_little", difference(bent(context_, id, still, kLittle), reference_.little))
        .add("bends_far", difference(bent(context_, id, still, kFar), reference_.far))
        .add("turns", difference(turned(context_, id), reference_.turned))
        .add("lies", difference(lying(context_, id, still), reference_.lying));
    const Dent dent = dented(context_, id, still);
    errors.add("dents", difference(dent.displacements, reference_.dented.displacements))
        .add("dent_force", force_difference(dent.force, reference_.dented.force));
    JsonObject row;
    row.add("model", quoted(short_name(id)), "steps_itself", itself, "errors", errors.text());
    add_cells(id, false, itself, row);
    if (!m.lattices) return row.text();
    JsonObject hexahedra;
    add_cells(id, true, itself, hexahedra);
    return row.add("hexahedra", hexahedra.text()).text();
  }

  std::string sizes(const std::string &id, bool lattice, int32_t integrator, bool itself) {
    JsonObject out;
    for (const auto &[touch, name] : kTouches) {
      std::vector<std::string> rows;
      for (const uint32_t cells : {400u, 2000u, 8000u, 64000u}) {
        if (touch == Touch::stacked && cells > kMaxStacked) continue;
        if (cells > kMaxHere && !on_card(context_, id)) continue;
        Setting s;
        s.model = id;
        s.integrator = integrator;
        s.cells = cells;
        s.lattice = lattice;
        s.held = touch == Touch::free || touch == Touch::pressed;
        s.touch = touch;
        const bool pressed = touch == Touch::pressed;
        const auto measured = [&](double h) {  // 0: the stable step
          const Bar bar(context_, s);
          if (h == 0) h = bar.stable_step();
          const Clock now = on_card(context_, id) ? clock_time : processor_time;
          return std::pair(bar.points(), number(pressed ? cost_pressed(bar, h, now) : cost(bar, h, now)));
        };
        const bool explicit_time = integrator == DFM_INTEGRATOR_SYMPLECTIC_EULER && !itself;
        const auto [points, ns] = measured(explicit_time ? 0 : kFrame);
        JsonObject row;
        row.add("points", points, "ns_per_point", ns);
        if (!explicit_time) row.add("short_ns_per_point", measured(kShort).second);
        rows.push_back(row.text());
      }
      out.add(name, json_array(rows));
    }
    return out.text();
  }

  // ns of a sub-step per point: of the first steps, since what moves costs more than what rests, but for what
  // is made once
  static double cost(const Bar &bar, double h, Clock now) {
    for (int i = 0; i < 2; ++i) bar.step(h);
    return time_steps(bar, [&] { bar.step(h); }, now);
  }

  // The same under a sphere that has gone in and then slides along a circle.
  static double cost_pressed(const Bar &bar, double h, Clock now) {
    constexpr double kDepth = 0.004, kGoesIn = 0.05, kCircle = 0.01, kTurns = 5;  // m, s, m, rad/s
    double t = 0;
    const auto step = [&] {
      t += h;
      bar.press(h, kDepth * std::min(1.0, t / kGoesIn), kCircle * (std::cos(kTurns * t) - 1),
                kCircle * std::sin(kTurns * t));
    };
    while (t < kGoesIn) step();
    return time_steps(bar, step, now);
  }

  static double time_steps(const Bar &bar, const std::function<void()> &step, Clock now) {
    const double begin = now();
    double spent = 0;
    unsigned n = 0;
    for (; spent < kShare || (n < 4 && spent < kMaxShare); ++n) {
      step();
      spent = now() - begin;
    }
    return 1e9 * spent / n / bar.points() / bar.bodies();
  }

  dfm_context *context_;
  bool wanted_;
  std::vector<Model> models_;
  Reference reference_;
};

int calibrate(std::string out, const std::vector<std::string> &models, Globals &globals) {
  if (out.empty()) out = costs_file();
  if (out.empty()) throw Failure(kBadInput, "there is no home folder to write to; name a file with --out");
  std::unique_ptr<dfm_context, decltype(&dfm_context_destroy)> context(make_context(globals),
                                                                       &dfm_context_destroy);
  Calibration calibration(context.get(), !globals.quiet && !globals.json, models);
  std::string text;
  {
    const Quiet quiet(globals);
    text = calibration.run(machine_name(), out);
  }
  for (const std::string &sentence : calibration.left_out) warn(sentence);
  const size_t slash = out.rfind('/');
  if (slash != std::string::npos && slash > 0) make_folder(out.substr(0, slash));
  write_whole(out, indented(text) + "\n");
  if (globals.json) std::printf("%s\n", text.c_str());
  else std::printf("costs of this machine: %s\n", out.c_str());
  return kDone;
}

}  // namespace

std::vector<std::string> kept_rows(const std::string &file, const std::string &machine,
                                   const std::vector<std::string> &measured) {
  std::vector<std::string> out;
  JsonValue costs, shipped;
  std::vector<std::string> known = measured;
  const auto take = [&](const JsonValue &row) {
    if (std::ranges::find(known, row.get("model")) != known.end()) return;
    out.push_back(json_text(row));
    known.push_back(row.get("model"));
  };
  if (std::filesystem::exists(path_of(file)) && parse_json(read_file(file, 64u << 20, "costs"), costs) &&
      costs.get("version") == "4" && costs.get("machine") == machine)
    for (const JsonValue &row : costs.list("models")) take(row);
  parse_json(dfm::scene::kShippedCosts, shipped);
  for (JsonValue row : shipped.list("models")) {
    if (!row.find("machine")) row.members.push_back({"machine", *shipped.find("machine")});
    take(row);
  }
  return out;
}

void add_calibrate(Command app, Globals &globals, int *exit_code) {
  struct Options {
    std::string out;
    std::vector<std::string> models;
  };
  auto options = std::make_shared<Options>();
  Command sub = app.command(kCalibrate.name, kCalibrate.about);
  sub.option("--out", options->out,
             "file to write (default: $XDG_CONFIG_HOME/deform/costs.json, which the command then takes "
             "for every scene with an accuracy or a budget)")
      .type_name("FILE");
  sub.option("--model", options->models, "measure this model alone; may be repeated (default: all loaded)")
      .type_name("ID")
      .repeated();
  sub.calls([=, &globals] { *exit_code = calibrate(options->out, options->models, globals); });
}

}  // namespace cli
