#include "law.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "json_text.h"
#include "messages.h"

namespace cli {
namespace {

// Keys that the cases of the reference set carry for some law; a law that does not use one of them
// does not get it.
const std::vector<std::string> kCaseKeys = {
    "F_C",    "F_S", "mu", "mu_C", "mu_S",  "v_s", "delta", "sigma", "sigma0", "sigma1", "sigma1_form",
    "sigma2", "v_d", "dv", "z_ba", "kappa", "i",   "alpha", "k",     "nu",     "C",      "multiplier"};

std::string short_name(const std::string &law) {
  return law == "ep" ? "elastoplastic" : law == "coulomb_plain" ? "coulomb" : law;
}

bool shipped(const dfm_type &type) { return std::strncmp(type.id, "org.deform.", 11) == 0; }

const dfm_param *row_of(const dfm_type &type, const std::string &key) {
  for (const dfm_param &row : params_of(type))
    if (key == row.key) return &row;
  return nullptr;
}

// Collects what goes to dfm_law_pack, and which keys of the case it came from.
class Filler {
 public:
  Filler(const FrictionCase &rig, const dfm_type &type, double fn) : rig_(rig), type_(type), fn_(fn) {}

  void fill() {
    for (const dfm_param &row : params_of(type_))
      if (const CaseParam *p = rig_.param(row.key)) take(row, *p);
    level("mu_C", {"F_C"});
    level("mu_S", {"F_S", "F_C"});
    if (!row_of(type_, "mu_C")) level("mu", {"F_C"});
    if (const CaseParam *p = rig_.param("sigma"); p && row_of(type_, "sigma0") && !given("sigma0"))
      take(*row_of(type_, "sigma0"), *p);
    kappa();
    sigma1_form();
    // A case that states no curve means that the level falls at once. What a law of somebody else means by
    // its v_s is not known.
    if (const dfm_param *row = row_of(type_, "v_s"); row && shipped(type_) && !given("v_s"))
      put("v_s", {row->min});
    for (const char *key : {"mu_C", "sigma0"})
      if (shipped(type_) && row_of(type_, key) && !given(key) && !given("mu"))
        throw Failure(kBadInput,
                      rig_.file + ": /params gives the law " + type_.id + " no " +
                          (key == std::string("mu_C") ? "friction level, expected F_C, mu_C or mu"
                                                      : "bristle stiffness, expected sigma0 or sigma"));
  }

  const std::vector<std::string> &used() const { return used_; }
  std::vector<dfm_param_value> values() const {
    std::vector<dfm_param_value> out;
    for (const auto &[key, value] : filled_)
      out.push_back({key.c_str(), value.data(), uint32_t(value.size())});
    return out;
  }

 private:
  bool given(const std::string &key) const {
    return std::ranges::any_of(filled_, [&](const auto &f) { return f.first == key; });
  }
  void put(const std::string &key, std::vector<double> value) { filled_.emplace_back(key, std::move(value)); }

  void take(const dfm_param &row, const CaseParam &p) {
    used_.push_back(p.key);
    if (p.word.empty()) return put(row.key, p.value);
    std::vector<std::string> names;
    for (const char *const *n = row.names; n && *n; ++n) names.push_back(*n);
    const auto found = std::ranges::find(names, p.word);
    if (found == names.end()) {
      std::string all;
      for (const std::string &n : names) all += (all.empty() ? "" : ", ") + n;
      throw Failure(kBadInput, rig_.file + ": /params/" + p.key + " is \"" + p.word + "\", expected " +
                                   (all.empty() ? "a number" : "one of " + all) + " for " + type_.id);
    }
    put(row.key, {double(found - names.begin())});
  }

  // A friction level in N becomes a coefficient: mu = F/F_n.
  void level(const char *key, const std::vector<std::string> &forces) {
    if (!row_of(type_, key) || given(key)) return;
    const CaseParam *p = rig_.param("mu");
    double scale = 1;
    if (!p && std::strcmp(key, "mu_S") == 0) p = rig_.param("F_S") ? nullptr : rig_.param("mu_C");
    for (const std::string &force : forces)
      if (!p && (p = rig_.param(force))) scale = fn_;
    if (!p) return;
    if (p->value.size() != 1)
      throw Failure(kBadInput, rig_.file + ": /params/" + p->key + " is not a number");
    used_.push_back(p->key);
    put(key, {p->value[0] / scale});
  }

