// Creates and removes bodies and obstacles. All functions throw Error; then the world is unchanged.
#pragma once
#include <algorithm>
#include <memory>
#include <string>

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

// What a shape has in the defs of obstacles, rigid bodies and tools alike.
template <class To, class From>
void copy_shape(To &to, const From &from) {
  std::copy_n(from.half_size, 3, to.half_size);
  to.radius = from.radius;
  to.half_length = from.half_length;
  to.material = from.material;
  to.category = from.category;
  to.collides_with = from.collides_with;
  to.user = from.user;
}

Body &create_body(World &w, const dfm_body_def &def);
Obstacle &create_obstacle(World &w, const dfm_obstacle_def &def);
// The same in two steps, for what has several parts: all are made before the world gets the first, so that
// one that is refused leaves nothing behind. rigid: of a rigid body. Only memory can be missing in
// add_obstacle().
std::unique_ptr<Obstacle> make_obstacle(World &w, const dfm_obstacle_def &def, bool rigid);
Obstacle &add_obstacle(World &w, std::unique_ptr<Obstacle> obstacle);
// A further shape of the rigid body that another obstacle is.
std::unique_ptr<Obstacle> make_rigid_shape(World &w, const std::string &body, const dfm_obstacle_def &def);
Obstacle &join_rigid_shape(Obstacle &body, std::unique_ptr<Obstacle> shape);
void destroy_body(Body &b);
void destroy_obstacle(Obstacle &o);
// Ends the attachments and contacts, with their events, of a body or obstacle that leaves the simulation.
void end_contacts(World &w, uint64_t id, bool obstacle);
// given, or where that is null kind and a number: that of the next id, or the first free one above it.
std::string name_of(World &w, const char *given, const char *kind);
// number: where to look for a free name; goes on behind it, for the next of a set
std::string name_of(World &w, const char *given, const char *kind, uint64_t &number);

}  // namespace dfm
