/* A block of jelly is cut in two by a blade that goes down through it. */
#include <deform/deform.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void need(dfm_status status) {
  if (status >= 0) return;
  fprintf(stderr, "%s\n", dfm_last_error());
  exit(1);
}

int main(void) {
  dfm_context *context = NULL;
  dfm_scene scene = 0;
  dfm_world world = 0;
  dfm_body jelly = 0;
  need(dfm_context_create(NULL, &context));
  need(dfm_scene_open(context, "knife.json", NULL, &scene));
  need(dfm_scene_world(scene, &world));
  need(dfm_world_find_body(world, "jelly", &jelly));

  /* the knife of the scene cuts in each step; events tell of it */
  unsigned faces = 0;
  for (int step = 0; step < 400; ++step) {
    dfm_contact_event events[64];
    uint32_t n = 0;
    need(dfm_world_step(world, 1e-3, NULL));
    need(dfm_world_events(world, 0, NULL, &n));
    if (n <= 64) need(dfm_world_events(world, 64, events, &n));
    for (uint32_t i = 0; n <= 64 && i < n; ++i)
      if (events[i].kind == DFM_EVENT_CUT) faces += (unsigned)events[i].key;
  }

  /* between two steps a body is cut without a tool: here the corner that lies farthest left */
  dfm_cut_def def = dfm_cut_def_default();
  dfm_cut_info info;
  info.size = sizeof info;
  def.shape = DFM_CUT_ELLIPSOID;
  def.pose.position[0] = -0.04;
  def.pose.position[2] = 0.04;
  def.half_size[0] = def.half_size[1] = def.half_size[2] = 0.012;
  need(dfm_body_cut(jelly, &def, &info));
  printf("the knife has opened %u faces; %u cells of %.2f g have gone; %u parts are left\n", faces,
         info.cells, 1e3 * info.mass, info.parts);
  need(dfm_scene_close(scene));
  dfm_context_destroy(context);
  return faces > 0 && info.cells > 0 && info.parts >= 2 ? 0 : 1;
}
