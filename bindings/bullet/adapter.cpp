#include "adapter.h"

#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace dfm_bullet_detail {
namespace {

// The adapter of a Bullet world: callbacks get the world alone, and its user info belongs to the user.
struct Worlds {
  std::mutex mutex;
  std::unordered_map<const btDynamicsWorld *, Adapter *> all;
};
Worlds &worlds() {
  static Worlds *const w = new Worlds;
  return *w;
}
Adapter *adapter_of(const btDynamicsWorld *world) {
  Worlds &w = worlds();
  const std::lock_guard lock(w.mutex);
  const auto at = w.all.find(world);
  return at == w.all.end() ? nullptr : at->second;
}

const void *address(const btCollisionObject *o) { return o; }

// Target of a body with a given motion at the end of h: by the velocity that Bullet has computed for a whole
// stepSimulation, or the place where it was put, if that is nearer.
Pose towards(const Pose &from, const Pose &to, Vec v, Vec w, double h) {
  const Vec way = to.position - from.position, turn = turn_of(to.rotation * conjugate(from.rotation));
  Pose out = to;
  constexpr double kAll = 1 - 1e-3;
  if (h * norm(v) < kAll * norm(way) && norm(v) > 0) out.position = from.position + h * v;
  if (h * norm(w) < kAll * norm(turn) && norm(w) > 0) out.rotation = unit(turn_by(h * w) * from.rotation);
  return out;
}

}  // namespace

Adapter::Adapter(dfm_world world, const dfm_bullet_def &def) : world_(world) {
  btDiscreteDynamicsWorld &bullet = static_cast<btDiscreteDynamicsWorld &>(*def.world);
  engine_.world = &bullet;
  theirs_before_ = std::exchange(bullet.*Opened::pre_tick(), before_tick);
  theirs_after_ = std::exchange(bullet.*Opened::tick(), after_tick);
  Worlds &w = worlds();
  const std::lock_guard lock(w.mutex);
  w.all[&bullet] = this;
}

Adapter::~Adapter() {
  for (auto &o : objects_) {
    for (dfm_obstacle &each : o->obstacles) unbind(each);
    if (o->body) o->body->release();
  }
  btDiscreteDynamicsWorld &bullet = *engine_.world;
  bullet.*Opened::pre_tick() = theirs_before_;
  bullet.*Opened::tick() = theirs_after_;
  Worlds &w = worlds();
  const std::lock_guard lock(w.mutex);
  w.all.erase(&bullet);
}

void Adapter::before_tick(btDynamicsWorld *world, btScalar h) {
  Adapter *const a = adapter_of(world);
  if (!a) return;
  const struct InTick {
    bool &is;
    explicit InTick(bool &flag) : is(flag) { is = true; }
    ~InTick() { is = false; }
  } in_tick(a->in_tick_);
  if (a->theirs_before_) a->theirs_before_(world, h);
  try {
    a->of_tick_ = a->tick(h);
  } catch (const std::bad_alloc &) {
    a->of_tick_ = dfm_fail(DFM_E_NOMEM, "bullet: out of memory");
  } catch (...) {
    a->of_tick_ = dfm_fail(DFM_E_FATAL, "bullet: internal error: an unexpected exception");
  }
  if (a->of_tick_ != DFM_OK) a->sentence_ = dfm_last_error();
  if (a->of_tick_ != DFM_OK && a->of_call_ == DFM_OK) {
    a->of_call_ = a->of_tick_;
    a->call_sentence_ = a->sentence_;
  }
  // without bodies that take part, the adapter has not stepped Bullet: the tick does it
  if (a->of_tick_ != DFM_OK || !a->engine_.members.empty())
    a->vacated_ = std::make_unique<Vacated>(*a->engine_.world);
}

void Adapter::after_tick(btDynamicsWorld *world, btScalar h) {
  Adapter *const a = adapter_of(world);
  if (!a) return;
  a->vacated_.reset();
  if (a->theirs_after_) a->theirs_after_(world, h);
}

const Adapter::Props *Adapter::props_of(const btCollisionObject *object) const {
  const auto known = props_.find(object);
  return known == props_.end() ? nullptr : &known->second;
}

