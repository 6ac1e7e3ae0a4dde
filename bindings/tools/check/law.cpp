#include "check/law.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "check/environment.h"
#include "plane.h"
#include "slots.h"

namespace cli::check {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::vector<dfm_slot> slots_with(const dfm_friction &law, const double *params) {
  const Kept kept("state");
  const auto own = slot_rows(law.state ? law.state(params) : nullptr);
  if (law.state && !own)
    broken("its function state names no slots for parameters that check accepts; return constant tables");
  return own ? *own : slot_rows(law.slots, law.nslot, law.slot_size);
}

}  // namespace

uint64_t Random::next() {
  s ^= s >> 12;
  s ^= s << 25;
  s ^= s >> 27;
  return s * 0x2545f4914f6cdd1dull;
}
double Random::uniform(double a, double b) {
  return a + (b - a) * (static_cast<double>(next() >> 11) * 0x1p-53);
}
double Random::logarithmic(double a, double b) { return a * std::exp(uniform(0, std::log(b / a))); }

std::vector<double> default_params(const dfm_type &type) {
  std::vector<double> out;
  for (uint32_t i = 0; i < type.nparam; ++i)
    out.insert(out.end(), std::clamp(type.params[i].width, 1u, 16u), type.params[i].def);
  return out;
}

std::string refusal(const dfm_friction &law, const std::vector<double> &params) {
  char why[256] = "";
  const Kept kept("check");
  if (!law.check || law.check(params.data(), why, sizeof why) == DFM_OK) return "";
  why[sizeof why - 1] = 0;
  return *why ? why : "(no reason)";
}

std::vector<double> lively_params(const Subject &subject) {
  const dfm_type &type = *subject.type;
  std::vector<double> out = default_params(type);
  size_t at = 0, kinetic = out.size(), level = out.size();
  double most = 0;
  for (uint32_t i = 0; i < type.nparam; at += std::clamp(type.params[i].width, 1u, 16u), ++i) {
    if (std::strcmp(type.params[i].key, "mu_C") == 0) kinetic = at;
    if (std::strcmp(type.params[i].key, "mu_S") == 0) {
      level = at;
      most = type.params[i].max;
    }
  }
  if (kinetic == out.size() || level == out.size() || out[level] > out[kinetic]) return out;
  std::vector<double> raised = out;
  raised[level] = std::min(1.5 * out[kinetic], most);
  return refusal(law_of(subject), raised).empty() ? raised : out;
}

Law::Law(const Subject &s, std::vector<double> values)
    : subject(s), ops(law_of(s)), params(std::move(values)), slots(slots_with(ops, params.data())) {
  for (const dfm_slot &slot : slots) nstate += slot.width;
  const Kept kept("prepare");
  if (ops.prepare && ops.prepare(&s.plugin->host().table(), params.data(), &data) != DFM_OK)
    broken("prepare refuses parameters that check accepts; refuse them in check");
}

Law::~Law() {
  const Kept kept("release");
  if (ops.prepare && ops.release) ops.release(&subject.plugin->host().table(), data);
}

Lanes::Lanes(const Law &l, uint32_t count, uint32_t gap)
    : law(l), n(count), stride(((count + 7) & ~7u) + ((gap + 7) & ~7u)) {
  const size_t columns = 7 + l.nstate + 10 + l.nstate;
  memory_.assign(columns * stride + stride / 8 + 16, 0.0);
  double *p = reinterpret_cast<double *>((reinterpret_cast<uintptr_t>(memory_.data()) + 63) & ~uintptr_t(63));
  const auto column = [&](size_t width) {
    double *at = p;
    p += width * stride;
    return at;
  };
  fn = column(1);
  vt = column(2);
  stop = column(2);
  area = column(1);
  dwell = column(1);
  state = column(l.nstate);
  out_ft = column(2);
  out_state = column(l.nstate);
  dv = column(4);
  dn = column(2);
  limit = column(1);
  stored = column(1);
  mode = reinterpret_cast<uint8_t *>(p);
  std::fill_n(area, stride, 1.0);
  if (!l.needs(DFM_NEED_FN)) std::fill_n(fn, stride, kNaN);
  if (!l.needs(DFM_NEED_VT)) std::fill_n(vt, 2 * stride, kNaN);
  if (!l.needs(DFM_NEED_FT_STOP)) std::fill_n(stop, 2 * stride, kNaN);
  in = {sizeof in,
        n,
        stride,
        0,
        0,
        l.params.data(),
        l.data,
        fn,
        vt,
        stop,
        l.needs(DFM_NEED_AREA) ? area : nullptr,
        l.needs(DFM_NEED_DWELL) ? dwell : nullptr,
        l.nstate ? state : nullptr};
  const bool derivatives = l.has(DFM_FRIC_JACOBIAN);
  out = {sizeof out,
         0,
         out_ft,
         l.nstate ? out_state : nullptr,
         derivatives ? dv : nullptr,
         derivatives ? dn : nullptr,
         limit,
         mode,
         stored};
}

