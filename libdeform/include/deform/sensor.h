/* deform/sensor.h -- bodies, obstacles and rigid bodies that report what overlaps them and push nothing.
 * doc/concepts/callbacks.md. */
#ifndef DEFORM_SENSOR_H
#define DEFORM_SENSOR_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Makes a body a sensor, or (false) a body that touches again. A sensor takes part in no contact but with
 * itself. At the end of each step it is looked which things overlap it, by dfm_world_query_overlap's meaning
 * of the word, of those with which its masks and rules would let it touch; other sensors are none of them.
 * What has come or gone since the last step is told by dfm_world_events as DFM_EVENT_SENSOR_BEGIN and
 * DFM_EVENT_SENSOR_END (a: the sensor, b: the other one, key 0, t: the end of the step). What ends because
 * one of the two is destroyed, or no sensor any more, is told at once. Queries pass sensors by
 * (DFM_QUERY_SENSORS). The mark is no part of snapshots; after a restore the next events count from the
 * restored state. Bodies wake.
 * @return DFM_OK; DFM_E_HANDLE; DFM_E_BUSY. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_set_sensor(dfm_body body, bool sensor);
/** The same of an obstacle or one shape of a rigid body, which also sees obstacles and rigid bodies; not the
 * other shapes of its own rigid body. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_set_sensor(dfm_obstacle obstacle, bool sensor);
/** Is it one? @param thing a body, an obstacle or a rigid body. @return DFM_OK; DFM_E_ARG; DFM_E_HANDLE.
 * Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_is_sensor(uint64_t thing, bool *sensor);
/** What overlapped a sensor at the end of the last step: bodies, then obstacles and rigid bodies, each in
 * order of creation.
 * @param sensor    a body, an obstacle or a rigid body
 * @param capacity  of out in things; 0 with out NULL only counts
 * @return DFM_OK; DFM_E_ARG no sensor, or capacity too small (out untouched, *n set); DFM_E_HANDLE;
 * DFM_E_BUSY. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_sensor_things(uint64_t sensor, uint32_t capacity, uint64_t *out, uint32_t *n);
#ifdef __cplusplus
}
#endif
#endif
