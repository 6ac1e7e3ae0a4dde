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
  for (const dfm_obstacle o : listed<dfm_obstacle>(dfm_world_obstacles, scene.world()))
    look(o);  // rigid bodies are among them
  if (!seen_.empty()) table_ = std::make_unique<Csv>(folder + "/sensors.csv", "t,sensor,thing,event");
}

void Sensors::add_step() {
  if (seen_.empty()) return;
  for (const dfm_contact_event &e : listed<dfm_contact_event>(dfm_world_events, scene_.world())) {
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
    std::vector<std::string> inside;
    for (const uint64_t thing : listed<uint64_t>(dfm_sensor_things, s.sensor))
      inside.push_back(quoted(scene_.name_of(thing)));
    out.add(scene_.name_of(s.sensor),
            json_object("begins", s.begins, "ends", s.ends, "inside", json_array(inside)));
  }
  return out.text();
}

}  // namespace cli
