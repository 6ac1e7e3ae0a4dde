// org.deform.cholmod: sparse Cholesky of SuiteSparse as a linear solver. Debian's CHOLMOD holds modules under
// the GPL, so a program that loads this plugin is under the GPL: it is built with -DDEFORM_CHOLMOD=ON alone.
#include <cholmod.h>
#include <deform/plugin.hpp>

#include <algorithm>
#include <cstdio>
#include <new>
#include <vector>

namespace {

namespace dp = dfm::plugin;

class Cholmod {
 public:
  Cholmod(const dfm_host &host, uint32_t n, uint32_t nb, const uint32_t *ij) : host_(host), n_(n) {
    cholmod_start(&common_);
    common_.print = 0;
    common_.error_handler = nullptr;
    common_.final_ll = 1;  // LDL' would take negative pivots; L L' says that the matrix is not definite
    try {
      build(nb, ij);
    } catch (...) {
      release();
      throw;
    }
  }
  ~Cholmod() { release(); }
  Cholmod(const Cholmod &) = delete;
  Cholmod &operator=(const Cholmod &) = delete;

  dfm_status factor(const double *blk) {
    double *const value = static_cast<double *>(matrix_->x);
    for (size_t e = 0; e < target_.size(); ++e)
      if (target_[e] >= 0) value[target_[e]] = blk[e];
    common_.status = CHOLMOD_OK;
    cholmod_factorize(matrix_, factor_, &common_);
    if (common_.status == CHOLMOD_NOT_POSDEF) return DFM_DISCARD;
    return status("factor");
  }

  dfm_status solve(uint32_t nrhs, const double *b, double *x) {
    cholmod_dense right{};
    right.nrow = right.d = 3 * size_t{n_};
    right.ncol = nrhs;
    right.nzmax = right.nrow * nrhs;
    right.x = const_cast<double *>(b);
    right.xtype = CHOLMOD_REAL;
    right.dtype = CHOLMOD_DOUBLE;
    cholmod_solve2(CHOLMOD_A, factor_, &right, nullptr, &solution_, nullptr, &work_y_, &work_e_, &common_);
    if (const dfm_status failed = status("solve")) return failed;
    std::copy_n(static_cast<const double *>(solution_->x), right.nzmax, x);
    return DFM_OK;
  }

 private:
  // The upper triangle by columns. Values of the pattern are set again and again at target_.
  void build(uint32_t nb, const uint32_t *ij) {
    struct Entry {
      int column, row;
      size_t from;
    };
    std::vector<Entry> entries;
    for (uint32_t b = 0; b < nb; ++b)
      for (uint32_t r = 0; r < 3; ++r)
        for (uint32_t c = 0; c < 3; ++c) {
          const int row = int(3 * ij[2 * size_t{b}] + r), column = int(3 * ij[2 * size_t{b} + 1] + c);
          if (row <= column) entries.push_back({column, row, 9 * size_t{b} + 3 * r + c});
        }
    std::sort(entries.begin(), entries.end(), [](const Entry &a, const Entry &b) {
      return a.column != b.column ? a.column < b.column : a.row < b.row;
    });
    const size_t rows = 3 * size_t{n_};
    matrix_ = cholmod_allocate_sparse(rows, rows, entries.size(), 1, 1, 1, CHOLMOD_REAL, &common_);
    if (!matrix_) throw std::bad_alloc();
    int *const begin = static_cast<int *>(matrix_->p), *const row = static_cast<int *>(matrix_->i);
    target_.assign(9 * size_t{nb}, -1);
    std::fill(begin, begin + rows + 1, 0);
    for (size_t k = 0; k < entries.size(); ++k) {
      row[k] = entries[k].row;
      ++begin[entries[k].column + 1];
      target_[entries[k].from] = int(k);
      static_cast<double *>(matrix_->x)[k] = 0;
    }
    for (size_t k = 0; k < rows; ++k) begin[k + 1] += begin[k];
    factor_ = cholmod_analyze(matrix_, &common_);
    if (!factor_) throw std::bad_alloc();
  }

  dfm_status status(const char *what) {
    if (common_.status == CHOLMOD_OK) return DFM_OK;
    if (common_.status == CHOLMOD_OUT_OF_MEMORY) return DFM_E_NOMEM;
    char text[100];
    std::snprintf(text, sizeof text, "cholmod: %s ended with status %d of CHOLMOD", what, common_.status);
    host_.log(host_.ctx, 3, 0, text);
    return DFM_E_FATAL;
  }

  void release() {
    cholmod_free_dense(&solution_, &common_);
    cholmod_free_dense(&work_y_, &common_);
    cholmod_free_dense(&work_e_, &common_);
    cholmod_free_factor(&factor_, &common_);
    cholmod_free_sparse(&matrix_, &common_);
    cholmod_finish(&common_);
  }

  const dfm_host &host_;
  uint32_t n_;
  std::vector<int> target_;
  cholmod_common common_{};
  cholmod_sparse *matrix_ = nullptr;
  cholmod_factor *factor_ = nullptr;
  cholmod_dense *solution_ = nullptr, *work_y_ = nullptr, *work_e_ = nullptr;
};

dfm_status analyse(const dfm_host *host, uint32_t n, uint32_t nb, const uint32_t *ij, void **self) {
  *self = new Cholmod(*host, n, nb, ij);
  return DFM_OK;
}
dfm_status factor(void *self, const double *blk) { return static_cast<Cholmod *>(self)->factor(blk); }
dfm_status solve(void *self, uint32_t nrhs, const double *b, double *x, double) {
  return static_cast<Cholmod *>(self)->solve(nrhs, b, x);
}
void release(void *self) { delete static_cast<Cholmod *>(self); }

const dfm_solver solver = {sizeof(dfm_solver),  DFM_SOLVER_DIRECT,  dp::guarded<analyse>,
                           dp::guarded<factor>, dp::guarded<solve>, release};
const dfm_type type =
    dp::type(DFM_KIND_SOLVER, "org.deform.cholmod", "CHOLMOD", "1.0.0", "GPL-2.0-or-later",
             "Chen, Davis, Hager and Rajamanickam 2008, ACM TOMS 35 (3), algorithm 887", nullptr, &solver);

}  // namespace

DFM_PLUGIN(&type)
