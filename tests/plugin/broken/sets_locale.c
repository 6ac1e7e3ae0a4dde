/* V12: sets a locale when its parameters are checked, as a formatter of messages may.
 * Not for Windows: its locales have other names. */
#include <locale.h>
#include <stddef.h>
#include <stdint.h>
#include "deform/plugin.h"
static dfm_status check(const double *params, char *why, size_t cap) {
  (void)params;
  (void)why;
  (void)cap;
  setlocale(LC_ALL, "C.UTF-8");
  return DFM_OK;
}
#define CHECK check
#include "law.h"
