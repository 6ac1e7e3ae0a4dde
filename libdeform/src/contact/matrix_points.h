// Points of bodies that a sparse matrix ties together, and what acts on them: A v = load + J^T l.
#pragma once
#include <cstdint>
#include <span>

namespace dfm {

class MatrixPoints {
 public:
  // Points [first, first + n) of a body that nothing holds: its rigid motions become unknowns of the
  // preconditioner, and the linear solve's remainder leaves its momentum alone.
  struct Loose { uint32_t first, n; };

  uint32_t n = 0;
  const double *blocks = nullptr;  // [n,9] kg, diagonal blocks of A
  const double *load = nullptr;    // [n,4] N s
  const double *moves = nullptr;   // [n,4] 1, or 0 where a component keeps its v
  const double *mass = nullptr;    // [n] kg
  const double *x = nullptr;       // [n,4] m
  std::span<const Loose> loose;
  virtual ~MatrixPoints() = default;
  virtual void multiply(const double *v, double *product) const = 0;  // [n,4] m/s -> [n,4] N s
};

}  // namespace dfm
