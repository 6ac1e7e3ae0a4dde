// What bodies of springs and of cells have alike for their points.
#pragma once
#include <algorithm>

#include "../model_common/params.h"
#include "stepper.h"

namespace gpu {

constexpr uint32_t kGrain = 4096;  // springs, cells, points: waking a worker costs more than fewer save

inline constexpr const char *kDevices[] = {"auto", "hardware", "software", "reference", nullptr};
inline constexpr dfm_param kDeviceRow = {
    "device",
    "auto: a graphics card, else a software driver; hardware: a card or none; software: that driver; "
    "reference: the processor",
    "1",
    0,
    3,
    0,
    DFM_PARAM_ENUM,
    1,
    kDevices};

// Springs with a dashpot in series (doc/models/msm.md, viscoelastic dampers).
struct Branches {
  uint32_t n = 0;
  size_t room = 0;                    // for both ends of each
  const uint32_t *edge_of = nullptr;  // [room] whose spring it is; ~0: none
  const uint32_t *end_of = nullptr;   // [n] one of its ends
  double part = 0, time = 1;          // share of the stiffness; s, in which they relax
};

struct Parts {
  const dfm_host *host = nullptr;
  uint32_t npoint = 0;
  Buffer<double> mass;            // [npoint] kg
  Buffer<double> row;             // [npoint] N/m, of the step bound, at rest where it depends on the shape
  Buffer<double> undamped;        // [npoint] N/m, of what has no dampers
  double damping = 0, drag = 0;   // s, 1/s
  const double *drags = nullptr;  // [npoint] 1/s, in place of `drag`
  double lag = 0;                 // s, with which dampers see velocities; 0: none
  double longest = 0;             // s, the longest sub-step that is stable near rest
  uint32_t worst = 0;             // the point that asks for the shortest sub-step at rest
  bool drawn = false;             // cells add to the rows what their shapes ask for
  // What the rows of the bound count for a point: of stiffness and of dampers.
  double stiff(uint32_t i) const { return row[i] * (lag > 0 ? 1 + damping / lag : 1) + undamped[i]; }
  double damper(uint32_t i) const { return (lag > 0 ? 0 : damping * row[i]) + drag_of(i) * mass[i]; }
  double drag_of(size_t i) const { return drags ? drags[i] : drag; }
  void take_points(const dfm_host *h, const dfm_mesh &m) {
    host = h;
    npoint = m.npoint;
    mass.create_copy(h, m.mass, npoint);
    row.create(h, npoint);
    undamped.create(h, npoint);
  }
  Branches branches;
  // Places in the state: of the longest sub-step that is stable; of r of a branch, and behind all of them of
  // b of the last sub-step.
  size_t of_longest() const { return 3 * size_t(npoint); }
  size_t of_stretch(size_t n) const { return of_longest() + 1 + n; }
  // f(n) for each of `all`, on the host's workers.
  template <class F>
  static void each(const dfm_host *host, uint32_t all, const F &f) {
    model::in_pieces(host, true, all, kGrain, [&](uint32_t begin, uint32_t end) {
      for (size_t i = begin; i < end; ++i) f(i);
    });
  }
};

}  // namespace gpu
