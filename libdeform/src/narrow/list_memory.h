// What is known of listed pairs from earlier sub-steps, so that most sub-steps compare one number for each.
#pragma once
#include <algorithm>
#include <cstdint>

#include "core/memory.h"
#include "core/tasks.h"
#include "geometry/views.h"

namespace dfm {

// Data on the listed pairs that save work and do not change results. Valid while d_c is the same and surfaces
// move in sub-steps alone that keep() counts; pairs that two lists share are carried over.
struct ListMemory {
  static constexpr double kRounding = 1 + 1e-6;  // bounds hold despite rounding

  struct Run {  // of the list: one pair of sides, one kind
    uint32_t begin, end;
    Candidate of;  // its first one
    // m, bounds of the motion of the two sides against each other: in all sub-steps since the run is
    // known; in this one
    double way, travel;
  };
  Array<Run> runs, old_runs;
  Array<uint64_t> features, old_features;  // by candidate: feature a, feature b
  // m, `way` and the distance when it was last computed, or less: that distance less the motion since then
  // bounds the present one
  Array<double> apart, old_apart;
  // [n,3] direction along which it was last found to be apart; zero: none
  Array<double> normal, old_normal;
  Array<uint32_t> before;  // by run: its place in old_runs, or kNone

  // tasks: null: on this thread alone
  void follow(const Array<Candidate> &list, Tasks *tasks = nullptr);
  void forget() { runs.clear(); }
  // what `apart` of a pair that is further than `distance` exceeds, in the sub-steps that `way` counts
  static double limit(double way, double distance) { return kRounding * (way + distance); }
  // the sub-step has been taken
  void keep() {
    for (Run &r : runs) r.way += r.travel;
  }

 private:
  // from: place in old_runs, or kNone
  void carry_over(const Array<Candidate> &list, Run &run, uint32_t from);
};

// The part of it for candidates of two bodies.
struct KnownRun {
  double *apart = nullptr;  // by candidate; null: nothing is known
  double way = 0;           // m
  double speed = 0;         // m/s, bound over the surfels of both

  // Whether candidate i is further apart than that.
  bool beyond(size_t i, double distance) const {
    return apart && ListMemory::limit(way, distance) < apart[i];
  }
  void found(size_t i, double distance) const {
    if (apart) apart[i] = std::max(apart[i], way + distance);
  }
};

}  // namespace dfm
