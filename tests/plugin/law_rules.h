// What every friction law must keep, written once: the tests of each law call these with its parameters
// (doc/laws/formulas.md). A set-valued law is asked while it slides: its ft_stop is far outside the cone,
// against the slip, unless the test says otherwise.
#pragma once
#include <cstdint>
#include <cstring>
#include <functional>
#include <random>

#include "near.h"
#include "set_valued_rig.h"

namespace rules {

constexpr uint32_t kMaxState = 50;

struct Law {
  const dfm_friction *ops = nullptr;
  std::vector<double> params;
  uint32_t nstate = 0;
  std::vector<uint32_t> pairs;  // first column of every tangent pair of the state
  std::vector<uint32_t> flags;  // columns that hold 0 or 1
  bool set_valued = false;
};

inline void read_slots(Law &law) {
  const dfm_slots all{sizeof(dfm_slots), law.ops->nslot, law.ops->slots, 0, 0};
  const dfm_slots own = law.ops->state ? *law.ops->state(law.params.data()) : all;
  for (uint32_t s = 0; s < own.nslot; ++s) {
    const dfm_slot &slot = own.slots[s];
    for (uint32_t k = 0; slot.kind == DFM_SLOT_TANGENT && k + 1 < slot.width; k += 2)
      law.pairs.push_back(law.nstate + k);
    for (uint32_t k = 0; slot.kind == DFM_SLOT_SCALAR && k < slot.width; ++k)
      law.flags.push_back(law.nstate + k);
    law.nstate += slot.width;
  }
}

inline Law law_of(dfm_law handle, std::vector<double> params) {
  const dfm_type *type = nullptr;
  EXPECT_EQ(dfm_law_type(handle, &type), DFM_OK) << dfm_last_error();
  Law law;
  law.ops = static_cast<const dfm_friction *>(type->ops);
  law.params = std::move(params);
  law.set_valued = (law.ops->flags & DFM_FRIC_SET_VALUED) != 0;
  read_slots(law);
  return law;
}

inline dfm_law open(const tiny::Context &c, const std::string &name) {
  return c.open(std::string(DEFORM_PLUGIN_DIR) + "/" + name + ".so");
}

struct In {
  double fn = 1, v[2] = {0, 0}, h = 1e-3, area = 1, state[kMaxState] = {};
  double stop[2] = {NAN, NAN};  // NAN: far outside the cone, against the slip
};
// f: the resistive force, -ft
struct Out {
  double f[2], dv[4], dn[2], limit, stored, state[kMaxState];
  int mode;
};

inline void put(const Law &law, const In &in, tiny::Batch &b, uint32_t i) {
  b.fn[i] = in.fn;
  b.area[i] = in.area;
  const double w = std::hypot(in.v[0], in.v[1]), pull = 1e3 * (1 + std::fabs(in.fn));
  for (uint32_t k = 0; k < 2; ++k) {
    b.vt[k * b.stride + i] = in.v[k];
    b.stop[k * b.stride + i] = !std::isnan(in.stop[k])     ? in.stop[k]
                               : w > 0 && std::isfinite(w) ? -(pull + w) * (in.v[k] / w)
                               : k == 0                    ? 0.5 * in.fn
                                                           : 0.0;
  }
  for (uint32_t k = 0; k < law.nstate; ++k) b.state[k * b.stride + i] = in.state[k];
}

inline Out get(const Law &law, const tiny::Batch &b, uint32_t i) {
  const uint32_t s = b.stride;
  Out o{{-b.ft[i], -b.ft[s + i]},
        {-b.dv[i], -b.dv[s + i], -b.dv[2 * s + i], -b.dv[3 * s + i]},
        {-b.dn[i], -b.dn[s + i]},
        b.limit[i],
        b.stored[i],
        {},
        b.mode[i]};
  for (uint32_t k = 0; k < law.nstate; ++k) o.state[k] = b.state_out[k * s + i];
  return o;
}

inline Out evaluate(const Law &law, const In &in) {
  tiny::Batch b(1, law.params, law.nstate);
  b.in.dt = in.h;
  put(law, in, b, 0);
  EXPECT_EQ(law.ops->eval(&b.in, &b.out), DFM_OK);
  return get(law, b, 0);
}

inline double norm(const double *p) { return std::hypot(p[0], p[1]); }

inline In turned(const Law &law, In in, double c, double s) {
  const auto turn = [&](double *p) {
    const double x = p[0], y = p[1];
    p[0] = c * x - s * y;
    p[1] = s * x + c * y;
  };
  turn(in.v);
  for (uint32_t k : law.pairs) turn(in.state + k);
  return in;
}

// Draws inputs that stand for the law's working range: bristles up to twice the cone, speeds from 1e-7 to 10
// m/s. z_max is |z| at the static cone for fn = area = 1.
struct Draw {
  std::mt19937 random{11};
  double z_max = 0;
  double log_uniform(double a, double b) {
    return a * std::pow(b / a, std::uniform_real_distribution<double>(0, 1)(random));
  }
  double direction() { return std::uniform_real_distribution<double>(0, 6.283185307179586)(random); }
  In next(const Law &law) {
    In in;
    in.fn = log_uniform(1e-4, 1e4);
    in.area = log_uniform(0.1, 10);
    in.h = log_uniform(1e-6, 1.0 / 30);
    const double w = log_uniform(1e-7, 10), a = direction();
    in.v[0] = w * std::cos(a);
    in.v[1] = w * std::sin(a);
    for (uint32_t k : law.pairs) {
      const double r = std::uniform_real_distribution<double>(0, 2)(random) * z_max * in.fn / in.area;
      const double t = direction();
      in.state[k] = r * std::cos(t);
      in.state[k + 1] = r * std::sin(t);
    }
    for (uint32_t k : law.flags) in.state[k] = random() % 2;
    return in;
  }
};

inline void odd_to_the_bit(const Law &law, Draw draw) {
  for (int n = 0; n < 500; ++n) {
    const In in = draw.next(law);
    In minus = in;
    for (double &v : minus.v) v = -v;
    for (uint32_t k : law.pairs) {
      minus.state[k] = -minus.state[k];
      minus.state[k + 1] = -minus.state[k + 1];
    }
    const Out a = evaluate(law, in), b = evaluate(law, minus);
    for (int k = 0; k < 2; ++k) {
      ASSERT_EQ(a.f[k], -b.f[k]);
      ASSERT_EQ(a.dn[k], -b.dn[k]);
    }
    for (int k = 0; k < 4; ++k) ASSERT_EQ(a.dv[k], b.dv[k]);
    for (uint32_t k : law.pairs) ASSERT_EQ(a.state[k], -b.state[k]);
    ASSERT_EQ(a.limit, b.limit);
    ASSERT_EQ(a.mode, b.mode);
  }
}

// Force, state and derivatives turn with the frame; limit, energy, mode do not: 360 directions, 1e-12.
inline void turns_with_the_frame(const Law &law, Draw draw) {
  for (int degree = 0; degree < 360; ++degree) {
    const In in = draw.next(law);
    const double t = degree * 0.017453292519943295, c = std::cos(t), s = std::sin(t);
    const Out a = evaluate(law, in), b = evaluate(law, turned(law, in, c, s));
    const double f = norm(a.f) + 1e-300;
    ASSERT_NEAR(b.f[0], c * a.f[0] - s * a.f[1], 1e-12 * f) << degree;
    ASSERT_NEAR(b.f[1], s * a.f[0] + c * a.f[1], 1e-12 * f) << degree;
    ASSERT_NEAR(b.limit, a.limit, 1e-12 * a.limit);
    ASSERT_NEAR(b.stored, a.stored, 1e-12 * a.stored);
    for (uint32_t k : law.pairs) {
      const double z = norm(a.state + k) + 1e-300;
      ASSERT_NEAR(b.state[k], c * a.state[k] - s * a.state[k + 1], 1e-12 * z);
      ASSERT_NEAR(b.state[k + 1], s * a.state[k] + c * a.state[k + 1], 1e-12 * z);
    }
    const double d = std::fabs(a.dv[0]) + std::fabs(a.dv[1]) + std::fabs(a.dv[2]) + std::fabs(a.dv[3]);
    const double r[4] = {c, -s, s, c};
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j) {
        double sum = 0;
        for (int p = 0; p < 2; ++p)
          for (int q = 0; q < 2; ++q) sum += r[2 * i + p] * a.dv[2 * p + q] * r[2 * j + q];
        ASSERT_NEAR(b.dv[2 * i + j], sum, 1e-11 * d);
      }
  }
}

