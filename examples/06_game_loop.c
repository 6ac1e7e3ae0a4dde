/* Soft crates in a game loop: display frames of slightly varying length, world steps of a fixed 1/60 s,
 * sleep, impacts for sounds, vertices for the renderer. Prints a line per simulated second: the cost of a
 * step on this machine, the number of sounds, the number of sleeping bodies.
 *   06_game_loop [YOUNG in Pa] [CELLS per crate] [SECONDS] [WORK]
 * 1e5, 200 and 4 where not given; WORK limits each step (dfm_world_def.max_work), 0: as by default. */
#include <deform/deform.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { CRATES = 4, VERTICES = 4096, PAIRS = 64 };
#define TRY(call)                       \
  do {                                  \
    if ((call) < 0) {                   \
      printf("%s\n", dfm_last_error()); \
      return 1;                         \
    }                                   \
  } while (0)

/* s, of the world: fixed, so that a replay gives the same bits */
static const double kStep = 1.0 / 60;
static const double kAudible = 0.02;  /* N s, of an impact */
static double vertices[3 * VERTICES]; /* what the renderer gets */

static int make_crate(dfm_context *context, dfm_world world, double young, uint32_t cells, int number,
                      dfm_body *out) {
  const double size[3] = {0.2, 0.2, 0.2};
  dfm_body_def def = dfm_body_def_default();
  dfm_material_def material = dfm_material_def_default();
  dfm_mesh_info info = {.size = sizeof info};
  dfm_mesh_handle mesh;
  /* Damping by stiffness quiets what wobbles: at 2 ms a wobble of 10 Hz loses 6 % of its amplitude
   * per radian. */
  material.density = 300;
  material.young = young;
  material.poisson = 0.3;
  material.damping_stiffness = 2e-3;
  TRY(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, cells, &mesh));
  TRY(dfm_mesh_get_info(mesh, &info));
  def.points = info.points;
  def.tets = info.tets;
  TRY(dfm_material_create(world, &material, &def.material));
  def.npoint = info.npoint;
  def.ntet = info.ntet;
  def.pose.position[0] = 0.03 * number;
  def.pose.position[2] = 0.02 + 0.24 * number;
  TRY(dfm_body_create(world, &def, out));
  TRY(dfm_mesh_destroy(mesh));
  return 0;
}

/* One fixed step, and what the game takes from it. */
static int step(dfm_world world, const dfm_body *crates, int *sounds, double *loudest) {
  dfm_pair_impulse impacts[PAIRS];
  uint32_t n = 0;
  /* where the budget is used up it ends early, and the world falls behind: stats.shortened counts that */
  TRY(dfm_world_step(world, kStep, NULL));
  TRY(dfm_world_pair_impulses(world, PAIRS, impacts, &n));
  for (uint32_t i = 0; i < n; ++i) {
    /* A load at rest gives weight times step each time; what is well above its mean over the
     * contact is an impact. */
    const double impulse = impacts[i].peak_normal * kStep;
    if (impulse > kAudible && impacts[i].peak_normal * impacts[i].touching > 2 * impacts[i].normal_impulse)
      ++*sounds;
    if (impacts[i].peak_normal > *loudest) *loudest = impacts[i].peak_normal;
  }
  /* the renderer's vertex buffer */
  for (int k = 0; k < CRATES; ++k) TRY(dfm_surface_positions(crates[k], VERTICES, vertices, &n));
  return 0;
}

int main(int argc, char **argv) {
  const double young = argc > 1 ? atof(argv[1]) : 1e5, seconds = argc > 3 ? atof(argv[3]) : 4;
  const uint32_t cells = argc > 2 ? (uint32_t)atoi(argv[2]) : 200;
  dfm_world_def world_def = dfm_world_def_default();
  const dfm_obstacle_def floor_def = dfm_obstacle_def_default(); /* the plane z = 0 */
  dfm_world_stats stats = {.size = sizeof stats};
  dfm_context *context;
  dfm_world world;
  dfm_obstacle ground;
  dfm_body crates[CRATES];
  double late = 0, stable = 0; /* s of display time that the world has not made yet */
  world_def.max_work = argc > 4 ? strtoull(argv[4], NULL, 10) : 0;
  world_def.sleep = 1; /* crates at rest cost nothing until something reaches them */
  TRY(dfm_context_create(NULL, &context));
  TRY(dfm_world_create(context, &world_def, &world));
  TRY(dfm_obstacle_create(world, &floor_def, &ground));
  for (int k = 0; k < CRATES; ++k)
    if (make_crate(context, world, young, cells, k, &crates[k])) return 1;
  TRY(dfm_world_stable_step(world, &stable, NULL, NULL));
  printf("%d crates of %u cells asked for, E %g Pa: stable step %.3g ms\n", CRATES, cells, young,
         1e3 * stable);

  int frame = 0, steps = 0, sounds = 0;
  double spent = 0, longest = 0, loudest = 0, shown = 0;
  for (double display = 0; display < seconds; ++frame) {
    /* an engine asks its clock */
    const double passed = frame % 10 == 9 ? 2 * kStep : kStep * (frame % 2 ? 1.01 : 0.99);
    display += passed;
    late += passed;
    /* after a hitch the world falls behind rather than the frame rate */
    if (late > 4 * kStep) late = 4 * kStep;
    for (; late >= kStep; late -= kStep, ++steps) {
      const clock_t begin = clock();
      if (step(world, crates, &sounds, &loudest)) return 1;
      const double ms = 1e3 * (double)(clock() - begin) / CLOCKS_PER_SEC;
      spent += ms;
      if (ms > longest) longest = ms;
    }
    /* draw here: the last step's vertices, or a mixture of the last two by late / kStep */
    if (display < shown + 1 && display < seconds) continue;
    TRY(dfm_world_get_stats(world, &stats));
    printf(
        "t %5.2f s: %3d steps of %u sub-steps, %6.2f ms each, longest %6.2f ms; %2d impacts, peak %6.1f N; "
        "%u asleep, %llu shortened\n",
        dfm_world_time(world), steps, stats.last_substeps, steps ? spent / steps : 0.0, longest, sounds,
        loudest, stats.asleep, (unsigned long long)stats.shortened);
    shown = display;
    steps = sounds = 0;
    spent = longest = loudest = 0;
  }
  dfm_context_destroy(context);
  return 0;
}
