// The ops on the blocks. Forces run in two passes: each block loads its points, sums its springs and cells
// into its own array, halo included; then each block adds up, in block order, what the others' halos hold for
// its points. No two workers write the same place, and the mesh alone determines the order of every sum.
#include "../model_common/width.h"
#include "msm_body.h"

namespace msm {

const Kernels *choose_kernels(const dfm_host *host) {
  const model::Width width = model::choose_width(host, "msm");
  if constexpr (model::kHasWider) {
    if (width != model::kSse2) return width == model::kAvx512 ? kernels_avx512() : kernels_avx2();
  }
  return kernels_sse2();
}

// Branches: exact for a stretch that grows evenly over a step, dp/dt = de/dt - p/tau, hence p+ = E p + kept
// (e+ - e) with E = exp(-x), kept = (1 - E)/x, x = h/tau. What is known at the start of the step is r = E p -
// kept e; the state is that and kept.
Branch Body::branch_at(const dfm_kin &k) const {
  Branch b{};
  if (!has_branch() || !k.state) return b;
  b.part = part();
  b.state = k.state;
  b.state_out = k.state_out;
  b.kept = k.state[nedge];
  b.follow = 1 - b.part * (1 - b.kept);
  const Decay decay = decay_of(k.dt / params[kRelaxationTime]);
  b.keep = decay.keep;
  b.next = decay.next;
  return b;
}

bool Body::lacks_state(const dfm_kin &k) const {
  if (!has_branch() || k.state) return false;
  complain(host,
           "the host gives no state, which dampers other than voigt need: it must ask the instance for the "
           "extension " DFM_EXT_SLOTS);
  return true;
}

template <class Store>
void Body::sum_forces(const dfm_kin &k, bool in_single, const Store &store) {
  const Branch branch = branch_at(k);
  if (has_branch() && k.state_out) k.state_out[nedge] = branch.next;
  const Damping how = damping();
  const double all = damp_scale() * params[kDampingStiffness], *const v = how != kUndamped ? k.v : nullptr;
  for_each_block(ncell >= kParallelCells, [&](uint32_t n, uint32_t begin) {
    const Block b = lend(n, begin);
    if (in_single) {
      SingleBlock s = single.block[n];
      s.at = reinterpret_cast<SinglePoint *>(b.p);
      const float unit = kernels->single->load(s, k.x, v, k.stride);
      kernels->single->forces[form() != kPlain][how][cells_on](s, unit, float(all));
      return;
    }
    kernels->load(b, k.x, v, k.stride);
    if (has_branch()) kernels->branches[how](b, all, branch);
    else kernels->springs[form()][how](b, all);
    if (cells_on) kernels->cells(b);
  });
  const double *const drags = point_drag.empty() ? nullptr : point_drag.data();
  for_each_block(ncell >= kParallelMergeCells, [&](uint32_t n, uint32_t) {
    const Block &b = block[n];
    merge_block(*kernels, n);
    if (drag_on) kernels->drag(b, mass.data(), drags, params[kDampingMass], k.v, k.stride);
    store(n, b);
  });
}

void Body::add_forces(const dfm_kin &k, double *f_out, bool in_single) {
  sum_forces(k, in_single, [&](uint32_t, const Block &b) { kernels->store(b, f_out, k.stride); });
}

void Body::part_forces(const dfm_kin &k, bool in_single, dfm_take_part_fn take, void *user) {
  sum_forces(k, in_single, [&](uint32_t n, const Block &b) { take(user, n, b.owned, b.point, b.f); });
}

// T = k (L - L0 - part q), q the dashpot's extension: a plain spring of the same stiffness and a rest length
// of L0 + part q.
void Body::rest_of_branches(uint32_t n, const dfm_kin &k) {
  const Branch branch = branch_at(k);
  const size_t begin = size_t(block[n].stiffness - stiffness.data());
  for (size_t s = begin; s < begin + 4 * size_t(block[n].quads); ++s) {
    const uint32_t e = spring_edge[s];
    if (e == kNone) continue;
    const uint32_t *ends = edges.data() + 2 * size_t(e);
    const double dd = square_between(k.x + size_t(k.stride) * ends[0], k.x + size_t(k.stride) * ends[1]);
    const double more = __builtin_sqrt(dd + tilt[s]) - rest[s];
    rest_now[s] = rest[s] + branch.part * ((1 - branch.kept) * more - branch.state[e]);
  }
}

}  // namespace msm
