// A law under test: parameters, batches of contacts, and driving by a given slip or by a force on a mass.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "check/plugin.h"

namespace cli::check {

constexpr double kTurn = 6.283185307179586;

std::vector<double> default_params(const dfm_type &type);
// Defaults, but with a static level above the kinetic one where the table knows both and their defaults
// agree: what a promise needs to be seen.
std::vector<double> lively_params(const Subject &subject);
// What the law's own check says; empty where it accepts.
std::string refusal(const dfm_friction &law, const std::vector<double> &params);

struct Law {
  Law(const Subject &subject, std::vector<double> values);
  ~Law();
  Law(const Law &) = delete;
  Law &operator=(const Law &) = delete;
  bool needs(uint32_t bit) const { return (ops.needs & bit) != 0; }
  bool has(uint32_t flag) const { return (ops.flags & flag) != 0; }
  const Subject &subject;
  const dfm_friction &ops;
  std::vector<double> params;
  void *data = nullptr;
  std::vector<dfm_slot> slots;
  uint32_t nstate = 0;
};

// n contacts with all columns. Undeclared inputs hold NaN (area and dwell: NULL, as the host gives them).
struct Lanes {
  Lanes(const Law &law, uint32_t n, uint32_t gap = 0);  // gap: lanes between n rounded to 8 and the stride
  Lanes(const Lanes &) = delete;
  Lanes &operator=(const Lanes &) = delete;
  dfm_status evaluate(double dt);  // evaluates; the state stays
  void must(double dt);            // the same, and Broken where the law does not return DFM_OK
  void must_be_finite() const;     // the force; else Broken, with the inputs of the lane
  void commit();                   // the trial state becomes the state
  // trial slip; with FT_STOP a stopping force far beyond any level, against it
  void slip(uint32_t i, double x, double y);
  void stop_by(uint32_t i, double x, double y);  // another stopping force, N, of a law that takes one
  void press(double force);                      // all lanes of a law that takes a normal force, N
  double ft(uint32_t i) const;                   // norm
  std::string inputs(uint32_t i) const;          // for a sentence: " at a slip of .."
  void spoil_padding();                          // NaN in the input lanes beyond n
  // A lane's inputs from another batch, and whether its outputs, but for those that are NULL in `out`, are
  // those of another lane, bit by bit.
  void take(uint32_t i, const Lanes &from, uint32_t k);
  bool same(uint32_t i, const Lanes &other, uint32_t k) const;
  // The state of lane k in lane i, with its tangent pairs turned.
  void turn_state(uint32_t i, uint32_t k, double angle);

  const Law &law;
  uint32_t n, stride;
  double *fn, *vt, *stop, *area, *dwell, *state, *out_ft, *out_state, *dv, *dn, *limit, *stored;
  uint8_t *mode;
  dfm_friction_in in{};
  dfm_friction_out out{};

 private:
  std::vector<double> memory_;
};

// Typical magnitudes of this law, found by evaluating it. Rigs press with fn on 1 m2, their mass weighs fn.
struct Scales {
  double fn = 1;         // N
  double level = 0;      // N, largest force at rest, or the force at 1 m/s of a law that has none
  double stiffness = 0;  // N/m of presliding; 0: rigid or none
  double z = 0;          // m, level / stiffness; 0: none
  double mass() const { return fn / 9.81; }
  double length() const { return z > 0 ? z : 1e-5; }  // a displacement that is presliding where there is any
};
Scales scales_of(const Law &law);

// Resistive force at steady slip for each speed.
std::vector<double> steady_force(const Law &law, const Scales &scales, const std::vector<double> &speeds);
std::vector<double> decades(double from, double to, int per_decade);

// Masses driven along x by forces, one per lane, by implicit steps: m (v' - v)/h = f + ft(v').
struct Masses {
  Masses(const Law &law, const Scales &scales, uint32_t n);
  void step(const std::vector<double> &force, double h);
  Lanes lanes;
  double mass, level;
  std::vector<double> x, v, resist;  // resist: -ft of the last step

 private:
  // The search of one lane: r is known at a, and at b once the root lies between; next try `at`.
  struct Root {
    double a, b, ra, rb, at, slope;
    bool done, bracket, held;
    int side;
    void take(double r, int round);  // r: at `at`
  };
  std::vector<Root> roots_;
};

// xorshift64*, so that a seed means the same on every machine.
struct Random {
  uint64_t s;
  explicit Random(uint64_t seed) : s(seed * 0x9e3779b97f4a7c15ull + 0x853c49e6748fea9bull) {
    for (int i = 0; i < 8; ++i) next();
  }
  uint64_t next();
  double uniform(double a, double b);
  double logarithmic(double a, double b);
};

}  // namespace cli::check
