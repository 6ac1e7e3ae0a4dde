/* deform/sensor.h -- bodies, obstacles and rigid bodies that report overlaps and have no contact forces.
 * doc/concepts/callbacks.md. */
#ifndef DEFORM_SENSOR_H
#define DEFORM_SENSOR_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Makes a body a sensor, or (false) an ordinary body again. A sensor has no contacts except with itself. At
 * the end of each step the library determines which things overlap the sensor (as dfm_world_query
 * defines it), among those that its masks and rules would let it touch, other sensors excepted.
 * dfm_world_events reports changes since the last step as DFM_EVENT_SENSOR_BEGIN and DFM_EVENT_SENSOR_END
 * (a: the sensor, b: the other thing, key 0, t: the end of the step). An overlap that ends because one of the
 * two is destroyed, or is no longer a sensor, is reported at once. Queries ignore sensors by default
 * (DFM_QUERY_SENSORS). Snapshots do not contain the sensor flag; after a restore the next events are relative
 * to the restored state. Bodies wake.
 * @return DFM_OK; DFM_E_HANDLE; DFM_E_BUSY. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_set_sensor(dfm_body body, bool sensor);
/** The same for an obstacle or one shape of a rigid body, which also detects obstacles and rigid bodies,
 * except the other shapes of its own rigid body. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_set_sensor(dfm_obstacle obstacle, bool sensor);
/** Whether a thing is a sensor. @param thing a body, an obstacle or a rigid body. @return DFM_OK; DFM_E_ARG;
 * DFM_E_HANDLE. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_is_sensor(uint64_t thing, bool *sensor);
/** Things that overlapped a sensor at the end of the last step: bodies, then obstacles and rigid bodies, each
 * in order of creation.
 * @param sensor    a body, an obstacle or a rigid body
 * @param capacity  of out in things; 0 with out NULL only counts
 * @return DFM_OK; DFM_E_ARG no sensor, or capacity too small (out untouched, *n set); DFM_E_HANDLE;
 * DFM_E_BUSY. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_sensor_things(uint64_t sensor, uint32_t capacity, uint64_t *out, uint32_t *n);
#ifdef __cplusplus
}
#endif
#endif
