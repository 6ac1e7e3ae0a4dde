// deform/tools.hpp -- part of deform.hpp: tools. Comments of deform/tool.h hold.
#ifndef DEFORM_TOOLS_HPP
#define DEFORM_TOOLS_HPP
#include <cstdint>
#include <span>
#include <vector>

#include "deform/obstacles.hpp"
#include "deform/result.hpp"
#include "deform/tool.h"

namespace deform {

struct ToolDef : dfm_tool_def {
  ToolDef() noexcept : dfm_tool_def(dfm_tool_def_default()) {}
};

namespace basic {

template <class E>
class Tool : public Handle<dfm_tool, struct ToolKind> {
 public:
  using Handle::Handle;
  static void end(dfm_tool tool) noexcept { dfm_tool_destroy(tool); }
  auto destroy() const { return E::done(dfm_tool_destroy(raw_)); }
  auto def() const {
    return produce<E, dfm_tool_def>([&](dfm_tool_def &d) {
      d.size = sizeof d;
      return dfm_tool_get_def(raw_, &d);
    });
  }
  auto parts() const { return collect_handles<E, Rigid<E>>(dfm_tool_parts, raw_); }
  auto set_pose(const dfm_pose &pose) const { return E::done(dfm_tool_set_pose(raw_, &pose, nullptr)); }
  // velocity: [6] m/s and rad/s at that time
  auto set_pose(const dfm_pose &pose, std::span<const double, 6> velocity) const {
    return E::done(dfm_tool_set_pose(raw_, &pose, velocity.data()));
  }
  auto set_opening(double angle) const { return E::done(dfm_tool_set_opening(raw_, angle)); }
  auto follow_keys() const { return E::done(dfm_tool_follow_keys(raw_)); }
  auto keys_at(double t, double *opening = nullptr) const {
    return produce<E, dfm_pose>([&](dfm_pose &p) { return dfm_tool_keys_at(raw_, t, &p, opening); });
  }
  auto teleport(const dfm_pose &pose) const { return E::done(dfm_tool_teleport(raw_, &pose)); }
  // On the tool, in its frame, about its origin.
  auto force() const {
    return produce<E, Wrench>(
        [&](Wrench &w) { return dfm_tool_force(raw_, w.force.data(), w.moment.data()); });
  }
  // On the hand, in the device's frame, about its origin.
  auto feedback() const {
    return produce<E, Wrench>(
        [&](Wrench &w) { return dfm_tool_feedback(raw_, w.force.data(), w.moment.data()); });
  }
  auto state() const {
    return produce<E, dfm_tool_state>([&](dfm_tool_state &s) {
      s.size = sizeof s;
      return dfm_tool_get_state(raw_, &s);
    });
  }
  // The numbers of the attachments, as many as out holds at most (one for each part is enough); how many.
  auto grab(dfm_body body, std::span<uint32_t> out, double reach = 0, double release = 0) const {
    return produce<E, uint32_t>([&](uint32_t &n) {
      return dfm_tool_grab(raw_, body, reach, release, static_cast<uint32_t>(out.size()), out.data(), &n);
    });
  }
  // how: DFM_CUT_*; no bodies: it cuts nothing.
  auto set_cuts(uint32_t how, std::span<const dfm_body> bodies, uint32_t most = 0) const {
    return E::done(dfm_tool_set_cuts(raw_, how, most, static_cast<uint32_t>(bodies.size()), bodies.data()));
  }
  // The bodies, as raw handles; how, most: as in set_cuts, may be null.
  auto cuts(uint32_t *how = nullptr, uint32_t *most = nullptr) const {
    return produce<E, std::vector<dfm_body>>([&](std::vector<dfm_body> &out) {
      uint32_t n = 0;
      const dfm_status s = dfm_tool_cuts(raw_, how, most, 0, nullptr, &n);
      if (s < 0 || n == 0) return s;
      out.resize(n);
      return dfm_tool_cuts(raw_, nullptr, nullptr, n, out.data(), &n);
    });
  }
  auto set_device(const dfm_device &device) const { return E::done(dfm_tool_set_device(raw_, &device)); }
  auto remove_device() const { return E::done(dfm_tool_set_device(raw_, nullptr)); }
};

}  // namespace basic
}  // namespace deform
#endif