dfm_status Lanes::evaluate(double dt) {
  in.dt = dt;
  const Kept kept("eval");
  const dfm_status status = law.ops.eval(&in, &out);
  law.subject.plugin->host().release_scratch();
  return status;
}

void Lanes::must(double dt) {
  if (const dfm_status status = evaluate(dt); status != DFM_OK)
    broken(
        "eval returns %s for finite slip and normal force at a step of %g s; return finite values for every "
        "finite input",
        dfm_status_name(status), dt);
}

std::string Lanes::inputs(uint32_t i) const {
  std::string said;
  if (law.needs(DFM_NEED_VT)) said += text(" at a slip of %.3g m/s", plane_length(vt[i], vt[stride + i]));
  if (law.needs(DFM_NEED_FN))
    said += text("%s a normal force of %.3g N", said.empty() ? " at" : " and", fn[i]);
  return said;
}

void Lanes::must_be_finite() const {
  for (uint32_t i = 0; i < n; ++i)
    if (!std::isfinite(ft(i)))
      broken("the force is not finite%s in a step of %g s; return a finite force for every finite slip",
             inputs(i).c_str(), in.dt);
}

void Lanes::commit() {
  std::copy_n(out_state, size_t(law.nstate) * stride, state);
  for (uint32_t i = 0; i < n; ++i) dwell[i] = mode[i] == 1 ? dwell[i] + in.dt : 0;
}

void Lanes::slip(uint32_t i, double x, double y) {
  const double w = std::sqrt(x * x + y * y);
  if (law.needs(DFM_NEED_VT)) {
    vt[i] = x;
    vt[stride + i] = y;
  }
  const double much = law.needs(DFM_NEED_FN) ? 1e6 * std::max(fn[i], 1e-6) : 1e6;
  stop_by(i, w > 0 ? -much * x / w : 0, w > 0 ? -much * y / w : 0);
}

void Lanes::stop_by(uint32_t i, double x, double y) {
  if (!law.needs(DFM_NEED_FT_STOP)) return;
  stop[i] = x;
  stop[stride + i] = y;
}

void Lanes::press(double force) {
  if (law.needs(DFM_NEED_FN)) std::fill_n(fn, n, force);
}

void Lanes::spoil_padding() {
  const auto columns = [&](double *at, uint32_t width) {
    for (uint32_t c = 0; c < width; ++c)
      std::fill(at + size_t(c) * stride + n, at + size_t(c + 1) * stride, kNaN);
  };
  columns(fn, 1);
  columns(vt, 2);
  columns(stop, 2);
  columns(area, 1);
  columns(dwell, 1);
  columns(state, law.nstate);
}

double Lanes::ft(uint32_t i) const { return plane_length(out_ft[i], out_ft[stride + i]); }

void Lanes::take(uint32_t i, const Lanes &from, uint32_t k) {
  const auto columns = [&](double *to, const double *at, uint32_t width) {
    for (uint32_t c = 0; c < width; ++c) to[size_t(c) * stride + i] = at[size_t(c) * from.stride + k];
  };
  columns(fn, from.fn, 1);
  columns(vt, from.vt, 2);
  columns(stop, from.stop, 2);
  columns(area, from.area, 1);
  columns(dwell, from.dwell, 1);
  columns(state, from.state, law.nstate);
}

