#include "deform/sensor.h"

#include <algorithm>

#include "api/objects.h"
#include "state/obstacle.h"
#include "step/stages.h"
#include "world/sensors.h"

using namespace dfm;

namespace {

template <class Part>
void mark(Part &part, bool sensor) {
  World &w = exclusive(*part.world);
  if (part.sensor == sensor) return;
  end_sensor_overlaps(w, part.id);  // ends overlaps in both directions
  if (sensor) {
    ++w.sensors;
  } else {
    --w.sensors;
    w.overlaps.place(part.id);
  }
  part.sensor = sensor;
  wake_all(w);
  w.changed = true;
}

struct Found {
  World *world;
  uint64_t id;
  bool sensor;
};
Found thing_of(uint64_t handle) {
  if (dfm_handle_kind(handle) == DFM_HANDLE_BODY) {
    const Body &b = shown_body_of(handle);
    return {b.world, b.id, b.sensor};
  }
  const Obstacle &o = obstacle_of(handle);
  return {o.world, o.id, o.sensor};
}

}  // namespace

dfm_status dfm_body_set_sensor(dfm_body body, bool sensor) {
  return as_status([&] { mark(shown_body_of(body), sensor); });
}

dfm_status dfm_obstacle_set_sensor(dfm_obstacle obstacle, bool sensor) {
  return as_status([&] { mark(obstacle_of(obstacle), sensor); });
}

dfm_status dfm_is_sensor(uint64_t thing, bool *sensor) {
  return as_status([&] {
    need(sensor, "sensor");
    *sensor = thing_of(thing).sensor;
  });
}

dfm_status dfm_sensor_things(uint64_t sensor, uint32_t capacity, uint64_t *out, uint32_t *n) {
  return as_status([&] {
    const Found found = thing_of(sensor);
    const World &w = not_in_step(*found.world);
    if (!found.sensor)
      fail(
          DFM_E_ARG,
          "this body or obstacle is not a sensor; call dfm_body_set_sensor or dfm_obstacle_set_sensor first");
    uint32_t count = 0;
    for (const Sensed &s : w.sensed) count += s.sensor == found.id;
    if (!room(count, capacity, out, n)) return;
    const auto list = [&](const auto &things) {
      for (auto &thing : things)
        if (std::binary_search(w.sensed.begin(), w.sensed.end(), Sensed{found.id, thing->id}))
          *out++ = thing->handle;
    };
    list(w.bodies);
    list(w.obstacles);
  });
}
