// Both builds of Bullet are installed beside the command, and a process can load only one: the binding is
// opened when the first scene needs it, and these hosts forward all calls to it.
#include "bullet_host.h"

#include <dlfcn.h>

#include <mutex>
#include <new>
#include <string>

#include "cli.h"
#include "deform/deform.h"
#include "messages.h"

namespace cli {
namespace {

struct Build {
  const char *host;      // its name in scenes
  const char *files[2];  // the first that is there
};
constexpr const char *kFloat = "libdeform_bullet.so.0", *kDouble = "libdeform_bullet64.so.0";
const Build builds[] = {{"bullet", {kDouble, kFloat}},
                        {"bullet_float", {kFloat, nullptr}},
                        {"bullet_double", {kDouble, nullptr}}};

// What is open, for the length of the program.
struct Open {
  std::mutex mutex;
  std::string file;
  const dfm_rigid_host *table = nullptr;
};
Open &opened() {
  static Open *const open = new Open;
  return *open;
}

dfm_status refuse(const std::string &sentence) { return dfm_fail(DFM_E_UNSUPPORTED, sentence.c_str()); }

dfm_status open_build(const Build &build, const dfm_rigid_host *&table) {
  Open &o = opened();
  const std::lock_guard lock(o.mutex);
  std::string wanted = build.files[0];
  for (const char *file : build.files)
    if (file && o.file == file) wanted = file;
  if (o.table && o.file != wanted)
    return refuse("host \"" + std::string(build.host) + "\" needs " + wanted + ", and " + o.file +
                  " is already open; use only one of the two in a run");
  std::string why;
  for (size_t i = 0; i < 2 && !o.table && build.files[i]; ++i) {
    void *const library = dlopen(build.files[i], RTLD_NOW | RTLD_LOCAL);
    void *const entry = library ? dlsym(library, "dfm_bullet_table") : nullptr;
    if (!entry) why = dlerror();
    else o.table = reinterpret_cast<const dfm_rigid_host *(*)()>(entry)();
    if (o.table) o.file = build.files[i];
  }
  table = o.table;
  return table ? dfm_status{DFM_OK}
               : refuse("host \"" + std::string(build.host) + "\": " + why +
                        "; build (`make tools`) or install libdeform_bullet");
}

struct Instance {
  const dfm_rigid_host *table;
  void *self;
};

dfm_status create(void *user, const dfm_rigid_set_def *set, void **self, uint32_t *group, uint32_t *nextra) {
  try {
    const dfm_rigid_host *table = nullptr;
    if (const dfm_status s = open_build(*static_cast<const Build *>(user), table); s != DFM_OK) return s;
    auto *const instance = new Instance{table, nullptr};
    const dfm_status s = table->create(table->user, set, &instance->self, group, nextra);
    if (s == DFM_OK) *self = instance;
    else delete instance;
    return s;
  } catch (const std::bad_alloc &) {
    return dfm_fail(DFM_E_NOMEM, "rigid host: out of memory");
  }
}
Instance &of(void *self) { return *static_cast<Instance *>(self); }
void destroy(void *self) {
  of(self).table->destroy(of(self).self);
  delete &of(self);
}
dfm_status predict(void *self, const dfm_rigid_step *step, double *velocity) {
  return of(self).table->predict(of(self).self, step, velocity);
}
dfm_status respond(void *self, const dfm_rigid_step *step, uint32_t group, double *matrix) {
  return of(self).table->respond(of(self).self, step, group, matrix);
}
dfm_status commit(void *self, const dfm_rigid_step *step, const double *impulse, dfm_rigid_state *state,
                  double *extra) {
  return of(self).table->commit(of(self).self, step, impulse, state, extra);
}
dfm_status push(void *self, const dfm_rigid_step *step, const double *impulse) {
  return of(self).table->push(of(self).self, step, impulse);
}
dfm_status set_motor(void *self, uint32_t joint, double velocity, double max, double *extra) {
  return of(self).table->set_motor(of(self).self, joint, velocity, max, extra);
}
dfm_status joint(void *self, const dfm_rigid_state *state, const double *extra, uint32_t number,
                 double *position, double *rate, double *effort) {
  return of(self).table->joint(of(self).self, state, extra, number, position, rate, effort);
}

}  // namespace

void register_bullet() {
  static bool done = false;
  if (done) return;
  done = true;
  for (const Build &build : builds) {
    const dfm_rigid_host table{.size = sizeof table,
                               .flags = 0,
                               .user = const_cast<Build *>(&build),
                               .create = create,
                               .destroy = destroy,
                               .predict = predict,
                               .respond = respond,
                               .commit = commit,
                               .set_motor = set_motor,
                               .joint = joint,
                               .revise = nullptr,
                               .push = push,
                               .may_destroy = nullptr};
    if (dfm_rigid_host_register(build.host, &table) != DFM_OK) warn(dfm_last_error());
  }
}

}  // namespace cli
