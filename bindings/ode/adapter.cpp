#include "adapter.h"

#include <algorithm>
#include <chrono>
#include <cstring>

namespace dfm_ode_detail {
namespace {

bool same(const dMass &a, const dMass &b) { return a.mass == b.mass && std::equal(a.I, a.I + 12, b.I); }

dfm_status not_in_space(dGeomID geom) {
  return failed(DFM_E_ARG, "geom %p is not in the adapter's space; dSpaceAdd puts it there",
                static_cast<void *>(geom));
}

}  // namespace

Adapter::Adapter(dfm_world world, const dfm_ode_def &def)
    : world_(world), space_(def.space), own_group_(!def.contacts), own_near_(!def.near_callback) {
  engine_.world = def.world;
  engine_.quick = def.flags & DFM_ODE_QUICK;
  engine_.contacts = def.contacts ? def.contacts : dJointGroupCreate(0);
  near_.world = def.world;
  near_.group = engine_.contacts;
  near_.coefficient = def.friction;
  near_.most = def.most_contacts;
  engine_.friction = &near_;
  engine_.near_callback = def.near_callback ? def.near_callback : near_callback;
  engine_.near_data = def.near_callback ? def.near_data : &near_;
}

Adapter::~Adapter() {
  for (auto &g : geoms_)
    if (g->obstacle) dfm_obstacle_destroy(g->obstacle);
  for (auto &b : bodies_) b->release();
  if (own_group_) dJointGroupDestroy(engine_.contacts);
}

void Adapter::walk(dSpaceID space) {
  engine_.spaces.push_back(space);
  const int n = dSpaceGetNumGeoms(space);
  for (int i = 0; i < n; ++i) {
    const dGeomID g = dSpaceGetGeom(space, i);
    if (dGeomIsSpace(g)) walk(reinterpret_cast<dSpaceID>(g));
    else seen_.push_back(g);
  }
}

dfm_status Adapter::sync() {
  const auto start = std::chrono::steady_clock::now();
  const dfm_status status = look();
  sync_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return status;
}

// Returns an error before anything has changed.
dfm_status Adapter::check(const std::vector<Signature> &signatures) const {
  for (size_t i = 0; i < seen_.size(); ++i) {
    const Part part = part_of(signatures[i]);
    if (part != Part::needs_arrays && part != Part::unknown) continue;
    const auto known = props_.find(seen_[i]);
    if (known != props_.end() &&
        (known->second.ignore || known->second.arrays_class == signatures[i].inner_class))
      continue;
    const char *const kind = class_name(signatures[i].inner_class);
    const char *const name =
        known != props_.end() && !known->second.name.empty() ? known->second.name.c_str() : "unnamed";
    if (part == Part::unknown)
      return failed(DFM_E_UNSUPPORTED,
                    "geom %p (%s) is a %s, which soft bodies cannot touch; call dfm_ode_set_geom with ignore "
                    "= 1, or replace it by a trimesh",
                    static_cast<void *>(seen_[i]), name, kind);
    return failed(DFM_E_UNSUPPORTED,
                  "geom %p (%s) is a %s, and ODE does not tell its arrays; hand them to %s, or call "
                  "dfm_ode_set_geom with ignore = 1",
                  static_cast<void *>(seen_[i]), name, kind,
                  signatures[i].inner_class == dConvexClass ? "dfm_ode_set_convex" : "dfm_ode_set_heights");
  }
  return DFM_OK;
}

// Reads only geoms in the space and their bodies: others may have been destroyed by the caller.
dfm_status Adapter::look() {
  seen_.clear();
  signatures_.clear();
  engine_.spaces.clear();
  walk(space_);
  if (!own_near_) engine_.spaces.resize(1);  // the caller's callback knows how it wants nested spaces
  for (const dGeomID g : seen_) signatures_.push_back(signature_of(g));
  TRY(check(signatures_));
  TRY(clock_.poll(world_));
  for (auto &g : geoms_) g->found = false;
  for (auto &b : bodies_) b->found = false;
  for (size_t i = 0; i < seen_.size(); ++i) {
    const auto body = signatures_[i].body ? by_body_.find(signatures_[i].body) : by_body_.end();
    if (body != by_body_.end() && !body->second->found) {
      dMass mass;
      dBodyGetMass(body->first, &mass);
      body->second->found = same(mass, body->second->mass);
    }
    const auto geom = by_geom_.find(seen_[i]);
    if (geom == by_geom_.end()) continue;
    Geom &g = *geom->second;
    g.found = g.signature == signatures_[i] && (body == by_body_.end() || body->second->found);
    if (!g.found || (g.signature.has_filter(signatures_[i]) && !clock_.restored)) continue;
    g.signature = signatures_[i];
    TRY(set_filter(g.obstacle, g.signature.category, g.signature.collides,
                   g.signature.body ? nullptr : &g.pose, pose_of(g.id)));
  }
  TRY(drop());
  if (geoms_.size() != seen_.size())
    for (size_t i = 0; i < seen_.size(); ++i)
      if (!by_geom_.count(seen_[i])) TRY(bind(seen_[i], signatures_[i]));
  std::erase_if(props_, [&](const auto &p) { return !by_geom_.count(p.first); });
  for (auto &g : geoms_) TRY(follow(*g));
  if (clock_.restored && !keeps_friction_) near_.forget();
  if (clock_.restored) keeps_friction_ = false;
  TRY(states_.poll(world_));
  for (auto &b : bodies_) TRY(b->agree(clock_.restored, states_));
  clock_.restored = false;
  return DFM_OK;
}

dfm_status Adapter::drop() {
  for (auto &g : geoms_) {
    if (g->found) continue;
    TRY(unbind(g->obstacle));
    by_geom_.erase(g->id);
  }
  std::erase_if(geoms_, [](const auto &g) { return !g->found; });
  for (auto &b : bodies_) {
    if (b->found) continue;
    TRY(b->release());
    engine_.forget(&b->member);
    by_body_.erase(b->id);
  }
  std::erase_if(bodies_, [](const auto &b) { return !b->found; });
  return DFM_OK;
}

dfm_status Adapter::bind_body(dBodyID id, Body *&out) {
  const auto known = by_body_.find(id);
  if (known != by_body_.end()) {
    out = known->second;
    return DFM_OK;
  }
  auto body = std::make_unique<Body>();
  body->id = id;
  dBodyGetMass(id, &body->mass);
  OdeMember &m = body->member;
  m.engine = &engine_;
  m.body = id;
  m.inertia = inertia_of(id);
  body->seat.refuse = [id] {
    return failed(DFM_E_STATE,
                  "the rigid body belongs to the adapter, which made it for ODE's body %p; call "
                  "dBodyDestroy, or remove its geoms from the adapter's space, and the next dfm_ode_step "
                  "removes it, or dfm_ode_detach, which removes all of them",
                  static_cast<void *>(id));
  };
  TRY(body->create(world_, "ode", m));
  engine_.members.push_back(&m);
  out = body.get();
  by_body_[id] = body.get();
  bodies_.push_back(std::move(body));
  return DFM_OK;
}

dfm_status Adapter::bind(dGeomID id, const Signature &s) {
  auto geom = std::make_unique<Geom>();
  geom->id = id;
  geom->signature = s;
  geom->found = true;
  const auto known = props_.find(id);
  const Props *const props = known != props_.end() ? &known->second : nullptr;
  const Part part = part_of(s);
  if (part != Part::none && !(props && props->ignore)) {
    dfm_obstacle_def def = dfm_obstacle_def_default();
    Triangles made;
    describe(id, s, props ? &props->arrays : nullptr, def, made);
    def.category = s.category;
    def.collides_with = s.collides;
    if (props) {
      def.name = props->name.empty() ? nullptr : props->name.c_str();
      def.material = props->material;
    }
    if (s.body) {
      Body *body = nullptr;
      TRY(bind_body(s.body, body));
      def.pose = to_pose(in_principal_frame(body->member.inertia, s.local));
      TRY(dfm_rigid_add_shape(body->rigid, &def, &geom->obstacle));
    } else {
      geom->pose = pose_of(id);
      def.pose = to_pose(geom->pose);
      TRY(dfm_obstacle_create(world_, &def, &geom->obstacle));
    }
  }
  by_geom_[id] = geom.get();
  geoms_.push_back(std::move(geom));
  return DFM_OK;
}

dfm_status Adapter::follow(Geom &g) {
  if (!g.obstacle || g.signature.body) return DFM_OK;
  if (clock_.restored) TRY(find_again(g.obstacle, g.pose));
  return dfm_rigid_detail::follow(g.obstacle, g.pose, pose_of(g.id));
}

// Bodies that move with the known ones because joints lead to them.
std::vector<dBodyID> Adapter::hidden_bodies() const {
  std::vector<dBodyID> found, open;
  for (auto &b : bodies_) open.push_back(b->id);
  // Bodies without a geom that is used: ODE moves them, and a repeated solve must reset them too.
  for (const Signature &s : signatures_)
    if (s.body && !by_body_.count(s.body) && std::find(found.begin(), found.end(), s.body) == found.end()) {
      found.push_back(s.body);
      open.push_back(s.body);
    }
  while (!open.empty()) {
    const dBodyID b = open.back();
    open.pop_back();
    const int n = dBodyGetNumJoints(b);
    for (int i = 0; i < n; ++i)
      for (int side = 0; side < 2; ++side) {
        const dBodyID other = dJointGetBody(dBodyGetJoint(b, i), side);
        if (!other || by_body_.count(other) || std::find(found.begin(), found.end(), other) != found.end())
          continue;
        found.push_back(other);
        open.push_back(other);
      }
  }
  return found;
}

dfm_status Adapter::step(double dt) {
  trouble = 0;
  TRY(sync());
  ++steps_;
  engine_.gather(hidden_bodies());
  engine_.callers_step = dt;
  return step_both(engine_, world_, dt, &trouble, states_, clock_, [&](auto &&update) {
    for (auto &b : bodies_) update(*b);
  });
}

dfm_status Adapter::obstacle(dGeomID geom, dfm_obstacle *out) {
  TRY(sync());
  const auto known = by_geom_.find(geom);
  if (known == by_geom_.end()) return not_in_space(geom);
  if (!known->second->obstacle)
    return failed(
        DFM_E_ARG,
        "geom %p takes no part: it is ignored (dfm_ode_set_geom), disabled, a ray or an empty transform",
        static_cast<void *>(geom));
  *out = known->second->obstacle;
  return DFM_OK;
}

dfm_status Adapter::rigid(dBodyID body, dfm_rigid *out) {
  TRY(sync());
  const auto known = by_body_.find(body);
  if (known == by_body_.end())
    return failed(DFM_E_ARG, "body %p has no geom in the adapter's space that takes part; add one",
                  static_cast<void *>(body));
  *out = known->second->rigid;
  return DFM_OK;
}

// Refuses an unknown geom; one that was added since the last step is known, too.
dfm_status Adapter::must_have(dGeomID geom) {
  seen_.clear();
  engine_.spaces.clear();
  walk(space_);
  return by_geom_.count(geom) || std::ranges::find(seen_, geom) != seen_.end() ? dfm_status{DFM_OK}
                                                                               : not_in_space(geom);
}

dfm_status Adapter::rebind(dGeomID geom) {
  const auto known = by_geom_.find(geom);
  if (known == by_geom_.end()) return DFM_OK;
  TRY(unbind(known->second->obstacle));
  by_geom_.erase(known);
  std::erase_if(geoms_, [&](const auto &g) { return g->id == geom; });
  return DFM_OK;
}

dfm_status Adapter::set_geom(dGeomID geom, const dfm_ode_geom &props) {
  TRY(must_have(geom));
  TRY(rebind(geom));
  Props &p = props_[geom];
  p.ignore = props.ignore;
  p.name = props.name ? props.name : "";
  p.material = props.material;
  return DFM_OK;
}

dfm_status Adapter::set_arrays(dGeomID geom, int geom_class, Triangles arrays) {
  TRY(must_have(geom));
  if (signature_of(geom).inner_class != geom_class)
    return failed(DFM_E_ARG, "geom %p is no %s; only of those ODE keeps the arrays to itself",
                  static_cast<void *>(geom), class_name(geom_class));
  TRY(rebind(geom));
  Props &p = props_[geom];
  p.arrays = std::move(arrays);
  p.arrays_class = geom_class;
  return DFM_OK;
}

dfm_status Adapter::refresh(dGeomID geom) {
  if (!by_geom_.count(geom))
    return failed(DFM_E_ARG, "geom %p has not taken part in a step yet; nothing is there to be read again",
                  static_cast<void *>(geom));
  return rebind(geom);
}

dfm_ode_stats Adapter::stats() const {
  dfm_ode_stats s{};
  s.size = sizeof s;
  s.bodies = static_cast<uint32_t>(bodies_.size());
  for (auto &g : geoms_) ++(g->obstacle ? s.shapes : s.refused);
  s.steps = steps_;
  s.ode_steps = engine_.steps;
  s.corrections = engine_.corrections;
  s.residual = engine_.residual;
  s.residual_max = engine_.residual_max;
  s.sync_seconds = sync_seconds_;
  s.ode_seconds = engine_.engine_seconds;
  return s;
}

}  // namespace dfm_ode_detail
