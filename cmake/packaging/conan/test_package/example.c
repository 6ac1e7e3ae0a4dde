/* Does the package hold a library that finds its plugins? A ball falls on a floor. */
#include <deform/deform.h>
#include <stdio.h>
#include <stdlib.h>

static void must(dfm_status status) {
  if (status == DFM_OK) return;
  fprintf(stderr, "%s\n", dfm_last_error());
  exit(1);
}

int main(void) {
  const dfm_world_def world_def = dfm_world_def_default();
  const dfm_obstacle_def floor_def = dfm_obstacle_def_default(); /* the plane z = 0 */
  dfm_body_def def = dfm_body_def_default();
  dfm_tetmesh_info info = {.size = sizeof info};
  dfm_context *context;
  dfm_world world;
  dfm_obstacle ground;
  dfm_tetmesh ball;
  dfm_body body;
  must(dfm_context_create(NULL, &context));
  must(dfm_world_create(context, &world_def, &world));
  must(dfm_obstacle_create(world, &floor_def, &ground));
  must(dfm_tetmesh_make(context, "ball", (double[]){0.1, 0, 0}, 200, &ball));
  must(dfm_tetmesh_get_info(ball, &info));
  must(dfm_tetmesh_data(ball, &def.points, &def.tets, NULL));
  def.npoint = info.npoint;
  def.ntet = info.ntet;
  def.pose.position[2] = 0.101;
  must(dfm_body_create(world, &def, &body));
  for (int i = 0; i < 100; ++i) must(dfm_world_step(world, 1e-3, NULL));
  dfm_body_measure measure = {.size = sizeof measure};
  must(dfm_body_get_measure(body, &measure));
  printf("deform %s: center at %.4f m after %.1f s\n", dfm_version(NULL, NULL, NULL), measure.com[2],
         dfm_world_time(world));
  dfm_context_destroy(context);
  return measure.com[2] > 0.05 && measure.com[2] < 0.101 ? 0 : 1;
}
