/* Soft bodies in an engine of one's own: three crates that this engine moves fall on a soft bed that
 * libdeform moves, and the contact between them is solved for both at once. The guide is own_engine.md. */
#include <deform/deform.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TRY(call)                                \
  do {                                           \
    if ((call) < 0) {                            \
      fprintf(stderr, "%s\n", dfm_last_error()); \
      return 1;                                  \
    }                                            \
  } while (0)

/* ---- the table: begin ---------------------------------------------------------------------------------- */
/* kg, kg m2 about the crate's own axes; states come with every call */
typedef struct { double mass, inertia[3]; } mass_t;
typedef struct {
  uint32_t n;
  mass_t crate[];
} engine_t;

static dfm_status create(void *user, const dfm_rigid_set_def *set, void **self, uint32_t *group,
                         uint32_t *nextra) {
  engine_t *e = set->njoint ? NULL : malloc(sizeof *e + set->nbody * sizeof *e->crate);
  (void)user;
  if (!e) return set->njoint ? DFM_E_UNSUPPORTED : DFM_E_NOMEM;
  for (uint32_t i = 0; i < set->nbody; ++i) {
    const dfm_rigid_def *body = dfm_rigid_set_body(set, i);
    memcpy(e->crate[i].inertia, body->inertia, sizeof e->crate[i].inertia);
    e->crate[i].mass = body->mass;
    /* free bodies: none answers another's impulses */
    group[i] = i;
  }
  e->n = set->nbody;
  *self = e;
  *nextra = 0;
  return DFM_OK;
}
static void destroy(void *self) { free(self); }

/* Mean velocity over the sub-step without contact, linear and angular. The engine's own forces, rigid-rigid
 * contact among them, belong here. */
static void free_velocity(const dfm_rigid_step *s, uint32_t i, double v[6]) {
  for (int k = 0; k < 3; ++k) {
    v[k] = s->state[i].velocity[k] + s->h * s->gravity[k];
    v[3 + k] = s->state[i].spin[k];
  }
}
static dfm_status predict(void *self, const dfm_rigid_step *s, double *velocity) {
  for (uint32_t i = 0; i < ((engine_t *)self)->n; ++i) free_velocity(s, i, velocity + 6 * i);
  return DFM_OK;
}

