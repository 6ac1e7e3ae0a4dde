#include "report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>

#include "file.h"
#include "messages.h"

namespace cli::cost {
namespace {

constexpr size_t kNamed = 6;  // choices in a line that lists them

std::string error_json(const std::map<std::string, double> &error) {
  JsonObject out;
  for (const auto &[name, e] : error) out.add(name, e);
  return out.text();
}

const char *word_of(Outcome::State state) {
  constexpr const char *kWords[] = {"not run", "done", "unstable", "refused", "cut"};
  return kWords[state];
}

std::string line_of(const Row &row, double error) {
  return formatted("  %8s %9.3g%s ", percent(error).c_str(), row.cpu_per_s, row.alone ? " " : "~") +
         row.job.label + "\n";
}

std::string choice_json(const Subject &subject, const Study &study, size_t i) {
  const Row &row = study.rows[i];
  const Outcome &o = row.job.outcome;
  const Described d = describe(subject, row);
  JsonObject out;
  out.add("model", quoted(d.model), "integrator", quoted(d.integrator), "step", d.step);
  out.add("cells", o.cells, "law", quoted(d.law), "precision", quoted(d.precision));
  out.add("error", error_json(row.error), "cpu_s_per_s", row.cpu_per_s > 0 ? number(row.cpu_per_s) : "null");
  out.add("unstable", o.state == Outcome::unstable, "label", quoted(row.job.label));
  out.add("state", quoted(word_of(o.state)), "why", quoted(o.sentence));
  out.add("axes", json_words(row.candidate.axes), "headline", row.headline, "timed_alone", row.alone);
  out.add("steps", o.steps, "took_s", o.took);
  const double predicted = o.predicted(subject.duration);
  out.add("predicted_s", o.state == Outcome::cut && std::isfinite(predicted) ? number(predicted) : "null");
  JsonObject set;
  for (const auto &[pointer, value] : settings_of_file(subject, row)) set.add(pointer, value);
  out.add("set", set.text(), "folder", quoted(row.job.folder));
  return out.text();
}

const char *word_of(Basis basis) {
  const char *const words[] = {"order",      "slow order", "no order", "no fall",
                               "two meshes", "same mesh",  "damped"};
  return words[size_t(basis)];
}

std::string limits_json(const Study &study) {
  JsonObject out;
  for (const auto &[name, limit] : study.limits) {
    out.add(name, json_object("order", limit.order, "used", limit.used, "basis", quoted(word_of(limit.basis)),
                              "bound", limit.bound));
  }
  return out.text();
}

std::string reference_json(const Study &study) {
  return json_object("choice", study.reference, "converged", study.converged, "error",
                     study.reference_headline, "bound", study.reference_bound, "errors",
                     error_json(study.reference_error), "check",
                     study.check >= 0 ? std::to_string(study.check) : "null", "third",
                     study.third >= 0 ? std::to_string(study.third) : "null", "limits", limits_json(study),
                     "best_error_shown", study.best, "why", quoted(study.axes.reference_why));
}

std::string own_mesh_json(const Study &study) {
  const OnThisMesh &own = study.own_mesh;
  if (own.reference < 0) return "null";
  std::vector<std::string> front;
  for (const size_t i : own.front)
    front.push_back("{\"choice\": " + std::to_string(i) + ", \"error\": " + number(own.error.at(i)) + "}");
  return json_object("choice", own.reference, "check", own.check, "error", own.own, "mesh_error", own.mesh,
                     "front", json_array(front), "pick", own.pick < 0 ? "null" : std::to_string(own.pick));
}

std::string separated_json(const Study &study) {
  std::vector<std::string> parts;
  for (const Separated &part : study.separated) {
    std::vector<std::string> rows;
    for (const auto &[i, e] : part.rows)
      rows.push_back("{\"choice\": " + std::to_string(i) + ", \"error\": " + number(e) + "}");
    parts.push_back(json_object("axis", quoted(part.axis), "kind", quoted(part.kind), "anchor", part.anchor,
                                "rows", json_array(rows)));
  }
  return json_array(parts);
}

// A sentence without its figures: what differs in them alone is said once.
std::string without_figures(const std::string &sentence) {
  std::string out;
  for (const char c : sentence)
    if (!std::strchr("0123456789.+-", c)) out += c;
  return out;
}

void list_axes(const Study &study, std::string &out) {
  out +=
      std::string("\none change at a time, from the scene as it is (difference from the axis' own finest; ") +
      "cpu " + study.cost_unit + ")\n";
  for (const Separated &part : study.separated) {
    out += "  " + part.axis + (part.axis == part.kind ? "" : " (" + part.kind + ")") + ": against " +
           study.rows[part.anchor].job.label + "\n";
    for (const auto &[i, e] : part.rows) {
      if (i == part.anchor) continue;
      out += formatted("    %8s  %9.3g  %s\n", percent(e).c_str(), study.rows[i].cpu_per_s,
                       study.rows[i].job.label.c_str());
    }
  }
  for (const Axis &axis : study.axes.axes)
    if (!axis.left_out.empty()) out += "  " + axis.name + ": left out, " + axis.left_out + "\n";
}

}  // namespace

std::vector<std::string> left_out(const Subject &subject, const Study &study) {
  struct Reason {
    std::string sentence, labels;
    size_t rows = 0;
    bool unstable = false;
  };
  std::map<std::string, Reason> said;
  std::string cut;
  size_t n = 0;
  double least = 1e300;
  for (const Row &row : study.rows) {
    const Outcome &o = row.job.outcome;
    if (o.state == Outcome::cut || o.state == Outcome::none) {
      if (o.state == Outcome::cut) least = std::min(least, o.predicted(subject.duration));
      if (++n <= kNamed) cut += (n > 1 ? "; " : "") + row.job.label;
    }
    if (o.state != Outcome::unstable && o.state != Outcome::refused) continue;
    const bool unstable = o.state == Outcome::unstable;
    Reason &reason = said[(unstable ? "a" : "b") + without_figures(o.sentence)];
    if (reason.rows == 0) reason.sentence = o.sentence;
    reason.unstable = unstable;
    if (++reason.rows <= kNamed) reason.labels += (reason.rows > 1 ? "; " : "") + row.job.label;
  }
  std::vector<std::string> out;
  for (const auto &[key, reason] : said)
    out.push_back((reason.unstable ? "unstable: " : "refused: ") + reason.labels +
                  (reason.rows > kNamed ? "; and " + std::to_string(reason.rows - kNamed) + " more" : "") +
                  (reason.rows > 1 ? ". The first says: " : ". It says: ") + reason.sentence);
  if (n > 0)
    out.push_back("too long for the budget: " + cut +
                  (n > kNamed ? "; and " + std::to_string(n - kNamed) + " more" : "") +
                  (least < 1e300 ? ". The shortest would take " + formatted("%.3g", least) + " s" : ""));
  return out;
}

std::string percent(double part) {
  if (!std::isfinite(part)) return "-";
  const double p = 100 * part;
  return formatted(p >= 100 ? "%.0f %%" : p >= 9.95 ? "%.1f %%" : p >= 0.0995 ? "%.2f %%" : "%.1g %%", p);
}

Described describe(const Subject &subject, const Row &row) {
  const Knobs &k = row.candidate.knobs;
  const Outcome &o = row.job.outcome;
  Described d;
  d.model = k.model.empty() ? models_of(subject) : k.model;
  d.integrator = k.integrator.empty() ? subject.word("/time/integrator", "auto") : k.integrator;
  d.step = o.steps > 0 ? o.simulated / o.steps : 0;
  d.law = k.law.empty() ? laws_of(subject) : k.law;
  d.precision = k.precision.empty() ? precision_of(subject) : k.precision;
  return d;
}

namespace {
std::string count_of(const Study &study, int row) {
  return formatted("%.0f", study.rows[size_t(row)].job.outcome.cells);
}

// The limit of the quantity that decides: the one with the largest bound, then the largest error.
Limit deciding(const Study &study) {
  Limit worst;
  worst.bound = -1;
  for (const std::string &name : study.headline) {
    const auto found = study.limits.find(name);
    if (found == study.limits.end()) continue;
    const Limit &limit = found->second;
    if (limit.bound > worst.bound || (limit.bound == worst.bound && !(limit.error <= worst.error)))
      worst = limit;
  }
  return worst;
}

std::string why_unproven(const Study &study) {
  switch (deciding(study).basis) {
    case Basis::no_order: return "the meshes show no order";
    case Basis::no_fall: return "the differences of the meshes do not fall";
    case Basis::two_meshes: return "two meshes show no order";
    case Basis::damped: return "contacts of implicit time damp impacts, and explicit time is impossible here";
    default: return "";
  }
}

// By what the reference's own error is known.
std::string how_known(const Study &study) {
  const Limit worst = deciding(study);
  const std::string check = study.rows[size_t(study.check)].job.label;
  const bool meshes = count_of(study, study.reference) != count_of(study, study.check);
  if (worst.used)
    return "taken on to cells without end from " + count_of(study, study.reference) + ", " +
           count_of(study, study.check) + " and " + count_of(study, study.third) + " at the order " +
           formatted("%.2g", worst.order) + " that they show";
  std::string out = "against " + check;
  if (!meshes) return out;
  const std::string third = study.third >= 0 ? count_of(study, study.third) : "";
  if (worst.basis == Basis::slow_order)
    return out + ", taken on at the order " + formatted("%.2g", worst.order) + " that they show with " +
           third + " cells, times 1.25";
  out += ", taken on at first order";
  if (third.empty()) return out;
  out += worst.basis == Basis::no_fall ? ": with " + third + " cells the differences do not fall"
                                       : ": with " + third + " cells they show no order";
  if (std::isfinite(worst.bound))
    out += ", bounded by " + percent(worst.bound) + ", three times their largest distance";
  return out;
}
}  // namespace

std::string mesh_doubt(const Study &study) {
  return "the mesh brings " + percent(study.own_mesh.mesh) + ", give or take the " +
         percent(study.reference_headline) + " of the reference";
}

std::string mesh_text(const Study &study) {
  const OnThisMesh &own = study.own_mesh;
  if (own.reference < 0) return "";
  return "on the scene's own mesh, model and step alone: against " +
         study.rows[size_t(own.reference)].job.label + ", own error " + percent(own.own) + "; " +
         mesh_doubt(study);
}

std::string reference_text(const Study &study) {
  const Row &row = study.rows[size_t(study.reference)];
  std::string out = "reference: " + row.job.label + " (" + study.axes.reference_why + "; " +
                    formatted("%.0f", row.job.outcome.cells) + " cells, " + formatted("%.3g", row.cpu_per_s) +
                    " cpu " + study.cost_unit + ")";
  if (study.check < 0) return out + "; NOT CONVERGED: no second run to check it with fits into the budget";
  out += "; its own error " + percent(study.reference_headline) + " (" + how_known(study) + ")";
  if (std::isfinite(study.reference_bound)) out += ", bound " + percent(study.reference_bound);
  if (study.converged) return out + ", at most a third of the best error shown";
  if (!std::isfinite(study.reference_bound))
    return out + "; NOT CONVERGED: " + why_unproven(study) + ", so nothing bounds this error";
  if (study.reference_headline <= study.best / 3)
    return out + "; NOT CONVERGED: the bound is more than a third of the best error shown, " +
           percent(study.best);
  return out + "; NOT CONVERGED: more than a third of the best error shown, " + percent(study.best) +
         ", so errors below " + percent(3 * study.reference_headline) + " cannot be distinguished";
}

// Which budget says more, and what.
std::string next_step(const Study &study) {
  if (study.finest && !(study.next_budget > 0))
    return "no finer reference is tried with a larger --budget; more cells in the scene make it finer";
  if (!(study.next_budget > 0)) return "with a larger --budget the same call continues from here";
  return "the same call with --budget " + formatted("%.0f", std::ceil(study.next_budget)) +
         " continues from here; that is enough to " + study.next;
}

std::string next_text(const Study &study) { return "  " + next_step(study) + "\n"; }

namespace {
// The cheapest of the front whose error alone is within the target, if it is not the choice; -1: none.
int cheaper_but_unproven(const Study &study) {
  for (const size_t i : study.front) {
    if (int(i) == study.pick) return -1;
    if (study.rows[i].headline <= study.options.target) return int(i);
  }
  return -1;
}
}  // namespace

std::string doubt_text(const Study &study) {
  const std::string own = "the reference's own error of " + percent(study.reference_headline);
  if (study.rows[size_t(study.pick)].headline + study.reference_headline > study.options.target)
    return "with " + own + " it may be above the target";
  const std::string bound =
      std::isfinite(study.reference_bound) ? " (at most " + percent(study.reference_bound) + ")" : "";
  return why_unproven(study) + ", so " + own + " may be larger" + bound;
}

std::string pick_text(const Subject &subject, const Study &study) {
  const std::string target = percent(study.options.target);
  if (study.pick < 0 && study.check < 0)
    return "nothing can be said about " + target + ": nothing checks the reference\n" + next_text(study);
  if (study.pick < 0 && !(study.reference_headline <= study.options.target))
    return "nothing can be said about " + target + ": the reference's own error, " +
           percent(study.reference_headline) + ", is above it\n" + next_text(study);
  if (study.pick < 0) {
    return "no choice stays within " + target + " together with the reference's own error of " +
           percent(study.reference_headline) + "\n" + next_text(study);
  }
  const Row &row = study.rows[size_t(study.pick)];
  std::string out = "cheapest within " + target + (study.mesh_stays ? " on this mesh: " : ": ");
  out += row.job.label + " (" +
         percent(study.mesh_stays ? study.own_mesh.error.at(size_t(study.pick)) : row.headline) + ", " +
         formatted("%.3g", row.cpu_per_s) + " cpu " + study.cost_unit + ")\n";
  if (study.mesh_stays)
    out += "  proven for model and step; " + mesh_doubt(study) +
           ": no mesh within this budget is fine enough to say more\n" + next_text(study);
  else if (const int nearly = cheaper_but_unproven(study); study.proven && nearly >= 0)
    out += "  cheaper, but proven only to " +
           percent(study.rows[size_t(nearly)].headline + study.reference_bound) +
           " with the reference's own error of " + percent(study.reference_bound) + ": " +
           study.rows[size_t(nearly)].job.label + " (" + percent(study.rows[size_t(nearly)].headline) + ", " +
           formatted("%.3g", study.rows[size_t(nearly)].cpu_per_s) + " cpu " + study.cost_unit + ")\n" +
           next_text(study);
  else if (!study.proven) out += "  likely, not proven: " + doubt_text(study) + "\n" + next_text(study);
  const Settings set = settings_of_file(subject, row);
  for (const auto &[pointer, value] : set) out += "  --set '" + pointer + "=" + value + "'\n";
  return out + (set.empty() ? "  nothing has to be changed\n" : "");
}

std::string refusal_to_apply(const Study &study) {
  if (study.pick < 0)
    return "--apply: no choice meets the target, so there is nothing to apply; give a larger --budget or a "
           "larger --target";
  if (study.proven || study.mesh_stays) return "";
  return "--apply: \"" + study.rows[size_t(study.pick)].job.label + "\" is likely, not proven (" +
         doubt_text(study) + "), so nothing is applied; " + next_step(study);
}

std::string error_text(const Subject &subject, const Study &study) {
  std::string names;
  for (size_t i = 0; i < study.headline.size() && i < 6; ++i) {
    names += (names.empty() ? "" : ", ") + study.headline[i];
    if (const auto end = study.until.find(study.headline[i]); end != study.until.end())
      names += " (until a cut takes it after " + formatted("%.4g", end->second) + " s)";
  }
  if (study.headline.size() > 6) names += ", ...";
  for (size_t i = 0; i < study.zeros.size(); ++i)
    names += (i ? ", " : "; not of what is 0 in the reference: ") + study.zeros[i];
  return "error of " + names + (study.headline.size() > 1 ? " (the largest)" : "") +
         (subject.at_rest ? ": of the end, " : ": root mean square over time, ") +
         "relative to how far the reference moves";
}

std::string short_reference(const Study &study) {
  return "against \"" + study.rows[size_t(study.reference)].job.label + "\"" +
         (study.converged ? "" : ", NOT CONVERGED");
}

std::string table_text(const Subject &subject, const Study &study) {
  std::string out = shown(subject.path) + ": what accuracy costs\n" + error_text(subject, study) + "\n";
  out += std::string("cost, cpu ") + study.cost_unit + ": seconds of processor time" +
         (subject.at_rest ? " until the equilibrium" : " for a simulated second") +
         "; ~ taken while other runs ran beside\n";
  out += reference_text(study) + "\n";
  list_axes(study, out);
  out += "\nfront: nothing cheaper is as accurate (error " + short_reference(study) + "; cpu " +
         study.cost_unit + ", choice)\n";
  for (const size_t i : study.front) out += line_of(study.rows[i], study.rows[i].headline);
  if (const std::string here = mesh_text(study); !here.empty()) {
    out += here + "\n";
    for (const size_t i : study.own_mesh.front) out += line_of(study.rows[i], study.own_mesh.error.at(i));
  }
  const Row &own = study.rows[0];
  if (own.compared)
    out +=
        "  the scene as it is: " + percent(own.headline) + " at " + formatted("%.3g", own.cpu_per_s) + "\n";
  else if (own.job.outcome.state == Outcome::unstable)
    out += "  the scene as it is stops itself before its end, see \"unstable\"\n";
  else out += "  the scene as it is does not fit into the budget\n";
  for (const std::string &line : left_out(subject, study)) out += "  " + line + "\n";
  return out + "\n" + pick_text(subject, study);
}

std::string csv_text(const Subject &subject, const Study &study) {
  std::string out = "index,label,axes,model,integrator,step,cells,law,precision,cpu_s_per_s,state,headline";
  for (const std::string &name : study.quantities) out += "," + csv_cell(name);
  out += "\n";
  const auto cell = [](double x) { return std::isfinite(x) ? number(x) : std::string(); };
  for (size_t i = 0; i < study.rows.size(); ++i) {
    const Row &row = study.rows[i];
    const Described d = describe(subject, row);
    std::string axes;
    for (const std::string &axis : row.candidate.axes) axes += (axes.empty() ? "" : "+") + axis;
    out += std::to_string(i) + "," + csv_cell(row.job.label) + "," + axes + "," + d.model + "," +
           d.integrator + "," + cell(d.step) + "," + cell(row.job.outcome.cells) + "," + d.law + "," +
           d.precision + "," + cell(row.cpu_per_s) + "," + word_of(row.job.outcome.state) + "," +
           cell(row.headline);
    for (const std::string &name : study.quantities) {
      const auto found = row.error.find(name);
      out += "," + (found == row.error.end() ? "" : cell(found->second));
    }
    out += "\n";
  }
  return out;
}

std::string json_report(const Subject &subject, const Study &study, const JsonValue &patch) {
  std::vector<std::string> choices, front, left_out;
  for (size_t i = 0; i < study.rows.size(); ++i) choices.push_back(choice_json(subject, study, i));
  for (const size_t i : study.front) front.push_back(std::to_string(i));
  for (const Axis &axis : study.axes.axes)
    if (!axis.left_out.empty())
      left_out.push_back("{\"axis\": " + quoted(axis.name) + ", \"why\": " + quoted(axis.left_out) + "}");
  JsonObject scales;
  for (const auto &[name, scale] : study.scales)
    scales.add(name, "{\"scale\": " + number(scale) + ", \"unit\": " + quoted(study.units.at(name)) + "}");
  JsonObject out;
  out.add("format", quoted("deform-cost"), "version", "1", "scene", quoted(subject.path), "quantities",
          json_words(study.quantities), "headline", json_words(study.headline), "says",
          json_words({error_text(subject, study), reference_text(study), pick_text(subject, study)}),
          "scales", scales.text(), "reference", reference_json(study), "choices", json_array(choices),
          "front", json_array(front));
  if (study.pick < 0) {
    out.add("pick", "null");
  } else {
    JsonObject pick;
    pick.add("index", study.pick, "scene_patch", json_text(patch), "target", study.options.target, "proven",
             study.proven, "this_mesh", study.mesh_stays);
    out.add("pick", pick.text());
  }
  out.add("this_mesh", own_mesh_json(study), "separated", separated_json(study), "left_out",
          json_array(left_out), "budget_s", study.options.budget, "used_s", study.used, "runs_started",
          study.started);
  JsonValue whole;
  parse_json(out.text(), whole);
  return as_utf8(json_lines(whole));
}

}  // namespace cli::cost
