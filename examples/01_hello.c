/* Two soft balls fall on a floor, one on top of the other; prints what touches what. */
#include <deform/deform.h>
#include <stdio.h>

static dfm_body drop(dfm_world world, dfm_tetmesh mesh, double x, double z) {
  dfm_body_def def = dfm_body_def_default();
  dfm_tetmesh_info info = {.size = sizeof info};
  dfm_body body = 0;
  dfm_tetmesh_get_info(mesh, &info);
  def.npoint = info.npoint;
  def.ntet = info.ntet;
  dfm_tetmesh_data(mesh, &def.points, &def.tets, NULL);
  def.pose.position[0] = x;
  def.pose.position[2] = z;
  if (dfm_body_create(world, &def, &body) < 0) fprintf(stderr, "%s\n", dfm_last_error());
  return body;
}

int main(void) {
  dfm_context *context;
  dfm_world world;
  dfm_tetmesh mesh;
  dfm_obstacle ground;
  dfm_contact c[256];
  uint32_t n = 0;
  const dfm_world_def world_def = dfm_world_def_default();
  const dfm_obstacle_def floor_def = dfm_obstacle_def_default(); /* the plane z = 0 */
  if (dfm_context_create(NULL, &context) < 0 || dfm_world_create(context, &world_def, &world) < 0 ||
      dfm_obstacle_create(world, &floor_def, &ground) < 0 ||
      dfm_tetmesh_make(context, "ball", (double[]){0.1, 0, 0}, 500, &mesh) < 0) {
    puts(dfm_last_error());
    return 1;
  }
  const dfm_body lower = drop(world, mesh, 0, 0.11), upper = drop(world, mesh, 0.01, 0.31);
  for (int i = 0; i < 500; ++i)
    if (dfm_world_step(world, 1e-3, NULL) != DFM_OK) {
      puts(dfm_last_error());
      return 1;
    }
  if (!lower || !upper || dfm_world_contacts(world, 256, c, &n) < 0) {
    puts(dfm_last_error());
    return 1;
  }
  for (uint32_t i = 0; i < n; ++i)
    printf("%s: %.3f N at z = %.4f m\n", c[i].body_b ? "ball on ball" : "ball on floor", c[i].fn,
           c[i].point[2]);
  dfm_context_destroy(context);
  return 0;
}
