// V07, V08, F04: a law is a pure function of each lane. Whatever else it looks at (a static variable, the
// lane beside it, where it lies in the batch, the address of a table) makes a world depend on how contacts
// happen to be grouped.
#include <cmath>
#include <cstring>
#include <limits>

#include "check/groups.h"
#include "check/law.h"
#include "check/runner.h"

namespace cli::check {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Contacts of every kind: open, at rest, presliding, sliding; with the states that a few steps make.
void fill(Lanes &b, const Scales &s, Random &random) {
  for (uint32_t i = 0; i < b.n; ++i) {
    const double angle = random.uniform(0, kTurn);
    const double w = i % 7 == 0 ? 0 : random.logarithmic(1e-6, 10);
    if (b.law.needs(DFM_NEED_FN)) b.fn[i] = i % 11 == 0 ? 0 : s.fn * random.logarithmic(1e-2, 1e2);
    b.slip(i, w * std::cos(angle), w * std::sin(angle));
    const double force = s.level * random.logarithmic(1e-3, 1e3);
    b.stop_by(i, -force * std::cos(angle), -force * std::sin(angle));
    b.area[i] = random.logarithmic(0.1, 10);
    b.dwell[i] = random.logarithmic(1e-3, 10);
  }
}

void evaluate_states(Lanes &b, const Scales &s, Random &random, double h) {
  for (int k = 0; k < 4; ++k) {
    fill(b, s, random);
    b.must(h);
    b.commit();
  }
  fill(b, s, random);
}

uint64_t mix(uint64_t hash, const void *data, size_t bytes) {
  const unsigned char *p = static_cast<const unsigned char *>(data);
  for (size_t i = 0; i < bytes; ++i) hash = (hash ^ p[i]) * 0x100000001b3ull;
  return hash;
}

uint64_t hash_of(const Lanes &b, uint64_t hash) {
  const auto columns = [&](const double *p, uint32_t width) {
    for (uint32_t c = 0; c < width; ++c) hash = mix(hash, p + size_t(c) * b.stride, b.n * sizeof(double));
  };
  columns(b.out_ft, 2);
  columns(b.out_state, b.law.nstate);
  columns(b.limit, 1);
  columns(b.stored, 1);
  if (b.out.dft_dvt) {
    columns(b.dv, 4);
    columns(b.dn, 2);
  }
  return mix(hash, b.mode, b.n);
}

constexpr double kSteps[] = {1e-3, 1.0 / 60, 1e-5};

}  // namespace

uint64_t digest(const Subject &subject) {
  const Law law(subject, lively_params(subject));
  const Scales scales = scales_of(law);
  Random random(subject.seed);
  uint64_t hash = 0xcbf29ce484222325ull;
  for (const double h : kSteps) {
    Lanes b(law, 200);
    evaluate_states(b, scales, random, h);
    b.must(h);
    hash = hash_of(b, hash);
  }
  return hash;
}

std::string same_bits(const Subject &subject) {
  const Law law(subject, lively_params(subject)), plain(subject, default_params(*subject.type));
  const Scales scales = scales_of(law);
  Random random(subject.seed);
  // One batch is evaluated again after others with another step, other parameters and other inputs.
  Lanes first(law, 200), between(plain, 33);
  evaluate_states(first, scales, random, kSteps[0]);
  evaluate_states(between, scales, random, kSteps[1]);
  Lanes again(law, 200);
  for (uint32_t i = 0; i < first.n; ++i) again.take(i, first, i);
  first.must(kSteps[0]);
  for (int round = 0; round < 3; ++round) {
    between.must(kSteps[(round + 1) % 3]);
    again.must(kSteps[0]);
    for (uint32_t i = 0; i < first.n; ++i)
      if (!again.same(i, first, i))
        broken(
            "lane %u of the same batch gave (%.17g, %.17g) N and, after another batch, (%.17g, %.17g) N, so "
            "it keeps data between calls; keep the data in a state slot",
            i, first.out_ft[i], first.out_ft[first.stride + i], again.out_ft[i],
            again.out_ft[again.stride + i]);
  }
  stage("a second process is asked for the same batches");
  const uint64_t here = digest(subject), once_more = digest(subject);
  if (here != once_more)
    broken(
        "the same series of batches gave other bits the second time, so it keeps data between calls; keep "
        "the data in a state slot");
  return same_elsewhere(subject, here, "law", "batches");
}

