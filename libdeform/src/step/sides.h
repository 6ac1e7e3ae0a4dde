// The two sides of contacts and attachments: two bodies, or a body and an obstacle.
#pragma once
#include "contact/contact_set.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/solve/cut_drag.h"
#include "step/stages.h"

namespace dfm {

inline uint64_t id_of_b(const Entities &w, const ContactPoint &c) {
  return c.obstacle ? w.obstacles[c.slot_b]->id : w.bodies[c.slot_b]->id;
}

// Whether lists of contacts have side b of the store as a: of two rigid things, if b alone gives way.
bool b_first(const Entities &w, const ContactStore &s, uint32_t i);
// The sides as reports of pairs have them, by ids; of two bodies a is the older one. turned: the store has
// the other one first.
struct PairSides {
  uint64_t a, b;
  bool turned;
};
PairSides pair_sides(const World &w, const ContactStore &s, uint32_t i);

// Whether the body of this slot is one of them.
inline bool is_side(const ContactPoint &c, uint32_t slot) {
  return c.slot_a == slot || (!c.obstacle && c.slot_b == slot);
}

// f(slot): the bodies of a contact, of an attachment.
template <class F>
void each_body(const ContactPoint &c, const F &f) {
  f(c.slot_a);
  if (!c.obstacle) f(c.slot_b);
}
template <class F>
void each_body(const World &w, const Attachment &a, const F &f) {
  for (const uint64_t id : {a.body, a.to})
    if (const uint32_t slot = slot_of(w, id); slot != kNone) f(slot);
}

// f(slot), of some several times: bodies with contacts in the last sub-step, or attached. By the stored
// contacts, so that a restored world does the same.
template <class F>
void each_body_held(const World &w, const F &f) {
  for (uint32_t m = 0; m < w.store.n; ++m)
    for (const uint64_t id : {w.store.id_a[m], w.store.id_b[m]})
      if (const uint32_t slot = slot_of(w, id); slot != kNone) f(slot);
  for (const Attachment &a : w.attachments)
    if (!a.released) each_body(w, a, f);
}

// f(slot), of some several times: bodies with contacts in this sub-step, and those awake that are attached,
// or have a tool that has not paid for its cuts.
template <class F>
void each_body_touched(const World &w, const StepContext &step, const F &f) {
  const auto if_awake = [&](uint32_t slot) {
    if (!w.bodies[slot]->sleep_state.asleep) f(slot);
  };
  for (const ContactPoint &c : step.contacts) each_body(c, f);
  for (const Attachment &a : w.attachments)
    if (!a.released) each_body(w, a, if_awake);
  for (uint32_t slot = 0; slot < w.bodies.size(); ++slot)
    if (has_dues(*w.bodies[slot])) if_awake(slot);
}

}  // namespace dfm
