// The mass-spring plugin on the host of model_host.h.
#pragma once
#include "model_host.h"

namespace msm_test {

using namespace model_test;

inline const dfm_type &plugin_type() {
  static const dfm_type &type = type_of("model_msm");
  return type;
}

struct Params {
  double young = 1e5, poisson = 0.3, damping_stiffness = 0, damping_mass = 0, volume = 0;
  double collapse = 0;
  double slope = 0;
  Vec axis = {1, 0, 0};
  bool stiffer = false, form_a = false;
  int damper = 0;  // voigt, maxwell, sls
  double ratio = 1, time = 0.1;
};

struct Instance : ModelInstance {
  Instance(Host &h, const Mesh &m, const Params &p, uint32_t s = 4, const Fields &by_cell = {})
      : ModelInstance(h, plugin_type(), m, row(p), s, by_cell) {}

  static std::vector<double> row(const Params &p) {
    std::map<std::string, std::vector<double>> by_key = {{"young", {p.young}},
                                                         {"poisson", {p.poisson}},
                                                         {"damping_stiffness", {p.damping_stiffness}},
                                                         {"damping_mass", {p.damping_mass}},
                                                         {"volume", {p.volume}},
                                                         {"collapse", {p.collapse}},
                                                         {"anisotropy_slope", {p.slope}},
                                                         {"anisotropy_axis", {p.axis.begin(), p.axis.end()}},
                                                         {"anisotropy_kind", {double(p.stiffer)}},
                                                         {"anisotropy_form", {double(p.form_a)}},
                                                         {"damper", {double(p.damper)}},
                                                         {"relaxation_ratio", {p.ratio}},
                                                         {"relaxation_time", {p.time}}};
    std::vector<double> values;
    for (uint32_t n = 0; n < plugin_type().nparam; ++n) {
      const std::vector<double> &value = by_key.at(plugin_type().params[n].key);
      values.insert(values.end(), value.begin(), value.end());
    }
    return values;
  }
  void mask(const std::vector<uint32_t> &which, bool on) {
    const auto *ext = static_cast<const dfm_spring_mask *>(ops->extension(self, DFM_EXT_SPRING_MASK));
    EXPECT_EQ(ext->set(self, uint32_t(which.size()), which.data(), on), DFM_OK);
  }
};

}  // namespace msm_test
