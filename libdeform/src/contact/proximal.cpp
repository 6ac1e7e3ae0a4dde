#include "contact/proximal.h"

#include <algorithm>
#include <cmath>

namespace dfm {
namespace {

// Largest number of motions: a matrix of this size is factored in every iteration.
constexpr uint32_t kMostMotions = 300;
constexpr uint32_t kMostIterations = 16, kMostHalvings = 6;
// Tolerance for |F|, relative to |z|.
constexpr double kLeast = 1e-11;

// Sums have four partial sums at every vector width.
using Four = double __attribute__((vector_size(32)));
const Four *fours(const double *p) { return reinterpret_cast<const Four *>(p); }
Four *fours(double *p) { return reinterpret_cast<Four *>(p); }

double dot(const double *a, const double *b, uint32_t n) {
  Four sum{0, 0, 0, 0};
  for (uint32_t k = 0; k < n / 4; ++k) sum += fours(a)[k] * fours(b)[k];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}
void add(double *to, double s, const double *a, uint32_t n) {
  for (uint32_t k = 0; k < n / 4; ++k) fours(to)[k] += s * fours(a)[k];
}

// The limit of friction at a normal impulse, N s, and its derivative.
struct Disc { double radius, growth; };
Disc disc_of(const ContactState &s, uint32_t i, double h, double ln) {
  const uint32_t n = s.stride;
  const double fn = s.fn[i], share = fn > 0 ? s.limit[i] / fn : 0;
  if (s.form[i] != kSetValuedLaw) {
    if (s.mode[i] == 1 || share * ln > h * s.limit[i]) return {share * ln, share};
    return {h * s.limit[i], 0};
  }
  if (s.mode[i] != 2) return {share * ln, share};
  const double growth = std::sqrt(s.dft_dfn[i] * s.dft_dfn[i] + s.dft_dfn[n + i] * s.dft_dfn[n + i]);
  const double radius = h * s.limit[i] + growth * (ln - h * fn);
  return radius > 0 ? Disc{radius, growth} : Disc{0, 0};
}

}  // namespace

Proximal::Proximal(const Memory &m) {
  ContactRows::Motions &of = motions_;
  use_memory(m, of.g, of.columns, of.left, of.first_column, of.column_count, of.first_value);
  use_memory(m, parts_, root_, alone_, contact_, block_, from_, start_, z_, try_, f_, down_, u_, l_, slope_,
             matrix_);
}

uint32_t Proximal::root_of(uint32_t block) const {
  while (root_[block] != block) block = root_[block];
  return block;
}

uint32_t Proximal::find_parts(const ContactRows &rows, const RowsPart &of, std::span<const uint8_t> leave) {
  root_.resize(rows.blocks.size());
  for (const uint32_t b : of.blocks) root_[b] = b;
  alone_.assign(leave.begin(), leave.end());
  // blocks of a contact, in any order
  const auto each_block = [&](uint32_t i, auto &&f) {
    for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j) f(rows.block[rows.dof[j]]);
    if (!rows.rigid.empty() && rows.rigid[i] != kNone) f(rows.block[rows.rigid[i]]);
  };
  each_row(of.contacts, [&](uint32_t i) {
    uint32_t seen = kNone;
    bool points = false;
    each_block(i, [&](uint32_t b) {
      if (b == kNone) {
        points = true;
        return;
      }
      const uint32_t root = root_of(b), other = seen == kNone ? root : root_of(seen);
      root_[std::max(root, other)] = seen = std::min(root, other);
    });
    if (points && seen != kNone) alone_[seen] = 1;
  });
  // strides treat contacts only: parts with bonds are left to the sweeps
  each_row(of.bonds, [&](uint32_t i) {
    each_block(i, [&](uint32_t b) {
      if (b != kNone) alone_[b] = 1;
    });
  });
  for (const uint32_t b : of.blocks)
    if (alone_[b]) alone_[root_of(b)] = 1;
  parts_.clear();
  contact_.clear();
  block_.clear();
  const auto close = [&](uint32_t root) {
    parts_.push_back({root, static_cast<uint32_t>(contact_.size()), static_cast<uint32_t>(block_.size())});
  };
  for (const uint32_t root : of.blocks) {
    if (root_[root] != root || alone_[root]) continue;
    close(root);
    for (const uint32_t b : of.blocks)
      if (root_of(b) == root) block_.push_back(b);
    each_row(of.contacts, [&](uint32_t i) {
      uint32_t own = kNone;
      each_block(i, [&](uint32_t b) { own = b; });
      if (own != kNone && root_of(own) == root) contact_.push_back(i);
    });
  }
  close(kNone);
  return static_cast<uint32_t>(parts_.size() - 1);
}

