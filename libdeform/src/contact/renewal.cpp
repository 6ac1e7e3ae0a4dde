#include "contact/renewal.h"

#include <algorithm>
#include <cmath>

namespace dfm {
namespace {

// The same number for corners of one body on the other and of the other on the one.
uint64_t sides_of(const ContactPoint &c) {
  const uint64_t a = c.slot_a, b = side_b(c);
  return std::min(a, b) << 32 | std::max(a, b);
}

}  // namespace

Renewal::Renewal(const Memory &m) { use_memory(m, patches_, patch_of_); }

void Renewal::list(std::span<const ContactPoint> contacts, const double *impulse) {
  patches_.clear();
  patch_of_.resize(contacts.size());
  for (const ContactPoint &c : contacts)
    if (const uint64_t sides = sides_of(c); patches_.empty() || patches_.back().sides != sides)
      patches_.push_back({sides, 0, 0, 0, 0, 0, 0, 0});
  std::sort(patches_.begin(), patches_.end(),
            [](const Patch &l, const Patch &r) { return l.sides < r.sides; });
  patches_.erase(std::unique(patches_.begin(), patches_.end(),
                             [](const Patch &l, const Patch &r) { return l.sides == r.sides; }),
                 patches_.end());
  auto at = patches_.begin();
  for (size_t i = 0; i < contacts.size(); ++i) {
    if (const uint64_t sides = sides_of(contacts[i]); at->sides != sides)
      at = std::lower_bound(patches_.begin(), patches_.end(), sides,
                            [](const Patch &p, uint64_t value) { return p.sides < value; });
    patch_of_[i] = static_cast<uint32_t>(at - patches_.begin());
    at->before += impulse[3 * i];
  }
}

void Renewal::fill(const uint8_t *keeps_area, const double *target_area, double *area) {
  for (size_t i = 0; i < patch_of_.size(); ++i) {
    if (!keeps_area[i]) continue;
    Patch &p = patches_[patch_of_[i]];
    p.lacks += target_area[i] - area[i];
    p.below += std::max(0.0, target_area[i] - area[i]);
  }
  for (size_t i = 0; i < patch_of_.size(); ++i) {
    const Patch &p = patches_[patch_of_[i]];
    if (keeps_area[i] && p.lacks > 0 && target_area[i] > area[i])
      area[i] += p.lacks / p.below * (target_area[i] - area[i]);
  }
}

void Renewal::measure(double h, const double *impulse, const Way *ways, const double *dwell,
                      double *renewed) {
  for (Patch &p : patches_) p.load = p.young = p.slid = p.out = 0;
  for (size_t i = 0; i < patch_of_.size(); ++i) {
    Patch &p = patches_[patch_of_[i]];
    const double ln = impulse[3 * i];
    p.load += ln;
    p.young += ln * (h / (h + dwell[i]));
    p.slid += ln * ways[i].slid;
    p.out += ln * ways[i].out;
  }
  for (size_t i = 0; i < patch_of_.size(); ++i) {
    const Patch &p = patches_[patch_of_[i]];
    const double slides = p.slid < p.out ? p.slid / p.out : p.slid > 0 ? 1 : 0;
    const double begins =
        p.load > 0 ? std::min(std::fabs(p.load - p.before) / std::max(p.load, p.before), p.young / p.load)
                   : 0;
    renewed[i] = std::min(1.0, slides + begins);
  }
}

}  // namespace dfm