/* What an impulse and its moment change of that velocity: diag(1/m, R diag(1/I) R^T). */
static dfm_status respond(void *self, const dfm_rigid_step *s, uint32_t i, double *W) {
  const mass_t *m = &((engine_t *)self)->crate[i];
  const double *q = s->state[i].rotation, x = q[0], y = q[1], z = q[2], w = q[3];
  const double R[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                          {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                          {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
  memset(W, 0, 36 * sizeof *W);
  for (int r = 0; r < 3; ++r) {
    W[7 * r] = 1 / m->mass;
    for (int c = 0; c < 3; ++c)
      for (int k = 0; k < 3; ++k) W[6 * (3 + r) + 3 + c] += R[r][k] * R[c][k] / m->inertia[k];
  }
  return DFM_OK;
}

static dfm_status commit(void *self, const dfm_rigid_step *s, const double *impulse, dfm_rigid_state *out,
                         double *extra) {
  (void)extra;
  for (uint32_t i = 0; i < ((engine_t *)self)->n; ++i) {
    double v[6], W[36], norm = 0;
    free_velocity(s, i, v);
    respond(self, s, i, W);
    for (int k = 0; k < 36; ++k) v[k / 6] += W[k] * impulse[6 * i + k % 6];
    /* q' = q + h/2 w q */
    const double *q = s->state[i].rotation, *w = v + 3, t = s->h / 2;
    const double turned[4] = {q[0] + t * (w[0] * q[3] + w[1] * q[2] - w[2] * q[1]),
                              q[1] + t * (w[1] * q[3] + w[2] * q[0] - w[0] * q[2]),
                              q[2] + t * (w[2] * q[3] + w[0] * q[1] - w[1] * q[0]),
                              q[3] - t * (w[0] * q[0] + w[1] * q[1] + w[2] * q[2])};
    for (int k = 0; k < 4; ++k) norm += turned[k] * turned[k];
    for (int k = 0; k < 4; ++k) out[i].rotation[k] = turned[k] / sqrt(norm);
    for (int k = 0; k < 3; ++k) {
      out[i].velocity[k] = v[k];
      out[i].spin[k] = w[k];
      out[i].position[k] = s->state[i].position[k] + s->h * v[k];
    }
  }
  return DFM_OK;
}
static const dfm_rigid_host table = {.size = sizeof table,
                                     .create = create,
                                     .destroy = destroy,
                                     .predict = predict,
                                     .respond = respond,
                                     .commit = commit};
/* ---- the table: end ------------------------------------------------------------------------------------ */

/* A soft bed of 0.9 x 0.4 x 0.15 m, its lowest points held. */
static int make_bed(dfm_context *context, dfm_world world) {
  dfm_mesh_handle mesh;
  dfm_body bed;
  dfm_mesh_info info = {.size = sizeof info};
  dfm_body_def def = dfm_body_def_default();
  dfm_material_def gel = dfm_material_def_default();
  gel.young = 4e4;
  gel.damping_mass = 4;
  gel.damping_stiffness = 4e-3;
  TRY(dfm_mesh_make(context, "beam", (double[]){0.9, 0.4, 0.15}, DFM_MESH_CELLS, 2500, &mesh));
  TRY(dfm_mesh_get_info(mesh, &info));
  def.points = info.points;
  def.tets = info.tets;
  TRY(dfm_material_create(world, &gel, &def.material));
  def.name = "bed";
  def.npoint = info.npoint;
  def.ntet = info.ntet;
  TRY(dfm_body_create(world, &def, &bed));
  for (uint32_t i = 0; i < info.npoint; ++i)
    if (def.points[3 * i + 2] < 1e-6) TRY(dfm_body_hold(bed, 1, &i, 7));
  return 0;
}

int main(void) {
  enum { N = 3, RATE = 240, SECONDS = 4 };
  dfm_context *context;
  dfm_world world;
  dfm_rigid_def crate[N];
  dfm_rigid rigid[N];
  /* the engine's own copy: to draw, to collide, to script */
  dfm_rigid_state state[N];
  double carried = 0, weight = 0, speed = 0, force[3], moment[3];
  TRY(dfm_rigid_host_register("my_engine", &table));
  TRY(dfm_context_create(NULL, &context));
  const dfm_world_def def = dfm_world_def_default();
  TRY(dfm_world_create(context, &def, &world));
  if (make_bed(context, world)) return 1;

  for (int i = 0; i < N; ++i) {
    crate[i] = dfm_rigid_def_default();
    crate[i].name = (const char *[]){"crate0", "crate1", "crate2"}[i];
    crate[i].shape = DFM_SHAPE_BOX;
    crate[i].mass = 1 + i;
    for (int k = 0; k < 3; ++k) crate[i].half_size[k] = 0.06;
    crate[i].pose.position[0] = 0.15 + 0.3 * i;
    crate[i].pose.position[1] = 0.2;
    crate[i].pose.position[2] = 0.25 + 0.03 * i;
    crate[i].pose.rotation[1] = sin(0.1 * i);
    crate[i].pose.rotation[3] = cos(0.1 * i); /* tilted: they land on an edge */
    weight += crate[i].mass * 9.81;
  }
  const dfm_rigid_set_def set = {.size = sizeof set, .nbody = N, .bodies = crate};
  TRY(dfm_rigid_create(world, "my_engine", &set, rigid));

  /* the engine's frame: whatever sub-steps are needed happen inside */
  for (int frame = 1; frame <= SECONDS * RATE; ++frame) {
    TRY(dfm_world_step(world, 1.0 / RATE, NULL));
    for (int i = 0; i < N; ++i) {
      TRY(dfm_rigid_get_state(rigid[i], &state[i]));
      TRY(dfm_rigid_contact_wrench(rigid[i], force, moment));
      if (frame > (SECONDS - 1) * RATE) carried += force[2] / RATE;
    }
    if (frame % RATE == 0)
      printf("t %d s: crates at %.4f %.4f %.4f m\n", frame / RATE, state[0].position[2], state[1].position[2],
             state[2].position[2]);
  }
  for (int i = 0; i < N; ++i)
    for (int k = 0; k < 3; ++k) speed = fmax(speed, fmax(fabs(state[i].velocity[k]), fabs(state[i].spin[k])));
  printf("carried %.3f N of %.3f N; fastest %.1e\n", carried, weight, speed);
  dfm_context_destroy(context);
  return fabs(carried - weight) < 0.01 * weight && speed < 1e-2 ? 0 : 1;
}