// A trajectory and its mirror image at the first axis: mirrored to the bit.
inline void mirrored_trajectories(const Law &law, Draw draw) {
  In a, b;
  a.h = b.h = 1e-3;
  for (int n = 0; n < 2000; ++n) {
    const double t = 1e-3 * n;
    a.fn = b.fn = 1 + 0.5 * std::sin(17 * t);
    const double scale = 30 * draw.z_max;
    a.v[0] = b.v[0] = scale * std::sin(9 * t);
    a.v[1] = scale * std::cos(23 * t);
    b.v[1] = -a.v[1];
    const Out p = evaluate(law, a), q = evaluate(law, b);
    ASSERT_EQ(p.f[0], q.f[0]) << n;
    ASSERT_EQ(p.f[1], -q.f[1]) << n;
    std::memcpy(a.state, p.state, sizeof a.state);
    std::memcpy(b.state, q.state, sizeof b.state);
  }
}

// dF/dv and dF/dfn against central differences, except where `near`: a kink is within reach of the step.
inline void derivatives(const Law &law, Draw draw, int draws, double tolerance,
                        const std::function<bool(const In &)> &kink) {
  int compared = 0, cut = 0;
  for (int n = 0; n < draws; ++n) {
    In in = draw.next(law);
    if (kink(in)) continue;
    const Out a = evaluate(law, in);
    const double w = norm(in.v);
    const double step = 1e-5 * w, noise = 4e-15 * norm(a.f) / step;  // of the difference, in its last digits
    double scale = 0;
    for (double d : a.dv) scale = std::max(scale, std::fabs(d));
    scale = std::max(scale, norm(a.f) / w * 1e-3);
    for (int k = 0; k < 2; ++k) {
      In up = in, down = in;
      up.v[k] += step;
      down.v[k] -= step;
      const Out p = evaluate(law, up), q = evaluate(law, down);
      for (int i = 0; i < 2; ++i)
        ASSERT_NEAR(a.dv[2 * i + k], (p.f[i] - q.f[i]) / (up.v[k] - down.v[k]), tolerance * scale + noise)
            << "d f" << i << " / d v" << k << " at v " << in.v[0] << " " << in.v[1] << ", fn " << in.fn
            << ", h " << in.h << ", area " << in.area << ", z " << in.state[0] << " " << in.state[1]
            << ", draw " << n;
    }
    In up = in, down = in;
    up.fn *= 1 + 1e-5;
    down.fn *= 1 - 1e-5;
    const Out p = evaluate(law, up), q = evaluate(law, down);
    for (int i = 0; i < 2; ++i)
      ASSERT_NEAR(a.dn[i], (p.f[i] - q.f[i]) / (up.fn - down.fn),
                  tolerance * (norm(a.dn) + norm(a.f) / in.fn * 1e-3))
          << "d f" << i << " / d fn at v " << in.v[0] << " " << in.v[1] << ", fn " << in.fn << ", h " << in.h
          << ", z " << in.state[0] << " " << in.state[1];
    ++compared;
    for (uint32_t k : law.pairs) cut += norm(in.state + k) > draw.z_max * in.fn / in.area;
  }
  EXPECT_GT(compared, draws / 2);
  EXPECT_TRUE(!law.nstate || cut > draws / 10) << "the old bristle is cut by the cone in many of them";
}

