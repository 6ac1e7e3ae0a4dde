// Equivalent stress on the surface of a body, for pictures.
#pragma once
#include <vector>

#include "scene_file.h"

namespace cli {

class SurfaceStress {
 public:
  // surfels: [nsurfel,3] m, as they are now. Each takes the phyxel that is nearest now.
  SurfaceStress(const BodyView &body, const std::vector<double> &surfels);
  // Pa, von Mises: mean of the cells around each surfel's phyxel, by volume at rest. False: the model has
  // no stress, and `out` is unchanged.
  bool read(std::vector<float> &out);

 private:
  dfm_body body_;
  std::vector<uint32_t> cells_, nearest_;  // [ntet,4] phyxels; [nsurfel]
  std::vector<double> volume_, around_;    // [ntet], [npoint] m3: of a cell, of the cells around a phyxel
  std::vector<double> stress_, mean_;      // [ntet,6] Pa; [npoint] N m, times volume
};

}  // namespace cli
