#include "contact/tresca.h"

#include <algorithm>
#include <cmath>

namespace dfm {
namespace {

// rho over a contact's own 1 / response. A stride leaves about 1 / (1 + kRho s) of an error, s the share of
// its response in the contact's own (0.01 of the smoothest loads); larger ones take more Newton iterations.
constexpr double kRho = 30, kGrows = 3, kSlow = 0.8, kMostRho = 1e6;
constexpr uint32_t kStrides = 60, kNewton = 2;
constexpr double kFalls = 1e-3;  // of a residual by Newton's method, per stride
constexpr uint32_t kCuts = 24;
constexpr double kLeast = 0.1;  // share of a slope that may be left, with the other sign

double product(const Array<double> &a, const Array<double> &b) {
  double sum[3] = {};
  for (size_t k = 0; k < a.size(); k += 3)
    for (size_t c = 0; c < 3; ++c) sum[c] += a[k + c] * b[k + c];
  return sum[0] + sum[1] + sum[2];
}

}  // namespace

Tresca::Tresca(const Memory &m) {
  use_memory(m, contacts_, limit_, kept_, base_, l_, u_, answer_, r_, dl_, du_, curve_, stiffness_, given_,
             change_, begin_, surfel_, weight_);
}

bool Tresca::serves(const ContactRows &rows, const RowsPart &part, const ContactState &law) {
  if (part.nbond || part.blocks.size() != 1 || rows.blocks[part.blocks[0]].group != kNone) return false;
  bool all = true;
  each_row(part.contacts, [&](uint32_t i) {
    all = all && law.form[i] != kSmoothLaw && rows.yields[2 * size_t(i)] == 0 &&
          (rows.rigid.empty() || rows.rigid[i] == kNone);
    for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j)
      all = all && rows.block[rows.dof[j]] == part.blocks[0];
  });
  return all;
}

Backing Tresca::backing() const {
  return {static_cast<uint32_t>(contacts_.size()), begin_.data(), surfel_.data(), weight_.data(),
          stiffness_.data()};
}

void Tresca::put(ContactRows &rows, const RowsPart &part, const double *l) {
  for (const Contact &c : contacts_) {
    std::copy_n(l, 3, &rows.impulse[size_t(3) * c.row]);
    l += 3;
  }
  rows.restore(part);
  ++products_;
}

void Tresca::velocities(const ContactRows &rows, double *u) const {
  for (const Contact &c : contacts_) {
    store3(u, rows.velocity(c.row) + Vec3{rows.rate[c.row], 0, 0});
    u += 3;
  }
}

void Tresca::renew_limits(const ContactState &law, double h) {
  for (size_t k = 0; k < contacts_.size(); ++k) {
    const uint32_t i = contacts_[k].row, n = law.stride;
    const double ln = base_[3 * k], fn = law.fn[i];
    double radius = 0;
    if (law.form[i] != kNoFriction && ln > 0 && fn > 0) {
      radius = law.limit[i] / fn * ln;
      if (law.mode[i] == 2) {
        const double a = law.dft_dfn[i], b = law.dft_dfn[n + i];
        radius = std::max(0.0, h * law.limit[i] + std::sqrt(a * a + b * b) * (ln - h * fn));
      }
    }
    limit_[k] = contacts_[k].rt > 0 ? radius : 0;
  }
}

// answer_: P at u_ + ahead du_.
void Tresca::project(double ahead) {
  for (size_t k = 0; k < contacts_.size(); ++k) {
    Contact &c = contacts_[k];
    double *const to = &answer_[3 * k];
    double u[3];
    for (size_t d = 0; d < 3; ++d) u[d] = u_[3 * k + d] + ahead * du_[3 * k + d];
    to[0] = std::max(0.0, base_[3 * k] - c.rn * u[0]);
    c.holds = to[0] > 0;
    c.slides = false;
    to[1] = to[2] = 0;
    if (!(limit_[k] > 0)) continue;
    const double a = base_[3 * k + 1] - c.rt * u[1], b = base_[3 * k + 2] - c.rt * u[2];
    const double size = std::sqrt(a * a + b * b);
    c.slides = size > limit_[k];
    const double share = c.slides ? limit_[k] / size : 1;
    to[1] = share * a;
    to[2] = share * b;
  }
}

