#include "step/messages.h"

#include <algorithm>

#include "state/attachment.h"
#include "state/obstacle.h"
#include "state/world.h"

namespace dfm {

std::string at_step(const WorldState &w) {
  return format("step %llu", static_cast<unsigned long long>(w.step_count));
}

std::string at_step(const WorldState &w, const Body &b) {
  return format("%s, body '%s'", at_step(w).c_str(), b.name.c_str());
}

const std::string &name_of(const Entities &w, uint64_t id) {
  static const std::string gone = "?";
  if (const Body *const b = w.body(id)) return b->name;
  const Obstacle *const o = w.obstacle(id);
  return o ? o->name : gone;
}

std::string names_of(const Entities &w, uint64_t a, uint64_t b) {
  const char *const first = name_of(w, a).c_str(), *const second = name_of(w, b).c_str();
  if (a == b) return format("body '%s' on itself", first);
  return w.body(b) ? format("bodies '%s' and '%s'", first, second)
                   : format("body '%s' on obstacle '%s'", first, second);
}

const char *hint_of_attachment(const WorldState &w, uint64_t body) {
  const auto holds = [&](const Attachment &a) {
    return a.body == body && a.obstacle && !a.released && !(a.stiffness > 0) && !(a.damping > 0);
  };
  return std::any_of(w.attachments.begin(), w.attachments.end(), holds)
             ? "; an attachment without \"stiffness\" holds points of it, which contact cannot push out"
             : "";
}

bool fail_step(uint32_t *trouble, uint32_t bit, const char *text, ...) {
  va_list args;
  va_start(args, text);
  const std::string sentence = vformat(text, args);
  va_end(args);
  *trouble |= bit;
  set_last_error(sentence.c_str());
  return false;
}

}  // namespace dfm
