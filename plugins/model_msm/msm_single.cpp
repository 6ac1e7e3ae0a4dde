// What the kernels in single precision read beside the points: the arrays of the blocks in floats, each at
// the place that it has in double. Places, velocities and forces stay double for the caller.
#include "../model_common/edges.h"
#include "msm_fans.h"

namespace msm {
namespace {

// Below and above these lengths products of stiffness and volume leave the range of a float.
constexpr double kShortestEdge = 1e-6, kLongestEdge = 1e4;
constexpr uint32_t kMaxPoints = 16383;  // of a block: four times a number of 16 bits

}  // namespace

const char *Body::keeps_double() const {
  if (has_branch()) return "single precision works with damper voigt only";
  if (choice(kAxisForm) == kFormA) return "single precision works with anisotropy_form B only";
  if (largest > kMaxPoints) return "a block of the body has too many points for single precision";
  for (uint32_t e = 0; e < nedge; ++e)
    if (edge_length[e] > 0 && !(edge_length[e] >= kShortestEdge && edge_length[e] <= kLongestEdge))
      return "single precision works with edges of 1e-6 m to 1e4 m only";
  return nullptr;
}

void Body::prepare_single() {
  if (has_single()) return;
  const Fans fans(*this);
  Single made;
  made.block.create(host, nblock);
  made.above.create(host, nblock);
  size_t groups = 0, rings = 0;
  for (uint32_t n = 0; n < nblock; ++n)
    fans.each_group(n, [&](const Fan *, uint32_t, uint32_t longest) {
      ++groups;
      rings += longest;
    });
  made.create(host, groups, rings);
  size_t group = 0, number_at = 0, ray_at = 0, cell_at = 0;
  for (uint32_t n = 0; n < nblock; ++n) {
    SingleBlock &out = made.block[n];
    static_cast<model::BlockPoints &>(out) = block[n];
    out.above = made.above.data() + n;
    out.cells = made.cells.data() + group;
    out.number = made.number.data() + number_at;
    out.stiffness = made.stiffness.data() + ray_at;
    out.rest = made.rest.data() + ray_at;
    out.tilt = made.tilt.data() + ray_at;
    out.damp = made.damp.data() + ray_at;
    out.bulk = made.bulk.data() + cell_at;
    out.volume6 = made.volume6.data() + cell_at;
    out.collapse = made.collapse.data() + cell_at;
    out.limit = made.limit.data() + cell_at;
    const size_t first = group;
    fans.each_group(n, [&](const Fan *fan, uint32_t count, uint32_t longest) {
      made.cells[group++] = longest;
      for (uint32_t lane = 0; lane < kFans; ++lane) {
        const Fan &own = fan[lane < count ? lane : 0];
        for (uint32_t k = 0; k < longest + 3; ++k) {
          const uint32_t local = k == 0 ? own.a : k == 1 ? own.b : own.ring[std::min(k - 2, own.cells)];
          made.number[number_at + kFans * size_t(k) + lane] = uint16_t(4 * local);
        }
        if (lane >= count) continue;
        for (uint32_t k = 0; k < own.cells + 2; ++k) {
          if (!(own.springs >> k & 1)) continue;
          const uint32_t to = k == 0 ? own.b : own.ring[k - 1];
          made.edge[ray_at + kFans * size_t(k) + lane] =
              model::find_edge(edges.data(), nedge, block[n].point[own.a], block[n].point[to]);
        }
        for (uint32_t k = 0; k < own.cells; ++k) made.cell[cell_at + kFans * size_t(k) + lane] = own.slot[k];
      }
      number_at += kFans * (size_t(longest) + 3);
      ray_at += kFans * (size_t(longest) + 2);
      cell_at += kFans * size_t(longest);
    });
    out.groups = uint32_t(group - first);
  }
  std::swap(single, made);
  fill_single();
}

void Body::fill_single() {
  if (!has_single()) return;
  Single &to = single;
  for (size_t s = 0; s < to.rays; ++s) {
    const uint32_t e = to.edge[s];
    const bool real = e != kNone;
    to.stiffness[s] = real ? float(stiffness_of(e)) : 0;
    to.rest[s] = real ? float(rest_length(e)) : 0;
    to.tilt[s] = real && !edge_tilt.empty() ? float(edge_tilt[e]) : 0;
    to.damp[s] = real && !edge_damp.empty() ? float(edge_damp[e]) : 0;
  }
  for (size_t s = 0; s < to.ncell; ++s) {
    const uint32_t c = to.cell[s];
    const bool real = c != kNone;
    to.bulk[s] = real ? float(bulk[c]) : 0;
    to.volume6[s] = real ? float(volume6[c]) : 0;
    to.collapse[s] = real ? float(collapse[c]) : 0;
    to.limit[s] = real && limit[c] < 1e30 ? float(limit[c]) : 1e30f;
  }
}

}  // namespace msm
