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

  Abilities abilities() const override {
    return {.forces = true, .springs = true, .placed = true, .energy = true};
  }
  ExplicitTime measure(const Pose &placed, bool spectrum) override;
  bool rest_rows(const Pose &placed, double share, RestRows &out) override;
  bool bound(double time, double share, const AddRowSums &outside, StepBound &out) override;
  bool add_forces(const SubStep &now, bool keep) override;
  bool free_motion(const SubStep &now, double &kinetic) override;
  Unknowns unknowns() override { return {p_.v_free.data(), p_.inv_mass.data(), nullptr}; }
  bool end_state(const SubStep &now, const double *surfel_impulse, bool touched) override;
  void free_again(const SubStep &now) override;
  void take_part(double share, bool in_full, const double *surfel_impulse) override;
  EndState end() const override {
    const double *const v = in_place_ ? p_.v_free.data() : p_.v_end.data();
    return {v, v};
  }
  double damper_energy(double time) override;
  void commit(const SubStep &now) override;
  void damp(double time, double c, double ahead) override;

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
