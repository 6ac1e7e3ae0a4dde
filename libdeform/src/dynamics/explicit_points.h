// Points that the library moves by symplectic Euler, each with its own mass, under the forces of a model.
// Where the model gives its forces part by part, the points of a part move as soon as it comes: forces and
// free motion are one pass (doc/decisions/explicit_time.md).
#pragma once
#include <optional>
#include <vector>

#include "dynamics/dynamics.h"
#include "dynamics/points_kernel.h"

namespace dfm {

class ExplicitPoints : public Dynamics {
 public:
  ExplicitPoints(const Memory &memory, Phyxels &points, Surface &surface, ModelInstance &model,
                 const Array<uint32_t> &edges);

  ExplicitTime measure(const Pose &placed, bool spectrum) override;
  bool rest_rows(const Pose &placed, double share, RestRows &out) override;
  bool bound(double time, double share, const AddRowSums &outside, StepBound &out) override;
  bool add_forces(const SubStep &now, bool keep) override;
  bool free_motion(const SubStep &now, double &kinetic) override;
  bool end_state(const SubStep &now, const double *surfel_impulse, bool touched) override;
  void take_part(double share, bool in_full, const double *surfel_impulse) override;
  double damper_energy(double time) override;
  void commit(const SubStep &now) override;

 private:
  const Array<uint32_t> &edges_;
  const PointsKernels &loops_;
  Array<double> stiffness_, damping_;           // [npoint] row sums: N/m, N s/m
  Array<double> lagged_;                        // [npoint] N/m, row sums of what the lag makes of dampers
  Array<double> drag_;                          // [npoint] N s/m, which sees no lag; empty: there is none
  std::optional<std::vector<double>> drag_of_;  // the parameters that it was found with
  Array<double> load_;                          // [npoint,4] N, with the drag that the model's forces lack
  // [part] J, of the free motion; empty where the model gives its forces for all points at once
  Array<double> part_kinetic_;
  bool moved_ = false;  // in this sub-step points have moved part by part, and their forces are not kept
  // The end is the free motion but for the few points that contact reaches: it is stored in v_free, and the
  // former values of these points are kept.
  bool in_place_ = false;
  Array<size_t> reached_;  // places in v_free
  Array<double> before_;   // [reached,3] m/s

  bool row_sums(const dfm_kin &k, double &cell);
  void free_again(const SubStep &now);
  struct Trial;
  bool find_drag();
  void lag_rows(double lag);
  double own_frequency(Trial &rest, double edge);
  double find_lag(Trial &rest, double edge);
  double step_at_rest(Trial &rest, const ExplicitTime &with);
  double find_share(Trial &rest, double lag, double edge);
  double drag(uint32_t point) const { return drag_.empty() ? 0 : drag_[point]; }
  dfm_kin seen(double time, double h, bool trial = false) const;  // with the velocity that dampers see
  const double *loads();
  double largest_strain() const;
  bool find_forces(const SubStep &now);  // in points().f
  bool move_parts(const SubStep &now);
};

}  // namespace dfm
