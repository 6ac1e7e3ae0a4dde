#include "step/method.h"

#include <algorithm>

#include "core/error.h"
#include "state/world.h"
#include "step/context.h"

namespace dfm {
namespace {

const Inability *find(const ContactMethod &method, Ability what) {
  const auto is = [&](const Inability &x) { return x.what == what; };
  const auto at = std::find_if(method.unable.begin(), method.unable.end(), is);
  return at == method.unable.end() ? nullptr : &*at;
}

}  // namespace

void use_method(World &w, const ContactMethod &method) {
  std::vector<StageTime> times(method.table.size());
  std::unique_ptr<MethodBuffers> buffers = method.buffers ? method.buffers(w.memory()) : nullptr;
  w.method = &method;
  w.steps->facts = {};  // the plan is one for another table
  w.steps->stage_times = std::move(times);
  w.steps->method = std::move(buffers);
}

bool guards(const ContactMethod &method) {
  return std::any_of(method.table.begin(), method.table.end(),
                     [](const Stage &s) { return s.role == StageRole::guards; });
}

bool lacks(const ContactMethod &method, Ability what) { return find(method, what) != nullptr; }

void need_ability(const World &w, Ability what, const char *kind, const std::string &name) {
  const Inability *const missing = find(*w.method, what);
  if (!missing) return;
  const std::string whose = *kind ? format("%s '%s': ", kind, name.c_str()) : std::string();
  fail(DFM_E_UNSUPPORTED, "%s%s cannot be in a world whose contact method is %s%s; use the method velocity",
       whose.c_str(), missing->why, w.method->name, w.method->remark);
}

Plan make_plan(std::span<const Stage> table, const SceneFacts &facts) {
  Plan plan;
  plan_effects(facts, plan);
  for (size_t row = 0; row < table.size(); ++row) {
    StageChoice choice = table[row].when(facts);
    if (choice.runs) plan.stages.push_back({row, table[row].role, std::move(choice.why)});
    else if (!choice.why.empty()) plan.absent.push_back({table[row].name, std::move(choice.why)});
  }
  return plan;
}

}  // namespace dfm
