// Random cuts, tears, pieces and undone cuts, in contact with a floor (support/cut_walk.h). A million of
// them: make soak.
#include "cut_walk.h"

// soak: long; the other two have the seeds that failed once
TEST(CutWalk, RandomCuts_KeepMassMomentumContactsAndVolumes) {
  uint64_t cuts = 0, contacts = 0, pieces = 0, tears = 0, rolled_back = 0, fast = 0;
  for (uint64_t seed = 1; seed <= 40; ++seed) {
    const test::cutting::Walked r = test::cutting::walk_cuts(seed, 60);
    EXPECT_EQ(r.failure, "") << "seed " << seed;
    cuts += r.cuts;
    contacts += r.contacts;
    pieces += r.pieces;
    tears += r.tears;
    rolled_back += r.rolled_back;
    fast += r.speed >= test::cutting::CutWalk::kFast;
  }
  EXPECT_GT(cuts, 1000u);
  for (const uint64_t n : {contacts, pieces, tears, rolled_back}) EXPECT_GT(n, 5u);
  // Where jams ended by sweeps alone (doc/decisions/contact_solver.md) two of these worlds reached 155 and
  // 137,156 m/s.
  EXPECT_EQ(fast, 0u);
}

// Pieces with interlocked teeth jam: a solve that did not converge threw points at 471 m/s to 3e8 m/s, and at
// up to 155 m/s where a small budget ended it and forces drove what could not move.
TEST(CutWalk, JammedPieces_AreNotThrown) {
  for (const uint64_t seed : {52u, 186u, 197u, 212u, 2u, 19u, 28u}) {
    const test::cutting::Walked r = test::cutting::walk_cuts(seed, 60);
    EXPECT_EQ(r.failure, "") << "seed " << seed;
    EXPECT_LT(r.speed, test::cutting::CutWalk::kFast) << "seed " << seed;
  }
}

// A crumb reached 12 to 48 km/s where a hit had turned a contact, whose friction stayed without its normal
// impulse, and up to 2,430 m/s where contacts that oppose each other opened their depths
// (doc/decisions/contact_solver.md).
TEST(CutWalk, CrumbsBetweenTeeth_AreNotThrown) {
  for (const uint64_t seed : {202123u, 200171u, 203186u, 200117u, 200176u}) {
    const test::cutting::Walked r = test::cutting::walk_cuts(seed, 60);
    EXPECT_EQ(r.failure, "") << "seed " << seed;
    EXPECT_LT(r.speed, test::cutting::CutWalk::kFast) << "seed " << seed;
  }
}