std::string bad_lane_stays(const Subject &subject) {
  const Law law(subject, lively_params(subject));
  const Scales scales = scales_of(law);
  Random random(subject.seed);
  Lanes good(law, 19), spoilt(law, 19);
  evaluate_states(good, scales, random, 1e-3);
  for (uint32_t i = 0; i < good.n; ++i)
    // a contact that is open may answer zero to anything
    if (law.needs(DFM_NEED_FN)) good.fn[i] = scales.fn * random.logarithmic(0.1, 10);
  good.must(1e-3);
  struct Input {
    const char *name;
    bool given;
    double *column;
  };
  const size_t S = spoilt.stride;
  std::vector<Input> inputs = {{"fn", law.needs(DFM_NEED_FN), spoilt.fn},
                               {"vt", law.needs(DFM_NEED_VT), spoilt.vt},
                               {"vt", law.needs(DFM_NEED_VT), spoilt.vt + S},
                               {"ft_stop", law.needs(DFM_NEED_FT_STOP), spoilt.stop},
                               {"ft_stop", law.needs(DFM_NEED_FT_STOP), spoilt.stop + S},
                               {"area", law.needs(DFM_NEED_AREA), spoilt.area},
                               {"dwell", law.needs(DFM_NEED_DWELL), spoilt.dwell}};
  for (uint32_t c = 0; c < law.nstate; ++c) inputs.push_back({"state", true, spoilt.state + c * S});
  constexpr uint32_t kBad = 6;
  for (const Input &input : inputs)
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), kInfinite, -kInfinite}) {
      if (!input.given) continue;
      for (uint32_t i = 0; i < good.n; ++i) spoilt.take(i, good, i);
      input.column[kBad] = bad;
      stage("%s = %g in lane %u", input.name, bad, kBad);
      // nothing was changed: the host may try smaller
      if (spoilt.evaluate(1e-3) != DFM_OK) continue;
      for (uint32_t i = 0; i < good.n; ++i)
        if (i != kBad && !spoilt.same(i, good, i))
          broken(
              "%s = %g in lane %u changed lane %u from (%.17g, %.17g) to (%.17g, %.17g) N; compute each lane "
              "from its own inputs",
              input.name, bad, kBad, i, good.out_ft[i], good.out_ft[S + i], spoilt.out_ft[i],
              spoilt.out_ft[S + i]);
      bool finite = std::isfinite(spoilt.ft(kBad));
      for (uint32_t c = 0; c < law.nstate && std::strcmp(input.name, "state") == 0; ++c)
        finite = finite && std::isfinite(spoilt.out_state[c * S + kBad]);
      if (std::isnan(bad) && std::strcmp(input.name, "dwell") != 0 && finite)
        broken("%s = NaN gave a finite force (%.17g, %.17g) N; return a NaN, or DFM_DISCARD", input.name,
               spoilt.out_ft[kBad], spoilt.out_ft[S + kBad]);
    }
  return "";
}

std::string split_equals_whole(const Subject &subject) {
  const Law law(subject, lively_params(subject));
  const Scales scales = scales_of(law);
  Random random(subject.seed);
  for (const double h : kSteps) {
    Lanes whole(law, 103);
    evaluate_states(whole, scales, random, h);
    whole.must(h);
    for (const uint32_t piece : {1u, 2u, 7u, 8u, 9u, 32u, 64u})
      for (uint32_t begin = 0; begin < whole.n; begin += piece) {
        const uint32_t n = std::min(piece, whole.n - begin);
        Lanes part(law, n, piece == 9 ? 16 : 0);
        // may be read, and must not matter
        part.spoil_padding();
        // in reverse: neighbors change too
        for (uint32_t k = 0; k < n; ++k) part.take(n - 1 - k, whole, begin + k);
        part.must(h);
        for (uint32_t k = 0; k < n; ++k)
          if (!part.same(n - 1 - k, whole, begin + k))
            broken(
                "contact %u gets (%.17g, %.17g) N in a batch of %u and (%.17g, %.17g) N in one of %u; "
                "compute each lane by the same operations at every place in a batch",
                begin + k, whole.out_ft[begin + k], whole.out_ft[whole.stride + begin + k], whole.n,
                part.out_ft[n - 1 - k], part.out_ft[part.stride + n - 1 - k], n);
      }
  }
  return "";
}

// A counter of calls or contacts fails only after many, a 16-bit number of a contact only in large batches.
std::string endures(const Subject &subject) {
  const Law law(subject, lively_params(subject));
  const Scales scales = scales_of(law);
  Random random(subject.seed);
  constexpr uint32_t kContacts = 1u << 20, kBatch = 4096, kLarge = 70000;
  Lanes first(law, 200), again(law, 200), many(law, kBatch);
  evaluate_states(first, scales, random, 1e-3);
  for (uint32_t i = 0; i < first.n; ++i) again.take(i, first, i);
  first.must(1e-3);
  fill(many, scales, random);
  uint32_t summary = 0;
  for (; summary < kContacts; summary += kBatch) {
    stage("%u contacts have been asked for", summary);
    many.must(kSteps[(summary / kBatch) % 3]);
  }
  again.must(1e-3);
  for (uint32_t i = 0; i < first.n; ++i)
    if (!again.same(i, first, i))
      broken(
          "lane %u gave (%.17g, %.17g) N and, after %u other contacts, (%.17g, %.17g) N; keep nothing "
          "between calls but state slots",
          i, first.out_ft[i], first.out_ft[first.stride + i], summary, again.out_ft[i],
          again.out_ft[again.stride + i]);
  Lanes large(law, kLarge);
  for (uint32_t i = 0; i < kLarge; ++i) large.take(i, many, i % kBatch);
  stage("a batch of %u contacts", kLarge);
  large.must(1e-3);
  many.must(1e-3);
  for (uint32_t i = 0; i < kLarge; ++i)
    if (!large.same(i, many, i % kBatch))
      broken(
          "contact %u of a batch of %u gets (%.17g, %.17g) N, and in a batch of %u (%.17g, %.17g) N; index "
          "contacts by uint32_t, and keep no table of fixed size",
          i, kLarge, large.out_ft[i], large.out_ft[large.stride + i], kBatch, many.out_ft[i % kBatch],
          many.out_ft[many.stride + i % kBatch]);
  return text("%u contacts", summary);
}

}  // namespace cli::check