// Every combination of the ends of the range: finite, inside the limit, no energy from nowhere.
inline void extremes(const Law &law, double z_max) {
  const double forces[] = {0, 5e-324, 1e-310, 1e-200, 1e-30, 1, 1e6, 1e100, 1e200};
  const double speeds[] = {0, 5e-324, 1e-310, 1e-160, 1e-12, 1, 1e6, 1e100, 1e200};
  for (double fn : forces)
    for (double v : speeds)
      for (double z : {0.0, 5e-324, 1e-200, 0.5, 1.0, 1e6, 1e160})
        for (double h : {0.0, 1e-6, 1.0 / 30})
          for (double area : {1e-30, 1.0}) {
            In in;
            in.fn = fn;
            in.v[0] = v;
            in.v[1] = -0.5 * v;
            in.h = h;
            in.area = area;
            for (uint32_t k : law.pairs) {
              in.state[k] = -z * z_max;
              in.state[k + 1] = 0.3 * z * z_max;
            }
            for (uint32_t k : law.flags) in.state[k] = k % 2;
            const Out o = evaluate(law, in);
            const auto where = [&] {
              char text[120];
              std::snprintf(text, sizeof text, "fn %g v %g z %g h %g area %g", fn, v, z, h, area);
              return std::string(text);
            };
            ASSERT_TRUE(std::isfinite(o.f[0]) && std::isfinite(o.f[1]) && o.limit >= 0 &&
                        std::isfinite(o.stored))
                << where();
            for (double d : o.dv) ASSERT_TRUE(std::isfinite(d)) << where();
            for (double d : o.dn) ASSERT_TRUE(std::isfinite(d)) << where();
            for (uint32_t k = 0; k < law.nstate; ++k) ASSERT_TRUE(std::isfinite(o.state[k])) << where();
            ASSERT_LE(norm(o.f), o.limit * (1 + 1e-12) + 1e-130) << where();
            ASSERT_TRUE(fn > 0 || o.mode == 0) << where();
          }
}

