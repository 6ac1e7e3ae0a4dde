// deform/models.hpp -- part of deform.hpp: a body's model while it runs. Comments of deform/model.h hold.
#ifndef DEFORM_MODELS_HPP
#define DEFORM_MODELS_HPP
#include <cstdint>
#include <span>

#include "deform/model.h"

namespace deform::basic {

template <class E, class Self>
class BodyModels {
 public:
  auto set_model(const char *type, const dfm_params &params = {}) const {
    return E::done(dfm_body_set_model(body(), type, &params));
  }
  auto set_switches(std::span<const dfm_switch> switches) const {
    return E::done(dfm_body_set_switches(body(), static_cast<uint32_t>(switches.size()), switches.data()));
  }
  auto set_switch_rule(const dfm_switch_rule &rule) const {
    return E::done(dfm_body_set_switch_rule(body(), &rule));
  }
  auto remove_switch_rule() const { return E::done(dfm_body_set_switch_rule(body(), nullptr)); }
  auto set_interest(const double (&point)[3]) const { return E::done(dfm_body_set_interest(body(), point)); }

 private:
  dfm_body body() const { return static_cast<const Self &>(*this).get(); }
};

}  // namespace deform::basic
#endif
