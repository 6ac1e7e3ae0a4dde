// Creates and removes bodies and obstacles. All functions throw Error; then the world is unchanged.
#pragma once
#include "deform/deform.h"

namespace dfm {

struct Body;
struct Obstacle;
struct World;

// Its name in scenes.
inline const char *integrator_name(uint32_t integrator) {
  return integrator == DFM_INTEGRATOR_SYMPLECTIC_EULER ? "symplectic_euler"
         : integrator == DFM_INTEGRATOR_TR_BDF2        ? "tr_bdf2"
                                                       : "implicit_euler";
}

Body &create_body(World &w, const dfm_body_def &def);
Obstacle &create_obstacle(World &w, const dfm_obstacle_def &def);
void destroy_body(Body &b);
void destroy_obstacle(Obstacle &o);
// Ends the attachments and contacts, with their events, of a body or obstacle that leaves the simulation.
void end_contacts(World &w, uint64_t id, bool obstacle);

}  // namespace dfm
