/* A host by somebody else, in C, against the installed tree: a ball on a floor under a law from the plugin
 * file argv[1]. */
#include <deform/deform.h>
#include <math.h>
#include <stdio.h>

#define TRY(call)                                           \
  do {                                                      \
    if ((call) < 0) {                                       \
      fprintf(stderr, "%s: %s\n", #call, dfm_last_error()); \
      return 1;                                             \
    }                                                       \
  } while (0)

int main(int argc, char **argv) {
  int major = -1, minor = -1, patch = -1;
  printf("deform %s\n", dfm_version(&major, &minor, &patch));
  if (major != DFM_VERSION_MAJOR || minor != DFM_VERSION_MINOR || patch != DFM_VERSION_PATCH || argc != 2)
    return 1;

  dfm_context *context = NULL;
  TRY(dfm_context_create(NULL, &context));
  dfm_law law = 0;
  const dfm_type *type = NULL;
  TRY(dfm_law_open(context, argv[1], &law));
  TRY(dfm_law_type(law, &type));
  printf("law %s\n", type->id);

  dfm_world_def world_def = dfm_world_def_default();
  dfm_world world = 0;
  TRY(dfm_world_create(context, &world_def, &world));
  dfm_obstacle_def floor_def = dfm_obstacle_def_default();
  floor_def.name = "floor";
  dfm_obstacle floor_plane = 0;
  TRY(dfm_obstacle_create(world, &floor_def, &floor_plane));

  const double size[3] = {0.1, 0, 0};
  dfm_mesh_handle mesh = 0;
  TRY(dfm_mesh_make(context, "ball", size, DFM_MESH_CELLS, 100, &mesh));
  dfm_mesh_info info = {sizeof info};
  TRY(dfm_mesh_get_info(mesh, &info));
  dfm_body_def body_def = dfm_body_def_default();
  body_def.name = "ball";
  body_def.npoint = info.npoint;
  body_def.ntet = info.ntet;
  body_def.points = info.points;
  body_def.tets = info.tets;
  body_def.pose.position[2] = 0.101;
  dfm_body body = 0;
  TRY(dfm_body_create(world, &body_def, &body));
  dfm_friction_def pair = {sizeof pair};
  pair.between[0] = pair.between[1] = "*";
  pair.law = type->id;
  TRY(dfm_world_add_friction(world, &pair));

  for (int i = 0; i < 100; ++i) TRY(dfm_world_step(world, 1e-3, NULL));
  dfm_body_measure measure = {sizeof measure};
  TRY(dfm_body_get_measure(body, &measure));
  printf("center at %.4f m after %.3f s\n", measure.com[2], dfm_world_time(world));
  dfm_context_destroy(context);
  return isfinite(measure.com[2]) && measure.com[2] > 0.05 && measure.com[2] < 0.101 ? 0 : 1;
}
