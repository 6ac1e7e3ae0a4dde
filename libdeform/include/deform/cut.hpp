// deform/cut.hpp -- part of deform.hpp: cuts. Comments of deform/cut.h hold.
#ifndef DEFORM_CUT_HPP
#define DEFORM_CUT_HPP
#include <cstdint>
#include <span>
#include <vector>

#include "deform/cut.h"
#include "deform/result.hpp"

namespace deform {

struct CutDef : dfm_cut_def {
  CutDef() noexcept : dfm_cut_def(dfm_cut_def_default()) {}
};

struct SeparateDef : dfm_separate_def {
  SeparateDef() noexcept : dfm_separate_def(dfm_separate_def_default()) {}
};

namespace basic {

template <class E, class Self>
class BodyCuts {
 public:
  auto cut(const dfm_cut_def &def) const {
    return produce<E, dfm_cut_info>([&](dfm_cut_info &info) {
      info.size = sizeof info;
      return dfm_body_cut(body(), &def, &info);
    });
  }
  auto plan_cut(double t, const dfm_cut_def &def) const {
    return E::done(dfm_body_plan_cut(body(), t, &def));
  }
  auto plan_no_cuts() const { return E::done(dfm_body_plan_cut(body(), 0, nullptr)); }
  auto remove_cells(std::span<const uint32_t> cells) const {
    return produce<E, dfm_cut_info>([&](dfm_cut_info &info) {
      info.size = sizeof info;
      return dfm_body_remove_cells(body(), static_cast<uint32_t>(cells.size()), cells.data(), &info);
    });
  }
  // [npoint], [ntet]; either may be empty.
  auto origins(std::span<uint32_t> points, std::span<uint32_t> cells) const {
    return E::done(dfm_body_origins(body(), static_cast<uint32_t>(points.size()), given(points),
                                    static_cast<uint32_t>(cells.size()), given(cells)));
  }
  auto separate(const dfm_separate_def &def = SeparateDef()) const {
    return produce<E, dfm_cut_info>([&](dfm_cut_info &info) {
      info.size = sizeof info;
      return dfm_body_separate(body(), &def, &info);
    });
  }
  auto set_separate(const dfm_separate_def &def) const {
    return E::done(dfm_body_set_separate(body(), &def));
  }
  auto keep_together() const { return E::done(dfm_body_set_separate(body(), nullptr)); }
  auto set_cut_delay(double delay) const { return E::done(dfm_body_set_cut_delay(body(), delay)); }
  auto cut_delay() const {
    return produce<E, double>([&](double &delay) { return dfm_body_cut_delay(body(), &delay, nullptr); });
  }
  // Faces that wait to open.
  auto waiting_faces() const {
    return produce<E, uint32_t>([&](uint32_t &n) { return dfm_body_cut_delay(body(), nullptr, &n); });
  }
  auto pieces() const { return collect_handles<E, Self>(dfm_body_pieces, body()); }

 private:
  dfm_body body() const { return static_cast<const Self &>(*this).get(); }
};

}  // namespace basic
}  // namespace deform
#endif
