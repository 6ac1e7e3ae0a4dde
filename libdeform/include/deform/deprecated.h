/* deform/deprecated.h -- names that the next version leaves out, and what stands in their place. */
#ifndef DEFORM_DEPRECATED_H
#define DEFORM_DEPRECATED_H
/* dfm_world_def.method: the integrator decides. Where that is AUTO, VELOCITY makes it SYMPLECTIC_EULER and
 * IMPLICIT makes it IMPLICIT_EULER. ROLLBACK is refused with DFM_E_UNSUPPORTED: `deform rollback` runs a
 * scene by it (doc/concepts/rollback.md). Since 0.1. */
enum { DFM_METHOD_AUTO = 0, DFM_METHOD_VELOCITY = 1, DFM_METHOD_IMPLICIT = 2, DFM_METHOD_ROLLBACK = 3 };
#endif
