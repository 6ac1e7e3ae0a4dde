#include "math/coarse_space.h"

#include <algorithm>
#include <vector>

#include "core/lists.h"
#include "math/ldlt_solver.h"
#include "math/pcg_solver.h"
#include "math/vec3.h"

namespace dfm {

namespace {

constexpr uint32_t kNone = UINT32_MAX, kIsolated = kNone - 1;
constexpr uint32_t kMembers = 48;    // points of a patch
constexpr uint32_t kFactored = 256;  // coarse points up to which their matrix is factored
constexpr double kReduction = 0.1;   // of the residual of a level that is not factored
// In a patch of one point, or of points on a line, some rigid motions move no point. A small addition to the
// diagonal keeps the matrix factorizable; the value that such a motion gets has no effect.
constexpr double kRidge = 1e-9;

}  // namespace

CoarseSpace::CoarseSpace(const Memory &memory, Tasks *tasks, bool motions)
    : memory_(memory), tasks_(tasks), motions_(motions) {
  use_memory(memory, patch_, member_begin_, member_, near_begin_, near_, ij_);
  use_memory(memory, center_, arm_, free_, blk_, r_, y_);
}

// Patches grow breadth first, each from a point next to the existing patches. A remainder that is too small
// joins a neighbor. The motions of a finer patch stay together. What is tied to nothing is in no patch,
// and its patch_ is the number of patches: D^-1 serves it. Each patch then has at least two points or finer
// patches, so that the patches of a level are at most half as many as those of the level before.
void CoarseSpace::form_patches(const BlockRows &rows) {
  const uint32_t motions = motions_ ? 2 : 1;
  patch_.assign(n_, kNone);
  patches_ = 0;
  std::vector<uint32_t> edge, queue;
  const auto take = [&](uint32_t i) {
    queue.push_back(i);
    for (uint32_t m = 0; m < motions; ++m) patch_[i + m] = patches_;
  };
  size_t tried = 0;
  for (uint32_t scan = 0;;) {
    while (tried < edge.size() && patch_[edge[tried]] != kNone) ++tried;
    while (scan < n_ && patch_[scan] != kNone) ++scan;
    if (scan == n_) break;
    queue.clear();
    take(tried < edge.size() ? edge[tried] : scan);
    uint32_t beside = kNone;
    for (size_t k = 0; k < queue.size(); ++k)
      for (uint32_t e = rows.row[queue[k]]; e < rows.row[queue[k] + 1]; ++e) {
        const uint32_t j = rows.column[e] / motions * motions;
        if (patch_[j] != kNone) {
          if (patch_[j] != patches_) beside = patch_[j];
        } else if (queue.size() < kMembers) {
          take(j);
        } else {
          edge.push_back(j);
        }
      }
    if (beside == kNone && queue.size() == 1) beside = kIsolated;
    if (beside != kNone && queue.size() < kMembers / 3)
      for (const uint32_t i : queue)
        for (uint32_t m = 0; m < motions; ++m) patch_[i + m] = beside;
    else ++patches_;
  }
  for (uint32_t &p : patch_) p = std::min(p, patches_);
  list_by(size_t{patches_} + 1, n_, [&](uint32_t i) { return patch_[i]; }, member_begin_, member_);
}

void CoarseSpace::analyse(const BlockRows &rows, uint32_t n) {
  n_ = n;
  form_patches(rows);
  center_.assign(6 * size_t{patches_}, 0.0);
  arm_.assign(3 * size_t{n_}, 0.0);
  free_.assign(3 * size_t{n_}, 1.0);
  near_begin_.assign(1, 0);
  near_.clear();
  ij_.clear();
  std::vector<uint32_t> found;
  for (uint32_t p = 0; p < patches_; ++p) {
    found.assign(1, p);
    for (uint32_t k = member_begin_[p]; k < member_begin_[p + 1]; ++k)
      for (uint32_t e = rows.row[member_[k]]; e < rows.row[member_[k] + 1]; ++e)
        if (const uint32_t q = patch_[rows.column[e]]; q > p) found.push_back(q);
    sort_unique(found);
    for (const uint32_t q : found) {
      near_.push_back(q);
      ij_.insert(ij_.end(), {2 * p, 2 * q, 2 * p, 2 * q + 1, 2 * p + 1, 2 * q + 1});
      if (p != q) ij_.insert(ij_.end(), {2 * p + 1, 2 * q});
    }
    near_begin_.push_back(uint32_t(near_.size()));
  }
  blk_.assign(9 * (ij_.size() / 2), 0.0);
  r_.assign(6 * size_t{patches_}, 0.0);
  y_.assign(6 * size_t{patches_} + 6, 0.0);  // 0 in no patch
  const bool direct = 2 * patches_ <= kFactored;
  if (!solver_ || solver_->direct() != direct) {
    if (direct) solver_ = std::make_unique<LdltSolver>(memory_);
    else solver_ = std::make_unique<PcgSolver>(memory_, tasks_, 0, true);
  }
  solver_->analyse({2 * patches_, uint32_t(ij_.size() / 2), ij_.data()});
}

// A held component has a row of the identity: no motion of its patch moves it.
void CoarseSpace::find_free(const BlockRows &rows) {
  each_on(tasks(), n_, BlockMatrix::kGrain, [&](size_t i) {
    for (uint32_t r = 0; r < 3; ++r) {
      bool tied = false;
      for (uint32_t e = rows.row[i]; e < rows.row[i + 1] && !tied; ++e)
        for (uint32_t c = 0; c < 3; ++c)  // column after column
          tied = tied || (rows.value[9 * size_t{e} + 3 * c + r] != 0 && (rows.column[e] != i || c != r));
      free_[3 * i + r] = tied ? 1.0 : 0.0;
    }
  });
}

void CoarseSpace::find_arms(const double *points, uint32_t stride) {
  each_on(tasks(), patches_, 1, [&](size_t p) {
    const uint32_t begin = member_begin_[p], end = member_begin_[p + 1];
    Vec3 center;
    for (uint32_t k = begin; k < end; ++k) center += load3(points + size_t{stride} * member_[k]);
    center = 1.0 / (end - begin) * center;
    store3(&center_[6 * p], center);
    store3(&center_[6 * p + 3], center);
    for (uint32_t k = begin; k < end; ++k) {
      const uint32_t i = member_[k];
      if (!rotation(i)) store3(&arm_[3 * size_t{i}], load3(points + size_t{stride} * i) - center);
    }
  });
}

// sum = F_i (A P)_i in the columns of one patch, F the free components. P_j = F_j [1, -[a]x], because a turn
// w moves a point with the arm a by w x a = -[a]x w; F_j [0, 1] where j is a rotation. Returns the next patch
// that the row has blocks with.
uint32_t CoarseSpace::multiply(const BlockRows &rows, uint32_t i, uint32_t patch, Vec3 (&sum)[6]) const {
  std::fill(sum, sum + 6, Vec3{});
  uint32_t next = kNone;
  for (uint32_t e = rows.row[i]; e < rows.row[i + 1]; ++e) {
    const uint32_t j = rows.column[e];
    if (patch_[j] > patch) next = std::min(next, patch_[j]);
    if (patch_[j] != patch) continue;
    const double *const v = rows.value + 9 * size_t{e}, *const f = &free_[3 * size_t{j}];
    const Vec3 x = f[0] * load3(v), y = f[1] * load3(v + 3), z = f[2] * load3(v + 6);
    Vec3 *const to = rotation(j) ? sum + 3 : sum;
    to[0] += x;
    to[1] += y;
    to[2] += z;
    if (rotation(j)) continue;
    const Vec3 a = load3(&arm_[3 * size_t{j}]);
    sum[3] += a.y * z - a.z * y;
    sum[4] += a.z * x - a.x * z;
    sum[5] += a.x * y - a.y * x;
  }
  const double *const f = &free_[3 * size_t{i}];
  for (Vec3 &s : sum) s = {f[0] * s.x, f[1] * s.y, f[2] * s.z};
  return next;
}

// The upper triangle of P^T A P, patch after patch.
void CoarseSpace::assemble(const BlockRows &rows) {
  const auto add = [](Vec3 column, double *to) {  // of a row-major block
    to[0] += column.x;
    to[3] += column.y;
    to[6] += column.z;
  };
  each_on(tasks(), patches_, 1, [&](size_t p) {
    const uint32_t begin = near_begin_[p], end = near_begin_[p + 1];
    const auto blocks = [&](uint32_t k) { return &blk_[9 * (4 * size_t{k} - p - (k > begin))]; };
    double *const own = blocks(begin);
    std::fill(own, blocks(end - 1) + (end - 1 > begin ? 36 : 27), 0.0);
    for (uint32_t m = member_begin_[p]; m < member_begin_[p + 1]; ++m) {
      const uint32_t i = member_[m];
      const Vec3 arm = load3(&arm_[3 * size_t{i}]);
      uint32_t k = begin;
      for (uint32_t q = uint32_t(p), next; q != kNone; q = next) {  // patches that row i has blocks with
        while (near_[k] != q) ++k;
        Vec3 sum[6];
        next = multiply(rows, i, q, sum);
        double *const to = blocks(k);  // (t,t) (t,r) (r,r), and (r,t) of two patches
        for (uint32_t c = 0; c < 6; ++c) {
          const Vec3 moment = rotation(i) ? sum[c] : cross(arm, sum[c]);
          if (!rotation(i)) add(sum[c], to + (c < 3 ? c : 6 + c));
          if (c >= 3) add(moment, to + 15 + c);
          else if (k > begin) add(moment, to + 27 + c);
        }
      }
    }
    for (uint32_t e = 0; e < 27; e += e == 8 ? 10 : 4)  // the diagonals of (t,t) and (r,r)
      own[e] = own[e] > 0 ? own[e] * (1 + kRidge) : 1.0;
  });
}

bool CoarseSpace::factor(const BlockRows &rows, const double *points, uint32_t stride) {
  if (patches_ == 0) return false;
  find_free(rows);
  find_arms(points, stride);
  assemble(rows);
  solver_->place(center_.data(), 3);
  return solver_->factor(blk_.data());
}

double CoarseSpace::solve(const double *r) {
  each_on(tasks(), patches_, 4, [&](size_t p) {
    Vec3 force, moment;
    for (uint32_t k = member_begin_[p]; k < member_begin_[p + 1]; ++k) {
      const size_t i = 3 * size_t{member_[k]};
      const Vec3 f{free_[i] * r[i], free_[i + 1] * r[i + 1], free_[i + 2] * r[i + 2]};
      moment += rotation(member_[k]) ? f : cross(load3(&arm_[i]), f);
      if (!rotation(member_[k])) force += f;
    }
    store3(&r_[6 * p], force);
    store3(&r_[6 * p + 3], moment);
  });
  std::fill(y_.begin(), y_.end(), 0.0);
  SolveInfo info;  // whatever it reached is a preconditioner
  solver_->solve(1, r_.data(), y_.data(), kReduction, info);
  double dot = 0;
  for (size_t k = 0; k < r_.size(); ++k) dot += r_[k] * y_[k];
  return dot;
}

double CoarseSpace::add(uint32_t begin, uint32_t end, const double *q, double *z) const {
  Vec3 dot;
  for (uint32_t i = begin; i < end; ++i) {
    const double *const y = &y_[6 * size_t{patch_[i]}], *const f = &free_[3 * size_t{i}];
    const Vec3 turn = load3(y + 3);
    const Vec3 u = rotation(i) ? turn : load3(y) + cross(turn, load3(&arm_[3 * size_t{i}]));
    double *const to = z + 3 * size_t{i};
    const Vec3 sum{to[0] + f[0] * u.x, to[1] + f[1] * u.y, to[2] + f[2] * u.z}, of = load3(q + 3 * size_t{i});
    store3(to, sum);
    dot += {sum.x * of.x, sum.y * of.y, sum.z * of.z};
  }
  return dot.x + dot.y + dot.z;
}

}  // namespace dfm
