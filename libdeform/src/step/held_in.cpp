#include "step/held_in.h"

#include <algorithm>

#include "state/attachment.h"
#include "state/world.h"

namespace dfm {

const char *hint_of_attachment(const World &w, uint64_t body) {
  const auto holds = [&](const Attachment &a) {
    return a.body == body && a.obstacle && !a.released && !(a.stiffness > 0) && !(a.damping > 0);
  };
  return std::any_of(w.attachments.begin(), w.attachments.end(), holds)
             ? "; an attachment without \"stiffness\" holds points of it, which contact cannot push out"
             : "";
}

}  // namespace dfm
