/* A soft block lies on a soft plate that is held from below; an increasing force pulls it. Prints the force
 * at which it begins to slide (Coulomb: mu times the weight), and the events. */
#include <deform/deform.h>
#include <stdio.h>

enum { POINTS = 1024, EVENTS = 4096 };
static double x[3 * POINTS], force[3 * POINTS];
static uint32_t points[POINTS];
static dfm_contact_event events[EVENTS];

#define TRY(call)                       \
  do {                                  \
    if ((call) < 0) {                   \
      printf("%s\n", dfm_last_error()); \
      return 1;                         \
    }                                   \
  } while (0)

static int make(dfm_context *context, dfm_world world, const char *name, const double size[3], double z,
                dfm_body *body) {
  dfm_body_def def = dfm_body_def_default();
  dfm_material_def material = dfm_material_def_default();
  dfm_mesh_info info = {.size = sizeof info};
  dfm_mesh_handle mesh;
  material.young = 2e5;
  material.damping_stiffness = 2e-3;
  TRY(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 150, &mesh));
  TRY(dfm_mesh_get_info(mesh, &info));
  def.points = info.points;
  def.tets = info.tets;
  TRY(dfm_material_create(world, &material, &def.material));
  def.name = name;
  def.npoint = info.npoint;
  def.ntet = info.ntet;
  for (int k = 0; k < 2; ++k) def.pose.position[k] = -0.5 * size[k];
  def.pose.position[2] = z;
  TRY(dfm_body_create(world, &def, body));
  TRY(dfm_mesh_destroy(mesh));
  return 0;
}

int main(void) {
  const double mu = 0.5, plate_size[3] = {0.3, 0.2, 0.05}, block_size[3] = {0.1, 0.1, 0.05};
  const dfm_param_value value = {"mu", &mu, 1};
  const dfm_friction_def friction = {
      sizeof friction, 0, {"block", "plate"}, "coulomb", {sizeof(dfm_params), 1, &value}, 0};
  const dfm_scale_key rise[2] = {{0.5, 0}, {8.5, 1}}; /* the pull grows from nothing to the weight */
  dfm_body_measure m = {.size = sizeof m};
  dfm_context *context;
  dfm_world world;
  dfm_body plate, block;
  uint32_t n = 0, held = 0, begun = 0, ended = 0;
  double slid = 0;
  TRY(dfm_context_create(NULL, &context));
  TRY(dfm_world_create(context, NULL, &world));
  if (make(context, world, "plate", plate_size, 0, &plate) ||
      make(context, world, "block", block_size, 0.0501, &block))
    return 1;

  TRY(dfm_body_get_state(plate, POINTS, x, NULL, &n));
  for (uint32_t i = 0; i < n; ++i)
    if (x[3 * i + 2] < 1e-9) points[held++] = i;
  TRY(dfm_body_hold(plate, held, points, 7));
  TRY(dfm_world_add_friction(world, &friction));
  TRY(dfm_body_get_measure(block, &m));
  const double weight = 9.81 * m.mass;
  TRY(dfm_body_get_state(block, POINTS, x, NULL, &n));
  for (uint32_t i = 0; i < n; ++i) {
    points[i] = i;
    force[3 * i] = weight / n;
  }
  TRY(dfm_body_add_load(block, n, points, force, 2, rise, NULL, NULL));

  for (int i = 0; i < 8500 && slid == 0; ++i) {
    TRY(dfm_world_step(world, 1e-3, NULL));
    TRY(dfm_body_get_measure(block, &m));
    TRY(dfm_world_events(world, EVENTS, events, &n));
    for (uint32_t k = 0; k < n; ++k) events[k].kind == DFM_EVENT_BEGIN ? ++begun : ++ended;
    if (m.velocity[0] > 0.01) slid = (dfm_world_time(world) - 0.5) / 8;
  }
  printf("slides at %.3f of its weight (mu %.3f)\n", slid, mu);
  TRY(dfm_world_contacts(world, 0, NULL, &n));
  printf("contacts: %u begun, %u ended, %u now\n", begun, ended, n);
  dfm_context_destroy(context);
  return 0;
}
