// Rows of the product (cover_rows.h) that are known not to hold, and why.
#pragma once
#include "cover_rows.h"

namespace test::cover {

// Why a row of pairwise() is known not to hold; empty: it must hold. doc/reference/combinations.md has the
// figures.
inline std::string known_failure(const Row &row) {
  struct Known { const char *row, *why; };
  static constexpr Known kKnown[] = {
      {"shape_matching,mls,self,coulomb,symplectic_euler", "the prongs yield on slowly"},
  };
  const std::string name = columns(row);
  for (const Known &k : kKnown)
    if (name == k.row) return k.why;
  return {};
}

}  // namespace test::cover
