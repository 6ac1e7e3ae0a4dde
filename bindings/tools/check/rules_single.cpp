// M22: forces in single precision, the extension dfm.f32/1.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "check/groups.h"
#include "check/model.h"
#include "check/runner.h"
#include "deform/plugin_draft.h"

namespace cli::check {
namespace {

constexpr double kShaken = 0.02;  // of an edge
// As a share of the largest force: a strain of that size has 17 bits left of 24, less a digit for the sum at
// a point.
constexpr double kClose = 1e-4;
constexpr double kSum = 1e-12;  // of all forces

Numbers single_forces(const Body &body, const dfm_f32 &table) {
  Numbers f(body.x.size(), 0.0);
  std::vector<double> state_out(body.state.size());
  dfm_kin k = body.kin();
  if (!body.state.empty()) k.state_out = state_out.data();
  body.must("add_forces of " DFM_EXT_F32, [&] { return table.add_forces(body.self, &k, f.data()); });
  return f;
}

// False: the model has none with these parameters, and says why.
bool prepared(const Body &body, const dfm_f32 &table) {
  const size_t said = body.subject.plugin->host().said().size();
  const dfm_status status = body.call("prepare", [&] { return table.prepare(body.self); });
  if (status == DFM_OK) return true;
  if (status == DFM_E_UNSUPPORTED && body.subject.plugin->host().said().size() > said) return false;
  if (status == DFM_E_UNSUPPORTED)
    broken("prepare of " DFM_EXT_F32
           " refuses without a reason; log the reason, then return DFM_E_UNSUPPORTED");
  broken("prepare of " DFM_EXT_F32
         " returns %d; return DFM_OK, or DFM_E_UNSUPPORTED after the reason was logged",
         status);
}

}  // namespace

std::string single_is_close(const Subject &subject) {
  Random random(subject.seed);
  bool offered = false;
  const std::string summary = for_variants(subject, [&](const Variant &variant) {
    Body body(subject, small_block(variant.cell), variant);
    const auto *table = static_cast<const dfm_f32 *>(body.extension(DFM_EXT_F32));
    if (!table || !table->prepare || !table->add_forces) return;  // V03
    offered = true;
    if (!prepared(body, *table)) return;
    body.shake(kShaken * kCube, 0, random);
    const Numbers wanted = body.forces(), found = single_forces(body, *table);
    const double scale = largest(wanted);
    double sum[3] = {}, all = 0;
    for (uint32_t i = 0; i < body.points(); ++i)
      for (size_t a = 0; a < 3; ++a) {
        const size_t at = size_t(body.stride) * i + a;
        sum[a] += found[at];
        all += std::fabs(found[at]);
      }
    if (const double off = most_apart(found, wanted); !(off <= kClose * scale))
      broken(
          "forces in single precision are up to %.3g N off those in double, whose largest is %.3g N; "
          "compute the same forces",
          off, scale);
    if (const double rest = length(sum); !(rest <= kSum * all))
      broken(
          "forces in single precision sum to %.3g N (absolute values: %.3g N); add up each force and its "
          "reaction in double, from the same rounded number",
          rest, all);
    if (single_forces(body, *table) != found)
      broken("forces in single precision differ between two calls; let them depend on dfm_kin only");
  });
  if (!offered) skip("it does not offer " DFM_EXT_F32);
  return summary;
}

}  // namespace cli::check