// K = -dP/du at u_, where project(0) has been.
void Tresca::curve() {
  for (size_t k = 0; k < contacts_.size(); ++k) {
    const Contact &c = contacts_[k];
    double *const to = &curve_[9 * k];
    std::fill_n(to, 9, 0.0);
    if (c.holds) to[0] = c.rn;
    if (!(limit_[k] > 0)) continue;
    if (!c.slides) {
      to[4] = to[8] = c.rt;
      continue;
    }
    const double a = base_[3 * k + 1] - c.rt * u_[3 * k + 1], b = base_[3 * k + 2] - c.rt * u_[3 * k + 2];
    const double square = a * a + b * b, across = c.rt * limit_[k] / (square * std::sqrt(square));
    to[4] = across * b * b;
    to[8] = across * a * a;
    to[5] = to[7] = -across * a * b;
  }
}

// One iteration for l = P: r = P - l, du = (A_J + K)^-1 r, dl = r - K du. l_ and u_ belong together.
bool Tresca::newton(const ContactRows &rows, BackedResponse &body) {
  curve();
  for (size_t k = 0; k < contacts_.size(); ++k) {
    const double *const f = &rows.frame[size_t(9) * contacts_[k].row], *const own = &curve_[9 * k];
    double half[9];
    for (size_t r = 0; r < 3; ++r)
      for (size_t c = 0; c < 3; ++c)
        half[3 * r + c] = own[3 * r] * f[c] + own[3 * r + 1] * f[3 + c] + own[3 * r + 2] * f[6 + c];
    for (size_t r = 0; r < 3; ++r)
      for (size_t c = 0; c < 3; ++c)
        stiffness_[9 * k + 3 * r + c] = f[r] * half[c] + f[3 + r] * half[3 + c] + f[6 + r] * half[6 + c];
    store3(&given_[3 * k],
           r_[3 * k] * load3(f) + r_[3 * k + 1] * load3(f + 3) + r_[3 * k + 2] * load3(f + 6));
  }
  if (!body.factor(backing())) return false;
  if (!body.solve(backing(), given_.data(), change_.data())) return false;
  for (size_t k = 0; k < contacts_.size(); ++k) {
    const double *const f = &rows.frame[size_t(9) * contacts_[k].row], *const own = &curve_[9 * k];
    const Vec3 moved = load3(&change_[3 * k]);
    double *const d = &du_[3 * k];
    store3(d, {dot(load3(f), moved), dot(load3(f + 3), moved), dot(load3(f + 6), moved)});
    for (size_t r = 0; r < 3; ++r)
      dl_[3 * k + r] = r_[3 * k + r] - (own[3 * r] * d[0] + own[3 * r + 1] * d[1] + own[3 * r + 2] * d[2]);
  }
  const double slope = product(r_, du_), flat = product(dl_, du_);
  if (!(slope > 0) || !(slope < HUGE_VAL)) return false;
  // the slope at t: (l + t dl - P).du, which never falls
  double t = 1, low = 0, falls = slope, high = 0, rises = 0;
  for (uint32_t cut = 0;; ++cut) {
    project(t);
    const double now = product(l_, du_) + t * flat - product(answer_, du_);
    if (!(now < HUGE_VAL)) return false;
    if (now <= kLeast * slope && (high == 0 || -now <= kLeast * slope)) break;
    if (cut == kCuts) {
      if (!(low > 0)) return false;
      t = low;
      break;
    }
    (now > 0 ? high : low) = t;
    (now > 0 ? rises : falls) = std::fabs(now);
    t = cut % 2 ? 0.5 * (low + high) : low + (high - low) * (falls / (falls + rises));
  }
  for (size_t k = 0; k < l_.size(); ++k) {
    l_[k] += t * dl_[k];
    u_[k] += t * du_[k];
  }
  return true;
}

