// The same tolerance for every contact.
#pragma once
#include "contact/solver.h"

namespace test {

struct SameTolerance : dfm::Tolerance {
  SameTolerance(uint32_t n, double of_normal, double of_tangent, double most)
      : normals(n, of_normal), tangents(n, of_tangent) {
    most_normal = most;
    normal = normals.data();
    tangent = tangents.data();
  }
  SameTolerance(const SameTolerance &) = delete;
  SameTolerance &operator=(const SameTolerance &) = delete;

 private:
  std::vector<double> normals, tangents;
};

}  // namespace test