inline void no_normal_force_is_open(const Law &law, double z_max) {
  for (double fn : {0.0, -0.0, -1.0, -1e300}) {
    In in;
    in.fn = fn;
    in.v[0] = 1;
    in.v[1] = -2;
    for (uint32_t k : law.pairs) {
      in.state[k] = z_max;
      in.state[k + 1] = -z_max;
    }
    const Out o = evaluate(law, in);
    EXPECT_EQ(o.mode, 0);
    EXPECT_EQ(o.limit, 0);
    EXPECT_EQ(o.stored, 0);
    for (double x : {o.f[0], o.f[1], o.dn[0], o.dn[1], o.dv[0], o.dv[1], o.dv[2], o.dv[3]}) EXPECT_EQ(x, 0);
    for (uint32_t k : law.pairs) EXPECT_EQ(norm(o.state + k), 0);
  }
}

inline void bad_lane_stays_in_its_lane(const Law &law, Draw draw) {
  for (double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL})
    for (uint32_t input = 0; input < 4 + (law.set_valued ? 2 : 0) + law.nstate; ++input) {
      tiny::Batch good(11, law.params, law.nstate), spoilt(11, law.params, law.nstate);
      Draw one = draw;
      for (uint32_t i = 0; i < good.n; ++i) {
        const In in = one.next(law);
        put(law, in, good, i);
        put(law, in, spoilt, i);
      }
      std::vector<double *> columns{spoilt.fn, spoilt.vt, spoilt.vt + spoilt.stride, spoilt.area};
      if (law.set_valued) columns.insert(columns.end(), {spoilt.stop, spoilt.stop + spoilt.stride});
      for (uint32_t k = 0; k < law.nstate; ++k) columns.push_back(spoilt.state + k * spoilt.stride);
      columns[input][6] = bad;
      ASSERT_EQ(law.ops->eval(&good.in, &good.out), DFM_OK);
      ASSERT_EQ(law.ops->eval(&spoilt.in, &spoilt.out), DFM_OK);
      for (uint32_t i = 0; i < good.n; ++i) {
        const Out a = get(law, good, i), b = get(law, spoilt, i);
        for (int k = 0; k < 2; ++k) {
          ASSERT_TRUE(i == 6 ? std::isnan(b.f[k]) : a.f[k] == b.f[k]) << input << " " << bad << " lane " << i;
        }
        for (uint32_t k = 0; i != 6 && k < law.nstate; ++k) ASSERT_EQ(a.state[k], b.state[k]) << i;
      }
      EXPECT_TRUE(std::isnan(spoilt.limit[6])) << input << " " << bad;
    }
}

