#include "step/stage_costs.h"

#include "core/error.h"
#include "dynamics/rigid/rigid_set.h"
#include "step/context.h"
#include "step/self_contact.h"

namespace dfm::cost {
namespace {

template <class F>
size_t sum(const World &w, F &&of) {
  size_t n = 0;
  for (const auto &b : w.bodies) n += of(*b);
  return n;
}
size_t surfels(const World &w) {
  return sum(w, [](const Body &b) { return b.surface.nsurfel; });
}

}  // namespace

std::string prescribed(const World &) { return "what is prescribed"; }

std::string cells(const World &w) {
  return format("%zu cells", sum(w, [](const Body &b) { return size_t{b.ncell()}; }));
}

std::string points(const World &w) {
  return format("%zu points", sum(w, [](const Body &b) { return b.p.n; }));
}

std::string rigid_states(const World &w) {
  size_t n = 0;
  for (const auto &set : w.rigid_sets) n += set->defs.size();
  return format("%zu states", n);
}

std::string weights(const World &w) {
  return format("%zu weights", sum(w, [](const Body &b) { return b.surface.weight.size(); }));
}

std::string surfels_and_triangles(const World &w) {
  const size_t triangles = sum(w, [](const Body &b) { return b.surface.ntri; });
  return format("%zu surfels every sub-step; %zu triangles whenever a skin is used up", surfels(w),
                triangles);
}

std::string candidates(const World &) { return "candidate pairs"; }

std::string candidates_near(const World &) {
  return "candidate pairs that may come nearer than d_c / 2 within the sub-step";
}

std::string self_surfels(const World &w) {
  size_t n = 0, t = 0;
  for (const auto &s : w.steps->self_bodies) {
    n += s->body->surface.nsurfel;
    t += s->body->surface.ntri;
  }
  return format(
      "%zu surfels every sub-step, and what of them is near; %zu triangles whenever a skin is used up", n, t);
}

std::string contacts_and_sweeps(const World &) { return "contacts x sweeps, laws once per pass"; }

std::string contacts_and_surfels(const World &w) { return format("contacts and %zu surfels", surfels(w)); }

std::string awake(const World &w) {
  return format("velocities of %zu awake bodies of %zu", w.steps->active.size(), w.bodies.size());
}

}  // namespace dfm::cost
