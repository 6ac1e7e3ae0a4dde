/* deform/law.h -- evaluation of a friction law without a world, for rigs, plots and tests. */
#ifndef DEFORM_LAW_H
#define DEFORM_LAW_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Opens a law by short name ("coulomb"), full id ("org.deform.coulomb") or path of a plugin file
 * (which is loaded).
 * @return DFM_OK; DFM_E_UNSUPPORTED no such law (lists those loaded); DFM_E_IO; DFM_E_ARG. Threads: Not
 * during step. Since 0.1. */
DFM_API dfm_status dfm_law_open(dfm_context *context, const char *id_or_path, dfm_law *out);
/** @return DFM_OK; DFM_E_HANDLE. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_law_close(dfm_law law);
/** Description of the law; ops is a dfm_friction. Valid until close. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_law_type(dfm_law law, const dfm_type **out);
/** Evaluates a batch. in->params holds the values of all rows end to end; in->data is ignored (the library
 * prepares and releases). Columns may have any alignment and any stride >= n: columns that a plugin cannot
 * use directly are copied.
 * @return what the law returns; DFM_DISCARD if it wrote a value that is not finite (a limit may be infinite);
 * DFM_E_ARG an input that the
 *         law needs is NULL; DFM_E_FATAL it threw. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_law_eval(dfm_law law, const dfm_friction_in *in, dfm_friction_out *out);
/** Writes params, given by key, over the law's defaults, in the layout of dfm_friction_in ("mu" sets mu_C and
 * mu_S).
 * @param values  out, [n]; capacity 0 with NULL only counts doubles
 * @return DFM_E_ARG unknown key (nearest valid one), out of range, or refused by the law's check. Threads:
 * Any thread. Since 0.1. */
DFM_API dfm_status dfm_law_pack(dfm_law law, const dfm_params *params, uint32_t capacity, double *values,
                                uint32_t *n);
#ifdef __cplusplus
}
#endif
#endif
