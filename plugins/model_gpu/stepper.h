// What moves the points of a body: kernels over arrays, run by a device (vulkan_stepper.h) or, as reference,
// by the processor. Both run the same .glsl files.
#pragma once
#include <algorithm>
#include <bit>
#include <cmath>

#include "../model_common/buffer.h"
#include "../model_common/pieces.h"

namespace gpu {

using model::Buffer;

// The types of GLSL, with its layout in memory.
struct dvec4 {
  double x, y, z, w;
  dvec4() = default;
  dvec4(double a, double b, double c, double d) : x(a), y(b), z(c), w(d) {}
};
struct dvec2 {
  double x, y;
  dvec2(double a, double b) : x(a), y(b) {}
};
struct uvec2 {
  uint32_t x, y;
  uvec2() = default;
  uvec2(uint32_t a, uint32_t b) : x(a), y(b) {}
};
struct uvec4 { uint32_t x, y, z, w; };

// Bindings of the arrays, as in the .comp files. From kOwn on they are those of the kernels.
enum Binding : uint32_t {
  kPlace,
  kSpeed,
  kLoad,
  kNextPlace,
  kNextSpeed,
  kSeen,
  kNextSeen,
  kHighest,
  kStretches,
  kOwn,
  kCornerRows = kOwn,
  kCorners,
  kShapes,
  kForces,
  kRestRows,
  kSpringRows,
  kSprings,
  kOptions,
  kBindings
};

// What a kernel is called with; the layout is that of the .comp files.
struct Constants {
  double step;                   // s
  double kept;                   // in a sub-step, of the difference of what dampers see from the velocity
  uint32_t count;                // of invocations
  float damping;                 // s
  float per_lag;                 // 1/s
  double was, keep, next, part;  // of branches: b of the sub-step before, E and b of this one, their share
};

// Damping over stiffness, s; one over the lag with which dampers see velocities, 1/s, 0 without one. Of
// branches their share of the stiffness, the time in which they relax, s, and b of the sub-step before
// (doc/models/msm.md, viscoelastic dampers).
struct Dampers {
  float damping = 0, per_lag = 0;
  double part = 0, time = 1, was = 1;
  bool operator==(const Dampers &) const = default;
  double kept(double h) const { return per_lag > 0 ? (2 - h * per_lag) / (2 + h * per_lag) : 0; }
  // As it is after sub-steps of h.
  Dampers after(double h) const;
  Constants constants(double h, uint32_t count) const;
};

// What a pass has beside its springs, and their form; the bits of Call.options.
enum Option : uint32_t { kWithCells = 1, kWithOptions = 2, kWithBranches = 4, kTurned = 8 };
constexpr uint32_t kOptionBits = 4, kCombinations = 1u << kOptionBits;

struct Call {
  void *array[kBindings];
  Constants now;
  uint32_t options;
  bool has(Option option) const { return options & option; }
  template <class T>
  T *of(uint32_t binding) const {
    return static_cast<T *>(array[binding]);
  }
  void raise(float rate) const;
};

enum Kernel : uint32_t { kSpringStep, kCellForces, kCellMotion, kVolumeForces, kKernels };

// A sub-step: passes one after the other, each over `count` items that may run in any order.
struct Work {
  struct Pass {
    Kernel kernel;
    uint32_t options, count;
    void (*some)(const Call &, uint32_t begin, uint32_t end);  // the same on the processor
    bool operator==(const Pass &) const = default;
  };
  struct Array {
    size_t bytes;      // 0: the binding is not used
    const void *data;  // NULL: the kernels alone write it
  };
  Pass pass[2] = {};
  uint32_t npass = 0;
  size_t nstretch = 0;  // entries of Stepper::stretch
  Array array[kBindings] = {};
  void add(Kernel kernel, uint32_t options, uint32_t count,
           void (*some)(const Call &, uint32_t begin, uint32_t end)) {
    pass[npass++] = {kernel, options, count, some};
  }
};

// Arrays [npoint] that a body writes before run() and reads after it: place (m; 1/kg), speed (m/s; held
// components, bits 1 x, 2 y, 4 z), seen by dampers (m/s), load (m/s2; drag, 1/s). stretch (m) has as many
// entries as the work says.
class Stepper {
 public:
  dvec4 *place = nullptr, *speed = nullptr, *seen = nullptr, *load = nullptr;
  double *stretch = nullptr;
  Stepper() = default;
  Stepper(const Stepper &) = delete;
  virtual ~Stepper() = default;
  // Throws; before the first run, and where the data have changed. The data must stay where they are.
  virtual void take(const Work &work) = 0;
  // n sub-steps of h; moved, loaded: place, speed, seen and stretch, or load, are not those that the last run
  // left.
  // NULL, or why it failed.
  virtual const char *run(uint32_t n, double h, const Dampers &dampers, bool moved, bool loaded) = 0;
  virtual const char *device() const = 0;  // its name
  virtual bool on_processor() const = 0;
  // 1/s, the highest rate of the step bound at the shapes of the last run; 0 where no kernel finds it.
  float highest() const { return std::bit_cast<float>(*highest_); }

 protected:
  uint32_t *highest_ = nullptr;
};

class Reference : public Stepper {
 public:
  Reference(const dfm_host *host, uint32_t npoint);
  void take(const Work &work) override;
  const char *run(uint32_t n, double h, const Dampers &dampers, bool moved, bool loaded) override;
  const char *device() const override { return "no driver"; }
  bool on_processor() const override { return true; }

 private:
  const dfm_host *host_;
  Work work_{};
  Buffer<dvec4> array_[7];
  Buffer<uint32_t> rate_;
  Buffer<uint8_t> own_[kBindings];
  Buffer<double> stretch_;
  dvec4 *next_place_, *next_speed_, *next_seen_;
};

constexpr uint32_t kSide = 32;  // points that read side by side, cells that are read so; in the kernels, too

// Where a point's entries are, `row.y` in number: the first in row.x, the next 32 further. Returns the room
// for all; the kernels read on to a multiple of four.
size_t lay_out(Buffer<uvec2> &row, uint32_t npoint);

// What the kernels use beside operators.
using std::abs;
using std::max;
using std::min;
using std::sqrt;
using uint = uint32_t;
inline float uintBitsToFloat(uint bits) { return std::bit_cast<float>(bits); }
inline uint floatBitsToUint(float value) { return std::bit_cast<uint>(value); }
inline uvec2 unpackDouble2x32(double value) {
  const uint64_t bits = std::bit_cast<uint64_t>(value);
  return {uint32_t(bits), uint32_t(bits >> 32)};
}
inline double packDouble2x32(uvec2 bits) { return std::bit_cast<double>(uint64_t{bits.y} << 32 | bits.x); }

}  // namespace gpu
