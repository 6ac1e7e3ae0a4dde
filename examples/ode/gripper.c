/* A gripper in a world of ODE takes a soft ball from the floor, lifts it and holds it. ODE has the palm, two
 * fingers, three sliders and their motors; libdeform has the ball and its contact with fingers and floor.
 * Prints how the ball slips in the fingers while it is held. */
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

/* steps per second; dfm_ode_step cuts them into what the ball needs */
enum { RATE = 240 };
static const double mu = 0.5;

typedef struct {
  dWorldID world;
  dSpaceID space;
  dBodyID palm, finger[2];
  dJointID lift, close[2];
} gripper;

static dBodyID part(gripper *g, double mass, double x, double y, double z, double at_x, double at_z) {
  dMass m;
  dBodyID body = dBodyCreate(g->world);
  dMassSetBoxTotal(&m, mass, x, y, z);
  dBodySetMass(body, &m);
  dBodySetPosition(body, at_x, 0, at_z);
  return body;
}

static dJointID slider(gripper *g, dBodyID moves, dBodyID on, double x, double z, double force) {
  dJointID joint = dJointCreateSlider(g->world, 0);
  dJointAttach(joint, moves, on);
  dJointSetSliderAxis(joint, x, 0, z);
  dJointSetSliderParam(joint, dParamFMax, force);
  return joint;
}

/* Fingers of 2 cm press with `force` each; the palm, which nothing touches, has no geom. */
static gripper make_gripper(double force) {
  gripper g;
  g.world = dWorldCreate();
  g.space = dHashSpaceCreate(0);
  dWorldSetGravity(g.world, 0, 0, -9.81);
  dCreatePlane(g.space, 0, 0, 1, 0);
  g.palm = part(&g, 1, 0.2, 0.03, 0.02, 0, 0.2);
  g.lift = slider(&g, g.palm, 0, 0, 1, 400);
  for (int k = 0; k < 2; ++k) {
    const double side = k ? 1 : -1;
    g.finger[k] = part(&g, 0.3, 0.02, 0.08, 0.08, 0.065 * side, 0.06);
    dGeomSetBody(dCreateBox(g.space, 0.02, 0.08, 0.08), g.finger[k]);
    g.close[k] = slider(&g, g.finger[k], g.palm, 1, 0, force);
    dJointSetSliderParam(g.close[k], dParamVel, -0.3 * side);
  }
  return g;
}

static int make_ball(dfm_context *context, dfm_world soft, dfm_body *out) {
  dfm_mesh_handle mesh;
  dfm_mesh_info info = {.size = sizeof info};
  dfm_body_def def = dfm_body_def_default();
  dfm_material_def foam = dfm_material_def_default();
  foam.density = 200;
  foam.young = 6e3;
  foam.poisson = 0.3;
  foam.damping_mass = 5;
  foam.damping_stiffness = 0.01;
  TRY(dfm_mesh_make(context, "ball", (double[3]){0.05}, DFM_MESH_CELLS, 500, &mesh));
  TRY(dfm_mesh_get_info(mesh, &info));
  def.points = info.points;
  def.tets = info.tets;
  TRY(dfm_material_create(soft, &foam, &def.material));
  def.name = "ball";
  def.npoint = info.npoint;
  def.ntet = info.ntet;
  def.pose.position[2] = 0.0501;
  return dfm_body_create(soft, &def, out) < 0;
}

static int run(dfm_ode ode, double seconds) {
  for (int i = 0; i < seconds * RATE; ++i) TRY(dfm_ode_step(ode, 1.0 / RATE));
  return 0;
}

/* How much higher the ball is than the palm. */
static double above_palm(const gripper *g, dfm_body ball) {
  dfm_body_measure m = {.size = sizeof m};
  return dfm_body_get_measure(ball, &m) < 0 ? NAN : m.com[2] - dBodyGetPosition(g->palm)[2];
}

int main(void) {
  dfm_context *context;
  dfm_world soft;
  dfm_body ball;
  dfm_body_measure m = {.size = sizeof m};
  dfm_ode ode;
  dInitODE2(0);
  TRY(dfm_context_create(NULL, &context));
  const dfm_world_def world_def = dfm_world_def_default();
  TRY(dfm_world_create(context, &world_def, &soft));
  if (make_ball(context, soft, &ball)) return 1;
  TRY(dfm_body_get_measure(ball, &m));
  gripper g = make_gripper(2 * m.mass * 9.81 / (2 * mu)); /* twice what friction needs */

  const double values[] = {mu};
  const dfm_param_value rows[] = {{"mu", values, 1}};
  dfm_friction_def friction = {.size = sizeof friction,
                               .between = {"*", "*"},
                               .law = "coulomb",
                               .params = {sizeof(dfm_params), 1, rows}};
  TRY(dfm_world_add_friction(soft, &friction));
  dfm_ode_def def = dfm_ode_def_default();
  def.world = g.world;
  def.space = g.space;
  TRY(dfm_ode_attach(soft, &def, &ode));

  if (run(ode, 0.4)) return 1; /* grip */
  dJointSetSliderParam(g.lift, dParamVel, 0.2);
  if (run(ode, 0.5)) return 1; /* lift */
  dJointSetSliderParam(g.lift, dParamVel, 0);
  if (run(ode, 1)) return 1; /* come to rest */
  const double before = above_palm(&g, ball);
  if (run(ode, 2)) return 1; /* hold */
  const double slip = fabs(above_palm(&g, ball) - before) / 2;
  TRY(dfm_body_get_measure(ball, &m));
  printf("the ball of %.3f kg is %.3f m above the floor and slips by %.3f micrometers per second\n", m.mass,
         m.com[2], 1e6 * slip);

  TRY(dfm_ode_detach(ode)); /* before either world goes */
  dfm_context_destroy(context);
  dSpaceDestroy(g.space);
  dWorldDestroy(g.world);
  dCloseODE();
  return m.com[2] > 0.13 && slip < 1e-6 ? 0 : 1;
}
