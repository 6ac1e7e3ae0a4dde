#include <string_view>
#include <utility>

#include "dynamics/rigid/rigid_set.h"
#include "state/world.h"
#include "step/context.h"
#include "step/self_contact.h"
#include "step/stages.h"

namespace dfm {

std::string cost_of(const World &w, const Stage &stage) {
  size_t cells = 0, points = 0, weights = 0, surfels = 0, triangles = 0, states = 0;
  size_t self_surfels = 0, self_triangles = 0;
  for (const auto &b : w.bodies) {
    cells += b->ncell();
    points += b->p.n;
    weights += b->surface.weight.size();
    surfels += b->surface.nsurfel;
    triangles += b->surface.ntri;
  }
  for (const auto &set : w.rigid_sets) states += set->defs.size();
  for (const auto &s : w.steps->self_bodies) {
    self_surfels += s->body->surface.nsurfel;
    self_triangles += s->body->surface.ntri;
  }
  const std::pair<std::string_view, size_t> counts[] = {
      {"{cells}", cells},
      {"{points}", points},
      {"{weights}", weights},
      {"{surfels}", surfels},
      {"{triangles}", triangles},
      {"{states}", states},
      {"{self surfels}", self_surfels},
      {"{self triangles}", self_triangles},
      {"{awake}", w.steps->active.size()},
      {"{bodies}", w.bodies.size()},
  };
  std::string text = stage.cost;
  for (const auto &[name, n] : counts)
    if (const size_t at = text.find(name); at != std::string::npos)
      text.replace(at, name.size(), std::to_string(n));
  return text;
}

}  // namespace dfm