Adapter::Traits Adapter::traits_of(const btCollisionObject *object) const {
  Traits t;
  if (const btBroadphaseProxy *const proxy = object->getBroadphaseHandle()) t.handle = proxy->m_uniqueId;
  const Props *const props = props_of(object);
  t.takes_part = object->hasContactResponse() && !(props && props->ignore);
  if (const btMultiBodyLinkCollider *const link = btMultiBodyLinkCollider::upcast(object)) {
    const btMultiBody &multi = *link->m_multiBody;
    t.mass = link->m_link < 0 ? multi.getBaseMass() : multi.getLinkMass(link->m_link);
    t.moves = t.mass > 0 && !(link->m_link < 0 && multi.hasFixedBase());
    return t;
  }
  const btRigidBody *const body = btRigidBody::upcast(object);
  t.moves = body && !body->isStaticOrKinematicObject() && body->getInvMass() > 0;
  if (!t.moves) return t;
  t.mass = body->getInvMass();
  t.moments = from_bullet(body->getInvInertiaDiagLocal());
  t.along = from_bullet(body->getLinearFactor());
  t.about = from_bullet(body->getAngularFactor());
  return t;
}

Adapter::Filter Adapter::filter_of(const btCollisionObject *object) {
  const btBroadphaseProxy *const proxy = object->getBroadphaseHandle();
  return proxy ? Filter{proxy->m_collisionFilterGroup, proxy->m_collisionFilterMask} : Filter{};
}

dfm_status Adapter::sync() { return look(0); }

// Most worlds list their objects in the order in which they were added.
Adapter::Object *Adapter::known(const btCollisionObject *object, int place) const {
  if (size_t(place) < objects_.size() && objects_[size_t(place)]->id == object)
    return objects_[size_t(place)].get();
  const auto at = by_id_.find(object);
  return at == by_id_.end() ? nullptr : at->second;
}

// Refuses an object whose shapes are not known.
dfm_status Adapter::check(const btCollisionObject *object) const {
  std::vector<Part> parts;
  const btCollisionShape *unknown = nullptr;
  if (!traits_of(object).takes_part || parts_of(object->getCollisionShape(), {}, parts, unknown))
    return DFM_OK;
  return failed(
      DFM_E_UNSUPPORTED,
      "collision object %p has a %s, which soft bodies cannot touch; call dfm_bullet_set_object with "
      "ignore = 1, or replace it by a triangle mesh",
      address(object), unknown->getName());
}

// Compares bytes: Traits has no padding.
bool Adapter::same(const Traits &a, const Traits &b) { return std::memcmp(&a, &b, sizeof a) == 0; }

// Whether the obstacles of the object were made of this shape.
bool Adapter::has_parts(const Object &o, const btCollisionShape *shape) {
  if (!o.traits.takes_part) return o.parts.empty();
  if (is_still(shape, o.parts)) return true;
  const btCollisionShape *unknown = nullptr;
  seen_.clear();
  return parts_of(shape, {}, seen_, unknown) && o.parts == seen_;
}

// Reads only objects that the world lists: any other one may have been deleted by its owner.
dfm_status Adapter::look(double h) {
  const Timer timer(sync_seconds_);
  const btCollisionObjectArray &all = engine_.world->getCollisionObjectArray();
  for (auto &o : objects_) o->found = false;
  for (int i = 0; i < all.size(); ++i) {
    Object *const found = known(all[i], i);
    if (found)
      found->found = !found->stale && same(found->traits, traits_of(all[i])) &&
                     has_parts(*found, all[i]->getCollisionShape());
    if (!found || !found->found) TRY(check(all[i]));  // before anything has changed
  }
  TRY(clock_.poll(world_));
  for (auto &o : objects_) {
    if (!o->found || (o->filter == filter_of(o->id) && !clock_.restored)) continue;
    o->filter = filter_of(o->id);
    o->pose = from_bullet(o->id->getWorldTransform());
    for (size_t i = 0; i < o->obstacles.size(); ++i)
      TRY(set_filter(o->obstacles[i], static_cast<uint32_t>(o->filter.group),
                     static_cast<uint32_t>(o->filter.mask), o->body ? nullptr : &o->sent[i],
                     o->pose * o->local[i]));
  }
  TRY(drop());
  if (objects_.size() != static_cast<size_t>(all.size()))
    for (int i = 0; i < all.size(); ++i)
      if (!by_id_.count(all[i])) TRY(bind(all[i]));
  if (!props_.empty()) std::erase_if(props_, [&](const auto &p) { return !by_id_.count(p.first); });
  for (auto &o : objects_) TRY(follow(*o, h));
  TRY(states_.poll(world_));
  for (auto &o : objects_)
    if (o->body) TRY(o->body->agree(clock_.restored, states_));
  clock_.restored = false;
  return DFM_OK;
}

