#include "contact/areas.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace dfm {
namespace {

// The side opposite to that of a node.
uint32_t other_of(const ContactPoint &c, int node) { return c.weight[node] < 0 ? c.slot_a : side_b(c); }
// Contacts that take area from corners: a crossing between bodies, and other contacts without an area from
// detection. The area of a contact is that of its first row.
bool takes(const ContactPoint &c) { return c.more == 0 && (!(c.area > 0) || (c.type_a != 0 && !c.obstacle)); }
bool corner_on_face(const ContactPoint &c) { return c.type_a == 0 && !c.obstacle; }

}  // namespace

AreaShares::AreaShares(const Memory &m) { use_memory(m, owners_, parts_, taken_, given_, left_); }

// Contacts of corners that are loaded or touch, or of the others; against an obstacle also the contact to
// which a corner has lent its area.
void AreaShares::list_owners(std::span<const ContactPoint> contacts, const double *impulse, double touch,
                             bool idle) {
  owners_.clear();
  for (uint32_t i = 0; i < contacts.size(); ++i) {
    const ContactPoint &c = contacts[i];
    const bool loaded = impulse[3 * size_t{i}] > 0;
    if (c.more > 0 || takes(c) || (loaded || c.distance < touch) == idle) continue;
    owners_.push_back({c.type_a == 0 ? c.node[0] : c.area_node_plus_1 - 1, other_of(c, 0), i, loaded});
  }
  std::sort(owners_.begin(), owners_.end(), [](const Owner &l, const Owner &r) {
    return std::tie(l.node, l.other, l.contact) < std::tie(r.node, r.other, r.contact);
  });
}

std::span<const AreaShares::Owner> AreaShares::owners_of(uint32_t node, uint32_t other) const {
  const auto before = [](const Owner &l, const std::pair<uint32_t, uint32_t> &r) {
    return std::tie(l.node, l.other) < std::tie(r.first, r.second);
  };
  const auto first = std::lower_bound(owners_.begin(), owners_.end(), std::pair{node, other}, before);
  auto last = first;
  while (last != owners_.end() && last->node == node && last->other == other) ++last;
  return {owners_.data() + (first - owners_.begin()), size_t(last - first)};
}

void AreaShares::share(std::span<const ContactPoint> contacts, const double *impulse, double touch,
                       double *area) {
  const uint32_t n = static_cast<uint32_t>(contacts.size());
  for (uint32_t i = 0; i < n; ++i) area[i] = contacts[i].area;
  if (std::all_of(contacts.begin(), contacts.end(),
                  [](const ContactPoint &c) { return c.obstacle && !takes(c); }))
    return;
  list_owners(contacts, impulse, touch, false);
  parts_.clear();
  taken_.assign(n, 0.0);
  left_.clear();
  given_.assign(area, area + n);
  const auto idle = [&](uint32_t i) { return !(impulse[3 * size_t{i}] > 0) && contacts[i].distance < touch; };
  const auto take = [&](uint32_t i) {
    const size_t before = parts_.size();
    for (int k = 0; k < contacts[i].nnode; ++k) {
      const auto owners = owners_of(contacts[i].node[k], other_of(contacts[i], k));
      for (const Owner &o : owners)
        parts_.push_back({i, o.contact, std::fabs(contacts[i].weight[k]) / double(owners.size())});
    }
    return parts_.size() > before;
  };
  for (uint32_t i = 0; i < n; ++i) {
    const ContactPoint &c = contacts[i];
    if (takes(c)) {
      if (take(i)) area[i] = 0;
      else if (!(c.area > 0)) left_.push_back(i);
    } else if (corner_on_face(c)) {
      // by loaded corners of the other side; by touching corners without load
      double covered = 0, beside = 0;
      for (int k = 1; k < c.nnode; ++k) {
        const auto owners = owners_of(c.node[k], other_of(c, k));
        if (!owners.empty())
          (std::any_of(owners.begin(), owners.end(), [](const Owner &o) { return o.loaded; }) ? covered
                                                                                              : beside) -=
              c.weight[k];
      }
      // places beyond an edge of the face have weights below zero and above one
      covered = std::clamp(covered, 0.0, 1.0);
      beside = std::max(beside, 0.0);
      given_[i] = idle(i) ? 2 * area[i] * (1 - covered) / (1 + beside) : 2 * area[i] / (1 + covered);
      area[i] *= 2 / (1 + covered);
    }
  }
  // between corners without load: their area is free
  if (!left_.empty()) list_owners(contacts, impulse, touch, true);
  for (const uint32_t i : left_) take(i);
  for (const Part &p : parts_)
    if (impulse[3 * size_t{p.taker}] > 0) taken_[p.giver] += p.weight;
  for (const Part &p : parts_) {
    const bool counted = impulse[3 * size_t{p.taker}] > 0;
    area[p.taker] +=
        given_[p.giver] * (p.weight / ((idle(p.giver) ? 0 : 1) + taken_[p.giver] + (counted ? 0 : p.weight)));
  }
  for (uint32_t i = 0; i < n; ++i) area[i] /= 1 + taken_[i];
}

}  // namespace dfm