  void kappa() {
    const CaseParam *z_ba = rig_.param("z_ba");
    if (!row_of(type_, "kappa") || given("kappa") || !z_ba) return;
    const double kinetic = rig_.param("mu_C") ? rig_.number_of("mu_C", 0) * fn_ : rig_.number_of("F_C", 0);
    const double stiffness = rig_.number_of("sigma0", rig_.number_of("sigma", 0));
    if (!(kinetic > 0) || z_ba->value.size() != 1)
      throw Failure(
          kBadInput,
          rig_.file + ": /params/z_ba needs a number and a level F_C above 0, for kappa = sigma0 z_ba / F_C");
    used_.push_back("z_ba");
    put("kappa", {stiffness * z_ba->value[0] / kinetic});
  }

  // The cases' sigma1 is constant, or falls with the speed where v_d is given.
  void sigma1_form() {
    const dfm_param *row = row_of(type_, "sigma1_form");
    if (!row || given("sigma1_form")) return;
    const std::string wanted = rig_.param("v_d") ? "falling" : "constant";
    for (uint32_t k = 0; row->names && row->names[k]; ++k)
      if (wanted == row->names[k]) put("sigma1_form", {double(k)});
  }

  const FrictionCase &rig_;
  const dfm_type &type_;
  double fn_;
  std::vector<std::pair<std::string, std::vector<double>>> filled_;
  std::vector<std::string> used_;
};

}  // namespace

RigLaw::RigLaw(const Globals &globals, const FrictionCase &rig, const std::string &law)
    : context_(make_context(globals), dfm_context_destroy) {
  const std::string name = short_name(law.empty() ? rig.law : law);
  if (name.empty() || name.find(',') != std::string::npos)
    throw Failure(kBadInput, rig.file + ": /law " +
                                 (name.empty() ? "is missing" : "lists several laws (" + name + ")") +
                                 "; choose one with --law");
  if (dfm_law_open(context_.get(), name.c_str(), &law_) < 0)
    throw Failure(kBadInput, (law.empty() ? rig.file + ": /law: " : "--law: ") + dfm_last_error());
  need(dfm_law_type(law_, &type_));
  if (rig.drive == Drive::loaded) fn_ = rig.input.at("F0");
  else if (rig.normal_force > 0) fn_ = rig.normal_force;
  else if (rig.mass > 0 && rig.gravity > 0) fn_ = rig.mass * rig.gravity;
  if (!(fn_ > 0))
    throw Failure(kBadInput,
                  rig.file + ": /input/F0 is " + number(fn_) + " N, expected a normal force above 0");
  fill_params(rig);
  uint32_t nstate = 0;
  const auto own = slot_rows(ops().state ? ops().state(params_.data()) : nullptr);
  slots_ = own ? *own : slot_rows(ops().slots, ops().nslot, ops().slot_size);
  for (const dfm_slot &slot : slots_) nstate += slot.width;
  state_.resize(nstate);
  trial_.resize(nstate);
  reset(rig);
}

void RigLaw::fill_params(const FrictionCase &rig) {
  Filler filler(rig, *type_, fn_);
  filler.fill();
  const std::vector<dfm_param_value> values = filler.values();
  const dfm_params packed = {sizeof packed, uint32_t(values.size()), values.data()};
  uint32_t n = 0;
  if (dfm_law_pack(law_, &packed, 0, nullptr, &n) < 0)
    throw Failure(kBadInput, rig.file + ": /params: " + dfm_last_error());
  params_.resize(n);
  if (n) need(dfm_law_pack(law_, &packed, n, params_.data(), &n));
  warn_of(rig, filler.used());
}

void RigLaw::warn_of(const FrictionCase &rig, const std::vector<std::string> &used) const {
  std::vector<std::string> names = kCaseKeys;
  for (const dfm_param &row : params_of(*type_)) names.push_back(row.key);
  std::string lacks;
  for (const CaseParam &p : rig.params) {
    if (std::ranges::find(used, p.key) != used.end()) continue;
    const bool known = std::ranges::find(kCaseKeys, p.key) != kCaseKeys.end();
    if (known && shipped(*type_)) continue;
    lacks += (lacks.empty() ? "" : ", ") + p.key;
    const std::string near = known ? "" : nearest(p.key, names);
    if (!near.empty()) lacks += " (did you mean \"" + near + "\"?)";
  }
  if (!lacks.empty())
    warn(rig.file + ": the law " + type_->id +
         " has no parameter for these keys of /params, they are left out: " + lacks);
}

double RigLaw::param(const std::string &key, double otherwise, uint32_t at) const {
  size_t offset = 0;
  for (const dfm_param &row : params_of(*type_)) {
    if (key == row.key && at < row.width) return params_[offset + at];
    offset += row.width;
  }
  return otherwise;
}

int RigLaw::tangent(uint32_t k) const {
  int at = 0;
  for (const dfm_slot &slot : slots_) {
    if (slot.kind == DFM_SLOT_TANGENT) {
      if (2 * k < slot.width) return at + int(2 * k);
      k -= slot.width / 2;
    }
    at += int(slot.width);
  }
  return -1;
}

void RigLaw::reset(const FrictionCase &rig) {
  for (Column &c : state_) c = Column();
  const int z = tangent(0);
  for (int axis = 0; z >= 0 && axis < 2; ++axis) state_[size_t(z + axis)].lane[0] = rig.z0[axis];
  trial_ = state_;
}

bool RigLaw::differs(const std::vector<Column> &other) const {
  size_t at = 0;
  for (size_t i = 0; i < slots_.size(); at += slots_[i].width, ++i)
    for (size_t k = at; k < at + slots_[i].width; ++k) {
      const double a = state_[k].lane[0], b = other[k].lane[0];
      if (slots_[i].kind != DFM_SLOT_TANGENT && a != b && a == std::floor(a) && b == std::floor(b))
        return true;
    }
  return false;
}

void RigLaw::extrapolate(const std::vector<Column> &whole, double share) {
  size_t at = 0;
  for (size_t i = 0; i < slots_.size(); at += slots_[i].width, ++i) {
    if (slots_[i].kind != DFM_SLOT_TANGENT) continue;
    for (size_t k = at; k < at + slots_[i].width; ++k)
      state_[k].lane[0] += share * (state_[k].lane[0] - whole[k].lane[0]);
  }
}

Resistance RigLaw::eval(const Slip &slip, bool derivative) {
  Column fn, vt[2], stop[2], area, dwell, ft[2], dvt[4], limit, stored;
  alignas(64) uint8_t mode[8] = {};
  for (int i = 0; i < 8; ++i) {
    fn.lane[i] = slip.fn;
    area.lane[i] = 1;
    dwell.lane[i] = slip.dwell;
    vt[0].lane[i] = slip.vx;
    vt[1].lane[i] = slip.vy;
    stop[0].lane[i] = slip.stop_x;
    stop[1].lane[i] = slip.stop_y;
  }
  const bool slope = derivative && (ops().flags & DFM_FRIC_JACOBIAN);
  dfm_friction_in in = {};
  in.size = sizeof in;
  in.n = 1;
  in.stride = 8;
  in.dt = slip.dt;
  in.params = params_.data();
  in.fn = fn.lane;
  in.vt = vt[0].lane;
  in.ft_stop = stop[0].lane;
  in.area = area.lane;
  in.dwell = dwell.lane;
  in.state = state_.empty() ? nullptr : state_[0].lane;
  dfm_friction_out out = {};
  out.size = sizeof out;
  out.ft = ft[0].lane;
  out.state = trial_.empty() ? nullptr : trial_[0].lane;
  out.dft_dvt = slope ? dvt[0].lane : nullptr;
  out.limit = limit.lane;
  out.mode = mode;
  out.stored = stored.lane;
  ++evaluations_;
  const dfm_status status = dfm_law_eval(law_, &in, &out);
  if (status < 0) throw Failure(kStopped, dfm_last_error());
  if (status != DFM_OK)
    throw Failure(kStopped, "the law " + std::string(type_->id) + " gave no usable answer at fn " +
                                number(slip.fn) + " N, v " + number(slip.vx) + " m/s");
  Resistance r;
  r.fx = -ft[0].lane[0];
  r.fy = -ft[1].lane[0];
  r.limit = limit.lane[0];
  r.stored = stored.lane[0];
  r.mode = mode[0];
  r.stopped = jumps_at_rest() && r.mode == 1 && ft[0].lane[0] == slip.stop_x && ft[1].lane[0] == slip.stop_y;
  if (slope) r.slope = -dvt[0].lane[0];
  return r;
}

// ---- the implicit step ------------------------------------------------------------------------------------
//
//   R(u) = m_h u - drive + f(u) = 0
//
// From the old speed v the search walks against the sign of R, first by the step R/m_h that suffices
// where f rises with u, then by twice that, until R changes sign. Newton's method inside that bracket,
// bisection where a step leaves it. Between rest and the old speed, and wherever the slope of R was seen
// below zero (g falls faster than m_h, doc/laws/formulas.md (2)), the bracket is first cut up and its
// first change of sign taken.
namespace {

class StepSolver {
 public:
  StepSolver(RigLaw &law, const Slip &slip, double m_h, double drive)
      : law_(law), slip_(slip), m_h_(m_h), drive_(drive) {
    slip_.stop_x = -drive;
    slip_.stop_y = 0;
  }

