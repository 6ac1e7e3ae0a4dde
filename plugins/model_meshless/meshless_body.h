// A body of scattered points: gradients by moving least squares, their elastic energy, and what resists the
// motions that gradients do not see. Derivation: doc/models/meshless.md.
#pragma once
#include <deform/plugin.h>

#include "../model_common/entry.h"
#include "../model_common/lists.h"
#include "../model_common/modes.h"
#include "../model_common/pieces.h"
#include "../model_common/small.h"

namespace meshless {

using model::Buffer;
using model::Modes;

// Rows of the parameter table, each one wide.
enum Param : uint32_t {
  kYoung,
  kPoisson,
  kDampingStiffness,
  kDampingMass,
  kHourglass,
  kSupport,
  kStrain,
  kVolumes,
  kParamCount
};
extern const dfm_param kParams[kParamCount];
constexpr const char *kId = "org.deform.meshless";
enum Strain : uint32_t { kCorotational, kGreen };
enum Volumes : uint32_t { kCells, kMasses };

// Elastic constants and volume of a point.
struct Solid {
  double lambda, mu;  // Pa
  double volume;      // m3
  double damping;     // s: damping over stiffness
  double drag;        // kg/s
  double residual;    // N m: times the weight of a neighbor, stiffness against what its gradient leaves
};

// The shape at a point: F = R S, S = V diag(stretch) V^T.
struct Shape { double rotation[9], stretch[3], axis[3][3]; };

struct Body {
  const dfm_host *host = nullptr;
  uint32_t npoint = 0, ncell = 0;
  double params[kParamCount] = {};
  const char *active_effects[3] = {};  // NULL-terminated

  void create(const dfm_host *h, const dfm_mesh &m);
  void apply_params(const double *values);  // cannot fail

  void add_forces(const dfm_kin &k, double *f);
  bool lacks_state(const dfm_kin &) const { return false; }
  void bound(const dfm_kin &k, double *ksum, double *csum);
  double energy(const dfm_kin &k);
  void cell_energy(const dfm_kin &k, double *density);
  uint32_t pairs() const;
  void pattern(uint32_t *ij) const;
  void add_stiffness(const dfm_kin &k, double a, double b, double *blk);

 private:
  Buffer<double> rest, mass;          // [npoint,3] m, [npoint] kg
  Buffer<double> cell_volume;         // [ncell] m3, 0 for what is turned inside out
  Buffer<uint32_t> cells;             // [ncell,4]
  Buffer<double> field[kParamCount];  // [ncell] values by cell; empty without
  // Neighbors of each point, ascending: F = sum (x_j - x_i) slope_j^T, weights over sum w |X_j - X_i|^2.
  Buffer<uint32_t> begin, neighbor;  // [npoint + 1]
  Buffer<double> slope, weight;      // [.,3] 1/m, [.] 1/m2
  // The same by neighbor: points whose neighbor a point is, ascending, and its place among theirs.
  struct Back { uint32_t point, place; };
  Buffer<uint32_t> back_begin;
  Buffer<Back> back;
  Buffer<double> volume;                // [npoint] m3
  Buffer<double> around, shared;        // [npoint] m3, a quarter of its cells; J/m3 of the energy there
  Buffer<Solid> solid;                  // [npoint]
  Buffer<double> rows, spread;          // [members] of the bound: N/m at rest, and sum |slope.slope|, 1/m2
  Buffer<double> own_rows, own_spread;  // [npoint] the same of the point itself
  // of one evaluation: by point gradient, its rate, stress times volume; by neighbor the force of its
  // residual, and the residual's rate
  Buffer<double> gradient, rate, stress, pull, pull_rate;
  uint32_t largest = 0;  // points of a gradient at most, the point itself with them
  Buffer<double> room;   // of one of them: slopes, residuals' stiffness, slopes in two frames, turns
  // Points that answer a point, from itself upward.
  mutable Buffer<uint32_t> row_begin, row_point;
  bool damping_on = false, drag_on = false;

  double at(Param which, uint32_t c) const { return field[which].empty() ? params[which] : field[which][c]; }
  Strain strain() const { return Strain(uint32_t(params[kStrain])); }
  void take_mesh(const dfm_mesh &m);
  void find_volumes();
  void find_neighbors();
  void find_back();
  void find_solids();
  void find_rows(uint32_t point);
  void make_pattern() const;
  void offset(uint32_t point, uint32_t place, double *out) const;  // X_j - X_i
  void own_slope(uint32_t point, double *out) const;               // minus the sum of its slopes
  void gradient_of(const double *x, uint32_t stride, uint32_t point, double *out) const;
  void residual(const dfm_kin &k, uint32_t point, uint32_t place, double *out) const;
  void find_pulls(const dfm_kin &k, uint32_t point);
  void turning_inverse(const double *residuals, uint32_t point, double *out) const;
  double density_at(uint32_t point) const;
  double energy_at(const dfm_kin &k, uint32_t point) const;
  template <class F>
  void for_points(const F &f) const;
  // One point, for passes in any cut: its gradient and what follows; what acts on it.
  void find_stress(const dfm_kin &k, uint32_t point);
  void add_force(const dfm_kin &k, double *f, uint32_t point) const;
  void find_gradients(const dfm_kin &k);
  uint32_t stencil_of(uint32_t point, double *g, double *h) const;
  void add_point(const dfm_kin &k, uint32_t point, double a, double b, double *blk);
  void find_twists(const dfm_kin &k, uint32_t point, uint32_t n, double *twist, double *inverse);
};

void shape_of(const double *gradient, Shape &out);
void modes_of(Strain strain, const Solid &c, const double *stretch, Modes &out);
// First Piola-Kirchhoff stress, Pa.
void stress_of(Strain strain, const Solid &c, const double *gradient, double *out);

}  // namespace meshless
