// Springs from points of a body to places in the world (body.h, Spring). They act in the motion stage,
// together with varying loads.
#pragma once
#include "state/body.h"

namespace dfm {

Vec3 spring_end(const Spring &s, double t);
// Adds the spring forces at the present state of the body, in a sub-step from t to t + h; h 0: the end does
// not move. The points' shares are added to existing forces.
Vec3 spring_force(const Body &b, const Spring &s, double t, double h);
void add_spring_force(Body &b, const Spring &s, double t, double h);
// Row sums of k w w^T: weights are >= 0 and sum to one, so row i sums to k w_i.
void add_spring_bound(const Spring &s, double *stiffness, double *damping);  // row sums, N/m, N s/m

}  // namespace dfm
