// Prescribed functions of time: poses, vectors and factors by keys, and sines.
#pragma once
#include <vector>

#include "math/turn.h"

namespace dfm {

// Keys at rising times, joined linearly (rotations by slerp along the shorter arc); constant before the first
// and after the last.
Pose pose_at(const std::vector<dfm_pose_key> &keys, double t);
Vec3 vector_at(const std::vector<dfm_vector_key> &keys, double t);
double scale_at(const std::vector<dfm_scale_key> &keys, double t);
// amplitude * sin(2 pi frequency t + phase)
double sine_at(const dfm_sine &s, double t);

// Angular velocity (world frame) that turns a into b in h seconds along the shorter arc, for arcs
// well below a turn.
Vec3 spin_between(Quat a, Quat b, double h);

// Throws Error(DFM_E_ARG) if times do not increase or a value is not finite; `what` names the keys.
void check_keys(const std::vector<dfm_pose_key> &keys, const char *what);
void check_keys(const std::vector<dfm_vector_key> &keys, const char *what);
void check_keys(const std::vector<dfm_scale_key> &keys, const char *what);

}  // namespace dfm
