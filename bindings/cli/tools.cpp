#include "tools.h"

#include <algorithm>

#include "messages.h"

namespace cli {

Tools::Tools(const SceneFile &scene, const std::string &folder) : scene_(scene) {
  for (const dfm_tool tool : listed<dfm_tool>(dfm_world_tools, scene.world())) {
    dfm_tool_def def = dfm_tool_def_default();
    need(dfm_tool_get_def(tool, &def));
    tools_.push_back({tool, def.name});
  }
  if (!tools_.empty())
    table_ = std::make_unique<Csv>(folder + "/tools.csv",
                                   "t,tool,x,y,z,qx,qy,qz,qw,opening_deg,fx,fy,fz,tx,ty,tz,"
                                   "hand_fx,hand_fy,hand_fz,hand_tx,hand_ty,hand_tz,work");
}

void Tools::add_step(double dt) {
  span_ += dt;
  for (Felt &f : tools_) {
    double mean[12];
    need(dfm_tool_force(f.tool, mean, mean + 3));
    need(dfm_tool_feedback(f.tool, mean + 6, mean + 9));
    for (int k = 0; k < 12; ++k) f.impulse[k] += dt * mean[k];
  }
}

void Tools::record() {
  if (tools_.empty()) return;
  constexpr double kDegree = 57.295779513082321;
  const double now = dfm_world_time(scene_.world());
  for (Felt &f : tools_) {
    const dfm_tool_state s = got<dfm_tool_state>(dfm_tool_get_state, f.tool);
    for (double &x : f.impulse) x = span_ > 0 ? x / span_ : 0;
    table_->cell(now).cell(f.name).cells(s.pose.position, 3).cells(s.pose.rotation, 4);
    table_->cell(kDegree * s.opening).cells(f.impulse, 12).cell(s.work).end_row();
    std::fill(f.impulse, f.impulse + 12, 0.0);
  }
  table_->flush();
  span_ = 0;
}

}  // namespace cli
