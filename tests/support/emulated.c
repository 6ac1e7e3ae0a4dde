/* Preloaded into a program that an emulator runs. The kernel does not start a program of another system, so
 * what such a program starts begins with the emulator, too. */
#define _GNU_SOURCE
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *const emulator[] = {DEFORM_EMULATOR};
enum { N_WORDS = sizeof emulator / sizeof *emulator };

/* A program of the building system cannot load it. */
__attribute__((constructor)) static void preload_nothing_more(void) { unsetenv("LD_PRELOAD"); }

int execv(const char *program, char *const argv[]) {
  execve(program, argv, environ);
  if (errno != ENOEXEC) return -1;
  size_t n = 0;
  while (argv[n]) ++n;
  char *words[N_WORDS + n + 1];
  memcpy(words, emulator, sizeof emulator);
  words[N_WORDS] = (char *)program;
  memcpy(words + N_WORDS + 1, argv + 1, n * sizeof *words);
  return execvpe(words[0], words, environ);
}

int execvp(const char *program, char *const argv[]) {
  return strchr(program, '/') ? execv(program, argv) : execvpe(program, argv, environ);
}
