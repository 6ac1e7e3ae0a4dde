// Springs of a body in the order in which points read them, and what moves points by them: the processor
// here, a device in vulkan_stepper.h. Both run spring_step.glsl.
#pragma once
#include <bit>
#include <cmath>

#include "../model_common/buffer.h"

namespace msm_gpu {

using model::Buffer;

// The types of GLSL, with its layout in memory.
struct dvec4 {
  double x, y, z, w;
  dvec4() = default;
  dvec4(double a, double b, double c, double d) : x(a), y(b), z(c), w(d) {}
};
struct uvec2 {
  uint32_t x, y;
  uvec2() = default;
  uvec2(uint32_t a, uint32_t b) : x(a), y(b) {}
};
struct uvec4 { uint32_t x, y, z, w; };

constexpr uint32_t kSide = 32;  // points whose springs lie side by side; spring_step.glsl

struct Springs {
  uint32_t npoint = 0;
  size_t nspring = 0;     // room for them, both ends counted
  Buffer<uvec2> row;      // [npoint] of a point's springs: the first, how many
  Buffer<uvec4> spring;   // [nspring] other end, stiffness, square of the rest length
  Buffer<uint32_t> edge;  // [nspring] whose spring it is

  // Edges [nedge,2]; a point's springs are in the order of the edges.
  void lay_out(const dfm_host *host, uint32_t points, uint32_t nedge, const uint32_t *edges);
  // After lay_out(): stiffness (N/m) and square of the rest length (m2) of each edge.
  void fill(const double *stiffness, const double *rest_square);
};

// Arrays [npoint] that a body writes before run() and reads after it: place, speed, load as in
// spring_step.glsl.
class Stepper {
 public:
  dvec4 *place = nullptr, *speed = nullptr, *load = nullptr;
  Stepper() = default;
  Stepper(const Stepper &) = delete;
  virtual ~Stepper() = default;
  virtual void take(const Springs &springs) = 0;  // throws; before the first run, and where they have changed
  // n sub-steps of h; moved, loaded: place and speed, or load, are not those that the last run left. NULL, or
  // why it failed.
  virtual const char *run(uint32_t n, double h, float damping, bool moved, bool loaded) = 0;
};

class Reference : public Stepper {
 public:
  Reference(const dfm_host *host, uint32_t npoint);
  void take(const Springs &springs) override { springs_ = &springs; }
  const char *run(uint32_t n, double h, float damping, bool moved, bool loaded) override;

 private:
  const dfm_host *host_;
  const Springs *springs_ = nullptr;
  uint32_t npoint_;
  Buffer<dvec4> array_[5];
  dvec4 *next_place_, *next_speed_;
};

}  // namespace msm_gpu