inline void same_alone_and_in_any_batch(const Law &law, Draw draw) {
  tiny::Batch all(203, law.params, law.nstate);
  std::vector<In> inputs;
  for (uint32_t i = 0; i < all.n; ++i) {
    In in = draw.next(law);
    in.h = 1e-3;
    if (i % 17 == 0) in.fn = 0;
    if (i % 13 == 0) in.v[0] = in.v[1] = 0;
    if (i % 5 == 0) std::memset(in.state, 0, sizeof in.state);
    for (double &s : in.stop)  // inside the cone and outside, whatever the slip
      if (law.set_valued) s = std::uniform_real_distribution<double>(-2, 2)(draw.random) * in.fn;
    inputs.push_back(in);
    put(law, in, all, i);
  }
  ASSERT_EQ(law.ops->eval(&all.in, &all.out), DFM_OK);
  int modes[3] = {0, 0, 0};
  for (uint32_t i = 0; i < all.n; ++i) {
    const Out a = get(law, all, i), b = evaluate(law, inputs[i]);
    for (int k = 0; k < 2; ++k) {
      ASSERT_EQ(a.f[k], b.f[k]);
      ASSERT_EQ(a.dn[k], b.dn[k]);
    }
    for (int k = 0; k < 4; ++k) ASSERT_EQ(a.dv[k], b.dv[k]);
    for (uint32_t k = 0; k < law.nstate; ++k) ASSERT_EQ(a.state[k], b.state[k]);
    ASSERT_EQ(a.limit, b.limit);
    ASSERT_EQ(a.mode, b.mode);
    ASSERT_LT(a.mode, 3);
    if (law.set_valued) {
      ASSERT_LE(norm(a.f), a.limit * (1 + 1e-15));
      const double power = a.f[0] * inputs[i].v[0] + a.f[1] * inputs[i].v[1];
      ASSERT_TRUE(a.mode != 2 || norm(inputs[i].v) < 2e-3 || power >= 0)
          << "what slides beyond the band of karnopp is braked";
    }
    ++modes[a.mode];
  }
  for (int count : modes) EXPECT_GT(count, 5) << "the batch holds every case";
  dfm_friction_out nothing{};
  nothing.size = sizeof nothing;
  EXPECT_EQ(law.ops->eval(&all.in, &nothing), DFM_OK) << "outputs that are not wanted are left out";
}

