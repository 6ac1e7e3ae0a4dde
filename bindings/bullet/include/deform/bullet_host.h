/* deform/bullet_host.h -- the rigid host "bullet" for scenes and dfm_rigid_create; needs no header of
 * Bullet. */
#ifndef DEFORM_BULLET_HOST_H
#define DEFORM_BULLET_HOST_H
#include "deform/rigid.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Makes the rigid host "bullet" known: a btDiscreteDynamicsWorld of its own per set, in which the set's
 * bodies touch each other too (friction 0.5). Joints mean and say what they do on the builtin host
 * (dfm_rigid_joint). A second call does nothing.
 * @return DFM_OK; DFM_E_UNSUPPORTED both builds of Bullet, of single and of double precision, are loaded.
 * Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_bullet_register(void);
/** The same host's table, for a program that opens the binding at run time and registers it under a name of
 * its own; NULL where dfm_bullet_register refuses. Threads: Any thread. Since 0.1. */
DFM_API const dfm_rigid_host *dfm_bullet_table(void);
#ifdef __cplusplus
}
#endif
#endif