bool Lanes::same(uint32_t i, const Lanes &other, uint32_t k) const {
  const auto equal = [&](const double *a, const double *b, uint32_t width) {
    for (uint32_t c = 0; a && c < width; ++c)
      if (std::memcmp(a + size_t(c) * stride + i, b + size_t(c) * other.stride + k, sizeof(double)) != 0)
        return false;
    return true;
  };
  return equal(out.ft, other.out_ft, 2) && equal(out.state, other.out_state, law.nstate) &&
         equal(out.limit, other.limit, 1) && equal(out.stored, other.stored, 1) &&
         (!out.mode || mode[i] == other.mode[k]) && equal(out.dft_dvt, other.dv, 4) &&
         equal(out.dft_dfn, other.dn, 2);
}

void Lanes::turn_state(uint32_t i, uint32_t k, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  double *row = state;
  for (const dfm_slot &slot : law.slots) {
    for (uint32_t a = 0; a < slot.width; ++a) row[a * size_t(stride) + i] = row[a * size_t(stride) + k];
    if (slot.kind == DFM_SLOT_TANGENT && slot.width == 2) {
      const double x = row[k], y = row[stride + k];
      row[i] = x * c - y * s;
      row[stride + i] = x * s + y * c;
    }
    row += slot.width * size_t(stride);
  }
}

std::vector<double> decades(double from, double to, int per_decade) {
  std::vector<double> out;
  const int count = static_cast<int>(std::lround(per_decade * std::log10(to / from)));
  for (int i = 0; i <= count; ++i) out.push_back(from * std::pow(10.0, static_cast<double>(i) / per_decade));
  return out;
}

namespace {

// Level and presliding stiffness at one normal force: a displacement is made in one step, then held for some,
// so that only what is elastic is left; the first decade of displacements that leaves a hundredth of the
// level gives the stiffness.
Scales measure(const Law &law, double fn) {
  Scales s;
  s.fn = fn;
  Lanes one(law, 1);
  if (law.needs(DFM_NEED_FN)) one.fn[0] = fn;
  one.slip(0, 0, 0);
  one.must(1e-3);
  s.level = one.limit[0];
  if (!std::isfinite(s.level) || s.level <= 0) {
    one.slip(0, 1, 0);
    for (int i = 0; i < 100; ++i) {
      one.must(1e-3);
      one.commit();
    }
    s.level = one.ft(0);
  }
  if (law.nstate == 0 || !(s.level > 0) || !std::isfinite(s.level)) return s;
  for (double x = 1e-18; x < 10; x *= 10) {
    std::fill_n(one.state, size_t(law.nstate) * one.stride, 0.0);
    one.slip(0, x / 1e-3, 0);
    one.must(1e-3);
    one.commit();
    one.slip(0, 0, 0);
    for (int i = 0; i < 5; ++i) {
      one.must(1e-3);
      one.commit();
    }
    const double held = one.ft(0);
    if (held < 0.01 * s.level) continue;
    // at the smallest displacement the level itself: rigid
    if (held < 0.9 * s.level || x > 1e-18) s.stiffness = held / x;
    break;
  }
  if (s.stiffness > 0) s.z = s.level / s.stiffness;
  return s;
}

}  // namespace

// The normal force is chosen for a presliding displacement near 10 micrometers, so that absolute bounds mean
// something for every stiffness.
Scales scales_of(const Law &law) {
  Scales s = measure(law, 1);
  if (s.z > 0) s = measure(law, std::clamp(1e-5 / s.z, 1e-3, 1e6));
  return s;
}

