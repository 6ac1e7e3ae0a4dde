// Contacts that press back: what a body answers to impulses if each of these contacts resists the change of
// its velocity. With the body's matrix A, the contacts' J and a stiffness K_c (kg, symmetric, no negative
// eigenvalue) of each, that is
//
//     change = J (A + J^T K J)^-1 J^T impulse
//
// which is of the same size and pattern as A: one factorization of it takes about as long as a few products
// with the dense response J A^-1 J^T.
#pragma once
#include <cstdint>

namespace dfm {

// Contacts of one body with obstacles.
struct Backing {
  uint32_t n = 0;
  const uint32_t *begin = nullptr;   // [n+1] into surfel, weight
  const uint32_t *surfel = nullptr;  // of the body
  const double *weight = nullptr;
  const double *stiffness = nullptr;  // [n,9] kg, row-major in the world's axes
};

class BackedResponse {
 public:
  virtual ~BackedResponse() = default;
  virtual bool factor(const Backing &contacts) = 0;  // false: the body cannot
  // impulse, change: [n,3] N s, m/s, in the world's axes
  virtual bool solve(const Backing &contacts, const double *impulse, double *change) = 0;
};

}  // namespace dfm
