// The tangent stiffness of a model, as blocks of 3x3 between pairs of points.
#pragma once
#include "dynamics/model.h"
#include "math/block_matrix.h"

namespace dfm {

class ModelStiffness {
 public:
  explicit ModelStiffness(const Memory &memory);

  static bool offered(const ModelInstance &model) { return model.can(DFM_CAP_STIFFNESS); }
  // Gets the pairs of the model; throws Error, which names the plugin, if they do not meet plugin.h.
  void create(const ModelInstance &model, uint32_t npoint);
  bool constant() const { return constant_; }  // for the same parameters
  // blocks = a df/dx + b df/dv; returns false if the model fails.
  bool evaluate(const ModelInstance &model, const dfm_kin &k, double a, double b);

  BlockPattern pattern() const { return {npoint_, static_cast<uint32_t>(pairs_.size() / 2), pairs_.data()}; }
  Array<double> &blocks() { return blocks_; }  // [nb,9] row-major
  // calls act(point, block) for the diagonal blocks
  template <class Act>
  void each_own(const Act &act) {
    for (size_t b = 0; b < pairs_.size() / 2; ++b)
      if (pairs_[2 * b] == pairs_[2 * b + 1]) act(pairs_[2 * b], &blocks_[9 * b]);
  }

 private:
  uint32_t npoint_ = 0;
  Array<uint32_t> pairs_;  // [nb,2] points, i <= j
  Array<double> blocks_;
  bool constant_ = false;
};

}  // namespace dfm
