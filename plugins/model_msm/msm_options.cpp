// From the material to what the passes read: springs and cells in the order of the blocks, and those that are
// switched off. What nothing calls for stays empty and its kernels are never chosen.
#include "msm_body.h"

namespace msm {

void Body::place_material(Room &room) {
  tilt.swap(room.tilt);
  if (!room.damp.empty()) damp.swap(room.damp);
  for (size_t s = 0; s < spring_slots(); ++s) {
    const uint32_t e = spring_edge[s];
    rest[s] = e == kNone ? 0 : rest_length(e);
    if (!edge_tilt.empty()) tilt[s] = e == kNone ? 0 : edge_tilt[e];
    if (!edge_damp.empty()) damp[s] = e == kNone ? 0 : edge_damp[e];
  }
  for (uint32_t b = 0; b < nblock; ++b) {
    const size_t first = size_t(block[b].stiffness - stiffness.data());
    block[b].tilt = tilt.empty() ? nullptr : tilt.data() + first;
    block[b].damp = damp.empty() ? nullptr : damp.data() + first;
  }
}

void Body::fill_stiffness() {
  const size_t springs = spring_slots(), ncells = cell_slots();
  for (size_t s = 0; s < springs; ++s)
    stiffness[s] = spring_edge[s] == kNone ? 0 : stiffness_of(spring_edge[s]);
  for (size_t c = 0; c < ncells; ++c) {
    const CellStiffness k = cell_id[c] == kNone ? CellStiffness{0, 0} : cell_stiffness(cell_id[c]);
    bulk[c] = k.bulk;
    collapse[c] = k.collapse;
  }
}

namespace {
struct Aside {  // the mask, while no spring counts as off
  Buffer<uint8_t> &mask, kept;
  explicit Aside(Buffer<uint8_t> &m) : mask(m) { kept.swap(mask); }
  ~Aside() { kept.swap(mask); }
};
}  // namespace

void Body::make_room(Room &room) const {
  const size_t slots = spring_slots();
  Material::make_room(host, npoint, room);
  if (!room.edge_tilt.empty() || has_branch()) room.tilt.create(host, slots);
  if (!room.edge_damp.empty()) room.damp.create(host, slots);
  if (has_branch() && rest_now.empty()) room.rest_now.create(host, slots);
  room.own.create(host, npoint);
  room.next.create(host, npoint);
  room.tangent.create(host, nedge);
  room.gradient.create(host, largest_volume() > 0 ? 4 * size_t(ncell) : 0);
}

// All or nothing: what may fail comes first.
void Body::apply_params(const double *values) {
  Room room;
  model::try_params(params, values, [&] { make_room(room); });
  take_params(npoint, room);
  place_material(room);
  if (!room.rest_now.empty()) rest_now.swap(room.rest_now);
  {  // the weights of the step bound never depend on what is switched off, nor on when it was
    const Aside aside(edge_off);
    fill_stiffness();
    find_weights(room);
  }
  if (!edge_off.empty()) fill_stiffness();
  fill_single();
}

// The rows of the step bound keep counting a spring that is off: a bound it stays, and a cut need not look
// for new weights.
void Body::mask_changed() {
  fill_stiffness();
  fill_single();
}

}  // namespace msm