  StepResult solve(double v) {
    StepResult r = search(v);
    r.falls = falls_ || !(law_.ops().flags & DFM_FRIC_JACOBIAN);
    r.limit = limit_;
    return r;
  }

 private:
  struct Point {
    double u, r, slope;
    bool stopped;
  };

  StepResult search(double v) {
    Point a = at(v);
    if (a.stopped) return rest();
    if (a.r == 0) return finish(a);
    double step = -a.r / m_h_;
    Point c = at(a.u + step);
    for (int k = 0; k < 2000 && !c.stopped && a.r * c.r > 0; ++k) {
      step *= 2;
      a = c;
      c = at(a.u + step);
      if (!std::isfinite(c.u) || std::fabs(c.u) > 1e150)
        throw Failure(
            kStopped,
            "friction does not balance the force at any speed, so the mass accelerates without limit");
    }
    if (c.stopped && c.u != 0) c = at(0);  // its solution is rest, wherever it was evaluated
    if (a.u * c.u <= 0 && a.u != 0) cut_toward_rest(a, c);
    else if (falls_) cut_evenly(a, c);
    return newton(a, c);
  }

  Point at(double u) {
    slip_.vx = u;
    const Resistance f = law_.eval(slip_, true);
    f_ = f.fx;
    limit_ = f.limit;
    Point p = {u, m_h_ * u - drive_ + f.fx, 0, f.stopped};
    if (f.stopped) p.r = m_h_ * u;  // exactly: the force is the drive
    p.slope = (law_.ops().flags & DFM_FRIC_JACOBIAN) ? m_h_ + f.slope : 0;
    if (p.slope < 0) falls_ = true;
    return last_ = p;
  }

