// The ops on the blocks. Forces run in two passes: each block loads its points, sums its springs and cells
// into its own array, halo included; then each block adds up, in block order, what the others' halos hold for
// its points. No two workers write the same place, and the mesh alone determines the order of every sum.
#include <deform/elementary.h>

#include "../model_common/width.h"
#include "msm_body.h"

namespace msm {
namespace {

void force_pass(void *user, uint32_t begin, uint32_t end) {
  const Call &call = *static_cast<const Call *>(user);
  Body &body = *call.body;
  const Damping damping = body.damping();
  const double damp = body.damp_scale() * body.params[kDampingStiffness];
  for (uint32_t n = begin; n < end; ++n) {
    const Block b = body.lend(n, begin);
    body.kernels->load(b, call.k->x, damping != kUndamped ? call.k->v : nullptr, call.k->stride);
    if (call.branch) body.kernels->branches[damping](b, damp, *call.branch);
    else body.kernels->springs[body.form()][damping](b, damp);
    if (body.cells_on) body.kernels->cells(b);
  }
}

void single_pass(void *user, uint32_t begin, uint32_t end) {
  const Call &call = *static_cast<const Call *>(user);
  Body &body = *call.body;
  const SingleKernels &kernels = *body.kernels->single;
  const Damping damping = body.damping();
  const float damp = float(body.damp_scale() * body.params[kDampingStiffness]);
  for (uint32_t n = begin; n < end; ++n) {
    SingleBlock b = body.single.block[n];
    b.at = reinterpret_cast<SinglePoint *>(body.lend(n, begin).p);
    const float unit = kernels.load(b, call.k->x, damping != kUndamped ? call.k->v : nullptr, call.k->stride);
    kernels.forces[body.form() != kPlain][damping][body.cells_on](b, unit, damp);
  }
}

void merge_pass(void *user, uint32_t begin, uint32_t end) {
  const Call &call = *static_cast<const Call *>(user);
  Body &body = *call.body;
  const double *const drags = body.point_drag.empty() ? nullptr : body.point_drag.data();
  for (uint32_t n = begin; n < end; ++n) {
    const Block &b = body.block[n];
    body.merge_block(*body.kernels, n);
    if (body.drag_on)
      body.kernels->drag(b, body.mass.data(), drags, body.params[kDampingMass], call.k->v, call.k->stride);
    if (call.take) call.take(call.user, n, b.owned, b.point, b.f);
    else body.kernels->store(b, call.f, call.k->stride);
  }
}

}  // namespace

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
  const double x = k.dt / params[kRelaxationTime];
  b.part = part();
  b.state = k.state;
  b.state_out = k.state_out;
  b.kept = k.state[nedge];
  b.follow = 1 - b.part * (1 - b.kept);
  if (x > 0.25) {
    b.keep = dfm_exp(-x);
    b.next = (1 - b.keep) / x;
  } else {  // 1 - E would lose digits: its series over x
    double series = 1;
    for (int n = 14; n > 1; --n) series = 1 - x / n * series;
    b.next = series;
    b.keep = 1 - x * series;
  }
  return b;
}

bool Body::lacks_state(const dfm_kin &k) const {
  if (!has_branch() || k.state) return false;
  complain(host,
           "the host gives no state, which dampers other than voigt need: it must ask the instance for the "
           "extension " DFM_EXT_SLOTS);
  return true;
}

void Body::add_forces(const dfm_kin &k, double *f_out) {
  Call call{this, &k, f_out};
  sum_forces(call, false);
}

void Body::add_single_forces(const dfm_kin &k, double *f_out) {
  Call call{this, &k, f_out};
  sum_forces(call, true);
}

void Body::part_forces(const dfm_kin &k, bool in_single, dfm_take_part_fn take, void *user) {
  Call call{this, &k, nullptr, nullptr, take, user};
  sum_forces(call, in_single);
}

void Body::sum_forces(Call &call, bool in_single) {
  const Branch branch = branch_at(*call.k);
  if (has_branch()) call.branch = &branch;
  if (has_branch() && call.k->state_out) call.k->state_out[nedge] = branch.next;
  for_each_block(ncell >= kParallelCells, in_single ? single_pass : force_pass, &call);
  for_each_block(ncell >= kParallelMergeCells, merge_pass, &call);
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
    const double dd = square_of(k.x + size_t(k.stride) * ends[0], k.x + size_t(k.stride) * ends[1]);
    const double more = __builtin_sqrt(dd + tilt[s]) - rest[s];
    rest_now[s] = rest[s] + branch.part * ((1 - branch.kept) * more - branch.state[e]);
  }
}

}  // namespace msm
