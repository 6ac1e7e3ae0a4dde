/* Everything in one file: runs the scene argv[1] for argv[2] steps of argv[3] seconds and prints the
 * state's hash; then a law that this program brings along; then asks for the plugin file argv[4], which
 * must be refused. */
#include <deform/deform.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TRY(call)                                           \
  do {                                                      \
    if ((call) < 0) {                                       \
      fprintf(stderr, "%s: %s\n", #call, dfm_last_error()); \
      return 1;                                             \
    }                                                       \
  } while (0)

extern const dfm_plugin *dfm_plugin_entry_slab(const dfm_host *host, uint32_t host_abi,
                                               uint32_t host_abi_min);

static void show(void *user, const dfm_type *type, const char *file) {
  (void)user;
  printf("%s from %s\n", type->id, file);
}

int main(int argc, char **argv) {
  dfm_context *context = NULL;
  dfm_world world = 0;
  dfm_law law = 0;
  if (argc != 5) return 2;
  TRY(dfm_context_create(NULL, &context));
  TRY(dfm_scene_load(context, argv[1], &world));
  for (long i = strtol(argv[2], NULL, 10); i > 0; --i)
    TRY(dfm_world_step(world, strtod(argv[3], NULL), NULL));
  printf("state_hash %016" PRIx64 "\n", dfm_world_hash(world));

  TRY(dfm_plugin_register_static(context, dfm_plugin_entry_slab, "slab"));
  TRY(dfm_plugin_visit(context, show, NULL));
  TRY(dfm_law_open(context, "slab", &law));
  if (dfm_plugin_load(context, argv[4]) != DFM_E_UNSUPPORTED ||
      !strstr(dfm_last_error(), "dfm_plugin_register_static")) {
    fprintf(stderr, "a plugin file was not refused: %s\n", dfm_last_error());
    return 1;
  }
  dfm_context_destroy(context);
  return 0;
}
