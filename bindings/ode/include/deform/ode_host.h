/* deform/ode_host.h -- the rigid host "ode" for scenes and dfm_rigid_create; needs no header of ODE. */
#ifndef DEFORM_ODE_HOST_H
#define DEFORM_ODE_HOST_H
#include "deform/base.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Makes the rigid host "ode" known: a dWorldID of its own per set, in which the set's bodies touch each
 * other too (friction 0.5). Joints mean and say what they do on the builtin host (dfm_rigid_joint). A second
 * call does nothing.
 * @return DFM_OK; DFM_E_UNSUPPORTED the ODE that is loaded is of single precision or has no trimeshes.
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_ode_register(void);
#ifdef __cplusplus
}
#endif
#endif
