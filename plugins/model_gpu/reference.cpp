#include <algorithm>
#include <atomic>

#include "../model_common/mass_spring.h"
#include "stepper.h"

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

Dampers Dampers::after(double h) const {
  Dampers out = *this;
  if (part > 0) out.was = msm::decay_of(h / time).next;
  return out;
}

Constants Dampers::constants(double h, uint32_t count) const {
  const msm::Decay decay = msm::decay_of(h / time);
  return {h, kept(h), count, damping, per_lag, was, decay.keep, decay.next, part};
}

void Call::raise(float rate) const {
  const std::atomic_ref<uint32_t> all(*of<uint32_t>(kHighest));
  const uint32_t bits = std::bit_cast<uint32_t>(rate);
  for (uint32_t seen = all; seen < bits && !all.compare_exchange_weak(seen, bits);) {}
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
  for (uint32_t n = kOwn; n < kBindings; ++n) {
    const Work::Array &of = work.array[n];
    if (!of.data && of.bytes != work_.array[n].bytes) own_[n].create(host_, of.bytes);
  }
  if (work.nstretch != work_.nstretch) stretch_.create(host_, work.nstretch);
  stretch = stretch_.data();
  work_ = work;
}

const char *Reference::run(uint32_t n, double h, const Dampers &dampers, bool, bool) {
  *highest_ = 0;
  Call call{};
  for (uint32_t a = kOwn; a < kBindings; ++a)
    call.array[a] = work_.array[a].data ? const_cast<void *>(work_.array[a].data) : own_[a].data();
  call.array[kLoad] = load;
  call.array[kHighest] = highest_;
  call.array[kStretches] = stretch;
  Dampers of = dampers;
  for (uint32_t k = 0; k < n; ++k) {
    dvec4 *const now[6] = {place, speed, seen, next_place_, next_speed_, next_seen_};
    constexpr Binding to[6] = {kPlace, kSpeed, kSeen, kNextPlace, kNextSpeed, kNextSeen};
    for (int a = 0; a < 6; ++a) call.array[to[a]] = now[a];
    for (uint32_t p = 0; p < work_.npass; ++p) {
      const Work::Pass &pass = work_.pass[p];
      call.now = of.constants(h, pass.count);
      call.options = pass.options;
      model::in_pieces(host_, true, pass.count, kGrain,
                       [&](uint32_t begin, uint32_t end) { pass.some(call, begin, end); });
    }
    std::swap(place, next_place_);
    std::swap(speed, next_speed_);
    if (dampers.per_lag > 0) std::swap(seen, next_seen_);
    of = of.after(h);
  }
  return nullptr;
}

}  // namespace gpu
