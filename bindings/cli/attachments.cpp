#include "attachments.h"

#include <deform/attach.h>

#include "messages.h"

namespace cli {

Attachments::Attachments(const SceneFile &scene, const std::string &folder)
    : scene_(scene),
      static_(scene.value("/time/mode") == "\"static\""),
      last_time_(dfm_world_time(scene.world())) {
  bool any = false;
  for (const BodyView &body : scene.bodies())
    any = any || !listed<uint32_t>(dfm_body_attachments, body.handle).empty();
  if (any)
    table_ = std::make_unique<Csv>(folder + "/attachments.csv",
                                   "t,body,attachment,to,x,y,z,force_x,force_y,force_z,moment_x,moment_y,"
                                   "moment_z,stretch");
}

void Attachments::record() {
  if (!table_) return;
  const double t = dfm_world_time(scene_.world());
  for (const BodyView &body : scene_.bodies())
    for (const uint32_t number : listed<uint32_t>(dfm_body_attachments, body.handle)) write(t, body, number);
  table_->flush();
  last_time_ = t;
}

void Attachments::write(double t, const BodyView &body, uint32_t number) {
  const dfm_attachment a = got<dfm_attachment>(dfm_body_get_attachment, body.handle, number);
  std::array<double, 3> &last = last_impulse_[{body.handle, number}];
  double force[3] = {0, 0, 0};
  for (size_t k = 0; k < 3; ++k) {
    if (static_) force[k] = a.force[k];  // no time passes in the search for the equilibrium
    else if (t > last_time_) force[k] = (a.impulse[k] - last[k]) / (t - last_time_);
    last[k] = a.impulse[k];
  }
  table_->cell(t).cell(body.name).cell(std::to_string(number)).cell(scene_.name_of(a.to)).cells(a.point, 3);
  table_->cells(force, 3).cells(a.moment, 3).cell(a.stretch).end_row();
}

}  // namespace cli
