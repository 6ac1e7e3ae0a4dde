// What the kernels in single precision read beside the points: the arrays of the blocks in floats, each at
// the place that it has in double. Places, velocities and forces stay double for whoever calls.
#include "msm_body.h"

namespace msm {
namespace {

// Below and above these lengths products of stiffness and volume leave the range of a float.
constexpr double kShortestEdge = 1e-6, kLongestEdge = 1e4;
constexpr uint32_t kMostPoints = 16383;  // of a block: four times a number of 16 bits

}  // namespace

const char *Body::keeps_double() const {
  if (has_branch()) return "single precision takes damper voigt alone";
  if (choice(kAxisForm) == kFormA) return "single precision takes anisotropy_form B alone";
  if (largest > kMostPoints) return "a block of the body has too many points for single precision";
  for (uint32_t e = 0; e < nedge; ++e)
    if (edge_length[e] > 0 && !(edge_length[e] >= kShortestEdge && edge_length[e] <= kLongestEdge))
      return "single precision takes edges of 1e-6 m to 1e4 m alone";
  return nullptr;
}

void Body::prepare_single() {
  if (has_single()) return;
  Single made;
  made.block.create(host, nblock);
  made.quad.create(host, spring_slots() / 4);
  made.cell.create(host, cell_slots());
  for (Buffer<float> *each : {&made.stiffness, &made.rest, &made.rest_square, &made.tilt, &made.damp})
    each->create(host, spring_slots());
  for (Buffer<float> *each : {&made.bulk, &made.volume6, &made.collapse, &made.limit})
    each->create(host, cell_slots());
  for (uint32_t n = 0; n < nblock; ++n) {
    const Block &b = block[n];
    SingleBlock &out = made.block[n];
    static_cast<model::BlockPoints &>(out) = b;
    out.quads = b.quads;
    out.cells = b.cells;
    const size_t q = size_t(b.quad - quad.data()), c = size_t(b.cell - cell.data());
    out.quad = made.quad.data() + q;
    out.stiffness = made.stiffness.data() + 4 * q;
    out.rest = made.rest.data() + 4 * q;
    out.rest_square = made.rest_square.data() + 4 * q;
    out.tilt = made.tilt.data() + 4 * q;
    out.damp = made.damp.data() + 4 * q;
    out.cell = made.cell.data() + c;
    out.bulk = made.bulk.data() + c;
    out.volume6 = made.volume6.data() + c;
    out.collapse = made.collapse.data() + c;
    out.limit = made.limit.data() + c;
  }
  for (size_t q = 0; q < spring_slots() / 4; ++q) {
    made.quad[q].i = uint16_t(4 * quad[q].i);
    for (int k = 0; k < 4; ++k) made.quad[q].j[k] = uint16_t(4 * quad[q].j[k]);
  }
  for (size_t c = 0; c < cell_slots(); ++c)
    for (int k = 0; k < 4; ++k) made.cell[c].p[k] = uint16_t(4 * cell[c].p[k]);
  single.swap(made);
  fill_single();
}

void Body::fill_single() {
  if (!has_single()) return;
  for (size_t s = 0; s < spring_slots(); ++s) {
    single.stiffness[s] = float(stiffness[s]);
    single.rest[s] = float(rest[s]);
    single.rest_square[s] = float(rest[s] * rest[s]);
    single.tilt[s] = tilt.empty() ? 0 : float(tilt[s]);
    single.damp[s] = damp.empty() ? 0 : float(damp[s]);
  }
  for (size_t c = 0; c < cell_slots(); ++c) {
    single.bulk[c] = float(bulk[c]);
    single.volume6[c] = float(volume6[c]);
    single.collapse[c] = float(collapse[c]);
    single.limit[c] = limit[c] < 1e30 ? float(limit[c]) : 1e30f;
  }
}

}  // namespace msm
