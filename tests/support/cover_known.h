// Rows of the product (cover_rows.h) that are known not to hold, and why.
#pragma once
#include "cover_rows.h"

namespace test::cover {

// Why a row of pairwise() is known not to hold; empty: it must hold. doc/reference/combinations.md has the
// figures.
inline std::string known_failure(const Row &row) {
  struct Known { const char *row, *why; };
  static constexpr const char *kFeet = "stands on the few surfels that thesis does not shrink, and wobbles";
  static constexpr const char *kProngs = "prongs are not at rest yet";
  static constexpr Known kKnown[] = {
      {"msm,thesis,voxels,dahl,symplectic_euler", kFeet},
      {"corotational_fem,thesis,soft:modal,gms,symplectic_euler", kFeet},
      {"modal,thesis,soft:shape_matching,karnopp,symplectic_euler", kFeet},
      {"meshless,thesis,soft:corotational_fem,dahl,symplectic_euler", kFeet},
      {"linear_fem,thesis,self,karnopp,symplectic_euler", "what thesis shrinks does not meet"},
      {"corotational_fem,mls,soft:msm,gms,symplectic_euler", "gms soft on soft (doc/laws/gms.md, limits)"},
      {"shape_matching,mls,self,coulomb,symplectic_euler", kProngs},
      {"msm,identity,self,gms,implicit_euler", kProngs},
  };
  const std::string name = columns(row);
  for (const Known &k : kKnown)
    if (name == k.row) return k.why;
  return {};
}

}  // namespace test::cover
