/* Your own rigid host: a table of five functions moves one box that can only go up and down, and libdeform
 * solves its contact with a soft ball together with the motion of the ball. Prints how the box comes to rest
 * and the force with which the ball carries it. */
#include <deform/deform.h>
#include <stdio.h>
#include <string.h>

#define TRY(call)                       \
  do {                                  \
    if ((call) < 0) {                   \
      printf("%s\n", dfm_last_error()); \
      return 1;                         \
    }                                   \
  } while (0)

/* What the host knows of its box. Position and velocity are not here: the world keeps them and hands them to
 * every call. */
typedef struct { double mass; } host_t;
static host_t host;

static dfm_status create(void *user, const dfm_rigid_set_def *set, void **self, uint32_t *group,
                         uint32_t *nextra) {
  if (set->nbody != 1 || set->njoint != 0) return DFM_E_UNSUPPORTED;
  ((host_t *)user)->mass = dfm_rigid_set_body(set, 0)->mass;
  *self = user;
  group[0] = 0;
  *nextra = 0; /* one group: bodies of a group answer each other's impulses */
  return DFM_OK;
}
static void destroy(void *self) { (void)self; }

/* Without contact: free fall along z, nothing else. */
static dfm_status predict(void *self, const dfm_rigid_step *step, double *velocity) {
  (void)self;
  velocity[2] = step->state[0].velocity[2] + step->h * step->gravity[2];
  return DFM_OK;
}

/* 1/m along z; no impulse turns it or pushes it aside. */
static dfm_status respond(void *self, const dfm_rigid_step *step, uint32_t group, double *matrix) {
  (void)step;
  (void)group;
  memset(matrix, 0, 36 * sizeof *matrix);
  matrix[2 * 6 + 2] = 1 / ((host_t *)self)->mass;
  return DFM_OK;
}

static dfm_status commit(void *self, const dfm_rigid_step *step, const double *impulse,
                         dfm_rigid_state *state, double *extra) {
  (void)extra;
  state[0] = step->state[0];
  state[0].velocity[2] += step->h * step->gravity[2] + impulse[2] / ((host_t *)self)->mass;
  state[0].position[2] += step->h * state[0].velocity[2];
  return DFM_OK;
}

int main(void) {
  const dfm_rigid_host table = {.size = sizeof table,
                                .user = &host,
                                .create = create,
                                .destroy = destroy,
                                .predict = predict,
                                .respond = respond,
                                .commit = commit};
  const double size[3] = {0.1}; /* radius */
  double force[3], moment[3], mean = 0;
  dfm_context *context;
  dfm_world world;
  dfm_mesh_handle mesh;
  dfm_body ball;
  dfm_obstacle floor;
  dfm_rigid box;
  dfm_mesh_info info = {.size = sizeof info};
  dfm_rigid_state state;
  TRY(dfm_rigid_host_register("lift", &table));
  TRY(dfm_context_create(NULL, &context));
  dfm_world_def world_def = dfm_world_def_default();
  TRY(dfm_world_create(context, &world_def, &world));
  dfm_obstacle_def plane = dfm_obstacle_def_default();
  TRY(dfm_obstacle_create(world, &plane, &floor));

  dfm_body_def def = dfm_body_def_default();
  dfm_material_def material = dfm_material_def_default();
  material.young = 3e4;
  material.damping_stiffness = 4e-3;
  material.damping_mass = 8;
  TRY(dfm_mesh_make(context, "ball", size, DFM_MESH_CELLS, 400, &mesh));
  TRY(dfm_mesh_get_info(mesh, &info));
  def.points = info.points;
  def.tets = info.tets;
  TRY(dfm_material_create(world, &material, &def.material));
  def.name = "ball";
  def.npoint = info.npoint;
  def.ntet = info.ntet;
  def.pose.position[2] = 0.101;
  TRY(dfm_body_create(world, &def, &ball));

  dfm_rigid_def body = dfm_rigid_def_default();
  body.name = "box";
  body.shape = DFM_SHAPE_BOX;
  body.mass = 2;
  body.pose.position[2] = 0.24;
  body.half_size[0] = body.half_size[1] = 0.1;
  body.half_size[2] = 0.03;
  const dfm_rigid_set_def set = {.size = sizeof set, .nbody = 1, .bodies = &body};
  TRY(dfm_rigid_create(world, "lift", &set, &box));

  for (int step = 1; step <= 2000; ++step) {
    TRY(dfm_world_step(world, 1e-3, NULL));
    TRY(dfm_rigid_contact_wrench(box, force, moment));
    if (step > 1800) mean += force[2] / 200;
    if (step % 400) continue;
    TRY(dfm_rigid_get_state(box, &state));
    printf("t %.1f s: box at %.4f m, %+.4f m/s\n", dfm_world_time(world), state.position[2],
           state.velocity[2]);
  }
  printf("carried with %.2f N, weight %.2f N\n", mean, body.mass * 9.81);
  dfm_context_destroy(context);
  return mean > 0.98 * body.mass * 9.81 && mean < 1.02 * body.mass * 9.81 ? 0 : 1;
}