bool Tresca::solve(ContactRows &rows, const RowsPart &part, const ContactState &law, double h,
                   const Tolerance &tolerance, double most, double enough, BackedResponse &body) {
  products_ = 0;
  contacts_.clear();
  kept_.clear();
  begin_.assign(1, 0);
  surfel_.clear();
  weight_.clear();
  each_row(part.contacts, [&](uint32_t i) {
    if (!(rows.wn[i] > 0)) return;
    contacts_.push_back(
        {kRho / rows.wn[i], rows.wt[i] > 0 ? kRho / rows.wt[i] : 0, rows.wn[i], rows.wt[i], i, false, false});
    for (size_t c = 0; c < 3; ++c) kept_.push_back(rows.impulse[size_t(3) * i + c]);
    for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j) {
      surfel_.push_back(rows.point[rows.dof[j]]);
      weight_.push_back(rows.weight[j]);
    }
    begin_.push_back(static_cast<uint32_t>(surfel_.size()));
  });
  const size_t n = contacts_.size();
  limit_.assign(n, 0.0);
  for (Array<double> *a : {&answer_, &r_, &dl_, &du_, &u_, &given_, &change_}) a->assign(3 * n, 0.0);
  curve_.resize(9 * n);
  stiffness_.resize(9 * n);
  base_.assign(kept_.begin(), kept_.end());
  l_.assign(kept_.begin(), kept_.end());
  velocities(rows, u_.data());
  double before = HUGE_VAL, best = HUGE_VAL;
  for (uint32_t stride = 0, fell = 0; stride < kStrides; ++stride) {
    renew_limits(law, h);
    double first = 0;
    for (uint32_t k = 0;; ++k) {
      project(0);
      double size = 0;
      for (size_t j = 0; j < 3 * n; ++j) {
        r_[j] = answer_[j] - l_[j];
        size += (j % 3 ? contacts_[j / 3].wt : contacts_[j / 3].wn) * (r_[j] * r_[j]);
      }
      if (k == 0) first = size;
      if (k == kNewton || !(size > kFalls * kFalls * first)) break;
      if (!newton(rows, body)) {
        put(rows, part, kept_.data());
        return best <= enough;
      }
    }
    // what is left of the contacts' conditions, in velocities: (l - P) / rho
    double left = 0;
    for (size_t k = 0; k < n; ++k) {
      const Contact &c = contacts_[k];
      const double *const a = &answer_[3 * k], *const b = &base_[3 * k];
      left = std::max(left, std::fabs(a[0] - b[0]) / c.rn / tolerance.most_normal);
      if (!(limit_[k] > 0)) continue;
      const double slip = std::sqrt(u_[3 * k + 1] * u_[3 * k + 1] + u_[3 * k + 2] * u_[3 * k + 2]);
      const double t = std::sqrt((a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
      if (!c.slides) left = std::max(left, t / c.rt / std::max(tolerance.tangent[c.row], 1e-3 * slip));
    }
    base_.assign(answer_.begin(), answer_.end());
    fell = left < before ? fell + 1 : 0;
    const bool slow = fell >= 3 && left > kSlow * before;
    before = left;
    if (slow && contacts_[0].rn * contacts_[0].wn < kMostRho)
      for (Contact &c : contacts_) {
        c.rn *= kGrows;
        c.rt *= kGrows;
      }
    if (left > most) continue;
    put(rows, part, base_.data());
    const double due = inner_residual(rows, part, law, h, tolerance).due;
    if (due < best) {
      best = due;
      kept_.assign(base_.begin(), base_.end());
    }
    if (due <= most) return true;
  }
  put(rows, part, kept_.data());
  return best <= enough;
}

}  // namespace dfm
