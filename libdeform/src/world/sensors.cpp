#include "world/sensors.h"

#include <algorithm>

#include "state/partner.h"
#include "step/stages.h"
#include "world/find.h"

namespace dfm {
namespace {

bool of_one_rigid(const Thing &a, const Thing &b) {
  return a.obstacle && b.obstacle && a.obstacle->rigid && a.obstacle->rigid == b.obstacle->rigid &&
         a.obstacle->rigid_body == b.obstacle->rigid_body;
}

// Whether they could touch if neither were a sensor.
bool may_meet(const World &w, const Thing &a, const Thing &b) {
  const auto partner = [](const Thing &t) { return t.body ? partner_of(*t.body) : partner_of(*t.obstacle); };
  return !of_one_rigid(a, b) && partner(a).meets(partner(b), w.filters);
}

std::vector<Sensed> sensed_now(World &w) {
  std::vector<Sensed> out;
  const auto look = [&](const Thing &sensor) {
    if (!sensor.sensor()) return;
    each_thing(w, ThingFilter(nullptr), [&](const Thing &thing) {
      if (may_meet(w, sensor, thing) && overlap(sensor, thing)) out.push_back({sensor.id(), thing.id()});
      return true;
    });
  };
  for (auto &b : w.bodies) look({b.get(), nullptr});
  for (auto &o : w.obstacles) look({nullptr, o.get()});
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace

void update_sensors(World &w, bool report) {
  if (w.sensors == 0 && w.sensed.empty()) return;
  std::vector<Sensed> now = sensed_now(w);
  if (report) {
    reserve_events(w, now.size() + w.sensed.size());
    const auto in = [](const std::vector<Sensed> &list, const Sensed &s) {
      return std::binary_search(list.begin(), list.end(), s);
    };
    for (const Sensed &s : w.sensed)
      if (!in(now, s)) add_event(w, DFM_EVENT_SENSOR_END, s.sensor, s.thing, 0, w.time);
    for (const Sensed &s : now)
      if (!in(w.sensed, s)) add_event(w, DFM_EVENT_SENSOR_BEGIN, s.sensor, s.thing, 0, w.time);
  }
  w.sensed = std::move(now);
}

void end_sensor_overlaps(World &w, uint64_t id) {
  reserve_events(w, w.sensed.size());
  std::erase_if(w.sensed, [&](const Sensed &s) {
    if (s.sensor != id && s.thing != id) return false;
    add_event(w, DFM_EVENT_SENSOR_END, s.sensor, s.thing, 0, w.time);
    return true;
  });
}

}  // namespace dfm