std::span<const uint32_t> Proximal::contacts(uint32_t part) const {
  return {contact_.data() + parts_[part].contact, contact_.data() + parts_[part + 1].contact};
}

bool Proximal::take(const ContactRows &rows, uint32_t part) {
  contacts_ = contacts(part);
  blocks_ = {block_.data() + parts_[part].block, block_.data() + parts_[part + 1].block};
  n_ = static_cast<uint32_t>(contacts_.size());
  if (!rows.motions(contacts_, blocks_, kMostMotions, motions_)) return false;
  r_ = motions_.rank;
  width_ = (r_ + 3) & ~3u;
  for (Array<double> *a : {&z_, &try_, &f_, &down_}) a->assign(width_, 0.0);
  for (Array<double> *a : {&from_, &start_, &u_, &l_}) a->resize(size_t(3) * n_);
  slope_.resize(size_t(9) * n_);
  matrix_.resize(size_t(r_) * width_);
  return true;
}

void Proximal::put(ContactRows &rows, const double *impulse) const {
  for (const uint32_t i : contacts_) std::copy_n(impulse + size_t(3) * i, 3, &rows.impulse[size_t(3) * i]);
  rows.restore(contacts_, blocks_);
}

// The impulse of a contact at the velocity u_. Returns false if it is zero.
bool Proximal::answer(const ContactRows &rows, const ContactState &s, uint32_t k, double h, double rho,
                      Answer &out) const {
  const uint32_t i = contacts_[k];
  const double *const u = &u_[size_t(3) * k], *const l0 = &start_[size_t(3) * k];
  double *const l = out.l, *const d = out.slope;
  std::fill_n(l, 3, 0.0);
  std::fill_n(d, 9, 0.0);
  if (!(rows.wn[i] > 0)) return false;
  double rn = rho / rows.wn[i];
  const double *const yields = &rows.yields[size_t(2) * i];
  const double closing = u[0] + rows.rate[i], share = 1 / (1 + rn * yields[0]);
  double pressed = l0[0] - rn * (closing + yields[1]);
  if (const double gives = share * (l0[0] - rn * closing); gives >= pressed) {
    pressed = gives;
    rn *= share;
  }
  if (!(pressed > 0)) return false;
  l[0] = pressed;
  d[0] = -rn;
  if (!(rows.wt[i] > 0) || s.form[i] == kNoFriction) return true;
  if (s.form[i] == kSetValuedLaw) {
    const double rt = rho / rows.wt[i];
    for (int c = 1; c < 3; ++c) {
      l[c] = l0[c] - rt * u[c];
      d[4 * c] = -rt;
    }
  } else {
    const uint32_t n = s.stride;
    const auto [d11, d12, d21, d22] = dissipative_slope(s, i);
    const double v1 = u[1] - s.vt[i], v2 = u[2] - s.vt[n + i], dfn = pressed / h - s.fn[i];
    l[1] = h * (s.ft[i] + d11 * v1 + d12 * v2 + s.dft_dfn[i] * dfn);
    l[2] = h * (s.ft[n + i] + d21 * v1 + d22 * v2 + s.dft_dfn[n + i] * dfn);
    d[4] = h * d11;
    d[5] = h * d12;
    d[7] = h * d21;
    d[8] = h * d22;
    d[3] = -rn * s.dft_dfn[i];
    d[6] = -rn * s.dft_dfn[n + i];
  }
  const Disc disc = disc_of(s, i, h, pressed);
  const double size = std::sqrt(l[1] * l[1] + l[2] * l[2]);
  if (size <= disc.radius) return true;
  const double e1 = l[1] / size, e2 = l[2] / size, cut = disc.radius / size;
  for (int c = 0; c < 3; ++c) {  // the component along the edge of the disc, and its length
    const double a = d[3 + c], b = d[6 + c], across = cut * (e1 * b - e2 * a);
    d[3 + c] = -e2 * across;
    d[6 + c] = e1 * across;
  }
  d[3] -= e1 * disc.growth * rn;
  d[6] -= e2 * disc.growth * rn;
  l[1] = disc.radius * e1;
  l[2] = disc.radius * e2;
  return true;
}

// f = F(z); its norm.
double Proximal::residual(const ContactRows &rows, const ContactState &law, double h, double rho,
                          const double *z, double *f) {
  std::copy_n(z, width_, f);
  for (uint32_t i = 0; i < n_; ++i) {
    const size_t at = size_t(3) * i;
    const double *const g = &motions_.g[at * width_];
    for (size_t k = 0; k < 3; ++k) u_[at + k] = from_[at + k] + dot(g + k * width_, z, width_);
    Answer a;
    const bool carries = answer(rows, law, i, h, rho, a);
    std::copy_n(a.l, 3, &l_[at]);
    std::copy_n(a.slope, 9, &slope_[size_t(9) * i]);
    for (size_t k = 0; carries && k < 3; ++k) add(f, -a.l[k], g + k * width_, width_);
  }
  work_ += n_;
  return std::sqrt(dot(f, f, width_));
}

