#include "stepper.h"

#include <algorithm>

namespace gpu {
namespace {

constexpr uint32_t kGrain = 1024;

}  // namespace

size_t lay_out(Buffer<uvec2> &row, uint32_t npoint) {
  size_t all = 0;
  for (uint32_t side = 0; side < npoint; side += kSide) {
    const uint32_t end = std::min(npoint, side + kSide);
    uint32_t most = 0;
    for (uint32_t i = side; i < end; ++i) {
      row[i].x = uint32_t(all) + (i - side);
      most = std::max(most, row[i].y);
    }
    all += size_t(kSide) * most;
  }
  all += size_t(3) * kSide;
  if (all > ~0u) throw "the body has more springs or cells than a number of 32 bits counts";
  return all;
}

Reference::Reference(const dfm_host *host, uint32_t npoint) : host_(host) {
  for (Buffer<dvec4> &array : array_) array.create(host, npoint);
  rate_.create(host, 1);
  place = array_[0].data();
  speed = array_[1].data();
  load = array_[2].data();
  next_place_ = array_[3].data();
  next_speed_ = array_[4].data();
  seen = array_[5].data();
  next_seen_ = array_[6].data();
  highest_ = rate_.data();
}

void Reference::take(const Work &work) {
  work_ = work;
  for (uint32_t n = 0; n < kHighest - kOwn; ++n) {
    const Work::Array &of = work.array[n];
    if (of.bytes && !of.data && own_[n].empty()) own_[n].create(host_, of.bytes);
  }
}

const char *Reference::run(uint32_t n, double h, const Dampers &dampers, bool, bool) {
  *highest_ = 0;
  Call call{};
  for (uint32_t a = 0; a < kHighest - kOwn; ++a)
    call.array[kOwn + a] = own_[a].empty() ? const_cast<void *>(work_.array[a].data) : own_[a].data();
  call.array[kLoad] = load;
  call.array[kHighest] = highest_;
  for (uint32_t k = 0; k < n; ++k) {
    dvec4 *const now[6] = {place, speed, seen, next_place_, next_speed_, next_seen_};
    constexpr Binding to[6] = {kPlace, kSpeed, kSeen, kNextPlace, kNextSpeed, kNextSeen};
    for (int a = 0; a < 6; ++a) call.array[to[a]] = now[a];
    for (uint32_t p = 0; p < work_.npass; ++p) {
      const Work::Pass &pass = work_.pass[p];
      call.now = dampers.constants(h, pass.count);
      model::in_pieces(host_, true, pass.count, kGrain,
                       [&](uint32_t begin, uint32_t end) { pass.some(call, begin, end); });
    }
    std::swap(place, next_place_);
    std::swap(speed, next_speed_);
    if (dampers.per_lag > 0) std::swap(seen, next_seen_);
  }
  return nullptr;
}

}  // namespace gpu
