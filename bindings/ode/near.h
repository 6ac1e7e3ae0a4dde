// Contact joints of ODE with the library's friction laws, for the default near callback and for those
// of the caller.
//
//   set-valued laws (coulomb, karnopp)   friction pyramid on the normal force of the same step, its
//                                        coefficient the law's at the present slip
//   laws with a state (dahl, lugre, ..)  the law's affine part f = f0 + D (v - v0) as slip and motion of the
//   contact's friction rows, bounded by the law's
//                                        limit; normal force of the last sub-step; the state goes on from
//                                        contact to contact of a pair by place
#pragma once
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "deform/ode.h"
#include "rigid_host/rigid_math.h"

namespace dfm_ode_detail {

using namespace dfm_rigid_detail;

class RigidFriction {
 public:
  using Key = std::pair<dGeomID, dGeomID>;
  struct Contact {
    Key key;
    dBodyID a, b;
    Vec place;  // in a's frame
    Vec point, normal, tangent[2];
    double fn = 0;
    std::vector<double> state;  // in the tangents' frame
    dJointFeedback feedback;
  };
  using Memory = std::map<Key, std::vector<Contact>>;
  dWorldID world = nullptr;
  dJointGroupID group = nullptr;
  double coefficient = 0.5;  // if no law is set
  uint32_t most = 8;
  ~RigidFriction();
  RigidFriction() = default;
  RigidFriction(const RigidFriction &) = delete;
  RigidFriction &operator=(const RigidFriction &) = delete;

  dfm_status set_law(dfm_context *context, const char *law, const dfm_params *params, double area);
  void clear_law();
  int collide(dGeomID a, dGeomID b, double h);  // contact joints made
  // after ODE's step, while its joints exist: keeps forces and states for the next sub-step
  void finish_step(double h);
  // after a sub-step that failed: drops its contacts, since their bodies may be destroyed next
  void drop() { now_.clear(); }
  void forget() { last_.clear(); }
  // What the contacts keep, as numbers. number: of a geom, -1 where it has none (its contacts are left out);
  // geom: the other way.
  void save(const std::function<double(dGeomID)> &number, std::vector<double> &out) const;
  // false: not saved under such a law
  bool read(const std::function<dGeomID(double)> &geom, const double *from, size_t count, Memory &out) const;
  void take(Memory &&memory) { last_ = std::move(memory); }
  double h = 0;  // s, of the sub-step that begins; 0: not given, the last one

 private:
  dfm_law law_ = 0;
  std::vector<double> params_;
  double area_ = 1e-4;  // m2 per contact
  bool set_valued_ = true;
  uint32_t nstate_ = 0;
  Memory last_;
  std::deque<Contact> now_;  // ODE keeps the addresses of the feedbacks
  struct LawResult {
    double ft[2], d[2], limit, by_fn;  // by_fn: what grows with the normal force, over it
    std::vector<double> state;
    bool good;
  };
  LawResult evaluate(const Contact &c, const double vt[2], double h) const;
  const Contact *match(const Key &key, Vec place, std::vector<bool> &taken) const;
  void take_over(Contact &c, const Contact &old) const;
};
void near_callback(void *data, dGeomID a, dGeomID b);  // dNearCallback; data: a RigidFriction

}  // namespace dfm_ode_detail