// down_ = -(I - G^T slope G)^-1 f_, by elimination with pivots of columns.
bool Proximal::newton() {
  std::fill(matrix_.begin(), matrix_.end(), 0.0);
  for (uint32_t k = 0; k < r_; ++k) matrix_[size_t(k) * width_ + k] = 1;
  uint64_t carry = 0;
  for (uint32_t i = 0; i < n_; ++i) {
    const double *const d = &slope_[size_t(9) * i], *const g = &motions_.g[size_t(3) * i * width_];
    if (d[0] == 0) continue;
    ++carry;
    const double *const g1 = g + width_, *const g2 = g1 + width_;
    for (uint32_t row = 0; row < r_; ++row) {
      double s[3];
      for (int k = 0; k < 3; ++k) s[k] = g[row] * d[k] + (g1[row] * d[3 + k] + g2[row] * d[6 + k]);
      double *const to = &matrix_[size_t(row) * width_];
      for (uint32_t k = 0; k < width_ / 4; ++k)
        fours(to)[k] -= s[0] * fours(g)[k] + (s[1] * fours(g1)[k] + s[2] * fours(g2)[k]);
    }
  }
  work_ += carry * r_ / 4 + uint64_t{r_} * r_ / 24;  // operations relative to those of the sweep of a contact
  for (uint32_t k = 0; k < r_; ++k) down_[k] = -f_[k];
  for (uint32_t k = 0; k < r_; ++k) {
    uint32_t best = k;
    for (uint32_t row = k + 1; row < r_; ++row)
      if (std::fabs(matrix_[size_t(row) * width_ + k]) > std::fabs(matrix_[size_t(best) * width_ + k]))
        best = row;
    double *const pivot = &matrix_[size_t(k) * width_];
    if (best != k) {
      std::swap_ranges(pivot, pivot + width_, &matrix_[size_t(best) * width_]);
      std::swap(down_[k], down_[best]);
    }
    if (!(std::fabs(pivot[k]) > 0)) return false;
    for (uint32_t row = k + 1; row < r_; ++row) {
      double *const to = &matrix_[size_t(row) * width_];
      const double share = to[k] / pivot[k];
      if (share == 0) continue;
      for (uint32_t q = k / 4; q < width_ / 4; ++q) fours(to)[q] -= share * fours(pivot)[q];
      down_[row] -= share * down_[k];
    }
  }
  for (uint32_t k = r_; k-- > 0;) {
    double sum = down_[k];
    for (uint32_t q = k + 1; q < r_; ++q) sum -= matrix_[size_t(k) * width_ + q] * down_[q];
    down_[k] = sum / matrix_[size_t(k) * width_ + k];
  }
  return true;
}

bool Proximal::stride(ContactRows &rows, const ContactState &law, double h, double rho) {
  work_ = 0;
  // velocities without impulses; z of the impulses that there are
  std::fill(z_.begin(), z_.end(), 0.0);
  for (uint32_t k = 0; k < n_; ++k) {
    std::copy_n(&rows.impulse[size_t(3) * contacts_[k]], 3, &start_[size_t(3) * k]);
    store3(&from_[size_t(3) * k], rows.velocity(contacts_[k], rows.y_free.data()));
  }
  for (uint32_t k = 0; k < 3 * n_; ++k)
    if (start_[k] != 0) add(z_.data(), start_[k], &motions_.g[size_t(k) * width_], width_);
  double left = residual(rows, law, h, rho, z_.data(), f_.data());
  for (uint32_t it = 0;; ++it) {
    if (left <= kLeast * std::sqrt(dot(z_.data(), z_.data(), width_))) break;
    if (it == kMostIterations || !(left < HUGE_VAL) || !newton()) return false;
    double fraction = 1, now = left;
    for (uint32_t cut = 0;; ++cut, fraction *= 0.5) {
      if (cut == kMostHalvings) return false;
      std::copy(z_.begin(), z_.end(), try_.begin());
      add(try_.data(), fraction, down_.data(), width_);
      now = residual(rows, law, h, rho, try_.data(), f_.data());
      if (now < (1 - 1e-3 * fraction) * left) break;
    }
    left = now;
    z_.swap(try_);
  }
  for (uint32_t k = 0; k < n_; ++k)
    std::copy_n(&l_[size_t(3) * k], 3, &rows.impulse[size_t(3) * contacts_[k]]);
  rows.restore(contacts_, blocks_);
  return true;
}

}  // namespace dfm
