#include "world/explain.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "friction/laws.h"
#include "state/material.h"
#include "state/obstacle.h"
#include "state/tool.h"
#include "step/context.h"
#include "step/impact.h"
#include "step/messages.h"
#include "step/step_bound.h"
#include "step/watch/energy_watch.h"
#include "world/body_effects.h"
#include "world/body_model.h"
#include "world/create.h"
#include "world/idle.h"
#include "world/may_cut.h"

namespace dfm {
namespace {

// As JSON writes it: `printable` gives control characters as JSON does.
std::string quote(const std::string &s) {
  std::string escaped;
  for (const char c : s) {
    if (c == '"' || c == '\\') escaped += '\\';
    escaped += c;
  }
  std::string out(6 * escaped.size() + 1, 0);
  printable(escaped.c_str(), out.data(), out.size());
  return std::string("\"") + out.c_str() + "\"";
}

const char *word_of(const Body &b) {
  return b.model.stepper ? "its own" : integrator_name(b.integrator.used);
}

// Its integrator, and the explicit sub-step.
std::string integrator(const Body &b) {
  const auto &i = b.integrator;
  const double step = b.world->def.step, n = std::max(1.0, std::ceil(step / i.step));
  std::string why;
  if (b.model.stepper)
    why = std::isfinite(i.step) ? "the model steps itself, and in contact within its bound"
                                : "the model steps itself";
  else if (i.chosen == Chosen::no) why = "named, or the world's";
  else if (i.chosen == Chosen::in_impact) why = "auto: implicit, but explicit until an impact is over";
  else if (i.used != DFM_INTEGRATOR_SYMPLECTIC_EULER)
    why = "auto: explicit time costs more than four times as much";
  else if (!b.model.can(DFM_CAP_STIFFNESS))
    why = "auto: the model gives no stiffness, which implicit time needs";
  else why = "auto: implicit time, which damps motion, would not be four times cheaper";
  std::string out = std::string("\"integrator\":{\"used\":") + quote(word_of(b)) + ",\"why\":" + quote(why);
  if (step > 0 && std::isfinite(i.step))
    out += format(",\"explicit_s\":%.9g,\"substeps\":%.0f,\"worst_point\":%u", i.step, n, i.point);
  if (!b.model.stepper && i.used != DFM_INTEGRATOR_SYMPLECTIC_EULER)
    out += ",\"rebound\":" +
           quote(std::string("will not rebound: ") + why_no_rebound(i.used) + "; it does with " +
                 (i.chosen == Chosen::implicit ? "automatic steps, or with " : "") +
                 "a restitution of the pair");
  return out + "}";
}

// Which point bounds explicit sub-steps at rest, how many nearly do, and what mass_scaling would give a body
// that nothing divides.
std::string light(const Body &b) {
  RestRows rows;
  if (!rest_rows(b, b.integrator.share, rows)) return "";
  uint32_t worst = 0, near = 0;
  for (uint32_t i = 1; i < b.p.n; ++i)
    if (step_of_point(b.p, rows, i) < step_of_point(b.p, rows, worst)) worst = i;
  const double step = step_of_point(b.p, rows, worst);
  if (!std::isfinite(step)) return "";
  for (uint32_t i = 0; i < b.p.n; ++i) near += step_of_point(b.p, rows, i) < 2 * step;
  const double *const at = &b.p.rest[size_t{3} * worst];
  std::vector<std::string> scaled;
  if (!rest_rows(b, 1, rows)) return "";
  std::vector<double> mass;
  const bool divided = b.tears || b.separate.on || cut_by_any(b) || !b.planned_cuts.empty();
  for (const double share : {0.001, 0.01, kMaxScaled})
    if (b.scaling.moved == 0 && !divided)
      scaled.push_back(format("{\"mass_scaling\":%g,\"step_s\":%.4g}", share,
                              kBoundShare * scale_mass(b.p, rows, share, mass).step));
  return format(",\"light\":{\"point\":%u,\"at\":[%.6g,%.6g,%.6g],\"step_s\":%.4g,\"below_twice\":%u", worst,
                at[0], at[1], at[2], kBoundShare * step, near) +
         format(",\"mass_moved\":%.4g,\"frequency_change\":%.4g,\"would\":[", b.scaling.moved,
                b.scaling.frequency) +
         join(scaled, ",") + "]}";
}

// The precision of the forces that move the body.
std::string precision(const Body &b) {
  const bool moves = b.dynamics->abilities().placed && b.integrator.used == DFM_INTEGRATOR_SYMPLECTIC_EULER;
  const char *const why = !b.model.single ? "the default"
                          : moves         ? "named; positions, contacts and the step's bound stay double"
                                          : "single was requested, but implicit steps take forces in double";
  return std::string("\"precision\":{\"used\":") + quote(b.model.single && moves ? "single" : "double") +
         ",\"why\":" + quote(why) + "}";
}

bool used(const World &w, const std::string &effect) {
  const auto same = [&](const PlannedEffect &e) { return e.name == effect; };
  return w.selection.wants(effect) && std::any_of(w.plan.effects.begin(), w.plan.effects.end(), same);
}

// Laws of pairs, and their effects.
std::string laws(const World &w) {
  std::vector<std::string> rows;
  for (const auto &law : w.laws) {
    std::vector<std::string> effects;
    for (const LawEffect &e : law_effects(*law->type, *law->host, law->params))
      effects.push_back("{\"name\":" + quote(e.name) + ",\"works\":" + (e.works ? "true" : "false") +
                        ",\"used\":" + (e.works && used(w, e.name) ? "true" : "false") +
                        ",\"switchable\":" + (e.switchable ? "true" : "false") + "}");
    rows.push_back("{\"name\":" + quote(law->type->id) + ",\"asked\":" + quote(law->requested_type->id) +
                   ",\"effects\":[" + join(effects, ",") + "]}");
  }
  return "\"laws\":[" + join(rows, ",") + "]";
}

// Effects that parameters call for but the list of effects leaves out.
std::string left_out(const World &w) {
  std::vector<LeftOut> all = w.left_out;
  const auto take = [&](const std::vector<LeftOut> &some) {
    all.insert(all.end(), some.begin(), some.end());
  };
  for (const auto &b : w.bodies) take(left_out_of(*b));
  for (const auto &law : w.laws) take(left_out_of(*law));
  std::vector<std::string> rows;
  for (const LeftOut &o : all)
    rows.push_back("{\"name\":" + quote(o.effect) + ",\"of\":" + quote(o.of) + ",\"by\":" + quote(o.by) +
                   "}");
  return "\"left_out\":[" + join(rows, ",") + "]";
}

// Effects of the model, which of them the scene uses, and what switches them off.
std::string effects(const Body &b) {
  std::vector<std::string> rows;
  for (const BodyEffect &e : body_effects(b)) {
    std::vector<std::string> switches;
    for (const EffectSwitch &s : e.switches)
      switches.push_back("{\"key\":" + quote(s.row->key) + ",\"now\":" + param_text(*s.row, s.now) +
                         ",\"off\":" + param_text(*s.row, s.off) + format(",\"off_value\":%.17g}", s.off));
    rows.push_back("{\"name\":" + quote(e.name) + ",\"works\":" + (e.works ? "true" : "false") +
                   ",\"used\":" + (e.works && used(*b.world, e.name) ? "true" : "false") + ",\"switches\":[" +
                   join(switches, ",") + "]}");
  }
  return "\"effects\":[" + join(rows, ",") + "]";
}

// Facts that the model computed at creation.
std::string facts(const Body &b) {
  std::vector<std::string> rows;
  for (const BodyFact &f : body_facts(b))
    rows.push_back("{\"key\":" + quote(f.key) + ",\"label\":" + quote(f.label) +
                   ",\"unit\":" + quote(f.unit) +
                   ",\"value\":" + (std::isfinite(f.value) ? format("%.9g", f.value) : "null") + "}");
  return "\"facts\":[" + join(rows, ",") + "]";
}

std::string change(const ModelChoice &c, const std::string &when) {
  std::string out = "{\"name\":" + quote(c.type) + ",\"when\":" + quote(when);
  if (c.integrator != kSameIntegrator && c.integrator != uint32_t{DFM_INTEGRATOR_AUTO})
    out += ",\"integrator\":" + quote(integrator_name(c.integrator));
  if (c.stable >= 0)
    out += std::isfinite(c.stable) ? format(",\"stable_s\":%.9g", c.stable) : ",\"stable_s\":null";
  if (c.max_jump < HUGE_VAL) out += format(",\"max_jump_J\":%.9g", c.max_jump);
  return out + "}";
}

// Future models.
std::string changes(const Body &b) {
  std::vector<std::string> rows;
  for (const Switch &s : b.switches) rows.push_back(change(s.to, format("at %g s", s.t)));
  for (const SwitchRule &r : b.rule) {
    if (!r.touching.type.empty()) rows.push_back(change(r.touching, "while it touches something"));
    if (!r.near.type.empty())
      rows.push_back(change(r.near, format("while its surface is within %g m of (%g, %g, %g)", r.distance,
                                           r.point.x, r.point.y, r.point.z)));
    rows.push_back(change(r.far, "else"));
  }
  return ",\"changes\":[" + join(rows, ",") + "]";
}

// Attachments.
std::string attachments(const Body &b) {
  std::vector<std::string> rows;
  for (const Attachment &a : b.world->attachments)
    if (a.body == b.id && !a.released)
      rows.push_back("{\"to\":" + quote(name_of(*b.world, a.to)) +
                     format(",\"surfels\":%zu,\"stiffness\":%.9g,\"damping\":%.9g,\"release\":%.9g}",
                            a.surfels.size(), a.stiffness, a.damping, a.release));
  return ",\"attached\":[" + join(rows, ",") + "]";
}

// What divides it: tools, and strain beyond what a material bears.
std::string cuts(const Body &b) {
  std::vector<std::string> rows;
  for (const auto &t : b.world->tools)
    if (t->cuts_body(b))
      rows.push_back("{\"by\":" + quote(t->name) +
                     ",\"how\":" + quote(t->cuts.how == DFM_CUT_SPLIT ? "opens faces" : "removes cells") +
                     format(",\"most\":%u}", t->cuts.most));
  static const char *const shapes[] = {"an ellipsoid", "a box", "a blade", "a plane"};
  for (const PlannedCut &c : b.planned_cuts)
    rows.push_back("{\"by\":" + quote(shapes[size_t(c.shape.kind)]) + ",\"at\":" + format("%.9g", c.t) +
                   ",\"how\":" + quote(c.how == DFM_CUT_SPLIT ? "opens faces" : "removes cells") +
                   format(",\"most\":%u}", c.most));
  double least = HUGE_VAL;
  for (const Material &m : b.composition.materials) least = std::min(least, m.entry(kTearKey, HUGE_VAL));
  return ",\"cuts\":[" + join(rows, ",") +
         "],\"tears_beyond\":" + (b.tears ? format("%.9g", least) : std::string("null"));
}

// Where a body's numbers come from: its cells, its surface, and the parameters that differ by cell.
std::string body(const Body &b) {
  std::string out = "{\"name\":" + quote(b.name) + ",\"model\":" + quote(b.model.type->id);
  out += std::string(",\"kind\":") +
         quote(b.model.can(DFM_CAP_PLAUSIBLE) ? "plausible, not physical" : "physical");
  out += format(",\"cells\":%u,\"points\":%u,\"surfels\":%u", b.ncell(), b.p.n, b.surface.nsurfel);
  const char *const surface = b.coupling == kNoCoupling           ? "boundary"
                              : b.coupling == DFM_COUPLING_MLS    ? "own, mls"
                              : b.coupling == DFM_COUPLING_THESIS ? "own, thesis"
                                                                  : "own, barycentric";
  out +=
      std::string(",\"surface\":") + quote(surface) + ",\"filled\":" + (b.share.empty() ? "false" : "true");
  std::vector<std::string> fields, idle;
  for (const CellField &f : b.fields) {
    const auto [lo, hi] = std::minmax_element(f.values.begin(), f.values.end());
    fields.push_back("{\"name\":" + quote(f.key) + ",\"from\":" + quote(f.from) +
                     format(",\"min\":%.9g,\"max\":%.9g}", *lo, *hi));
  }
  for (const IdleParam &p : idle_params(b))
    idle.push_back("{\"name\":" + quote(p.key) + ",\"why\":" + quote(p.why) + "}");
  return out + ",\"fields\":[" + join(fields, ",") + "]," + effects(b) + "," + facts(b) + "," +
         integrator(b) + "," + precision(b) + light(b) + ",\"idle\":[" + join(idle, ",") + "]" + changes(b) +
         attachments(b) + cuts(b) + ",\"unwatched\":" + quote(unwatched(*b.world, b)) + "}";
}

std::string seconds(double s) { return std::isfinite(s) ? format("%.3g s", s) : "any step"; }

// The dominant term at the worst point: the one that alone would allow the shorter step.
std::string reason(const World &w) {
  if (!w.bound.body) return "nothing bounds the step";
  const Body &b = *w.bound.body;
  const std::string cut = "; longer steps are cut into equal sub-steps";
  const StepBound &bound = b.bound.found;
  if (std::isinf(bound.by_stiffness) && std::isinf(bound.by_damping))
    return "0.9 of the bound that its model gives" + cut;
  const double share = w.bound.step / bound.step;
  const std::string stiffness = seconds(share * bound.by_stiffness);
  const std::string damping = seconds(share * bound.by_damping);
  if (bound.lagged)
    return "0.9 of the bound: stiffness and the lag of the dampers bound it (a lag of " +
           seconds(b.p.dampers.lag) + "; without damping " + stiffness +
           "); soften or coarsen this body, or lower its damping" + cut;
  return "0.9 of the bound: " +
         (bound.by_damping < bound.by_stiffness
              ? "damping bounds it (alone it allows " + damping + ", stiffness alone " + stiffness +
                    "); lower the damping of this body or of its springs"
              : "the stiffest point for its mass (alone its stiffness allows " + stiffness +
                    ", its damping " + damping + "); soften or coarsen this body") +
         cut;
}

}  // namespace

std::string explain(const World &w) {
  std::vector<std::string> effects, stages, absent, bodies;
  for (const PlannedEffect &e : w.plan.effects)
    effects.push_back("{\"name\":" + quote(e.name) + ",\"asked_by\":" + quote(e.requested_by) +
                      ",\"provided_by\":" + quote(e.provided_by) +
                      ",\"state\":" + (w.selection.lists(e.name) ? "\"asked\"" : "\"called for\"") + "}");
  for (const PlannedStage &s : w.plan.stages) {
    const Stage &stage = stage_table()[s.row];
    stages.push_back("{\"name\":" + quote(stage.name) + ",\"why\":" + quote(s.why) +
                     ",\"cost\":" + quote(stage.cost) + "}");
  }
  for (const AbsentStage &s : w.plan.absent)
    absent.push_back("{\"name\":" + quote(s.name) + ",\"why\":" + quote(s.why) + "}");
  for (const auto &b : w.bodies) bodies.push_back(body(*b));
  std::string out = "{\"effects\":[" + join(effects, ",") + "]," + left_out(w) + "," + laws(w) +
                    ",\"stages\":[" + join(stages, ",") + "],\"absent\":[" + join(absent, ",") +
                    "],\"bodies\":[" + join(bodies, ",") + "]";
  out += ",\"step\":{\"stable_s\":" +
         (std::isfinite(w.bound.step) ? format("%.9g", w.bound.step) : std::string("null")) +
         ",\"worst_body\":" + (w.bound.body ? quote(w.bound.body->name) : "null") +
         ",\"worst_point\":" + std::to_string(w.bound.point) +
         ",\"contact_offset_m\":" + format("%.9g", w.offset) + ",\"reason\":" + quote(reason(w)) +
         "},\"auto\":";
  // Steps in which bodies could change integrators; null: none.
  const IntegratorTimes &times = w.integrator_times;
  out += times.all > 0 ? format("{\"steps_s\":%.9g,\"implicit_s\":%.9g,\"changes\":%llu}}", times.all,
                                times.implicit, static_cast<unsigned long long>(times.changes))
                       : std::string("null}");
  return out;
}

}  // namespace dfm
