// The corotational plugin on the host of model_host.h.
#pragma once
#include "model_host.h"

namespace corot_test {

using namespace model_test;

inline const dfm_type &plugin_type() {
  static const dfm_type &type = type_of("model_corotational_fem");
  return type;
}

// Values by key; what is not named has its default.
using Params = std::map<std::string, std::vector<double>>;

struct Instance : ModelInstance {
  Instance(Host &h, const Mesh &m, const Params &p = {}, uint32_t s = 4, const Fields &by_cell = {})
      : ModelInstance(h, plugin_type(), m, row(p), s, by_cell) {}

  static std::vector<double> row(const Params &p) {
    std::vector<double> values;
    size_t used = 0;
    for (uint32_t n = 0; n < plugin_type().nparam; ++n) {
      const dfm_param &known = plugin_type().params[n];
      const auto given = p.find(known.key);
      used += given != p.end();
      for (uint32_t w = 0; w < known.width; ++w)
        values.push_back(given != p.end() ? given->second[w] : known.def);
    }
    EXPECT_EQ(used, p.size()) << "a parameter that the model lacks";
    return values;
  }
  void set_params(const Params &p) {
    const std::vector<double> values = row(p);
    EXPECT_EQ(ops->set_params(self, values.data()), DFM_OK);
  }
};

}  // namespace corot_test
