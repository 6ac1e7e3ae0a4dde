// The tangent stiffness of a model, as blocks of 3x3 between pairs of points.
#pragma once
#include "dynamics/model.h"

namespace dfm {

class ModelStiffness {
 public:
  explicit ModelStiffness(const Memory &memory);

  static bool offered(const ModelInstance &model) { return model.ops->caps & DFM_CAP_STIFFNESS; }
  // Asks the model for its pairs; throws Error naming the plugin where they are not what plugin.h asks for.
  void create(const ModelInstance &model, uint32_t npoint);
  bool constant() const { return constant_; }  // for the same parameters
  // blocks = a df/dx + b df/dv; false: the model cannot.
  bool evaluate(const ModelInstance &model, const dfm_kin &k, double a, double b);

  const Array<uint32_t> &pairs() const { return pairs_; }  // [nb,2] points, i <= j
  Array<double> &blocks() { return blocks_; }              // [nb,9] row-major

 private:
  Array<uint32_t> pairs_;
  Array<double> blocks_;
  bool constant_ = false;
};

}  // namespace dfm
