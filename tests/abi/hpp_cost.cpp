// What deform.hpp costs: each pair c_NAME, hpp_NAME does the same through the C API and through the wrapper;
// hpp_cost.py compares the instructions. Pairs that end in _throw tell errors by exception; their C side
// calls the same function that throws.
#include <deform/deform.hpp>

#if defined(__cpp_exceptions)
#define CHECK(status)               \
  do {                              \
    const dfm_status s_ = (status); \
    if (s_ < 0) [[unlikely]]        \
      deform::Throw::raise(s_);     \
  } while (0)
namespace throwing = deform::exceptions;
#endif
namespace values = deform::values;

// Every member compiles, whether used or not.
template class deform::basic::Context<deform::Values>;
template class deform::basic::World<deform::Values>;
template class deform::basic::Body<deform::Values>;
template class deform::basic::Obstacle<deform::Values>;
template class deform::basic::Rigid<deform::Values>;
template class deform::basic::Material<deform::Values>;
template class deform::basic::Law<deform::Values>;
template class deform::basic::Scene<deform::Values>;
template class deform::basic::Mesh<deform::Values>;
template struct deform::basic::Toi<deform::Values>;
#if defined(__cpp_exceptions)
template class deform::basic::Context<deform::Throw>;
template class deform::basic::World<deform::Throw>;
template class deform::basic::Body<deform::Throw>;
template class deform::basic::Obstacle<deform::Throw>;
template class deform::basic::Rigid<deform::Throw>;
template class deform::basic::Material<deform::Throw>;
template class deform::basic::Law<deform::Throw>;
template class deform::basic::Scene<deform::Throw>;
template class deform::basic::Mesh<deform::Throw>;
template struct deform::basic::Toi<deform::Throw>;
#endif

static_assert(sizeof(deform::World) == sizeof(dfm_world) &&
              sizeof(deform::Unique<deform::World>) == sizeof(dfm_world));
static_assert(std::is_trivially_copyable_v<deform::Body> && sizeof(values::Context) == sizeof(dfm_context *));
static_assert(sizeof(deform::Result<void>) == sizeof(dfm_status));

extern "C" {

dfm_status c_gravity(dfm_world w, const double *g) { return dfm_world_set_gravity(w, g); }
dfm_status hpp_gravity(dfm_world w, const double *g) {
  return values::World(w).set_gravity(deform::In3(g, 3)).status();
}

dfm_status c_step(dfm_world w, double dt, uint32_t *trouble) {
  uint32_t t = 0;
  const dfm_status s = dfm_world_step(w, dt, &t);
  *trouble = t;
  return s;
}
dfm_status hpp_step(dfm_world w, double dt, uint32_t *trouble) {
  const auto r = values::World(w).step(dt);
  *trouble = r->trouble;
  return r.status();
}

dfm_status c_positions(dfm_body b, double *xyz, size_t numbers, uint32_t *count) {
  uint32_t n = 0;
  const dfm_status s = dfm_surface_positions(b, static_cast<uint32_t>(numbers / 3), xyz, &n);
  *count = n;
  return s;
}
dfm_status hpp_positions(dfm_body b, double *xyz, size_t numbers, uint32_t *count) {
  const auto n = values::Body(b).surface_positions({xyz, numbers});
  *count = *n;
  return n.status();
}

dfm_status c_body(dfm_world w, const dfm_body_def *def, dfm_body *out) {
  dfm_body b = 0;
  const dfm_status s = dfm_body_create(w, def, &b);
  *out = b;
  return s;
}
dfm_status hpp_body(dfm_world w, const dfm_body_def *def, dfm_body *out) {
  const auto b = values::World(w).add_body(*def);
  *out = b->get();
  return b.status();
}

double c_mass(dfm_body b) {
  dfm_body_measure m{};
  m.size = sizeof m;
  return dfm_body_get_measure(b, &m) < 0 ? 0 : m.mass;
}
double hpp_mass(dfm_body b) {
  const auto m = values::Body(b).measure();
  return m ? m->mass : 0;
}

dfm_status c_friction(dfm_world w) {
  const double mu = 0.5;
  const dfm_param_value row = {"mu", &mu, 1};
  dfm_friction_def def{};
  def.size = sizeof def;
  def.between[0] = "a";
  def.between[1] = "b";
  def.law = "karnopp";
  def.params = {sizeof(dfm_params), 1, &row};
  return dfm_world_add_friction(w, &def);
}
dfm_status hpp_friction(dfm_world w) {
  return values::World(w).add_friction("a", "b", "karnopp", deform::Params({{"mu", 0.5}})).status();
}

#if defined(__cpp_exceptions)
void c_gravity_throw(dfm_world w, const double *g) { CHECK(dfm_world_set_gravity(w, g)); }
void hpp_gravity_throw(dfm_world w, const double *g) { throwing::World(w).set_gravity(deform::In3(g, 3)); }

uint32_t c_step_throw(dfm_world w, double dt) {
  uint32_t trouble = 0;
  CHECK(dfm_world_step(w, dt, &trouble));
  return trouble;
}
uint32_t hpp_step_throw(dfm_world w, double dt) { return throwing::World(w).step(dt).trouble; }

uint32_t c_contacts_throw(dfm_world w, dfm_contact *out, size_t room) {
  uint32_t n = 0;
  CHECK(dfm_world_contacts(w, static_cast<uint32_t>(room), out, &n));
  return n;
}
uint32_t hpp_contacts_throw(dfm_world w, dfm_contact *out, size_t room) {
  return throwing::World(w).contacts({out, room});
}

void c_measure_throw(dfm_body b, void (*use)(const dfm_body_measure *)) {
  dfm_body_measure m{};
  m.size = sizeof m;
  CHECK(dfm_body_get_measure(b, &m));
  use(&m);
}
void hpp_measure_throw(dfm_body b, void (*use)(const dfm_body_measure *)) {
  const auto m = throwing::Body(b).measure();
  use(&m);
}
#endif
}  // extern "C"