dfm_status Adapter::drop() {
  for (auto &o : objects_) {
    if (o->found) continue;
    for (dfm_obstacle &each : o->obstacles) TRY(unbind(each));
    if (o->body) {
      TRY(o->body->release());
      engine_.forget(o->body->member.get());
    }
    by_id_.erase(o->id);
  }
  std::erase_if(objects_, [](const auto &o) { return !o->found; });
  return DFM_OK;
}

dfm_status Adapter::bind_body(Object &o) {
  o.body = std::make_unique<Body>();
  if (const btMultiBodyLinkCollider *const link = btMultiBodyLinkCollider::upcast(o.id)) {
    auto made = std::make_unique<LinkMember>();
    made->body = link->m_multiBody;
    made->collider = link;
    made->link = link->m_link;
    made->read();
    o.body->member = std::move(made);
  } else {
    auto made = std::make_unique<BulletMember>();
    made->body = const_cast<btRigidBody *>(btRigidBody::upcast(o.id));
    made->read();
    o.body->member = std::move(made);
  }
  Member &m = *o.body->member;
  m.engine = &engine_;
  const btCollisionObject *const body = o.id;
  o.body->seat.refuse = [body] {
    return failed(
        DFM_E_STATE,
        "the rigid body belongs to the adapter, which made it for Bullet's body %p; call removeRigidBody, "
        "and the next tick removes it, or dfm_bullet_detach, which removes all of them",
        address(body));
  };
  TRY(o.body->create(world_, bullet_kind().host, m));
  engine_.members.push_back(&m);
  return DFM_OK;
}

dfm_status Adapter::bind_leaf(Object &o, size_t leaf) {
  dfm_obstacle_def def = dfm_obstacle_def_default();
  Triangles made;
  Pose local;
  describe(o.parts[leaf], def, local, made);
  def.category = static_cast<uint32_t>(o.filter.group);
  def.collides_with = static_cast<uint32_t>(o.filter.mask);
  std::string name;
  if (const Props *const props = props_of(o.id)) {
    name = props->name;
    if (leaf > 0 && !name.empty()) name += "." + std::to_string(leaf);
    def.name = name.empty() ? nullptr : name.c_str();
    def.material = props->material;
  }
  dfm_obstacle &out = o.obstacles.emplace_back();
  o.local.push_back(local);
  if (o.body) {
    def.pose = to_pose(in_principal_frame(o.body->member->inertia, local));
    return dfm_rigid_add_shape(o.body->rigid, &def, &out);
  }
  o.sent.push_back(o.pose * local);
  def.pose = to_pose(o.sent.back());
  return dfm_obstacle_create(world_, &def, &out);
}

dfm_status Adapter::bind(const btCollisionObject *id) {
  auto made = std::make_unique<Object>();
  Object &o = *made;
  o.id = id;
  o.traits = traits_of(id);
  o.filter = filter_of(id);
  o.pose = from_bullet(id->getWorldTransform());
  const btCollisionShape *unknown = nullptr;
  if (o.traits.takes_part) parts_of(id->getCollisionShape(), {}, o.parts, unknown);
  objects_.push_back(std::move(made));  // so that the parts made from here on are dropped with it on failure
  by_id_[id] = &o;
  o.found = o.stale = true;
  if (o.traits.moves && !o.parts.empty()) TRY(bind_body(o));
  for (size_t i = 0; i < o.parts.size(); ++i) TRY(bind_leaf(o, i));
  o.stale = false;
  return DFM_OK;
}

// An object that forces do not move was moved by the caller: its surface follows within the next step.
dfm_status Adapter::follow(Object &o, double h) {
  if (o.body || o.obstacles.empty()) return DFM_OK;
  for (size_t i = 0; clock_.restored && i < o.obstacles.size(); ++i)
    if (o.obstacles[i]) TRY(find_again(o.obstacles[i], o.sent[i]));
  if (h == 0) return DFM_OK;
  const Pose target = from_bullet(o.id->getWorldTransform());
  const btRigidBody *const body = btRigidBody::upcast(o.id);
  const bool driven = body && body->isKinematicObject();
  o.pose = driven ? towards(o.pose, target, from_bullet(body->getLinearVelocity()),
                            from_bullet(body->getAngularVelocity()), h)
                  : target;
  for (size_t i = 0; i < o.obstacles.size(); ++i)
    if (o.obstacles[i]) TRY(dfm_rigid_detail::follow(o.obstacles[i], o.sent[i], o.pose * o.local[i]));
  return DFM_OK;
}

