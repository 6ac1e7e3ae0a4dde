/* Two soft balls fall on a floor, one on top of the other; prints what touches what. */
#include <deform/deform.h>
#include <stdio.h>
#include <stdlib.h>

static void must(dfm_status status) {
  if (status == DFM_OK) return;
  fprintf(stderr, "%s\n", dfm_last_error());
  exit(1);
}

static void drop(dfm_world world, dfm_mesh_handle mesh, double x, double z) {
  dfm_body_def def = dfm_body_def_default();
  dfm_mesh_info info = {.size = sizeof info};
  dfm_body body;
  must(dfm_mesh_get_info(mesh, &info));
  def.points = info.points;
  def.tets = info.tets;
  def.npoint = info.npoint;
  def.ntet = info.ntet;
  def.pose.position[0] = x;
  def.pose.position[2] = z;
  must(dfm_body_create(world, &def, &body));
}

int main(void) {
  const dfm_world_def world_def = dfm_world_def_default();
  const dfm_obstacle_def floor_def = dfm_obstacle_def_default(); /* the plane z = 0 */
  dfm_context *context;
  dfm_world world;
  dfm_obstacle ground;
  dfm_mesh_handle ball;
  must(dfm_context_create(NULL, &context));
  must(dfm_world_create(context, &world_def, &world));
  must(dfm_obstacle_create(world, &floor_def, &ground));
  must(dfm_mesh_make(context, "ball", (double[]){0.1, 0, 0}, DFM_MESH_CELLS, 500, &ball));
  drop(world, ball, 0, 0.11);
  drop(world, ball, 0.01, 0.31);
  for (int i = 0; i < 500; ++i) must(dfm_world_step(world, 1e-3, NULL));
  dfm_contact c[256];
  uint32_t n = 0;
  must(dfm_world_contacts(world, 256, c, &n));
  for (uint32_t i = 0; i < n; ++i)
    printf("%s: %.3f N at z = %.4f m\n", c[i].body_b ? "ball on ball" : "ball on floor", c[i].fn,
           c[i].point[2]);
  dfm_context_destroy(context);
  return 0;
}
