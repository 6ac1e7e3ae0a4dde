#include "sensors.h"

#include "json_text.h"
#include "messages.h"

namespace cli {

Sensors::Sensors(const SceneFile &scene, const std::string &folder) : scene_(scene) {
  const auto look = [&](uint64_t thing) {
    bool sensor = false;
    need(dfm_is_sensor(thing, &sensor));
    if (sensor) seen_.push_back({thing});
  };
  for (const BodyView &b : scene.bodies()) look(b.handle);
  uint32_t n = 0;  // rigid bodies are among them
  need(dfm_world_obstacles(scene.world(), 0, nullptr, &n));
  std::vector<dfm_obstacle> obstacles(n);
  if (n) need(dfm_world_obstacles(scene.world(), n, obstacles.data(), &n));
  for (const dfm_obstacle o : obstacles) look(o);
  if (!seen_.empty()) table_ = std::make_unique<Csv>(folder + "/sensors.csv", "t,sensor,thing,event");
}

void Sensors::add_step() {
  if (seen_.empty()) return;
  uint32_t n = 0;
  need(dfm_world_events(scene_.world(), 0, nullptr, &n));
  if (n == 0) return;
  events_.resize(n);
  need(dfm_world_events(scene_.world(), n, events_.data(), &n));
  for (const dfm_contact_event &e : events_) {
    const bool begins = e.kind == DFM_EVENT_SENSOR_BEGIN;
    if (!begins && e.kind != DFM_EVENT_SENSOR_END) continue;
    for (Seen &s : seen_)
      if (s.sensor == e.a) ++(begins ? s.begins : s.ends);
    table_->cell(e.t).cell(scene_.name_of(e.a)).cell(scene_.name_of(e.b)).cell(begins ? "begin" : "end");
    table_->end_row();
  }
  table_->flush();
}

std::string Sensors::json() const {
  if (seen_.empty()) return {};
  JsonObject out;
  for (const Seen &s : seen_) {
    uint32_t n = 0;
    need(dfm_sensor_things(s.sensor, 0, nullptr, &n));
    std::vector<uint64_t> things(n);
    if (n) need(dfm_sensor_things(s.sensor, n, things.data(), &n));
    std::vector<std::string> inside;
    for (const uint64_t thing : things) inside.push_back(quoted(scene_.name_of(thing)));
    JsonObject row;
    row.add("begins", std::to_string(s.begins))
        .add("ends", std::to_string(s.ends))
        .add("inside", json_array(inside));
    out.add(scene_.name_of(s.sensor), row.text());
  }
  return out.text();
}

}  // namespace cli