dfm_status Adapter::tick(double h) {
  trouble_ = 0;
  TRY(look(h));
  ++ticks_;
  engine_.gather();
  engine_.callers_step = h;
  return step_both(engine_, world_, h, &trouble_, states_, clock_, [&](auto &&update) {
    for (auto &o : objects_)
      if (o->body) update(*o->body);
  });
}

dfm_status Adapter::step(double dt, int max_sub_steps, double fixed, int *ticks) {
  of_call_ = DFM_OK;
  const int n = engine_.world->stepSimulation(btScalar(dt), max_sub_steps, btScalar(fixed));
  if (ticks) *ticks = n;
  return of_call_ != DFM_OK ? dfm_fail(of_call_, call_sentence_.c_str()) : of_call_;
}

dfm_status Adapter::last_tick(uint32_t *trouble) const {
  if (trouble) *trouble = trouble_;
  return of_tick_ != DFM_OK ? dfm_fail(of_tick_, sentence_.c_str()) : of_tick_;
}

bool Adapter::in_world(const btCollisionObject *object) const {
  const btCollisionObjectArray &all = engine_.world->getCollisionObjectArray();
  for (int i = 0; i < all.size(); ++i)
    if (all[i] == object) return true;
  return false;
}

dfm_status Adapter::not_in_world(const btCollisionObject *object) const {
  return failed(DFM_E_ARG,
                "collision object %p is not in the adapter's world; addRigidBody or "
                "addCollisionObject puts it there",
                address(object));
}

dfm_status Adapter::obstacle(const btCollisionObject *object, uint32_t leaf, dfm_obstacle *out) {
  TRY(sync());
  const auto known = by_id_.find(object);
  if (known == by_id_.end()) return not_in_world(object);
  const Object &o = *known->second;
  if (leaf >= o.obstacles.size())
    return failed(DFM_E_ARG,
                  "collision object %p has %zu leaf shapes that take part in contact, and no leaf %u; it has "
                  "none if it is ignored (dfm_bullet_set_object), empty or without contact response",
                  address(object), o.obstacles.size(), leaf);
  *out = o.obstacles[leaf];
  return DFM_OK;
}

dfm_status Adapter::rigid(const btCollisionObject *body, dfm_rigid *out) {
  TRY(sync());
  const auto known = by_id_.find(body);
  if (known == by_id_.end()) return not_in_world(body);
  if (!known->second->body)
    return failed(DFM_E_ARG, "body %p is not moved by forces: it is static, kinematic, ignored or empty",
                  address(body));
  *out = known->second->body->rigid;
  return DFM_OK;
}

dfm_status Adapter::set_object(const btCollisionObject *object, const dfm_bullet_object &props) {
  if (!in_world(object)) return not_in_world(object);
  Props &p = props_[object];
  p.ignore = props.ignore;
  p.name = props.name ? props.name : "";
  p.material = props.material;
  const auto known = by_id_.find(object);
  if (known != by_id_.end()) known->second->stale = true;
  return DFM_OK;
}

dfm_status Adapter::refresh(const btCollisionObject *object) {
  const auto known = by_id_.find(object);
  if (known == by_id_.end() || !in_world(object)) return not_in_world(object);
  known->second->stale = true;
  return DFM_OK;
}

dfm_bullet_stats Adapter::stats() const {
  dfm_bullet_stats s{};
  s.size = sizeof s;
  for (auto &o : objects_) {
    s.bodies += o->body != nullptr;
    s.shapes += static_cast<uint32_t>(o->obstacles.size());
    s.refused += o->obstacles.empty();
  }
  s.ticks = ticks_;
  s.bullet_steps = engine_.steps;
  s.corrections = engine_.corrections;
  s.residual = engine_.residual;
  s.residual_max = engine_.residual_max;
  s.sync_seconds = sync_seconds_;
  s.bullet_seconds = engine_.engine_seconds;
  return s;
}

}  // namespace dfm_bullet_detail
