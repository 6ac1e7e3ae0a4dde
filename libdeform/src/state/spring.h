// Springs from points of a body to places in the world (body.h, Spring). They pull in the motion stage, with
// the loads that vary.
#pragma once
#include "state/body.h"

namespace dfm {

Vec3 spring_end(const Spring &s, double t);
// The pull at the body's present state on its way from t to t + h; h 0: the end stands still.
Vec3 spring_force(const Body &b, const Spring &s, double t, double h);
// Its shares join what already pulls at the points.
void add_spring_force(Body &b, const Spring &s, double t, double h);
// Row sums of k w w^T: weights are >= 0 and sum to one, so row i sums to k w_i.
void add_spring_bound(const Spring &s, double *stiffness, double *damping);  // row sums, N/m, N s/m

}  // namespace dfm
