#include "step/held_in.h"

#include <algorithm>

#include "core/error.h"
#include "deform/attach.h"
#include "dynamics/rigid/rigid_set.h"
#include "state/attachment.h"
#include "state/obstacle.h"
#include "state/tool.h"
#include "state/world.h"
#include "step/context.h"
#include "step/solve/attach.h"
#include "step/stages.h"

namespace dfm {
namespace {

// A tool goes where its hand or path puts it, unless a spring couples the two.
bool can_move(const World &w, const Obstacle &o) {
  if (!o.rigid) return false;
  if (!o.rigid->of_tool) return !o.rigid->defs[o.rigid_body].fixed;
  return std::any_of(w.tools.begin(), w.tools.end(),
                     [&](const auto &t) { return t->set == o.rigid && t->def.stiffness > 0; });
}

}  // namespace

HeldIn held_in(const World &w, OverlapSides &sides, const OverlapPair &p, double deeper) {
  HeldIn most;
  if (!p.obstacle || can_move(w, *w.obstacles[p.b])) return most;
  const uint64_t id = w.obstacles[p.b]->id;
  for (const Attachment &a : w.attachments) {
    if (a.released || !a.obstacle || a.body != w.bodies[p.a]->id) continue;
    if (a.to == id && !(a.flags & DFM_ATTACH_TOUCH)) continue;
    if (a.stiffness > 0 || a.damping > 0 || can_move(w, *w.obstacles[obstacle_slot_of(w, a.to)])) continue;
    uint32_t n = 0;
    // where it holds them, which a body that is torn to and fro may have left by now
    for (size_t i = 0; i < a.surfels.size(); ++i) n += sides.depth(p, attached_place(w, a, i)) > deeper;
    if (n > most.points) most = {&a, n};
  }
  return most;
}

std::string describe_held_in(const World &w, const HeldIn &held, uint32_t b) {
  const Obstacle &in = *w.obstacles[b], &to = *w.obstacles[obstacle_slot_of(w, held.by->to)];
  const bool one = held.points == 1;
  const std::string holds =
      format("its attachment to '%s' holds %u %s there, so that contact cannot push %s out; ",
             to.name.c_str(), held.points, one ? "point" : "points", one ? "it" : "them");
  if (&in == &to) return holds + "leave out \"touch\", or give the attachment a \"stiffness\"";
  return holds + format(
                     "attach only what is outside of '%s', keep '%s' away from it, or give the attachment a "
                     "\"stiffness\"",
                     in.name.c_str(), to.name.c_str());
}

std::string describe_held_at(World &w, uint32_t a, uint32_t b) {
  if (w.attachments.empty()) return {};
  OverlapSides sides(w);
  // a contact bears at the rest distance, and what is pressed on it may lag by as much, and by a sub-step
  double way = 0;
  for (const ObstacleView &v : w.steps->obstacle_views) way = std::max(way, w.steps->h * norm(v.velocity));
  const HeldIn held = held_in(w, sides, {a, b, true}, -2 * w.offset - way);
  return held.by ? describe_held_in(w, held, b) : std::string();
}

}  // namespace dfm
