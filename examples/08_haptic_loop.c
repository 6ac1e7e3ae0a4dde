/* A loop in its own thread at a fixed rate, as a haptic device needs it, beside a scene that another thread
 * steps: the loop writes the pose of the hand and reads the force, the scene reads the pose and writes the
 * force. Prints how late the loop woke up, how long a step took, and the age of the motion behind a force.
 *   08_haptic_loop SCENE [TOOL] [SECONDS] [RATE in Hz]     the first tool, 2 and 1000 where not given
 * The hand here is simulated: it moves up and down by 10 mm from the pose of the tool. Replace it by the
 * driver of a device. */
#define _POSIX_C_SOURCE 200809L
#include <deform/deform.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { CLASSES = 10 };
#define TRY(call)                       \
  do {                                  \
    if ((call) < 0) {                   \
      printf("%s\n", dfm_last_error()); \
      return 1;                         \
    }                                   \
  } while (0)

static const double kClass[CLASSES] = {0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 1e9}; /* ms, upper ends */
typedef struct Histogram {
  long count[CLASSES], n;
  double most, sum; /* ms */
} Histogram;

static void add(Histogram *h, double seconds) {
  const double ms = 1e3 * seconds;
  int k = 0;
  while (ms > kClass[k]) ++k;
  ++h->count[k];
  ++h->n;
  h->sum += ms;
  if (ms > h->most) h->most = ms;
}

static void print(const char *what, const Histogram *h) {
  printf("%-30s", what);
  for (int k = 0; k < CLASSES; ++k) printf(" %6ld", h->count[k]);
  printf("   mean %6.3f, most %6.3f ms\n", h->n ? h->sum / (double)h->n : 0.0, h->most);
}

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void sleep_until(double when) {
  struct timespec t = {.tv_sec = (time_t)when};
  t.tv_nsec = (long)(1e9 * (when - (double)t.tv_sec));
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
}

/* What the two threads share, each holding the lock for a copy. */
typedef struct Shared {
  pthread_mutex_t lock;
  dfm_pose hand;
  double hand_at;  /* s of the clock: when it was there; 0: not yet */
  double force[3]; /* N on the hand */
  double answers;  /* hand_at of the motion that the force answers; 0: no force yet */
  int stop;
} Shared;

typedef struct Loop {
  Shared *shared;
  dfm_pose start;
  double rate, force_most;
  Histogram late, age;
} Loop;

/* The device's thread. It never waits for the scene. */
static void *device_loop(void *data) {
  Loop *loop = data;
  const double begin = now(), period = 1 / loop->rate;
  for (long n = 1;; ++n) {
    const double due = begin + period * (double)n;
    double force[3], answers;
    int stop;
    sleep_until(due);
    const double t = now();
    add(&loop->late, t - due);
    dfm_pose hand = loop->start; /* a driver reads the device here */
    hand.position[2] -= 0.005 * (1 - cos(6.283185307179586 * 0.5 * (t - begin)));
    pthread_mutex_lock(&loop->shared->lock);
    loop->shared->hand = hand;
    loop->shared->hand_at = t;
    for (int k = 0; k < 3; ++k) force[k] = loop->shared->force[k];
    answers = loop->shared->answers;
    stop = loop->shared->stop;
    pthread_mutex_unlock(&loop->shared->lock);
    if (stop) return NULL;
    if (answers > 0) add(&loop->age, t - answers);
    /* and gives it the force here */
    const double size = sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]);
    if (size > loop->force_most) loop->force_most = size;
  }
}

/* The two functions of the scene's device, called by the thread that steps. */
typedef struct Port {
  Shared *shared;
  double read_at; /* hand_at of the sample that this step has */
} Port;

static dfm_status read_hand(void *user, double t, dfm_device_sample *out) {
  Port *port = user;
  (void)t;
  pthread_mutex_lock(&port->shared->lock);
  out->pose = port->shared->hand;
  port->read_at = port->shared->hand_at;
  pthread_mutex_unlock(&port->shared->lock);
  return port->read_at > 0 ? DFM_OK : DFM_DISCARD;
}

static dfm_status write_force(void *user, double t, const double force[3], const double torque[3]) {
  Port *port = user;
  (void)t;
  (void)torque;
  pthread_mutex_lock(&port->shared->lock);
  for (int k = 0; k < 3; ++k) port->shared->force[k] = force[k];
  port->shared->answers = port->read_at;
  pthread_mutex_unlock(&port->shared->lock);
  return DFM_OK;
}

int main(int argc, char **argv) {
  if (argc < 2) {
    printf("usage: 08_haptic_loop SCENE [TOOL] [SECONDS] [RATE]\n");
    return 2;
  }
  const double seconds = argc > 3 ? atof(argv[3]) : 2, step = 1e-3;
  Shared shared = {.lock = PTHREAD_MUTEX_INITIALIZER};
  Loop loop = {.shared = &shared, .rate = argc > 4 ? atof(argv[4]) : 1000};
  Port port = {.shared = &shared};
  const dfm_device device = {.size = sizeof device, .user = &port, .read = read_hand, .write = write_force};
  dfm_tool_state state = {.size = sizeof state};
  dfm_context *context;
  dfm_scene scene;
  dfm_world world;
  dfm_tool tool;
  if (!(loop.rate > 0 && loop.rate <= 1e5)) {
    printf("a rate of %g Hz; give 1 to 100000\n", loop.rate);
    return 2;
  }
  TRY(dfm_context_create(NULL, &context));
  TRY(dfm_scene_open(context, argv[1], NULL, &scene));
  TRY(dfm_scene_world(scene, &world));
  if (argc > 2 && argv[2][0]) {
    TRY(dfm_world_find_tool(world, argv[2], &tool));
  } else {
    uint32_t n = 0;
    TRY(dfm_world_tools(world, 0, NULL, &n));
    dfm_tool *all = malloc((n ? n : 1) * sizeof *all);
    if (!all || n == 0) {
      printf("%s: it has no tools\n", argv[1]);
      free(all);
      return 1;
    }
    TRY(dfm_world_tools(world, n, all, &n));
    tool = all[0];
    free(all);
  }
  TRY(dfm_tool_get_state(tool, &state));
  loop.start = state.pose;
  /* Models take their time for what leads their first step: before the hand takes over. */
  TRY(dfm_world_step(world, step, NULL));
  TRY(dfm_tool_set_device(tool, &device));

  pthread_t thread;
  if (pthread_create(&thread, NULL, device_loop, &loop)) return 1;
  Histogram steps = {{0}, 0, 0, 0};
  const double begin = now();
  long behind = 0;
  for (long n = 1; n <= (long)(seconds / step + 0.5); ++n) {
    const double at = now();
    TRY(dfm_world_step(world, step, NULL));
    add(&steps, now() - at);
    /* the scene keeps to the clock where it can */
    const double due = begin + step * (double)n;
    if (now() < due) sleep_until(due);
    else ++behind;
  }
  pthread_mutex_lock(&shared.lock);
  shared.stop = 1;
  pthread_mutex_unlock(&shared.lock);
  pthread_join(thread, NULL);

  printf("%-30s", "ms, up to");
  for (int k = 0; k < CLASSES - 1; ++k) printf(" %6g", kClass[k]);
  printf("   more\n");
  print("loop wakes up late by", &loop.late);
  print("a step takes", &steps);
  print("motion that the force answers", &loop.age);
  printf("%ld of %ld steps ended behind the clock; largest force %.3f N\n", behind, steps.n, loop.force_most);
  dfm_context_destroy(context);
  return 0;
}