// Work done against friction from a drawn state, along a random path with changing normal force: sum F.v h +
// V(0) may not fall below zero. Returns the worst sum relative to V(0) plus the work's size, so that a test
// can ask for a failure as well.
inline double worst_balance(const Law &law, double z_max, int paths, bool runs, uint32_t seed = 5) {
  std::mt19937 random(seed);
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  const auto decades = [&](double a, double b) { return a * std::pow(b / a, uniform(0, 1)); };
  double worst = 0;  // with the sign changed
  for (int path = 0; path < paths; ++path) {
    In in;
    in.h = decades(1e-5, 1.0 / 60);
    in.fn = decades(0.01, 10);
    for (uint32_t k : law.pairs) {
      const double r = uniform(0, 1) * z_max * in.fn / (law.pairs.size() > 1 ? 4 : 1);
      const double t = uniform(0, 6.283185307179586);
      in.state[k] = r * std::cos(t);
      in.state[k + 1] = r * std::sin(t);
    }
    for (uint32_t k : law.flags) in.state[k] = random() % 2;
    // energy of the state drawn: reported at rest, before the cone of another normal force
    In rest = in;
    const double start = evaluate(law, rest).stored;
    double sum = start, size = start, w = decades(1e-5, 3), a = uniform(0, 6.283185307179586);
    for (int step = 0; step < 60; ++step) {
      if (!runs || step % 20 == 0) {
        w = decades(1e-5, 3);
        a = uniform(0, 6.283185307179586);
      }
      in.v[0] = w * std::cos(a);
      in.v[1] = w * std::sin(a);
      if (step % 7 == 3) in.fn = uniform(0, 1) < 0.2 ? 0 : decades(0.01, 10);
      const Out o = evaluate(law, in);
      const double work = (o.f[0] * in.v[0] + o.f[1] * in.v[1]) * in.h;
      sum += work;
      size += std::fabs(work);
      worst = test::worse(worst, -sum / size);
      std::memcpy(in.state, o.state, sizeof in.state);
    }
  }
  return -worst;
}

// Every compiler, optimization level and vector width must give these bits; inputs use + - * / alone.
inline uint64_t hash_of_bits(const Law &law, double z_max) {
  uint64_t seed = 88172645463325252ull, hash = 14695981039346656037ull;
  const auto uniform = [&] {
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return static_cast<double>(seed >> 11) * 0x1p-52 - 1;
  };
  tiny::Batch b(1000, law.params, law.nstate);
  for (uint32_t i = 0; i < b.n; ++i) {
    b.fn[i] = 1 + uniform();
    b.area[i] = 1 + uniform();
    for (uint32_t k = 0; k < 2; ++k) {
      b.vt[k * b.stride + i] = 0.03 * uniform() * (i % 3 ? 1 : 0.01);
      b.stop[k * b.stride + i] = 0.7 * uniform();
    }
    for (uint32_t k = 0; k < law.nstate; ++k) b.state[k * b.stride + i] = z_max * uniform();
    for (uint32_t k : law.flags) b.state[k * b.stride + i] = uniform() > 0 ? 1 : 0;
  }
  EXPECT_EQ(law.ops->eval(&b.in, &b.out), DFM_OK);
  const auto add = [&](const double *column, uint32_t width) {
    for (uint32_t k = 0; k < width; ++k)
      for (uint32_t i = 0; i < b.n; ++i) {
        unsigned char bytes[sizeof(double)];
        std::memcpy(bytes, &column[k * b.stride + i], sizeof bytes);
        for (unsigned char byte : bytes) hash = (hash ^ byte) * 1099511628211ull;
      }
  };
  add(b.ft, 2);
  add(b.state_out, law.nstate);
  add(b.limit, 1);
  add(b.dv, 4);
  add(b.dn, 2);
  add(b.stored, 1);
  return hash;
}

// What every law with bristles keeps; z_max (m): the deflections to try at the extremes.
inline void of_every_bristle(const Law &law, const Draw &draw, double z_max) {
  odd_to_the_bit(law, draw);
  turns_with_the_frame(law, draw);
  mirrored_trajectories(law, draw);
  extremes(law, z_max);
  no_normal_force_is_open(law, 1e-5);
  bad_lane_stays_in_its_lane(law, draw);
  same_alone_and_in_any_batch(law, draw);
}

}  // namespace rules
