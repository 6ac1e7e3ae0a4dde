// deform/scene.h: argument checks; exceptions become statuses.
#include "deform/scene.h"

#include <cmath>
#include <cstring>

#include "api/objects.h"
#include "plugin/context.h"
#include "scene/scene.h"
#include "scene/write.h"
#include "step/stages.h"

using namespace dfm;
using scene::Scene;

namespace {

Scene &scene_of(dfm_scene handle) {
  Scene &scene = resolve<Scene>(Kind::scene, handle);
  return held(scene, *scene.context());
}

void close_scene(dfm_scene handle) {
  Scene *scene = &scene_of(handle);
  Call::now().need_alone(scene, "scene");
  // destroyed with the scene
  if (const auto *world = static_cast<World *>(handle_find(Kind::world, scene->world()))) {
    Call::now().need_alone(world, "scene's world");
    if (world->busy) Call::refuse("scene's world");
  }
  scene->context()->remove_live(handle);
  handle_destroy(handle);
  delete scene;
}

void check_call(const char *path, const void *out) {
  if (!path || !*path)
    fail(DFM_E_ARG, "dfm_scene: path is %s; expected a scene file", path ? "empty" : "NULL");
  need(out, "out");
}

}  // namespace

dfm_status dfm_scene_load(dfm_context *context, const char *path, dfm_world *out) {
  return as_status([&] {
    check_call(path, out);
    used(require(context));
    *out = Scene(context, path, nullptr).release_world();
  });
}

dfm_status dfm_scene_open(dfm_context *context, const char *path, const dfm_scene_options *options,
                          dfm_scene *out) {
  return as_status([&] {
    check_call(path, out);
    used(require(context));
    const dfm_scene_options given = take_def(options, dfm_scene_options{});
    auto scene = std::make_unique<Scene>(context, path, &given);
    *out = keep_live(*context, Kind::scene, std::move(scene), [](uint64_t h) { dfm_scene_close(h); });
  });
}

dfm_status dfm_scene_close(dfm_scene scene) {
  return as_status([&] { close_scene(scene); });
}

dfm_status dfm_scene_world(dfm_scene scene, dfm_world *out) {
  return as_status([&] {
    need(out, "out");
    *out = scene_of(scene).world();
  });
}

dfm_status dfm_scene_value(dfm_scene scene, const char *pointer, char *text, size_t *bytes) {
  return as_status([&] {
    if (!pointer || !bytes) fail(DFM_E_ARG, "dfm_scene_value: %s is NULL", pointer ? "bytes" : "pointer");
    const std::string value = scene_of(scene).value(pointer);
    copy_bytes(value.c_str(), value.size() + 1, text, bytes);
  });
}

dfm_status dfm_scene_get_settings(dfm_scene scene, dfm_scene_settings *out) {
  return as_status(scene_of, scene, [&](const Scene &s) {
    const scene::Definition &d = s.definition();
    dfm_scene_settings r = {};
    r.nprobe = uint32_t(s.probe_count());
    r.duration = d.duration;
    r.step = d.step;
    r.every = d.every;
    r.frames = d.frames;
    r.states = d.states;
    r.nodes = d.nodes;
    r.contacts = d.contacts;
    r.check = d.check;
    r.color = d.color.c_str();
    std::memcpy(r.eye, d.eye, sizeof r.eye);
    std::memcpy(r.look_at, d.look_at, sizeof r.look_at);
    r.has_camera = d.has_camera;
    copy_out(out, r);
  });
}

dfm_status dfm_scene_probe(dfm_scene scene, uint32_t probe, const char **name, double position[3],
                           double velocity[3]) {
  return as_status(scene_of, scene, [&](Scene &s) {
    if (probe >= s.probe_count())
      fail(DFM_E_ARG, "dfm_scene_probe: there is no probe %u, the scene has %zu", probe, s.probe_count());
    const scene::ProbePoint &p = s.probe(probe);
    if (!handle_find(Kind::body, p.body))
      fail(DFM_E_HANDLE, "probe \"%s\": its body was destroyed", p.name.c_str());
    not_in_step(any_body_of(p.body));
    double x[3], v[3];
    s.probe_state(probe, x, v);
    if (name) *name = p.name.c_str();
    if (position) std::memcpy(position, x, sizeof x);
    if (velocity) std::memcpy(velocity, v, sizeof v);
  });
}

namespace {

// call: name of the function, for its errors; beside: data of the scene that are not part of the world.
void write_scene(const char *call, World &w, const char *path, const dfm_scene_write_def &d,
                 writing::Beside beside, uint32_t *notes) {
  if (!path || !*path)
    fail(DFM_E_ARG, "%s: path is %s; expected a file name that ends in .json", call, path ? "empty" : "NULL");
  check_flags(d, DFM_SCENE_SNAPSHOT | DFM_SCENE_PARTIAL, call);
  if (!(d.duration > 0 && std::isfinite(d.duration)) || !(d.step >= 0 && std::isfinite(d.step)))
    fail(DFM_E_ARG,
         "%s: a duration of %g s and a step of %g s; both are finite, the duration is positive and the "
         "step not negative",
         call, d.duration, d.step);
  writing::WriteOptions options;
  options.duration = d.duration;
  options.step = d.step;
  options.snapshot = d.flags & DFM_SCENE_SNAPSHOT;
  options.partial = d.flags & DFM_SCENE_PARTIAL;
  options.beside = std::move(beside);
  options.note = [&](const std::string &sentence) {
    if (d.note) d.note(d.user, sentence.c_str());
    else w.context->warn("%s: %s", path, sentence.c_str());
  };
  uint32_t local_notes = 0;
  if (!notes) notes = &local_notes;
  *notes = 0;
  if (options.snapshot) prepare(w);  // pairs that are set aside, and d_c, are state
  writing::write_scene(w, path, options, *notes);
}

}  // namespace

dfm_status dfm_world_write_scene(dfm_world world, const char *path, const dfm_scene_write_def *def,
                                 uint32_t *notes) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    dfm_scene_write_def d = take_def(def, dfm_scene_write_def_default());
    if (d.step == 0) d.step = w.def.step;
    write_scene("dfm_world_write_scene", w, path, d, {}, notes);
  });
}

dfm_status dfm_scene_write(dfm_scene scene, const char *path, const dfm_scene_write_def *def,
                           uint32_t *notes) {
  return as_status(scene_of, scene, [&](const Scene &s) {
    World &w = exclusive(world_of(s.world()));
    const scene::Definition &has = s.definition();
    dfm_scene_write_def usual = dfm_scene_write_def_default();
    usual.duration = has.duration;
    dfm_scene_write_def d = take_def(def, usual);
    if (d.step == 0) d.step = has.step;
    writing::Beside beside;
    if (!has.probes.empty()) beside.probes = s.value("/probes");
    for (size_t i = 0; i < s.probe_count(); ++i) {
      const uint32_t *points;
      const bool there = handle_find(Kind::body, s.probe(i).body);
      const Body *const body = there ? s.probe_body(i, points) : nullptr;
      beside.probe_bodies.push_back(body ? body->name : "");
    }
    beside.output = s.value("/output");
    beside.equilibrium = has.equilibrium;
    write_scene("dfm_scene_write", w, path, d, std::move(beside), notes);
  });
}
