#include "springs.h"

#include <algorithm>

namespace msm_gpu {
namespace {

constexpr uint32_t kNone = ~0u;
constexpr uint32_t kGrain = 1024;

using std::sqrt;
using uint = uint32_t;
float uintBitsToFloat(uint bits) { return std::bit_cast<float>(bits); }
double packDouble2x32(uvec2 bits) { return std::bit_cast<double>(uint64_t{bits.y} << 32 | bits.x); }

// The kernel: its names are members here.
struct Points {
  const dvec4 *place, *speed, *loads;
  const uvec2 *rows;
  const uvec4 *springs;
  dvec4 *next_place, *next_speed;
  double step;
  float damping;

#define precise
#define UNROLLED
#define PLACE(i) place[i]
#define SPEED(i) speed[i]
#define LOAD(i) loads[i]
#define ROW(i) rows[i]
#define SPRING(i) springs[i]
#define NEXT_PLACE(i, value) next_place[i] = value
#define NEXT_SPEED(i, value) next_speed[i] = value
#define STEP step
#define DAMPING damping
#include "spring_step.glsl"
#undef precise
};

void move_points(void *user, uint32_t begin, uint32_t end) {
  Points &points = *static_cast<Points *>(user);
  for (uint32_t i = begin; i < end; ++i) points.move_point(i);
}

}  // namespace

void Springs::lay_out(const dfm_host *host, uint32_t points, uint32_t nedge, const uint32_t *edges) {
  npoint = points;
  row.create(host, npoint);
  for (size_t n = 0; n < 2 * size_t(nedge); ++n) ++row[edges[n]].y;
  nspring = 0;
  for (uint32_t side = 0; side < npoint; side += kSide) {
    const uint32_t end = std::min(npoint, side + kSide);
    uint32_t most = 0;
    for (uint32_t i = side; i < end; ++i) {
      row[i].x = uint32_t(nspring) + (i - side);
      most = std::max(most, row[i].y);
    }
    nspring += size_t(kSide) * most;
  }
  nspring += size_t(3) * kSide;  // the kernel reads on to a multiple of four
  if (nspring > kNone) throw "the body has more springs than a number of 32 bits counts";
  spring.create(host, nspring);
  edge.create(host, nspring);
  std::fill(edge.data(), edge.data() + nspring, kNone);
  Buffer<uint32_t> next;
  next.create(host, npoint);
  for (uint32_t e = 0; e < nedge; ++e)
    for (int end = 0; end < 2; ++end) {
      const uint32_t i = edges[2 * size_t(e) + end];
      const size_t at = row[i].x + size_t(kSide) * next[i]++;
      edge[at] = e;
      spring[at].x = edges[2 * size_t(e) + 1 - end];
    }
}

void Springs::fill(const double *stiffness, const double *rest_square) {
  for (size_t s = 0; s < nspring; ++s) {
    if (edge[s] == kNone) continue;
    const uint64_t square = std::bit_cast<uint64_t>(rest_square[edge[s]]);
    spring[s].y = std::bit_cast<uint32_t>(float(stiffness[edge[s]]));
    spring[s].z = uint32_t(square);
    spring[s].w = uint32_t(square >> 32);
  }
}

Reference::Reference(const dfm_host *host, uint32_t npoint) : host_(host), npoint_(npoint) {
  for (Buffer<dvec4> &array : array_) array.create(host, npoint);
  place = array_[0].data();
  speed = array_[1].data();
  load = array_[2].data();
  next_place_ = array_[3].data();
  next_speed_ = array_[4].data();
}

const char *Reference::run(uint32_t n, double h, float damping, bool, bool) {
  for (uint32_t k = 0; k < n; ++k) {
    Points points{place,       speed, load,   springs_->row.data(), springs_->spring.data(), next_place_,
                  next_speed_, h,     damping};
    host_->parallel_for(host_->ctx, npoint_, kGrain, move_points, &points);
    std::swap(place, next_place_);
    std::swap(speed, next_speed_);
  }
  return nullptr;
}

}  // namespace msm_gpu
