// The rigid motions of bodies that nothing holds, as unknowns of their own: a stiff body resists all others
// by h^2 K and these by its mass alone, so a preconditioner of the points' blocks hardly sees them.
#pragma once
#include <span>

#include "contact/matrix_points.h"
#include "contact/rows.h"

namespace dfm {

class RigidModes {
 public:
  explicit RigidModes(const Memory &memory);
  void find_bodies(const MatrixPoints &points);  // for add_response() and give(); start() does it too
  // place: [ndof] the matrix point of each dof of the rows; kNone
  void start(const ContactRows &rows, const MatrixPoints &points, std::span<const uint32_t> place);
  // R^T (M + J^T C J) R; slope: [contacts,4] kg, C in each contact's frame: normal, then a, b, c of [a b; b
  // c]
  void factor(const ContactRows &rows, const double *slope);
  // z += R (R^T (M + J^T C J) R)^-1 R^T r, [n,4] both; a bound of what that is, m/s
  double precondition(const MatrixPoints &points, const double *r, double *z);
  // v += R (R^T M R)^-1 R^T r: what r leaves of the bodies' momentum is in v then.
  void give(const MatrixPoints &points, const double *r, double *v) const;
  // [n,4] 1/kg, added: what the rigid motion of a body alone lets an impulse change of each point's velocity
  void add_response(const MatrixPoints &points, double *response) const;

 private:
  struct Body {
    uint32_t first, n;
    double mass;        // kg
    double radius;      // m, of its furthest point from the center
    Vec3 center;        // m
    double inertia[9];  // kg m2, about the center
    double inverse[9];  // its inverse
  };
  Array<Body> bodies_;
  Array<uint32_t> body_of_dof_;  // [ndof] kNone
  Array<Vec3> arm_;              // [ndof] m, from its body's center
  Array<double> matrix_;         // [6 bodies, 6 bodies], its Cholesky factor
  Array<double> sums_;           // [6 bodies] impulse and its moment, then velocities
  struct Seen {
    uint32_t body;
    double by[18];  // [3,6] relative velocity by the body's motion, in the contact's frame
  };
  Array<Seen> seen_;  // of one contact

  void collect(const MatrixPoints &points, const double *r, double *sums) const;
  void see(const ContactRows &rows, uint32_t contact);
};

}  // namespace dfm
