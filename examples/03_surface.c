/* A cube as exporters often write it: each triangle has separate corners, and every third one faces inward.
 * Reading it as a surface joins and turns the triangles; the OBJ file that is written is closed. Prints what
 * was repaired. */
#include <deform/deform.h>
#include <stdio.h>

#define TRY(call)                       \
  do {                                  \
    if ((call) < 0) {                   \
      printf("%s\n", dfm_last_error()); \
      return 1;                         \
    }                                   \
  } while (0)

static void quiet(void *user, int32_t level, const char *text) {
  (void)user;
  (void)level;
  (void)text;
}

int main(int argc, char **argv) {
  static const uint32_t face[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                      {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  const char *file = argc > 1 ? argv[1] : "cube.obj";
  dfm_context_def def = dfm_context_def_default();
  dfm_mesh_info info = {.size = sizeof info};
  dfm_context *context;
  dfm_mesh_handle cube, read;
  double points[36][3];
  uint32_t triangles[36], n = 0;
  for (int t = 0; t < 12; ++t)
    for (int k = 0; k < 3; ++k, ++n) {
      const int turn = t % 3 == 0 ? (3 - k) % 3 : k;
      const uint32_t corner = face[t / 2][turn == 0 ? 0 : turn + t % 2];
      for (int axis = 0; axis < 3; ++axis) points[n][axis] = corner >> axis & 1 ? 0.1 : 0;
      triangles[n] = n;
    }
  def.log = quiet; /* the warnings are printed below */
  TRY(dfm_context_create(&def, &context));
  TRY(dfm_mesh_create(context, n, &points[0][0], n / 3, triangles, &cube));
  TRY(dfm_mesh_get_info(cube, &info));
  printf("%s%u points, %u triangles, %s, %.4g m3\n", info.warnings, info.npoint, info.ntriangle,
         info.closed ? "closed" : "open", info.volume);
  TRY(dfm_mesh_write(cube, file));
  TRY(dfm_mesh_load(context, file, DFM_MESH_SURFACE, &read));
  TRY(dfm_mesh_get_info(read, &info));
  printf("read again: %u points, %s, nothing to repair: %s\n", info.npoint, info.closed ? "closed" : "open",
         *info.warnings ? "no" : "yes");
  dfm_context_destroy(context);
  return 0;
}
