#include "math/coarse_space.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "math/vec3.h"

namespace dfm {

namespace {

// Motions of a patch are two coarse points: 2p its translation, 2p + 1 its rotation.
constexpr uint32_t kPatches = 64;  // at least these many points each, and about so many patches
constexpr uint32_t kMembers = 48;
// In a patch of one point, or of points on a line, some rigid motions move no point. A small addition to the
// diagonal keeps the matrix factorizable; the value that such a motion gets has no effect.
constexpr double kRidge = 1e-9;

// a [w]x and [w]x^T a, where [w]x u = w x u; a row-major
void times_cross(const double *a, const double *w, double *out) {
  for (uint32_t r = 0; r < 3; ++r) store3(out + 3 * r, cross(load3(a + 3 * r), load3(w)));
}

void transpose(const double *a, double *out) {
  for (uint32_t r = 0; r < 3; ++r)
    for (uint32_t c = 0; c < 3; ++c) out[3 * r + c] = a[3 * c + r];
}

void add9(const double *a, double *to) {
  for (uint32_t k = 0; k < 9; ++k) to[k] += a[k];
}

}  // namespace

CoarseSpace::CoarseSpace(const Memory &memory, Tasks *tasks) : tasks_(tasks), solver_(memory, nullptr) {
  use_memory(memory, patch_, member_begin_, member_, ij_, first_);
  use_memory(memory, arm_, free_, blk_, r_, y_);
}

// Patches grow breadth first, each from a point next to the existing patches. A remainder that is too small
// joins a neighbor.
void CoarseSpace::form_patches(const BlockRows &rows) {
  constexpr uint32_t kNone = UINT32_MAX;
  const uint32_t members = std::max(kMembers, n_ / kPatches);
  patch_.assign(n_, kNone);
  patches_ = 0;
  std::vector<uint32_t> edge, queue;
  size_t tried = 0;
  for (uint32_t scan = 0;;) {
    while (tried < edge.size() && patch_[edge[tried]] != kNone) ++tried;
    while (scan < n_ && patch_[scan] != kNone) ++scan;
    if (scan == n_) break;
    queue.assign(1, tried < edge.size() ? edge[tried] : scan);
    patch_[queue[0]] = patches_;
    uint32_t beside = kNone;
    for (size_t k = 0; k < queue.size(); ++k)
      for (uint32_t e = rows.row[queue[k]]; e < rows.row[queue[k] + 1]; ++e) {
        const uint32_t j = rows.column[e];
        if (patch_[j] != kNone) {
          if (patch_[j] != patches_) beside = patch_[j];
        } else if (queue.size() < members) {
          patch_[j] = patches_;
          queue.push_back(j);
        } else {
          edge.push_back(j);
        }
      }
    if (beside != kNone && queue.size() < members / 3)
      for (const uint32_t i : queue) patch_[i] = beside;
    else ++patches_;
  }
  member_begin_.assign(size_t{patches_} + 1, 0);
  for (uint32_t i = 0; i < n_; ++i) ++member_begin_[patch_[i] + 1];
  for (uint32_t p = 0; p < patches_; ++p) member_begin_[p + 1] += member_begin_[p];
  member_.resize(n_);
  std::vector<uint32_t> at(member_begin_.begin(), member_begin_.end() - 1);
  for (uint32_t i = 0; i < n_; ++i) member_[at[patch_[i]]++] = i;
}

void CoarseSpace::analyse(const BlockPattern &pattern, const BlockRows &rows) {
  n_ = pattern.n;
  form_patches(rows);
  arm_.assign(3 * size_t{n_}, 0.0);
  free_.assign(3 * size_t{n_}, 1.0);
  std::vector<uint64_t> pairs;
  const auto key = [&](uint32_t b) {
    const uint32_t p = patch_[pattern.ij[2 * size_t{b}]], q = patch_[pattern.ij[2 * size_t{b} + 1]];
    return uint64_t{std::min(p, q)} << 32 | std::max(p, q);
  };
  for (uint32_t b = 0; b < pattern.nb; ++b) pairs.push_back(key(b));
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  std::vector<uint32_t> begin;
  ij_.clear();
  for (const uint64_t pair : pairs) {
    const uint32_t p = 2 * uint32_t(pair >> 32), q = 2 * uint32_t(pair);
    begin.push_back(uint32_t(ij_.size() / 2));
    ij_.insert(ij_.end(), {p, q, p, q + 1, p + 1, q + 1});
    if (p != q) ij_.insert(ij_.end(), {p + 1, q});
  }
  first_.resize(pattern.nb);
  for (uint32_t b = 0; b < pattern.nb; ++b)
    first_[b] = begin[size_t(std::lower_bound(pairs.begin(), pairs.end(), key(b)) - pairs.begin())];
  blk_.assign(9 * (ij_.size() / 2), 0.0);
  r_.assign(6 * size_t{patches_}, 0.0);
  y_ = r_;
  solver_.analyse({2 * patches_, uint32_t(ij_.size() / 2), ij_.data()});
}

// A held component has a row of the identity: no motion of its patch moves it.
void CoarseSpace::find_free(const BlockRows &rows) {
  for (uint32_t i = 0; i < n_; ++i)
    for (uint32_t r = 0; r < 3; ++r) {
      bool tied = false;
      for (uint32_t e = rows.row[i]; e < rows.row[i + 1] && !tied; ++e)
        for (uint32_t c = 0; c < 3; ++c)  // column after column
          tied = tied || (rows.value[9 * size_t{e} + 3 * c + r] != 0 && (rows.column[e] != i || c != r));
      free_[3 * size_t{i} + r] = tied ? 1.0 : 0.0;
    }
}

void CoarseSpace::find_arms(const double *points, uint32_t stride) {
  for (uint32_t p = 0; p < patches_; ++p) {
    const uint32_t begin = member_begin_[p], end = member_begin_[p + 1];
    Vec3 center;
    for (uint32_t k = begin; k < end; ++k) center += load3(points + size_t{stride} * member_[k]);
    center = 1.0 / (end - begin) * center;
    double largest = 0;
    for (uint32_t k = begin; k < end; ++k) {
      const Vec3 arm = load3(points + size_t{stride} * member_[k]) - center;
      store3(&arm_[3 * size_t{member_[k]}], arm);
      largest = std::max(largest, norm2(arm));
    }
    const double scale = largest > 0 ? 1 / std::sqrt(largest) : 0.0;
    for (uint32_t k = begin; k < end; ++k)
      for (uint32_t c = 0; c < 3; ++c) arm_[3 * size_t{member_[k]} + c] *= scale;
  }
}

// P_i = F_i [1, -[a]x] with the arm a and F the free components: a rotation w moves a point by
// w x a = -[a]x w.
void CoarseSpace::assemble(const BlockPattern &pattern, const double *blk) {
  std::fill(blk_.begin(), blk_.end(), 0.0);
  for (uint32_t b = 0; b < pattern.nb; ++b) {
    uint32_t i = pattern.ij[2 * size_t{b}], j = pattern.ij[2 * size_t{b} + 1];
    const bool own = i == j, swapped = patch_[i] > patch_[j];
    double a[9];
    if (swapped) transpose(blk + 9 * size_t{b}, a);
    else std::copy_n(blk + 9 * size_t{b}, 9, a);
    if (swapped) std::swap(i, j);
    for (uint32_t r = 0; r < 3; ++r)
      for (uint32_t c = 0; c < 3; ++c) a[3 * r + c] *= free_[3 * size_t{i} + r] * free_[3 * size_t{j} + c];
    const double *const left = &arm_[3 * size_t{i}], *const right = &arm_[3 * size_t{j}];
    // With S = -[a]x, a row of A S_j is (a_j x row); S_i^T A has the columns a_i x column.
    double tr[9], rt[9], rr[9], at[9], work[9];
    times_cross(a, right, work);  // row x a_j
    for (uint32_t k = 0; k < 9; ++k) tr[k] = -work[k];
    transpose(a, at);
    times_cross(at, left, work);
    for (uint32_t k = 0; k < 9; ++k) work[k] = -work[k];
    transpose(work, rt);
    times_cross(rt, right, rr);
    for (uint32_t k = 0; k < 9; ++k) rr[k] = -rr[k];
    double *const to = &blk_[9 * size_t{first_[b]}];  // (t,t) (t,r) (r,r), and (r,t) of two patches
    add9(a, to);
    add9(tr, to + 9);
    add9(rr, to + 18);
    if (patch_[i] != patch_[j]) {
      add9(rt, to + 27);
      continue;
    }
    if (own) continue;
    // the block (j, i) of the same patch
    transpose(a, work);
    add9(work, to);
    transpose(rt, work);
    add9(work, to + 9);
    transpose(rr, work);
    add9(work, to + 18);
  }
  for (size_t k = 0; k < ij_.size() / 2; ++k)
    if (ij_[2 * k] == ij_[2 * k + 1])
      for (uint32_t c = 0; c < 3; ++c) {
        double &d = blk_[9 * k + 4 * c];
        d = d > 0 ? d * (1 + kRidge) : 1.0;
      }
}

bool CoarseSpace::factor(const BlockPattern &pattern, const double *blk, const BlockRows &rows,
                         const double *points, uint32_t stride) {
  find_free(rows);
  find_arms(points, stride);
  assemble(pattern, blk);
  return solver_.factor(blk_.data());
}

double CoarseSpace::solve(const double *r) {
  const auto some = [&](uint32_t begin, uint32_t end) {
    for (uint32_t p = begin; p < end; ++p) {
      Vec3 force, moment;
      for (uint32_t k = member_begin_[p]; k < member_begin_[p + 1]; ++k) {
        const size_t i = 3 * size_t{member_[k]};
        const Vec3 f{free_[i] * r[i], free_[i + 1] * r[i + 1], free_[i + 2] * r[i + 2]};
        force += f;
        moment += cross(load3(&arm_[i]), f);
      }
      store3(&r_[6 * size_t{p}], force);
      store3(&r_[6 * size_t{p} + 3], moment);
    }
  };
  if (tasks_ && n_ > BlockMatrix::kAlone)
    tasks_->parallel_for(patches_, 4, [&](uint32_t begin, uint32_t end) { some(begin, end); });
  else some(0, patches_);
  SolveInfo info;
  solver_.solve(1, r_.data(), y_.data(), 0, info);
  double dot = 0;
  for (size_t k = 0; k < r_.size(); ++k) dot += r_[k] * y_[k];
  return dot;
}

void CoarseSpace::add(uint32_t begin, uint32_t end, double *z) const {
  for (uint32_t i = begin; i < end; ++i) {
    const double *const y = &y_[6 * size_t{patch_[i]}], *const f = &free_[3 * size_t{i}];
    const Vec3 u = load3(y) + cross(load3(y + 3), load3(&arm_[3 * size_t{i}]));
    for (uint32_t c = 0; c < 3; ++c) z[3 * size_t{i} + c] += f[c] * u[int(c)];
  }
}

}  // namespace dfm