  StepResult finish(const Point &p) {
    if (last_.u != p.u) at(p.u);  // the trial state is that of the solution
    return {p.u, f_, false};
  }

  // A law that stops what slides but does not hold what rests is broken; the force that holds it is taken,
  // and the step counted as a jump.
  StepResult rest() {
    const Point p = last_.u == 0 ? last_ : at(0);
    return {0, drive_, !p.stopped};
  }

  // Keeps the first change of sign from a on, over points that crowd toward rest where the Stribeck curve is.
  void cut_toward_rest(Point &a, Point &c) {
    for (double u = 0.5 * a.u, least = std::ldexp(a.u, -16); std::fabs(u) > std::fabs(least); u *= 0.5)
      if (take(a, c, u)) return;
    take(a, c, 0);
  }
  void cut_evenly(Point &a, Point &c) {
    const double from = a.u, to = c.u;
    for (int k = 1; k < 32; ++k)
      if (take(a, c, from + (to - from) * k / 32)) return;
  }
  bool take(Point &a, Point &c, double u) {
    const Point p = at(u);
    const bool crossed = p.r * a.r <= 0;
    (crossed ? c : a) = p;
    return crossed;
  }

  StepResult newton(Point a, Point c) {
    for (int k = 0; k < 200; ++k) {
      if (c.r == 0) return c.stopped ? rest() : finish(c);
      if (a.r == 0) return a.stopped ? rest() : finish(a);
      const Point &best = std::fabs(a.r) < std::fabs(c.r) ? a : c;
      const double size = std::fabs(m_h_ * best.u) + std::fabs(drive_) + std::fabs(f_);
      if (std::fabs(best.r) <= 4e-16 * size && !best.stopped) return finish(best);
      const double low = std::min(a.u, c.u), high = std::max(a.u, c.u);
      const double secant = c.u - c.r * (c.u - a.u) / (c.r - a.r), slope = best.slope > 0 ? best.slope : 0;
      double u = slope > 0 ? best.u - best.r / slope : secant;
      // every third time: no one-sided crawl
      if (k % 3 == 2 || !(u > low && u < high)) u = 0.5 * (low + high);
      if (u <= low || u >= high || high - low <= 1e-300) return jump(a, c);
      const Point p = at(u);
      (p.r * a.r > 0 ? a : c) = p;
    }
    return jump(a, c);
  }

  // The bracket has closed on a jump of the law: the force between its two sides that balances (Filippov).
  // Rounding alone leaves next to nothing.
  StepResult jump(const Point &a, const Point &c) {
    Point best = std::fabs(a.r) < std::fabs(c.r) ? a : c;
    if (best.stopped) return rest();
    if (a.u * c.u <= 0) best.u = 0;  // a jump at rest holds what rests
    best = at(best.u);
    const double f = drive_ - m_h_ * best.u;
    const bool open =
        std::fabs(best.r) > 1e-9 * (std::fabs(f) + std::fabs(m_h_ * best.u) + std::fabs(drive_));
    return {best.u, open ? f : f_, open};
  }

  RigLaw &law_;
  Slip slip_;
  double m_h_, drive_, f_ = 0, limit_ = 0;
  Point last_ = {NAN, 0, 0, false};
  bool falls_ = false;
};

}  // namespace

StepResult implicit_step(RigLaw &law, Slip slip, double m_h, double drive, double v) {
  return StepSolver(law, slip, m_h, drive).solve(v);
}

}  // namespace cli
