// What bodies of springs and of cells have alike for their points.
#pragma once
#include <algorithm>

#include "../model_common/params.h"
#include "stepper.h"

namespace gpu {

// Rows of the parameter tables; springs have no last one.
enum Param : uint32_t { kYoung, kDampingStiffness, kDampingMass, kDevice, kPoisson, kParamCount };
extern const dfm_param kParams[kParamCount];

constexpr uint32_t kGrain = 4096;  // springs, cells, points: waking a worker costs more than fewer save

struct Parts {
  const dfm_host *host = nullptr;
  uint32_t npoint = 0;
  Buffer<double> mass;           // [npoint] kg
  Buffer<double> row;            // [npoint] N/m, of the step bound; of cells at rest
  double damping = 0, drag = 0;  // s, 1/s
  double lag = 0;                // s, with which dampers see velocities; 0: none
  double longest = 0;            // s, the longest sub-step that is stable near rest
  uint32_t worst = 0;            // the point that asks for the shortest sub-step at rest
  // What the rows of the bound count for a point: of stiffness and of dampers.
  double stiff(uint32_t i) const { return row[i] * (lag > 0 ? 1 + damping / lag : 1); }
  double damper(uint32_t i) const { return (lag > 0 ? 0 : damping * row[i]) + drag * mass[i]; }
  void take_points(const dfm_host *h, uint32_t n) {
    host = h;
    npoint = n;
    mass.create(h, n);
    row.create(h, n);
  }
  // f(n) for each of `all`, on the host's workers.
  template <class F>
  static void each(const dfm_host *host, uint32_t all, const F &f) {
    model::in_pieces(host, true, all, kGrain, [&](uint32_t begin, uint32_t end) {
      for (size_t i = begin; i < end; ++i) f(i);
    });
  }
};

}  // namespace gpu
