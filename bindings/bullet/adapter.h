// A world of Bullet joined to a dfm_world: each tick first compares its objects with the last tick, and makes
// the same changes in the dfm_world.
//
// A tick of stepSimulation calls back before and after it. Before it the adapter steps the dfm_world, and
// with it Bullet, by the engine. What the tick does between the two callbacks is done already: it finds an
// empty world, whose content the second callback puts back (Vacated).
#pragma once
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "deform/bullet.h"
#include "engine.h"
#include "own_world.h"
#include "rigid_host/seated.h"
#include "shapes.h"

namespace dfm_bullet_detail {

// Empties a world for its lifetime.
class Vacated {
 public:
  explicit Vacated(btDiscreteDynamicsWorld &world);
  ~Vacated();
  Vacated(const Vacated &) = delete;
  Vacated &operator=(const Vacated &) = delete;

 private:
  btDiscreteDynamicsWorld &world_;
  btAlignedObjectArray<btRigidBody *> bodies_;
  btAlignedObjectArray<btTypedConstraint *> constraints_;
  btAlignedObjectArray<btActionInterface *> actions_;
  btAlignedObjectArray<btPersistentManifold *> predictive_;
  btAlignedObjectArray<btCollisionObject *> objects_;
  btMultiBodyDynamicsWorld *multi_;  // null: the world has no multibodies
  btAlignedObjectArray<btMultiBody *> multi_bodies_;
  btAlignedObjectArray<btMultiBodyConstraint *> multi_constraints_;
  btDispatcher *dispatcher_;
  btBroadphaseInterface *broadphase_;
};

class Adapter {
 public:
  Adapter(dfm_world world, const dfm_bullet_def &def);
  ~Adapter();
  Adapter(const Adapter &) = delete;
  Adapter &operator=(const Adapter &) = delete;

  dfm_status sync();  // the objects as they are now, before a tick
  dfm_status step(double dt, int max_sub_steps, double fixed, int *ticks);
  dfm_status obstacle(const btCollisionObject *object, uint32_t leaf, dfm_obstacle *out);
  dfm_status rigid(const btCollisionObject *body, dfm_rigid *out);
  dfm_status set_object(const btCollisionObject *object, const dfm_bullet_object &props);
  dfm_status refresh(const btCollisionObject *object);
  dfm_status debug_draw(uint32_t what) const;
  dfm_bullet_stats stats() const;
  dfm_status last_tick(uint32_t *trouble) const;
  bool in_step() const { return in_tick_; }
  const char *shares(dfm_world world, const dfm_bullet_def &def) const {
    return def.world == engine_.world ? "world" : world == world_ ? "dfm_world" : nullptr;
  }

 private:
  struct Filter {
    int group = 0, mask = 0;
    bool operator==(const Filter &) const = default;
  };
  // All properties that an object's obstacles follow from, except its pose and filter.
  struct Traits {
    double mass = 0;
    Vec moments, along, about;
    int handle = 0;  // the broadphase's: another one after the object has been out of the world
    int16_t moves = 0, takes_part = 0;  // 0 or 1
  };
  static_assert(sizeof(Traits) == 10 * sizeof(double) + 2 * sizeof(int), "compared as bytes");
  struct Body : Seated { std::unique_ptr<Member> member; };
  struct Object {
    const btCollisionObject *id;
    Traits traits;
    Filter filter;
    std::vector<Part> parts;
    std::vector<dfm_obstacle> obstacles;  // empty: takes no part
    Pose pose;                            // of an object that forces do not move: target of its obstacles
    std::vector<Pose> local;              // of its leaves
    std::vector<Pose> sent;
    std::unique_ptr<Body> body;
    bool found = false, stale = false;
  };
  struct Props {  // set by the caller; kept while the object is in the world
    bool ignore = false;
    std::string name;
    dfm_material material = 0;
  };
  dfm_world world_;
  BulletEngine engine_;
  btInternalTickCallback theirs_before_, theirs_after_;
  std::vector<std::unique_ptr<Object>> objects_;  // in the order they came
  std::unordered_map<const btCollisionObject *, Object *> by_id_;
  std::unordered_map<const btCollisionObject *, Props> props_;
  std::vector<Part> seen_;  // of the present object
  Clock clock_;
  States states_;
  std::unique_ptr<Vacated> vacated_;
  uint64_t ticks_ = 0;
  double sync_seconds_ = 0;
  dfm_status of_tick_ = DFM_OK, of_call_ = DFM_OK;
  uint32_t trouble_ = 0;
  bool in_tick_ = false;
  std::string sentence_, call_sentence_;

  static void before_tick(btDynamicsWorld *world, btScalar h);
  static void after_tick(btDynamicsWorld *world, btScalar h);
  dfm_status tick(double h);
  dfm_status look(double h);
  dfm_status check(const btCollisionObject *object) const;
  static bool same(const Traits &a, const Traits &b);
  bool has_parts(const Object &o, const btCollisionShape *shape);
  Traits traits_of(const btCollisionObject *object) const;
  static Filter filter_of(const btCollisionObject *object);
  Object *known(const btCollisionObject *object, int place) const;  // place: in the world's list
  const Props *props_of(const btCollisionObject *object) const;
  bool in_world(const btCollisionObject *object) const;
  dfm_status not_in_world(const btCollisionObject *object) const;
  dfm_status drop();
  dfm_status bind(const btCollisionObject *object);
  dfm_status bind_leaf(Object &o, size_t leaf);
  dfm_status bind_body(Object &o);
  dfm_status follow(Object &o, double h);
};

}  // namespace dfm_bullet_detail
