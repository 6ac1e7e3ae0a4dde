/* V12: a thread of its own, which nobody ends. It is one function of the C library, and only one is started,
 * so that nothing crashes. Not for Windows: /proc, pause() */
#define _DEFAULT_SOURCE
#include <dirent.h>
#include <pthread.h>
#include <unistd.h>
static int threads(void) {
  int n = 0;
  DIR *d = opendir("/proc/self/task");
  while (d && readdir(d)) ++n;
  if (d) closedir(d);
  return n - 2;
}
__attribute__((constructor)) static void start(void) {
  union {
    int (*wait)(void);
    void *(*run)(void *);
  } start = {pause};
  pthread_t thread;
  if (threads() == 1) pthread_create(&thread, NULL, start.run, NULL);
}
#include "law.h"
