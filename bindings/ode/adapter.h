// An ODE world and space joined to a dfm_world: each step first compares the space with the last step, and
// makes the same changes in the dfm_world.
#pragma once
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "near.h"
#include "own_world.h"
#include "rigid_host/seated.h"
#include "shapes.h"

namespace dfm_ode_detail {

class Adapter {
 public:
  Adapter(dfm_world world, const dfm_ode_def &def);
  ~Adapter();
  Adapter(const Adapter &) = delete;
  Adapter &operator=(const Adapter &) = delete;

  dfm_status sync();  // the geoms and bodies as they are now
  dfm_status step(double dt);
  dfm_status obstacle(dGeomID geom, dfm_obstacle *out);
  dfm_status rigid(dBodyID body, dfm_rigid *out);
  dfm_status set_geom(dGeomID geom, const dfm_ode_geom &props);
  dfm_status set_arrays(dGeomID geom, int geom_class, Triangles arrays);
  dfm_status refresh(dGeomID geom);
  dfm_status snapshot(void *buffer, size_t *bytes);      // snapshot.cpp
  dfm_status restore(const void *buffer, size_t bytes);  // snapshot.cpp
  RigidFriction &friction() { return near_; }
  dfm_ode_stats stats() const;
  uint32_t trouble = 0;
  bool in_step() const { return engine_.in_step; }
  const char *shares(dfm_world world, const dfm_ode_def &def) const {
    return def.world == engine_.world ? "dWorldID"
           : def.space == space_      ? "dSpaceID"
           : world == world_          ? "dfm_world"
                                      : nullptr;
  }

 private:
  struct Body : Seated {
    dBodyID id;
    OdeMember member;
    dMass mass;
  };
  struct Geom {
    dGeomID id;
    Signature signature;
    Pose pose;                  // of a geom without a body: target of its obstacle
    dfm_obstacle obstacle = 0;  // 0: takes no part
    bool found = false;
  };
  struct Props {  // set by the caller; kept while the geom is in the space
    bool ignore = false;
    std::string name;
    dfm_material material = 0;
    Triangles arrays;
    int arrays_class = -1;
  };
  dfm_world world_;
  dSpaceID space_;
  OdeEngine engine_;
  RigidFriction near_;
  bool own_group_, own_near_;
  std::vector<std::unique_ptr<Geom>> geoms_;  // in the order they came
  std::vector<std::unique_ptr<Body>> bodies_;
  std::unordered_map<dGeomID, Geom *> by_geom_;
  std::unordered_map<dBodyID, Body *> by_body_;
  std::unordered_map<dGeomID, Props> props_;
  std::vector<dGeomID> seen_;  // of this sync, in the space's order
  std::vector<Signature> signatures_;
  uint64_t steps_ = 0;
  Clock clock_;
  States states_;
  bool keeps_friction_ = false;  // restored with the states of the rigid contacts
  double sync_seconds_ = 0;

  void walk(dSpaceID space);
  dfm_status must_have(dGeomID geom);
  dfm_status look();
  dfm_status check(const std::vector<Signature> &signatures) const;
  dfm_status drop();
  dfm_status bind(dGeomID geom, const Signature &s);
  dfm_status bind_body(dBodyID body, Body *&out);
  dfm_status follow(Geom &g);
  dfm_status rebind(dGeomID geom);
  std::vector<dBodyID> hidden_bodies() const;
};

}  // namespace dfm_ode_detail
