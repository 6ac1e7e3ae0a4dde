#include "world/explain.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "world/idle.h"
#include "world/context.h"
#include "world/method.h"

namespace dfm {
namespace {

std::string quote(const std::string &s) {
  std::string out = "\"";
  for (char c : s) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20) out += format("\\u%04x", c);
    else out += c;
  }
  return out + "\"";
}

// Where a body's numbers come from: its cells, its surface, and the parameters that differ by cell.
std::string body(const Body &b) {
  std::string out = "{\"name\":" + quote(b.name) + ",\"model\":" + quote(b.model.type->id);
  out += format(",\"cells\":%zu,\"points\":%u,\"surfels\":%u", b.tets.size() / 4, b.p.n, b.surface.nsurfel);
  const char *const surface = b.coupling == kNoCoupling           ? "boundary"
                              : b.coupling == DFM_COUPLING_MLS    ? "own, mls"
                              : b.coupling == DFM_COUPLING_THESIS ? "own, thesis"
                                                                  : "own, barycentric";
  out += std::string(",\"surface\":") + quote(surface) +
         ",\"filled\":" + (b.share.empty() ? "false" : "true") + ",\"fields\":[";
  for (size_t i = 0; i < b.fields.size(); ++i) {
    const CellField &f = b.fields[i];
    const auto [lo, hi] = std::minmax_element(f.values.begin(), f.values.end());
    out += (i ? "," : "") + ("{\"name\":" + quote(f.key) + ",\"from\":" + quote(f.from) +
                             format(",\"min\":%.9g,\"max\":%.9g}", *lo, *hi));
  }
  out += "],\"idle\":[";
  bool first = true;
  for (const IdleParam &p : idle_params(b)) {
    out += (first ? "" : ",") + ("{\"name\":" + quote(p.key) + ",\"why\":" + quote(p.why) + "}");
    first = false;
  }
  return out + "]}";
}

std::string seconds(double s) { return std::isfinite(s) ? format("%.3g s", s) : "any step"; }

// Which term rules at the worst point, from the sums that the bound was made of: h = 4 m / (c + sqrt(c^2 + 4
// m k)) is 2 sqrt(m / k) without damping and 2 m / c without stiffness.
std::string reason(const World &w) {
  if (!w.worst_body) return "nothing bounds the step";
  const Body &b = *w.worst_body;
  const std::string cut = "; longer steps are cut into equal sub-steps";
  const double m = w.worst_point < b.p.n ? b.p.mass[w.worst_point] : 0;
  const double k = m > 0 ? b.ksum[w.worst_point] : 0;
  const double c = m > 0 ? b.csum[w.worst_point] : 0;
  if (!(k > 0 || c > 0)) return "0.9 of the bound that its model gives" + cut;
  const double share = w.stable / b.bound.step;
  const std::string stiffness = seconds(share * 2 * std::sqrt(m / k)), damping = seconds(share * 2 * m / c);
  return "0.9 of the proven bound: " +
         (c * c > m * k ? "damping bounds it (alone it allows " + damping + ", stiffness alone " + stiffness +
                              "); lower the damping of this body or of its springs"
                        : "the stiffest point for its mass (alone its stiffness allows " + stiffness +
                              ", its damping " + damping + "); soften or coarsen this body") +
         cut;
}

}  // namespace

std::string explain(const World &w) {
  std::string out = "{\"effects\":[";
  for (size_t i = 0; i < w.plan.effects.size(); ++i) {
    const PlannedEffect &e = w.plan.effects[i];
    out += (i ? "," : "") + ("{\"name\":" + quote(e.name) + ",\"asked_by\":" + quote(e.asked_by) +
                             ",\"provided_by\":" + quote(e.provided_by) + "}");
  }
  out += "],\"stages\":[";
  for (size_t i = 0; i < w.plan.stages.size(); ++i) {
    const PlannedStage &s = w.plan.stages[i];
    const Stage &stage = w.method->table[s.row];
    out += (i ? "," : "") + ("{\"name\":" + quote(stage.name) + ",\"why\":" + quote(s.why));
    out += ",\"cost\":" + quote(stage.cost(w)) + "}";
  }
  out += "],\"absent\":[";
  for (size_t i = 0; i < w.plan.absent.size(); ++i) {
    const AbsentStage &s = w.plan.absent[i];
    out += (i ? "," : "") + ("{\"name\":" + quote(s.name) + ",\"why\":" + quote(s.why) + "}");
  }
  out += "],\"bodies\":[";
  for (size_t i = 0; i < w.bodies.size(); ++i) out += (i ? "," : "") + body(*w.bodies[i]);
  out += "],\"step\":{\"stable_s\":" +
         (std::isfinite(w.stable) ? format("%.9g", w.stable) : std::string("null")) +
         ",\"worst_body\":" + (w.worst_body ? quote(w.worst_body->name) : "null") +
         ",\"worst_point\":" + std::to_string(w.worst_point) +
         ",\"contact_offset_m\":" + format("%.9g", w.offset) + ",\"reason\":" + quote(reason(w)) + "}}";
  return out;
}

}  // namespace dfm