std::vector<double> steady_force(const Law &law, const Scales &scales, const std::vector<double> &speeds) {
  Lanes b(law, static_cast<uint32_t>(speeds.size()));
  for (uint32_t i = 0; i < b.n; ++i) {
    if (law.needs(DFM_NEED_FN)) b.fn[i] = scales.fn;
    b.slip(i, speeds[i], 0);
  }
  const double h = 1.0 / 240, slowest = std::ranges::min(speeds);
  const int least = law.nstate ? static_cast<int>(std::min(30000.0, 40 * scales.z / (slowest * h) + 50)) : 1;
  for (int i = 0; i < least; ++i) {
    b.must(h);
    b.commit();
  }
  std::vector<double> out;
  for (uint32_t i = 0; i < b.n; ++i) out.push_back(-b.out_ft[i]);
  return out;
}

Masses::Masses(const Law &law, const Scales &scales, uint32_t n)
    : lanes(law, n), mass(scales.mass()), level(scales.level), x(n, 0.0), v(n, 0.0), resist(n, 0.0) {
  if (law.needs(DFM_NEED_FN)) std::fill_n(lanes.fn, n, scales.fn);
}

// Until two values of r differ in sign, a step by the slope; then a step of the Illinois method.
void Masses::Root::take(double r, int round) {
  if (round == 0) {
    a = at;
    ra = r;
    at = a - r / slope;
  } else if (!bracket) {
    if ((r > 0) != (ra > 0)) {
      bracket = true;
      b = at;
      rb = r;
    } else {
      // a wider step: the friction stiffens what the mass alone would do
      slope *= 0.5;
      a = at;
      ra = r;
      at -= r / slope;
    }
  } else if ((r > 0) == (rb > 0)) {
    b = at;
    rb = r;
    ra = side == 1 ? 0.5 * ra : ra;
    side = 1;
  } else {
    a = at;
    ra = r;
    rb = side == 2 ? 0.5 * rb : rb;
    side = 2;
  }
  if (!bracket) return;
  double next = b - rb * (b - a) / (rb - ra);
  if (round % 8 == 7 || !std::isfinite(next)) next = 0.5 * (a + b);
  done = next == a || next == b || std::fabs(b - a) <= 4e-16 * std::max(std::fabs(a), std::fabs(b));
  at = next;
}

// The root of r(v) = m (v - v0)/h - f - ft(v), in all lanes at once; with FT_STOP the law gives it.
void Masses::step(const std::vector<double> &force, double h) {
  const uint32_t n = lanes.n;
  roots_.resize(n);
  const bool stops = lanes.law.needs(DFM_NEED_FT_STOP);
  for (uint32_t i = 0; i < n; ++i) {
    const double free = v[i] + h * force[i] / mass;
    roots_[i] = {0, 0, 0, 0, v[i], mass / h, false, false, false, 0};
    if (stops) {
      lanes.stop[i] = -mass * free / h;
      lanes.stop[lanes.stride + i] = 0;
    }
  }
  for (int round = 0; round < 200; ++round) {
    bool all = true;
    for (uint32_t i = 0; i < n; ++i)
      if (lanes.law.needs(DFM_NEED_VT)) {
        lanes.vt[i] = roots_[i].at;
        lanes.vt[lanes.stride + i] = 0;
      }
    lanes.must(h);
    for (uint32_t i = 0; i < n; ++i) {
      Root &q = roots_[i];
      if (q.done) continue;
      if (stops && round == 0 && lanes.mode[i] == 1) {
        q.done = q.held = true;
        continue;
      }
      const double r = mass * (q.at - v[i]) / h - force[i] - lanes.out_ft[i];
      if (!std::isfinite(r))
        broken("a mass of %g kg pushed with %g N meets a force of %g N at %g m/s; the force must stay finite",
               mass, force[i], lanes.out_ft[i], q.at);
      const double scale = std::fabs(force[i]) + std::fabs(lanes.out_ft[i]) + mass * std::fabs(v[i]) / h;
      if (std::fabs(r) <= 4e-16 * scale) {
        q.done = true;
        continue;
      }
      all = false;
      q.take(r, round);
    }
    if (all) break;
  }
  for (uint32_t i = 0; i < n; ++i) {
    v[i] = roots_[i].held ? 0.0 : roots_[i].at;
    x[i] += h * v[i];
    resist[i] = -lanes.out_ft[i];
  }
  lanes.commit();
}

}  // namespace cli::check
