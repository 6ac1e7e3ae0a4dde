/* Does the package hold a library that finds its plugins? */
#include <deform/deform.h>
#include <stdio.h>

static void count(void *user, const dfm_type *type, const char *file) {
  (void)type;
  (void)file;
  ++*(int *)user;
}

int main(void) {
  dfm_context *context = NULL;
  dfm_law law = 0;
  int types = 0;
  if (dfm_context_create(NULL, &context) < 0 || dfm_law_open(context, "coulomb", &law) < 0 ||
      dfm_plugin_visit(context, count, &types) < 0) {
    fprintf(stderr, "%s\n", dfm_last_error());
    return 1;
  }
  printf("deform %s: %d laws and models\n", dfm_version(NULL, NULL, NULL), types);
  dfm_context_destroy(context);
  return types > 10 ? 0 : 1;
}
