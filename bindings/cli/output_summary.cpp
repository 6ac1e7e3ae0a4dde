// summary.json, the table at the end of a run, and the profile.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <string_view>
#include <utility>

#include "json_text.h"
#include "messages.h"
#include "planned.h"
#include "run.h"
#include "state_file.h"
#include "voxel_core.h"

namespace cli {

namespace {
constexpr double kExactReach = 1e90;  // m
}

void StepTimes::add(double seconds) {
  longest_ = std::max(longest_, seconds);
  if (seen_++ % every_ == 0) kept_.push_back(float(seconds));
  if (kept_.size() < (size_t(1) << 20)) return;
  for (size_t i = 0; 2 * i < kept_.size(); ++i) kept_[i] = kept_[2 * i];
  kept_.resize(kept_.size() / 2);
  every_ *= 2;
}

double StepTimes::quantile(double q) const {
  if (kept_.empty()) return NAN;
  std::vector<float> sorted = kept_;
  std::ranges::sort(sorted);
  return sorted[std::min(sorted.size() - 1, size_t(q * double(sorted.size())))];
}

dfm_world_stats world_stats(const SceneFile &scene) {
  return got<dfm_world_stats>(dfm_world_get_stats, scene.world());
}

dfm_body_measure body_measure(const BodyView &body) {
  return got<dfm_body_measure>(dfm_body_get_measure, body.handle);
}

dfm_body_measure rigid_measure(const RigidView &rigid) {
  return got<dfm_body_measure>(dfm_rigid_get_measure, rigid.handle);
}

void add_unwatched(const SceneFile &scene, RunResult &run) {
  JsonValue plan;
  parse_json(scene.explain(), plan);
  for (const JsonValue &body : plan.list("bodies"))
    if (const std::string why = body.get("unwatched"); !why.empty())
      run.unwatched.emplace(body.get("name"), why);
}

Checker::Checker(const SceneFile &scene) : scene_(scene), positions_(scene.bodies().size()) {
  for (const ObstacleView &obstacle : scene.obstacles()) {
    if (obstacle.def.shape != DFM_SHAPE_MESH && obstacle.def.shape != DFM_SHAPE_VOXELS) continue;
    solids_.push_back(obstacle);
    if (obstacle.def.shape != DFM_SHAPE_VOXELS) continue;
    cores_.push_back(voxel_core(obstacle.def));
    solids_.back().def.points = cores_.back().data();
  }
  placed_.resize(solids_.size());
}

// Pairs of surfaces that are attached and do not touch: their common border coincides.
std::vector<std::array<uint32_t, 2>> Checker::joined() const {
  std::vector<std::array<uint32_t, 2>> out;
  for (uint32_t b = 0; b < positions_.size(); ++b) {
    const dfm_body body = scene_.bodies()[b].handle;
    for (const uint32_t number : listed<uint32_t>(dfm_body_attachments, body)) {
      const dfm_attachment a = got<dfm_attachment>(dfm_body_get_attachment, body, number);
      if (a.flags & DFM_ATTACH_TOUCH) continue;
      for (uint32_t other = 0; other < positions_.size(); ++other)
        if (scene_.bodies()[other].handle == a.to) out.push_back({std::min(b, other), std::max(b, other)});
    }
  }
  std::ranges::sort(out);
  return out;
}

void Checker::check(bool start_state) {
  ++checks_.states;
  checks_.inverted_last = 0;
  checks_.between_last = checks_.self_last = 0;
  surfaces_.clear();
  double reach = 0;
  bool finite = true;
  scene_.renew_list();
  positions_.resize(scene_.bodies().size());
  for (size_t b = 0; b < positions_.size(); ++b) {
    scene_.renew(b);
    const BodyView &body = scene_.bodies()[b];
    uint32_t n = 0;
    state_.resize(6 * size_t(body.npoint));
    need(dfm_body_get_state(body.handle, body.npoint, state_.data(), state_.data() + 3 * size_t(body.npoint),
                            &n));
    finite = finite && std::ranges::all_of(state_, [](double x) { return std::isfinite(x); });
    positions_[b].resize(3 * size_t(body.nsurfel));
    need(dfm_surface_positions(body.handle, body.nsurfel, positions_[b].data(), &n));
    for (double x : positions_[b]) reach = std::max(reach, std::fabs(x));
    const dfm_body_measure measured = body_measure(body);
    const uint32_t inverted = measured.inverted;
    if (inverted > checks_.inverted_there) {
      checks_.inverted_body = body.name;
      checks_.inverted_model = body.model;
      checks_.inverted_there = inverted;
      checks_.cells_there = body.ntet;
      checks_.volume_there = measured.volume / measured.rest_volume;
    }
    checks_.inverted_max = std::max(checks_.inverted_max, inverted);
    checks_.inverted_last += inverted;
    surfaces_.push_back({positions_[b].data(), n, body.triangles.data(), uint32_t(body.triangles.size() / 3),
                         false, body.cut, body.whole});
  }
  for (const RigidView &rigid : scene_.rigids()) {
    const dfm_body_measure m = rigid_measure(rigid);
    for (int k = 0; k < 3; ++k)
      finite =
          finite && std::isfinite(m.com[k]) && std::isfinite(m.momentum[k]) && std::isfinite(m.angular[k]);
  }
  checks_.finite = checks_.finite && finite;
  if (!finite) return;
  // Beyond this, products in exact signs overflow double; no valid state reaches it.
  if (reach > kExactReach) {
    if (!std::exchange(checks_.too_far, true))
      keep_warning("a body is further than 1e90 m away: crossings cannot be counted in such a state");
    return;
  }
  for (size_t o = 0; o < solids_.size(); ++o) {
    const ObstacleView &obstacle = solids_[o];
    place_points(obstacle, placed_[o]);
    surfaces_.push_back(
        {placed_[o].data(), obstacle.def.npoint, obstacle.def.triangles, obstacle.def.ntriangle, true});
  }
  const crossing::Found found = counter_.count(
      surfaces_, start_state ? crossing::Touching::allowed : crossing::Touching::counts, joined());
  keep(found);
  if (start_state) checks_.self_first = found.within;
}

void Checker::keep(const crossing::Found &found) {
  const auto name = [&](uint32_t surface) {
    const size_t nb = scene_.bodies().size();
    return surface < nb ? scene_.bodies()[surface].name : solids_[surface - nb].name;
  };
  const auto name_both = [&](const uint32_t of[2], std::string to[2]) {
    to[0] = name(of[0]);
    to[1] = name(of[1]);
  };
  const size_t others = found.between - found.parts;
  if (others > checks_.others_max) name_both(found.crossing, checks_.crossing);
  if (found.parts > checks_.parts_max) name_both(found.parted, checks_.parted);
  if (found.within > checks_.self_max) checks_.crossed = name(found.crossed);
  checks_.intersections_max = std::max(checks_.intersections_max, found.all());
  checks_.between_max = std::max(checks_.between_max, found.between);
  checks_.parts_max = std::max(checks_.parts_max, found.parts);
  checks_.others_max = std::max(checks_.others_max, others);
  checks_.self_max = std::max(checks_.self_max, found.within);
  checks_.between_last = found.between;
  checks_.parts_last = found.parts;
  checks_.others_last = others;
  checks_.self_last = found.within;
}

namespace {

std::vector<dfm_stage_time> profile(const SceneFile &scene) {
  return listed<dfm_stage_time>(dfm_world_profile, scene.world());
}

std::string stages_json(const SceneFile &scene, uint64_t steps) {
  JsonObject out;
  for (const dfm_stage_time &stage : profile(scene))
    out.add(stage.name, 1e3 * stage.seconds / double(std::max<uint64_t>(1, steps)));
  return out.text();
}

std::string names_json(const JsonValue &plan, const char *key) {
  std::vector<std::string> names;
  for (const JsonValue &row : plan.list(key)) names.push_back(row.get("name"));
  return json_words(names);
}

std::string plugins_json(const SceneFile &scene) {
  std::vector<std::string> rows;
  need(dfm_plugin_visit(
      scene.context(),
      [](void *user, const dfm_type *type, const char *file) {
        static_cast<std::vector<std::string> *>(user)->push_back(
            json_object("id", quoted(type->id), "version", quoted(type->version ? type->version : ""), "file",
                        quoted(file ? file : "")));
      },
      &rows));
  return json_array(rows);
}

// "facts" of a body in the library's plan, by key; "" if its model has none.
std::string facts_json(const JsonValue &plan, const std::string &body) {
  for (const JsonValue &b : plan.list("bodies")) {
    if (b.get("name") != body || b.list("facts").empty()) continue;
    JsonObject out;
    for (const JsonValue &f : b.list("facts")) out.add(f.get("key"), f.get("value"));
    return out.text();
  }
  return "";
}

std::string body_json(const dfm_body_measure &m, uint64_t dofs, uint32_t cells, const std::string &facts) {
  JsonObject row;
  row.add("com", json_vector(m.com), "velocity", json_vector(m.velocity), "kinetic_J", m.kinetic, "elastic_J",
          m.elastic, "volume_ratio", m.volume / m.rest_volume, "speed_max", m.speed_max, "dofs", dofs,
          "cells", cells);
  if (!facts.empty()) row.add("facts", facts);
  return row.text();
}

std::string bodies_json(const SceneFile &scene, const JsonValue &plan) {
  JsonObject out;
  for (const BodyView &body : scene.bodies())
    out.add(body.name,
            body_json(body_measure(body), 3 * uint64_t(body.npoint), body.ntet, facts_json(plan, body.name)));
  for (const RigidView &rigid : scene.rigids())
    out.add(rigid.name, body_json(rigid_measure(rigid), 6, 0, ""));
  return out.text();
}

std::string swaps_json(const SceneFile &scene, const RunResult &run) {
  std::vector<std::string> rows;
  for (const dfm_swap &s : run.swaps) {
    const bool refused = s.flags & DFM_SWAP_REFUSED;
    rows.push_back(json_object("t", s.t, "body", quoted(scene.name_of(s.body)), "from", quoted(s.from), "to",
                               quoted(s.to), "refused", refused, "elastic_before_J", s.elastic_before,
                               "elastic_after_J", s.elastic_after, "jump_J",
                               s.elastic_after - s.elastic_before));
  }
  return json_array(rows);
}

// What is not known is null: no body that was looked at all along.
std::string energy_json(const SceneFile &scene, const RunResult &run, const dfm_world_stats &stats) {
  const bool known = scene.value("/time/mode") != "\"static\"" &&
                     (run.unwatched.empty() || run.unwatched.size() < scene.bodies().size());
  JsonObject unwatched, out;
  for (const auto &[name, why] : run.unwatched) unwatched.add(name, quoted(why));
  const auto joules = [&](double value) { return known ? number(value) : std::string("null"); };
  out.add("start_J", joules(stats.energy_start), "max_J", joules(stats.energy_max), "gain_J",
          joules(stats.energy_gain));
  return out.add("unwatched", unwatched.text()).text();
}

// kbit/s that the frames have brought of each body that is there at the end.
std::vector<std::pair<std::string, double>> stream_rates(const SceneFile &scene,
                                                         const RtpSender::Report &sent) {
  std::vector<std::pair<std::string, double>> out;
  for (const BodyView &body : scene.bodies())
    if (const auto at = sent.bodies.find(uint32_t(body.handle)); at != sent.bodies.end())
      out.emplace_back(body.name, 8e-3 * double(at->second) / sent.lasted);
  return out;
}

std::string stream_json(const SceneFile &scene, const RtpSender::Report &sent) {
  JsonObject rates, out;
  for (const auto &[body, rate] : stream_rates(scene, sent)) rates.add(body, rate);
  out.add("frames", sent.frames, "packets", sent.packets, "bytes", sent.bytes, "lost", sent.lost);
  return out.add("kbit_per_s", rates.text()).text();
}

struct AutoShare { double steps = 0, implicit = 0, changes = 0; };
// Where the library may change integrators; steps 0: nowhere.
AutoShare auto_share(const JsonValue &plan) {
  AutoShare out;
  const JsonValue *const own = plan.find("auto");
  if (!own || !own->find("steps_s")) return out;
  out.steps = own->scalar("steps_s");
  out.implicit = own->scalar("implicit_s");
  out.changes = own->scalar("changes");
  return out;
}

std::string auto_json(const JsonValue &plan) {
  const AutoShare share = auto_share(plan);
  if (!(share.steps > 0)) return "null";
  JsonObject row;
  row.add("steps_s", share.steps, "implicit_s", share.implicit, "implicit_share",
          share.implicit / share.steps);
  return row.add("changes", share.changes).text();
}

std::string stopped_json(const RunResult &run) {
  if (!run.stopped && !run.interrupted) return "null";
  JsonObject row;
  row.add("step", run.steps, "t", run.simulated, "body",
          run.stop_body.empty() ? "null" : quoted(run.stop_body));
  return row.add("reason", quoted(run.stop_reason)).text();
}

}  // namespace

std::string summary_json(const SceneFile &scene, const RunOptions &options, const RunResult &run,
                         const Checks &checks) {
  if (checks.states == 0)
    throw Failure(kStopped, "no state was recorded, so nothing can be said about intersections");
  const dfm_world_stats stats = world_stats(scene);
  JsonValue plan;
  parse_json(scene.explain(), plan);
  JsonObject out;
  out.add("format", "\"deform-summary\"", "version", "1");
  out.add("library", quoted(dfm_version(nullptr, nullptr, nullptr)), "scene", quoted(options.scene));
  out.add("steps", run.steps, "substeps", stats.substeps, "simulated_s", run.simulated - run.begun);
  out.add("wall_s", run.wall, "cpu_s", run.cpu);
  out.add("ms_per_step", json_object("median", 1e3 * run.times.quantile(0.5), "p99",
                                     1e3 * run.times.quantile(0.99), "max", 1e3 * run.times.longest()));
  out.add("stages", stages_json(scene, run.steps), "threads", stats.threads);
  out.add("finite", checks.finite, "states_checked", checks.states);
  out.add("intersections_max", checks.intersections_max, "intersections_between_max", checks.between_max);
  out.add("intersections_self_max", checks.self_max);
  out.add("overlaps_at_start", run.overlaps, "untangled", run.untangled);
  out.add("inverted_max", std::max(checks.inverted_max, stats.inverted_max));
  out.add("limited_max", stats.limited_max, "self_bodies_max", stats.self_max);
  out.add("guard_steps", stats.guard_steps, "guard",
          json_object("solves", stats.guard_solves, "cuts", stats.guard_cuts, "lost_s", stats.guard_lost));
  out.add(
      "unconverged_steps", stats.unconverged, "budget",
      json_object("work_max", stats.work_max, "cheapened", stats.cheapened, "shortened", stats.shortened));
  out.add("auto", auto_json(plan), "energy", energy_json(scene, run, stats));
  out.add("solver", json_object("passes", stats.passes_max, "sweeps", stats.sweeps_max, "residual_max",
                                stats.residual_max));
  const bool held = run.hold_begun && run.hold_count > 0;
  out.add("hold", json_object("creep_max_um_per_s", held ? number(1e6 * run.creep) : "null"));
  out.add("effects",
          json_object("active", names_json(plan, "effects"), "absent", names_json(plan, "absent")));
  out.add("plugins", plugins_json(scene));
  if (run.load_steps > 0)
    out.add("equilibrium", json_object("load_steps", run.load_steps, "iterations", run.iterations, "residual",
                                       run.residual));
  out.add("bodies", bodies_json(scene, plan));
  out.add("contacts", json_object("max", stats.contacts_max, "mean", run.contacts_mean));
  out.add("impulse", run.impulses, "swaps", swaps_json(scene, run));
  out.add("state_hash", quoted(hash_text(dfm_world_hash(scene.world()))));
  if (!run.sensors.empty()) out.add("sensors", run.sensors);
  if (run.stream.frames) out.add("stream", stream_json(scene, run.stream));
  if (const std::string planned = planned_json(scene); !planned.empty()) out.add("planner", planned);
  out.add("stopped", stopped_json(run), "warnings", json_words(warnings()));
  return as_utf8(indented(out.text()));
}

namespace {

std::string joules(double energy) {
  if (std::isnan(energy)) return "unknown (the model computes none)";
  return formatted("%.4g J", energy);
}

// Most pieces of a shattered body are of a few cells, and each is a body: they are counted, not listed.
void print_shattered(const SceneFile &scene) {
  constexpr size_t kMany = 64;
  std::map<dfm_body, size_t> parts;  // by the body that the scene has made
  for (const BodyView &body : scene.bodies()) ++parts[body.whole];
  for (const auto &[whole, n] : parts) {
    if (n < kMany) continue;
    const std::string name = quoted(scene.name_of(whole)),
                      separate = scene.pointer_of(scene.name_of(whole)) + "/separate",
                      least = scene.value(separate + "/least_cells");
    std::printf(
        "body %s has come apart into %zu bodies; where that is slow, \"least_cells\" above %s%s in its "
        "\"separate\", or a larger \"tear\", makes fewer\n",
        name.c_str(), n, least.empty() ? "1" : least.c_str(),
        scene.value(separate + "/crumbs") == "\"remove\"" ? "" : " with \"crumbs\": \"remove\"");
  }
}

// Why a run is slow, where contact is why and its mesh can be made coarser: slower than a fifth of real time,
// half of it in contact of a hundred points.
void print_contact_share(const SceneFile &scene, const RunResult &run, uint32_t contacts_max) {
  constexpr double kSlow = 5, kMin = 0.2, kShare = 0.5, kMany = 100;
  if (run.wall < kMin || run.wall < kSlow * (run.simulated - run.begun) || run.contacts_mean < kMany) return;
  double contact = 0;
  for (const dfm_stage_time &s : profile(scene))
    if (std::string_view(s.name) == "contact+friction") contact += s.seconds;
  if (contact < kShare * run.wall) return;
  std::printf(
      "contact takes %.0f %% of the time, with up to %u points at once: fewer cells where bodies touch "
      "make it faster, most of all in bodies with implicit integration; --profile lists the stages\n",
      100 * std::min(1.0, contact / run.wall), contacts_max);
}

// What nothing damps swings as long as the run lasts, which many take for an error.
void print_undamped(const SceneFile &scene) {
  if (scene.bodies().empty() || scene.value("/time/mode") == "\"static\"" ||
      scene.value("/time/integrator") == "\"implicit_euler\"")
    return;
  JsonValue materials;
  parse_json(scene.value("/materials"), materials);
  for (const JsonMember &m : materials.members)
    if (const JsonValue *const damping = m.value.find("damping"))
      for (const char *key : {"mass", "stiffness"})
        if (damping->scalar(key) > 0) return;
  std::printf(
      "no material has damping, so bodies may swing for long: \"damping\": {\"mass\": 1, \"stiffness\": "
      "0.001} in a material, for example, lets them come to rest\n");
}

void print_stream(const SceneFile &scene, const RtpSender::Report &sent) {
  constexpr size_t kMax = 5;
  std::printf("streamed: %llu frames, %llu packets, %.3g MB, %.2g ms a frame; %.0f %% reported as lost\n",
              static_cast<unsigned long long>(sent.frames), static_cast<unsigned long long>(sent.packets),
              1e-6 * double(sent.bytes), 1e3 * sent.seconds / double(sent.frames), 100 * sent.lost);
  auto rates = stream_rates(scene, sent);
  std::ranges::stable_sort(rates, std::greater(), &std::pair<std::string, double>::second);
  for (size_t i = 0; i < rates.size() && i < kMax; ++i)
    std::printf("streamed of %s: %.4g kbit/s\n", rates[i].first.c_str(), rates[i].second);
}

void print_swaps(const SceneFile &scene, const RunResult &run) {
  constexpr size_t kMax = 20;
  for (size_t i = 0; i < run.swaps.size() && i < kMax; ++i) {
    const dfm_swap &s = run.swaps[i];
    const std::string &body = scene.name_of(s.body);
    if (s.flags & DFM_SWAP_REFUSED)
      std::printf("t = %g s: %s stays %s: a change to %s is refused, because energy or surface would jump\n",
                  s.t, body.c_str(), s.from, s.to);
    else
      std::printf("t = %g s: %s changes from %s to %s: elastic energy from %s to %s\n", s.t, body.c_str(),
                  s.from, s.to, joules(s.elastic_before).c_str(), joules(s.elastic_after).c_str());
  }
  if (run.swaps.size() > kMax)
    std::printf("and %zu more changes of models, which summary.json lists\n", run.swaps.size() - kMax);
}

}  // namespace

void print_table(const SceneFile &scene, const RunResult &run, const Checks &checks) {
  const dfm_world_stats stats = world_stats(scene);
  // of the fastest point, which moves where the center of mass stands still
  std::printf("%-16s %9s %8s  %-30s %11s %9s\n", "body", "points", "cells", "center of mass / m",
              "fastest m/s", "volume");
  for (const BodyView &body : scene.bodies()) {
    const dfm_body_measure m = body_measure(body);
    const std::string com = formatted("%9.4f %9.4f %9.4f", m.com[0], m.com[1], m.com[2]);
    std::printf("%-16.16s %9u %8u  %-30s %11.3g %8.2f%%\n", body.name.c_str(), body.npoint, body.ntet,
                com.c_str(), m.speed_max, 100 * m.volume / m.rest_volume);
  }
  std::printf("%llu steps, %g s simulated in %.3g s: %.4g steps/s, %.3g x real time\n",
              static_cast<unsigned long long>(run.steps), run.simulated - run.begun, run.wall,
              double(run.steps) / run.wall, (run.simulated - run.begun) / run.wall);
  if (run.stream.frames) print_stream(scene, run.stream);
  if (run.pictures)
    std::printf("pictures: %llu, drawn in a further %.3g s, %.2g s each, by %s\n",
                static_cast<unsigned long long>(run.pictures), run.drawing,
                run.drawing / double(run.pictures), run.drawn_by.c_str());
  std::printf(
      "contacts: %u at most, %.3g on average; states checked: %llu, crossing triangle pairs: %zu (%zu of a "
      "body with itself), inverted cells: %u\n",
      stats.contacts_max, run.contacts_mean, static_cast<unsigned long long>(checks.states),
      checks.intersections_max, checks.self_max, std::max(checks.inverted_max, stats.inverted_max));
  JsonValue plan;
  parse_json(scene.explain(), plan);
  if (const AutoShare share = auto_share(plan); share.changes > 0)
    std::printf("integrator auto: implicit for %.3g s of %.3g s (%.0f %%), explicit else; %.0f changes\n",
                share.implicit, share.steps, 100 * share.implicit / share.steps, share.changes);
  print_undamped(scene);
  print_contact_share(scene, run, stats.contacts_max);
  print_shattered(scene);
  print_swaps(scene, run);
}

void print_profile(const SceneFile &scene, const RunResult &run) {
  std::vector<dfm_stage_time> stages = profile(scene);
  double sum = 0;
  for (const dfm_stage_time &s : stages) sum += s.seconds;
  std::printf("%-20s %10s %12s %8s\n", "stage", "ms/step", "calls/step", "share");
  const double steps = double(std::max<uint64_t>(1, run.steps));
  for (const dfm_stage_time &s : stages)
    std::printf("%-20s %10.4f %12.2f %7.1f%%\n", s.name, 1e3 * s.seconds / steps, double(s.calls) / steps,
                sum > 0 ? 100 * s.seconds / sum : 0.0);
  std::printf("%-20s %10.4f %12s %7.1f%%\n", "outside stages", 1e3 * std::max(0.0, run.wall - sum) / steps,
              "", run.wall > 0 ? 100 * (run.wall - sum) / run.wall : 0.0);
}

}  // namespace cli
