// Bodies and obstacles enter and leave a world. All throw Error and leave the world as it was.
#pragma once
#include "deform/deform.h"

namespace dfm {

struct Body;
struct Obstacle;
struct World;

// The word of a scene for one that solves for the end of a sub-step.
inline const char *integrator_name(int32_t implicit) {
  return implicit == DFM_INTEGRATOR_TR_BDF2 ? "tr_bdf2" : "implicit_euler";
}

Body &create_body(World &w, const dfm_body_def &def);
Obstacle &create_obstacle(World &w, const dfm_obstacle_def &def);
void destroy_body(Body &b);
void destroy_obstacle(Obstacle &o);
// Of a body or an obstacle that steps are to see no more: attachments and contacts end, with their events.
void leave_contacts(World &w, uint64_t id, bool obstacle);

}  // namespace dfm
