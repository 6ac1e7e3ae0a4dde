#include <dlfcn.h>

#include <cmath>
#include <cstddef>

#include "adapter.h"

namespace dfm_bullet_detail {

const EngineKind &bullet_kind() {
  static const EngineKind kind{"bullet", "stepSimulation", create_own_world};
  return kind;
}

// The two builds of Bullet share all symbols whose arguments contain no btScalar: with both in one process,
// calls of one build would reach the other.
dfm_status check_bullet() {
  if (!dlsym(RTLD_DEFAULT, "_ZN11btRigidBody12applyDampingEf") ||
      !dlsym(RTLD_DEFAULT, "_ZN11btRigidBody12applyDampingEd"))
    return DFM_OK;
  return failed(DFM_E_UNSUPPORTED,
                "Bullet of single and of double precision are both loaded in this process, and take each "
                "other's calls; link all of it against one of them (libdeform_bullet, libdeform_bullet64)");
}

}  // namespace dfm_bullet_detail

using namespace dfm_bullet_detail;

namespace {

template <class F>
dfm_status with(dfm_bullet handle, F &&f) noexcept {
  return between_steps<Adapter>(bullet_kind(), handle, f);
}

// Ends of structs in 0.1, the smallest that a caller may have (deform/base.h, "structs of another version").
constexpr uint32_t kFirstDef = offsetof(dfm_bullet_def, version) + sizeof(uint32_t);
constexpr uint32_t kFirstStats = offsetof(dfm_bullet_stats, bullet_seconds) + sizeof(double);

dfm_status check_def(const dfm_bullet_def &d) {
  if (d.size < kFirstDef)
    return failed(DFM_E_ARG, "dfm_bullet_def: size is %u, expected %zu; start from dfm_bullet_def_default()",
                  d.size, sizeof d);
  if (d.real_bytes != sizeof(btScalar) || d.version != BT_BULLET_VERSION)
    return failed(
        DFM_E_UNSUPPORTED,
        "this program was compiled against Bullet %u with a btScalar of %u bytes, the library against "
        "Bullet %d with %zu; single precision is libdeform_bullet, double libdeform_bullet64",
        d.version, d.real_bytes, BT_BULLET_VERSION, sizeof(btScalar));
  if (const dfm_status s = check_bullet(); s != DFM_OK) return s;
  if (!d.world) return failed(DFM_E_ARG, "dfm_bullet_def: world is NULL; set it to that of your scene");
  if (!dynamic_cast<btDiscreteDynamicsWorld *>(d.world) ||
      d.world->getWorldType() != BT_DISCRETE_DYNAMICS_WORLD)
    return failed(
        DFM_E_UNSUPPORTED,
        "the world is of btDynamicsWorldType %d; pass a btDiscreteDynamicsWorld (a btSimpleDynamicsWorld "
        "has no ticks; make Bullet's own soft bodies bodies of the dfm_world)",
        static_cast<int>(d.world->getWorldType()));
  if (d.flags)
    return failed(DFM_E_ARG, "dfm_bullet_def: flags is %u; leave it 0, since no flag is defined", d.flags);
  return DFM_OK;
}

}  // namespace

void dfm_bullet_def_default_sized(uint32_t real_bytes, uint32_t version, uint32_t size, dfm_bullet_def *out) {
  if (!out) return;
  dfm_bullet_def d{};
  d.real_bytes = real_bytes;
  d.version = version;
  write_sized(out, d, size);
}

dfm_status dfm_bullet_attach(dfm_world world, const dfm_bullet_def *def, dfm_bullet *out) {
  return attach<Adapter>(bullet_kind(), world, def, out, check_def);
}

dfm_status dfm_bullet_detach(dfm_bullet bullet) { return detach<Adapter>(bullet_kind(), bullet); }

dfm_status dfm_bullet_step(dfm_bullet bullet, double dt, int max_sub_steps, double fixed, int *ticks) {
  return with(bullet, [&](Adapter &a) {
    if (!(dt > 0 && std::isfinite(dt) && max_sub_steps >= 0 && (fixed > 0 || max_sub_steps == 0)))
      return failed(DFM_E_ARG, "dt %g s in at most %d steps of %g s; they must be positive and finite", dt,
                    max_sub_steps, fixed);
    return a.step(dt, max_sub_steps, fixed, ticks);
  });
}

dfm_status dfm_bullet_last_tick(dfm_bullet bullet, uint32_t *trouble) {
  return with(bullet, [&](Adapter &a) { return a.last_tick(trouble); });
}

dfm_status dfm_bullet_get_stats(dfm_bullet bullet, dfm_bullet_stats *out) {
  return with(bullet, [&](Adapter &a) { return give(out, a.stats(), kFirstStats); });
}

dfm_status dfm_bullet_obstacle(dfm_bullet bullet, const btCollisionObject *object, uint32_t leaf,
                               dfm_obstacle *out) {
  return with(bullet, [&](Adapter &a) {
    return !object ? missing("object") : !out ? missing("out") : a.obstacle(object, leaf, out);
  });
}

dfm_status dfm_bullet_rigid(dfm_bullet bullet, const btCollisionObject *body, dfm_rigid *out) {
  return with(bullet, [&](Adapter &a) {
    return !body ? missing("body") : !out ? missing("out") : a.rigid(body, out);
  });
}

dfm_status dfm_bullet_set_object(dfm_bullet bullet, const btCollisionObject *object,
                                 const dfm_bullet_object *props) {
  return with(bullet, [&](Adapter &a) {
    return !object ? missing("object") : !props ? missing("props") : a.set_object(object, *props);
  });
}

dfm_status dfm_bullet_refresh(dfm_bullet bullet, const btCollisionObject *object) {
  return with(bullet, [&](Adapter &a) { return !object ? missing("object") : a.refresh(object); });
}

dfm_status dfm_bullet_debug_draw(dfm_bullet bullet, uint32_t what) {
  return with(bullet, [&](Adapter &a) { return a.debug_draw(what); });
}

dfm_status dfm_bullet_register(void) {
  if (const dfm_status s = check_bullet(); s != DFM_OK) return s;
  return register_host(bullet_kind());
}

const dfm_rigid_host *dfm_bullet_table(void) {
  static const dfm_rigid_host table = table_of(bullet_kind());
  return check_bullet() == DFM_OK ? &table : nullptr;
}
