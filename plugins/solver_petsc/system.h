// A matrix of PETSc over all ranks of MPI, and what solves with it. Each function is called on all ranks.
#pragma once
#include <petscksp.h>

#include <algorithm>
#include <vector>

#include "deform/plugin.h"

namespace petsc {

// Options of PETSC_OPTIONS with these prefixes go before what is set here.
struct Method { const char *prefix, *iteration, *preconditioner; };
constexpr Method methods[] = {{"deform_gamg_", KSPCG, PCGAMG},
                              {"deform_hypre_", KSPCG, PCHYPRE},
                              {"deform_mumps_", KSPPREONLY, PCCHOLESKY}};
enum : uint32_t { kGamg, kHypre, kMumps };

// What root has and gets; the other ranks have null pointers.
struct Data {
  uint32_t nb = 0;
  const uint32_t *ij = nullptr;
  const double *in = nullptr;
  double *out = nullptr;
  dfm_status status = DFM_OK;
  PetscInt iterations = 0;
};

// One matrix, its rows spread over the ranks in the order of the points.
class System {
 public:
  System() = default;
  System(const System &) = delete;
  ~System() {
    KSPDestroy(&solver_);
    VecScatterDestroy(&scatter_);
    for (Vec *v : {&b_, &x_, &whole_}) VecDestroy(v);
    MatDestroy(&matrix_);
  }

  PetscErrorCode analyse(MPI_Comm comm, uint32_t method, PetscInt n, const Data &root) {
    method_ = method;
    twice_.resize(root.nb);
    std::vector<PetscInt> rows, columns;
    rows.reserve(18 * size_t{root.nb});
    columns.reserve(18 * size_t{root.nb});
    for (uint32_t k = 0; k < root.nb; ++k) {
      const uint32_t *const pair = root.ij + 2 * size_t{k};
      twice_[k] = pair[0] != pair[1];
      for (uint32_t e = 0; e < (twice_[k] ? 18 : 9); ++e) {
        const uint32_t row = 3 * pair[0] + e % 9 / 3, column = 3 * pair[1] + e % 3;
        rows.push_back(PetscInt(e < 9 ? row : column));
        columns.push_back(PetscInt(e < 9 ? column : row));
      }
    }
    values_.resize(rows.size());
    PetscCall(MatCreate(comm, &matrix_));
    PetscCall(MatSetSizes(matrix_, PETSC_DECIDE, PETSC_DECIDE, n, n));
    PetscCall(MatSetBlockSize(matrix_, 3));
    PetscCall(MatSetType(matrix_, MATAIJ));
    // PETSc sends each entry to the rank of its row
    PetscCall(MatSetPreallocationCOO(matrix_, PetscCount(rows.size()), rows.data(), columns.data()));
    PetscCall(MatSetOption(matrix_, MAT_SPD, PETSC_TRUE));
    PetscCall(MatSetOption(matrix_, MAT_SPD_ETERNAL, PETSC_TRUE));
    PetscCall(MatCreateVecs(matrix_, &x_, &b_));
    PetscCall(VecScatterCreateToZero(b_, &scatter_, &whole_));
    PetscCall(KSPCreate(comm, &solver_));
    PetscCall(KSPSetOptionsPrefix(solver_, methods[method_].prefix));
    PetscCall(KSPSetType(solver_, methods[method_].iteration));
    PC pc;
    PetscCall(KSPGetPC(solver_, &pc));
    PetscCall(PCSetType(pc, methods[method_].preconditioner));
    // an interpolation of earlier values would make the answer depend on them
    if (method_ == kGamg) PetscCall(PCGAMGSetReuseInterpolation(pc, PETSC_FALSE));
    if (method_ == kHypre) PetscCall(PCHYPRESetType(pc, "boomeramg"));
    if (method_ == kMumps) PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
    PetscCall(KSPSetInitialGuessNonzero(solver_, method_ == kMumps ? PETSC_FALSE : PETSC_TRUE));
    if (method_ != kMumps) PetscCall(KSPSetNormType(solver_, KSP_NORM_NATURAL));  // as the library's `pcg`
    PetscCall(KSPSetOperators(solver_, matrix_, matrix_));
    return KSPSetFromOptions(solver_);
  }

  PetscErrorCode factor(Data &root) {
    double *to = values_.data();
    for (size_t k = 0; k < twice_.size(); ++k)
      for (int copy = 0; copy <= twice_[k]; ++copy) to = std::copy_n(root.in + 9 * k, 9, to);
    PetscCall(MatSetValuesCOO(matrix_, values_.data(), INSERT_VALUES));
    PetscCall(KSPSetOperators(solver_, matrix_, matrix_));
    PetscCall(KSPSetUp(solver_));
    PC pc;
    PCFailedReason reason;
    PetscCall(KSPGetPC(solver_, &pc));
    PetscCall(PCGetFailedReason(pc, &reason));
    if (reason != PC_NOERROR) root.status = reason == PC_FACTOR_OUTMEMORY ? DFM_E_NOMEM : DFM_DISCARD;
    if (method_ != kMumps || root.status != DFM_OK) return 0;
    Mat triangle;
    PetscInt negative = 0;  // pivots
    PetscCall(PCFactorGetMatrix(pc, &triangle));
    PetscCall(MatMumpsGetInfog(triangle, 12, &negative));
    if (negative > 0) root.status = DFM_DISCARD;
    return 0;
  }

  PetscErrorCode solve(double tolerance, Data &root) {
    PetscCall(move(whole_, b_, root.in, SCATTER_REVERSE));
    PetscCall(move(whole_, x_, root.out, SCATTER_REVERSE));
    PetscInt rows;
    PetscCall(VecGetSize(x_, &rows));
    const double share = std::min(tolerance, 1 - PETSC_MACHINE_EPSILON);
    PetscCall(KSPSetTolerances(solver_, share, PETSC_DEFAULT, PETSC_MAX_REAL, rows));
    PetscCall(KSPSolve(solver_, b_, x_));
    KSPConvergedReason reason;
    PetscCall(KSPGetConvergedReason(solver_, &reason));
    PetscCall(KSPGetIterationNumber(solver_, &root.iterations));
    if (reason < 0) root.status = DFM_DISCARD;
    return move(x_, whole_, root.out, SCATTER_FORWARD);
  }

 private:
  // One of the two is root's array.
  PetscErrorCode move(Vec from, Vec to, const double *array, ScatterMode mode) {
    if (array) PetscCall(VecPlaceArray(whole_, array));
    PetscCall(VecScatterBegin(scatter_, from, to, INSERT_VALUES, mode));
    PetscCall(VecScatterEnd(scatter_, from, to, INSERT_VALUES, mode));
    return array ? VecResetArray(whole_) : 0;
  }

  uint32_t method_ = 0;
  std::vector<uint8_t> twice_;  // blocks beside the diagonal are two of the matrix
  std::vector<double> values_;
  Mat matrix_ = nullptr;
  Vec b_ = nullptr, x_ = nullptr, whole_ = nullptr;
  VecScatter scatter_ = nullptr;
  KSP solver_ = nullptr;
};

}  // namespace petsc
