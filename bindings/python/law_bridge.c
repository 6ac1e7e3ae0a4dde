/* A plugin whose law is a Python class: it calls the process that DEFORM_PYTHON_LAW names, by a local socket,
 * for the law's description when it is loaded and for every evaluation. So the command (its validator, its
 * rig) meets a Python law as it meets any other plugin file. The other side is deform/law.py; both run on one
 * machine, so numbers travel as they lie in memory. */
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <deform/plugin.h>

enum { EVALUATE = 1, CHECK = 2 };
enum { MOST_TEXT = 1 << 16, MOST_ROWS = 256, MOST_NUMBERS = 1 << 26 };

static int channel = -1;
static pthread_mutex_t one_at_a_time = PTHREAD_MUTEX_INITIALIZER;
static int broken; /* set once, where the other side is gone */
static int users;  /* hosts in this process that have the tables: they are freed with the last one */
static void *kept[8 * MOST_ROWS];
static size_t nkept;
static uint32_t nvalue, nstate; /* doubles of all parameters, and of the state of a contact */

static dfm_friction law;
static dfm_type type;
static const dfm_type *const types[] = {&type};
static void shutdown_law(void);
static const dfm_plugin plugin = {sizeof plugin, DFM_ABI, DFM_ABI_DRAFT, 1, types, shutdown_law};

static void take(void *to, size_t bytes) {
  char *at = to;
  while (bytes && !broken) {
    const ssize_t n = recv(channel, at, bytes, 0);
    if (n > 0) {
      at += n;
      bytes -= (size_t)n;
    } else if (n == 0 || errno != EINTR) {
      broken = 1;
    }
  }
  if (broken) memset(at, 0, bytes);
}

static void give(const void *from, size_t bytes) {
  const char *at = from;
  while (bytes && !broken) {
    const ssize_t n = send(channel, at, bytes, MSG_NOSIGNAL);
    if (n > 0) {
      at += n;
      bytes -= (size_t)n;
    } else if (n == 0 || errno != EINTR) {
      broken = 1;
    }
  }
}

static uint32_t number(uint32_t most) {
  uint32_t out = 0;
  take(&out, sizeof out);
  if (out > most) broken = 1;
  return broken ? 0 : out;
}

static void *keep(size_t bytes) {
  void *p = nkept < sizeof kept / sizeof *kept ? calloc(bytes ? bytes : 1, 1) : NULL;
  if (!p) broken = 1;
  else kept[nkept++] = p;
  return p;
}

static const char *text(void) {
  const uint32_t n = number(MOST_TEXT);
  char *out = keep((size_t)n + 1);
  if (out) take(out, n);
  return out;
}

static const char *const *texts(void) {
  const uint32_t n = number(MOST_ROWS);
  const char **out = keep((size_t)(n + 1) * sizeof *out);
  for (uint32_t i = 0; out && i < n && !broken; ++i) out[i] = text();
  return out;
}

static void shutdown_law(void) {
  if (--users > 0) return;
  while (nkept) free(kept[--nkept]);
  if (channel >= 0) close(channel);
  channel = -1;
}

/* Columns that the law has, and columns that are there, go as n numbers each. */
static void give_columns(const double *from, const dfm_friction_in *in, uint32_t columns) {
  for (uint32_t c = 0; from && c < columns; ++c)
    give(from + (size_t)c * in->stride, (size_t)in->n * sizeof *from);
}

static void take_columns(double *to, const dfm_friction_in *in, uint32_t columns, double *row) {
  for (uint32_t c = 0; c < columns; ++c) {
    take(row, (size_t)in->n * sizeof *row);
    if (to && !broken) memcpy(to + (size_t)c * in->stride, row, (size_t)in->n * sizeof *row);
  }
}

static dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  const uint32_t present = (in->fn != NULL) | (in->vt != NULL) << 1 | (in->ft_stop != NULL) << 2 |
                           (in->area != NULL) << 3 | (in->dwell != NULL) << 4;
  const uint32_t head[3] = {EVALUATE, in->n, present};
  if (in->n == 0) return DFM_OK;
  if (in->n > MOST_NUMBERS) return DFM_E_NOMEM;
  double *row = malloc((size_t)in->n * sizeof *row);
  if (!row) return DFM_E_NOMEM;
  pthread_mutex_lock(&one_at_a_time);
  give(head, sizeof head);
  give(&in->dt, sizeof in->dt);
  give(in->params, nvalue * sizeof *in->params);
  give_columns(in->fn, in, 1);
  give_columns(in->vt, in, 2);
  give_columns(in->ft_stop, in, 2);
  give_columns(in->area, in, 1);
  give_columns(in->dwell, in, 1);
  give_columns(in->state, in, nstate);
  int32_t status = 0;
  take(&status, sizeof status);
  if (status == DFM_OK && !broken) {
    take_columns(out->ft, in, 2, row);
    take_columns(out->state, in, nstate, row);
    take_columns(out->dft_dvt, in, 4, row);
    take_columns(out->dft_dfn, in, 2, row);
    take_columns(out->limit, in, 1, row);
    take_columns(out->stored, in, 1, row);
    take(row, in->n);
    if (out->mode && !broken) memcpy(out->mode, row, in->n);
  }
  const int failed = broken;
  pthread_mutex_unlock(&one_at_a_time);
  free(row);
  return failed ? DFM_E_FATAL : status;
}

static dfm_status check(const double *params, char *why, size_t cap) {
  const uint32_t head[3] = {CHECK, 0, 0};
  char sentence[512] = "";
  pthread_mutex_lock(&one_at_a_time);
  give(head, sizeof head);
  give(params, nvalue * sizeof *params);
  int32_t status = 0;
  take(&status, sizeof status);
  const uint32_t n = number(sizeof sentence - 1);
  take(sentence, n);
  const int failed = broken;
  pthread_mutex_unlock(&one_at_a_time);
  if (why && cap) snprintf(why, cap, "%s", sentence);
  return failed ? DFM_E_FATAL : status;
}

/* What the other side sends first: the type, its parameters, effects and state. */
static void describe(void) {
  type.size = sizeof type;
  type.kind = DFM_KIND_FRICTION;
  type.id = text();
  type.name = text();
  type.version = text();
  type.licence = text();
  type.source = text();
  type.nparam = number(MOST_ROWS);
  dfm_param *rows = keep(type.nparam * sizeof *rows);
  nvalue = nstate = 0;
  for (uint32_t i = 0; rows && i < type.nparam && !broken; ++i) {
    rows[i].key = text();
    rows[i].label = text();
    rows[i].unit = text();
    take(&rows[i].min, sizeof rows[i].min);
    take(&rows[i].max, sizeof rows[i].max);
    take(&rows[i].def, sizeof rows[i].def);
    rows[i].flags = number(UINT32_MAX);
    rows[i].width = number(16);
    nvalue += rows[i].width;
  }
  type.params = rows;
  type.param_size = sizeof *rows;
  type.effects = texts();
  law.size = sizeof law;
  law.needs = number(UINT32_MAX);
  law.flags = number(UINT32_MAX);
  law.nslot = number(MOST_ROWS);
  dfm_slot *slots = keep(law.nslot * sizeof *slots);
  for (uint32_t i = 0; slots && i < law.nslot && !broken; ++i) {
    slots[i].unit = DFM_PER_CONTACT;
    slots[i].width = number(16);
    slots[i].kind = number(UINT32_MAX);
    nstate += slots[i].width;
  }
  law.slots = slots;
  law.eval = eval;
  law.check = check;
  type.ops = &law;
}

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  (void)host_abi;
  (void)host_abi_min;
  struct sockaddr_un address = {.sun_family = AF_UNIX};
  const char *path = getenv("DEFORM_PYTHON_LAW");
  if (!DFM_ABI_OK(host) || !path || strlen(path) >= sizeof address.sun_path) return NULL;
  if (users++ > 0) return &plugin;
  memcpy(address.sun_path, path, strlen(path) + 1);
  broken = 0;
  channel = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (channel < 0 || connect(channel, (const struct sockaddr *)&address, sizeof address) != 0) {
    shutdown_law();
    return NULL;
  }
  describe();
  if (!broken) return &plugin;
  shutdown_law();
  return NULL;
}
