/* Soft bodies in an ODE scene: a plate and a crate upon it, moved by ODE, come down on a soft cushion that
 * libdeform moves. The guide is ode.md; what the scene had before stands between "ODE" marks. */
#include <deform/ode.h>
#include <math.h>
#include <stdio.h>

#define TRY(call)                                \
  do {                                           \
    if ((call) < 0) {                            \
      fprintf(stderr, "%s\n", dfm_last_error()); \
      return 1;                                  \
    }                                            \
  } while (0)

/* ---- ODE: begin ---------------------------------------------------------------------------------------- */
static dWorldID world;
static dSpaceID space;

static dBodyID box(double mass, double x, double y, double z, double height) {
  dMass m;
  dBodyID body = dBodyCreate(world);
  dGeomID geom = dCreateBox(space, x, y, z);
  dMassSetBoxTotal(&m, mass, x, y, z);
  dBodySetMass(body, &m);
  dGeomSetBody(geom, body);
  dBodySetPosition(body, 0, 0, height);
  return body;
}
/* ---- ODE: end ------------------------------------------------------------------------------------------ */

/* A block of gel, 0.3 x 0.3 x 0.1 m, that lies where the plate will land. */
static int make_cushion(dfm_context *context, dfm_world soft, dfm_body *out) {
  dfm_mesh_handle mesh;
  dfm_mesh_info info = {.size = sizeof info};
  dfm_body_def def = dfm_body_def_default();
  dfm_material_def gel = dfm_material_def_default();
  gel.young = 3e4;
  gel.damping_mass = 4;
  gel.damping_stiffness = 4e-3;
  TRY(dfm_mesh_make(context, "beam", (double[]){0.3, 0.3, 0.1}, DFM_MESH_CELLS, 900, &mesh));
  TRY(dfm_mesh_get_info(mesh, &info));
  def.points = info.points;
  def.tets = info.tets;
  TRY(dfm_material_create(soft, &gel, &def.material));
  def.name = "cushion";
  def.npoint = info.npoint;
  def.ntet = info.ntet;
  def.pose.position[0] = def.pose.position[1] = -0.15;
  def.pose.position[2] = 1e-3;
  TRY(dfm_body_create(soft, &def, out));
  return 0;
}

int main(void) {
  enum { RATE = 240, SECONDS = 4 };
  double carried = 0, force[3], moment[3];
  dInitODE2(0);
  world = dWorldCreate();
  space = dHashSpaceCreate(0);
  dWorldSetGravity(world, 0, 0, -9.81);
  dCreatePlane(space, 0, 0, 1, 0);
  dBodyID plate = box(2, 0.25, 0.25, 0.02, 0.14), crate = box(1, 0.1, 0.1, 0.1, 0.21);

  dfm_context *context;
  dfm_world soft;
  dfm_body cushion;
  dfm_ode ode;
  dfm_rigid rigid;
  TRY(dfm_context_create(NULL, &context));
  const dfm_world_def world_def = dfm_world_def_default();
  TRY(dfm_world_create(context, &world_def, &soft));
  if (make_cushion(context, soft, &cushion)) return 1;
  dfm_ode_def def = dfm_ode_def_default();
  def.world = world;
  def.space = space;
  TRY(dfm_ode_attach(soft, &def, &ode));

  TRY(dfm_ode_rigid(ode, plate, &rigid)); /* the handle of the plate in reports */
  for (int frame = 1; frame <= SECONDS * RATE; ++frame) {
    /* was: dSpaceCollide, dWorldStep, dJointGroupEmpty */
    TRY(dfm_ode_step(ode, 1.0 / RATE));
    TRY(dfm_rigid_contact_wrench(rigid, force, moment));
    if (frame > (SECONDS - 1) * RATE) carried += force[2] / RATE;
    if (frame % RATE == 0)
      printf("t %d s: plate at %.4f m, crate at %.4f m\n", frame / RATE, dBodyGetPosition(plate)[2],
             dBodyGetPosition(crate)[2]);
  }
  printf("the cushion carries %.3f N of %.3f N\n", carried, 3 * 9.81);

  TRY(dfm_ode_detach(ode)); /* before either world goes */
  dfm_context_destroy(context);
  dSpaceDestroy(space);
  dWorldDestroy(world);
  dCloseODE();
  return fabs(carried - 3 * 9.81) < 0.01 * 3 * 9.81 ? 0 : 1;
}
