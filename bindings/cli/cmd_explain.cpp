// deform explain SCENE.json: the plan of a step, and why.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "arguments.h"
#include "become.h"
#include "effect_costs.h"
#include "json_text.h"
#include "messages.h"
#include "planned.h"
#include "scene_file.h"

namespace cli {
namespace {

struct Options {
  std::string scene;
  std::vector<std::string> set;
  bool costs = false;
};

void print_list(const JsonValue &plan, const char *key, const char *title,
                const std::vector<std::string> &columns) {
  std::printf("%s\n", title);
  if (plan.list(key).empty()) std::printf("  none\n");
  for (const JsonValue &row : plan.list(key)) {
    std::printf("  %-20s", row.get("name").c_str());
    for (const std::string &column : columns)
      if (const std::string text = row.get(column); !text.empty())
        std::printf("  %s%s", column == "why" ? "" : (column + ": ").c_str(), text.c_str());
    std::printf("\n");
  }
}

// What parameters call for, and the list of effects does not have.
void print_left_out(const JsonValue &plan) {
  for (const JsonValue &row : plan.list("left_out"))
    std::printf("  %-20s  off: not in the list of effects; %s calls for it: %s\n", row.get("name").c_str(),
                row.get("of").c_str(), row.get("by").c_str());
}

// Parameters that do nothing, or something else than they name.
void print_idle(const JsonValue &plan) {
  for (const JsonValue &body : plan.list("bodies"))
    for (const JsonValue &parameter : body.list("idle"))
      std::printf("  %-20s  %s does not do what its name says: %s\n", body.get("name").c_str(),
                  parameter.get("name").c_str(), parameter.get("why").c_str());
}

// What models found when they made their bodies: how many modes, how much they hold.
void print_facts(const JsonValue &plan) {
  for (const JsonValue &body : plan.list("bodies")) {
    for (const JsonValue &f : body.list("facts")) {
      const std::string unit = f.get("unit") == "1" ? "" : " " + f.get("unit");
      std::printf("  %-20s  %s: %.4g%s  (%s)\n", body.get("name").c_str(), f.get("key").c_str(),
                  f.scalar("value"), unit.c_str(), f.get("label").c_str());
    }
  }
}

// Bodies whose energy is not compared with the work done on them.
void print_unwatched(const JsonValue &plan) {
  for (const JsonValue &body : plan.list("bodies"))
    if (const std::string why = body.get("unwatched"); !why.empty())
      std::printf("  %-20s  not seen by the energy watch: %s\n", body.get("name").c_str(), why.c_str());
}

// What moves bodies whose scene says "device".
void print_devices(const std::string &json) {
  JsonValue devices;
  if (json.empty() || !parse_json(json, devices)) return;
  for (const JsonValue &d : devices.items)
    std::printf("  %-20s  runs on: %s, by %s: %s\n", d.get("name").c_str(), d.get("device").c_str(),
                d.get("model").c_str(), d.get("why").c_str());
}

// Models that bodies are to have later.
void print_changes(const JsonValue &plan) {
  for (const JsonValue &body : plan.list("bodies")) {
    for (const JsonValue &c : body.list("changes")) {
      std::printf("  %-20s  changes to %s  %s", body.get("name").c_str(), c.get("name").c_str(),
                  c.get("when").c_str());
      if (const std::string own = c.get("integrator"); !own.empty())
        std::printf(", moved by %s", own.c_str());
      if (const std::string most = c.get("max_jump_J"); !most.empty())
        std::printf(", unless its elastic energy would jump by more than %s J", most.c_str());
      if (const JsonValue *const stable = c.find("stable_s"))
        std::printf("; %s", stable->kind == JsonValue::null
                                ? "nothing bounds its step"
                                : ("explicit time is stable up to " + c.get("stable_s") + " s").c_str());
      std::printf("\n");
    }
  }
}

// Does one of them bound the step?
void print_attachments(const JsonValue &plan) {
  for (const JsonValue &body : plan.list("bodies")) {
    for (const JsonValue &a : body.list("attached")) {
      const bool spring = a.scalar("stiffness") > 0 || a.scalar("damping") > 0;
      const bool releases = a.scalar("release") > 0;
      std::printf("  %-20s  attached to %s by %s surfels, %s%s\n", body.get("name").c_str(),
                  a.get("to").c_str(), a.get("surfels").c_str(),
                  spring ? ("with " + a.get("stiffness") + " N/m").c_str() : "rigid",
                  releases ? (", released above " + a.get("release") + " N").c_str() : "");
    }
  }
}

void print_cuts(const JsonValue &plan) {
  for (const JsonValue &b : plan.list("bodies")) {
    const std::string tears = b.get("tears_beyond");
    const bool may_tear = !tears.empty() && tears != "null";
    bool each_step = may_tear;
    for (const JsonValue &c : b.list("cuts")) {
      std::string most = c.get("most") == "0" ? "" : ", " + c.get("most");
      if (c.find("at")) {
        if (!most.empty()) most += " at most";
        std::printf("  %-20s  cut at %s s by %s, which %s%s\n", b.get("name").c_str(), c.get("at").c_str(),
                    c.get("by").c_str(), c.get("how").c_str(), most.c_str());
        continue;
      }
      if (!most.empty()) most += " in a step at most";
      each_step = true;
      std::printf("  %-20s  cut by %s, which %s%s\n", b.get("name").c_str(), c.get("by").c_str(),
                  c.get("how").c_str(), most.c_str());
    }
    if (may_tear)
      std::printf("  %-20s  tears beyond a strain of %s, 64 points in a step at most\n",
                  b.get("name").c_str(), tears.c_str());
    if (each_step)
      std::printf(
          "  %-20s  a step that cuts or tears rebuilds the body of %s cells; any other step checks each of "
          "them once\n",
          "", b.get("cells").c_str());
  }
}

bool changes_bound(const JsonValue &plan) {
  for (const JsonValue &body : plan.list("bodies"))
    for (const JsonValue &change : body.list("changes"))
      if (change.scalar("stable_s") > 0) return true;
  return false;
}

// Which integrator moves each body, and how many explicit sub-steps would be in a step.
void print_integrators(const JsonValue &plan) {
  for (const JsonValue &body : plan.list("bodies")) {
    const JsonValue *own = body.find("integrator");
    if (!own) continue;
    std::printf("  %-20s  moves by: %s  %s", body.get("name").c_str(), own->get("used").c_str(),
                own->get("why").c_str());
    if (const std::string n = own->get("substeps"); !n.empty())
      std::printf(" (explicit: %s sub-step%s of %s s in a step, bounded by point %s)", n.c_str(),
                  n == "1" ? "" : "s", own->get("explicit_s").c_str(), own->get("worst_point").c_str());
    if (const std::string rebound = own->get("rebound"); !rebound.empty())
      std::printf("; %s", rebound.c_str());
    std::printf("\n");
  }
}

// Which point bounds explicit sub-steps, how many do nearly, and what mass_scaling has done or would do.
void print_light(const JsonValue &plan) {
  for (const JsonValue &body : plan.list("bodies")) {
    const JsonValue *const own = body.find("light");
    if (!own) continue;
    const std::vector<JsonValue> &at = own->list("at");
    std::printf(
        "  %-20s  at rest point %s (%s %s %s m in the mesh) bounds explicit sub-steps, to %s s; %s of %s "
        "points allow less than twice that\n",
        body.get("name").c_str(), own->get("point").c_str(), at[0].text.c_str(), at[1].text.c_str(),
        at[2].text.c_str(), own->get("step_s").c_str(), own->get("below_twice").c_str(),
        body.get("points").c_str());
    if (own->scalar("mass_moved") > 0)
      std::printf(
          "  %-20s  %.3g %% of its mass was moved to such points, which changes the frequencies of "
          "bending and torsion by %.3g %% at most\n",
          "", 100 * own->scalar("mass_moved"), 100 * own->scalar("frequency_change"));
    for (const JsonValue &row : own->list("would"))
      if (row.scalar("step_s") > own->scalar("step_s"))
        std::printf("  %-20s  \"mass_scaling\": %s would allow at least %s s\n", "",
                    row.get("mass_scaling").c_str(), row.get("step_s").c_str());
  }
}

// Bodies whose forces are asked for in single precision.
void print_precision(const JsonValue &plan) {
  for (const JsonValue &body : plan.list("bodies")) {
    const JsonValue *own = body.find("precision");
    if (own && own->get("why") != "the default")
      std::printf("  %-20s  forces in %s precision: %s\n", body.get("name").c_str(), own->get("used").c_str(),
                  own->get("why").c_str());
  }
}

// What differs from cell to cell, and who says so.
void print_fields(const JsonValue &plan) {
  for (const JsonValue &body : plan.list("bodies"))
    for (const JsonValue &f : body.list("fields"))
      std::printf("  %-20s  %s by cell, from %s: %s to %s\n", body.get("name").c_str(), f.get("name").c_str(),
                  f.get("from").c_str(), f.get("min").c_str(), f.get("max").c_str());
}

int explain(const Options &options, Globals &globals, MeasureEffects *measure) {
  if (options.costs && !measure) become("explain --costs", kCost.file, globals.words, kCost.missing);
  SceneFile scene(globals, options.scene, options.set, 0);
  const std::string text = scene.explain();
  JsonValue plan;
  if (!parse_json(text, plan))
    throw Failure(kBadInput, "the library's plan is not JSON: " + text.substr(0, 200));
  std::vector<EffectCost> costs;
  if (options.costs) costs = measure(globals, scene, options.set, plan);
  const std::string planned = planned_json(scene), devices = scene.value("/devices");
  if (globals.json) {
    const std::string more = (options.costs ? ",\"costs\":" + costs_json(costs) : "") +
                             (planned.empty() ? "" : ",\"planner\":" + planned) +
                             (devices.empty() ? "" : ",\"devices\":" + devices) + "}";
    std::printf("%s%s\n", text.substr(0, text.rfind('}')).c_str(), more.c_str());
    return kDone;
  }
  print_planned(planned);
  print_list(plan, "effects", "effects", {"state", "asked_by", "provided_by"});
  print_left_out(plan);
  print_list(plan, "stages", "stages of a step, in order", {"why", "cost"});
  print_list(plan, "absent", "left out", {"why"});
  print_list(plan, "bodies", "bodies", {"model", "kind", "surface", "cells", "points", "surfels"});
  print_devices(devices);
  if (scene.value("/time/mode") != "\"static\"") {
    print_integrators(plan);
    print_light(plan);
  }
  print_precision(plan);
  print_changes(plan);
  print_cuts(plan);
  print_attachments(plan);
  if (scene.value("/time/mode") != "\"static\"") print_unwatched(plan);
  print_fields(plan);
  print_idle(plan);
  print_facts(plan);
  print_effects(plan, options.costs ? &costs : nullptr);
  const JsonValue *const step = plan.find("step");
  if (scene.value("/time/mode") == "\"static\"") {
    std::printf("step\n  none: equilibria of the loads are looked for\n");
  } else if (step && step->get("stable_s").empty()) {
    std::printf("step\n  nothing bounds the step%s\n",
                changes_bound(plan) ? " with the models that bodies have now; \"changes to\" above says what "
                                      "bounds it with those that they get"
                                    : "");
  } else if (step) {
    std::printf("step\n  stable %s s", step->get("stable_s").c_str());
    if (const std::string body = step->get("worst_body"); !body.empty())
      std::printf(", bounded by point %s of \"%s\"", step->get("worst_point").c_str(), body.c_str());
    if (const std::string reason = step->get("reason"); !reason.empty()) std::printf(": %s", reason.c_str());
    std::printf("\n");
    const double stable = step->scalar("stable_s"), requested = scene.settings().step;
    if (requested > 0 && stable > 0)
      std::printf("  the scene asks for %g s: %s%g sub-step%s each\n", requested,
                  requested > stable ? "at least " : "", std::ceil(requested / stable - 1e-9),
                  requested > stable ? "s" : "");
  }
  return kDone;
}

}  // namespace

void add_explain(Command app, Globals &globals, int *exit_code, MeasureEffects *measure) {
  auto options = std::make_shared<Options>();
  Command sub = app.command("explain", "the plan: effects, stages that run, stages left out and why");
  sub.option("SCENE", options->scene, "scene file (JSON)").required();
  sub.option("--set", options->set, "change a value of the scene")
      .type_name("/json/pointer=value")
      .repeated();
  sub.flag("--costs", options->costs,
           "also measure, by steps with and without it, what each effect of a body costs here");
  sub.calls([=, &globals] { *exit_code = explain(*options, globals, measure); });
}

}  // namespace cli
