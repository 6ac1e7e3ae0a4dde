/* deform/math.h -- plain vectors that cross the API. */
#ifndef DEFORM_MATH_H
#define DEFORM_MATH_H
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif
/** Rigid placement: x = rotation * X + position. Quaternion x, y, z, w; all zero reads as no rotation;
 * normalized on use. */
typedef struct dfm_pose { double position[3], rotation[4]; } dfm_pose;
typedef struct dfm_aabb { double lo[3], hi[3]; } dfm_aabb;

/** Pose at a time (keyframes are joined linearly, rotations by slerp; before the first and after the last
 * key it stays). */
typedef struct dfm_pose_key {
  double t;
  dfm_pose pose;
} dfm_pose_key;
/** Vector at a time, joined linearly. */
typedef struct dfm_vector_key { double t, value[3]; } dfm_vector_key;
/** Factor at a time, joined linearly. */
typedef struct dfm_scale_key { double t, value; } dfm_scale_key;
/** amplitude * sin(2 pi frequency t + phase); frequency in Hz, phase in rad; amplitude zero: absent. */
typedef struct dfm_sine { double amplitude[3], frequency, phase; } dfm_sine;
#ifdef __cplusplus
}
#endif
#endif
