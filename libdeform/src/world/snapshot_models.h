// The fields of a snapshot for the future models of a body.
#pragma once
#include "deform/world.h"
#include "state/model_choice.h"
#include "world/snapshot_stream.h"

namespace dfm {

template <class Stream, class P>
void param_fields(Stream &s, P &params) {
  s.array("model's keys", params.keys, kAnyCount, must::any);
  s.array("model's widths", params.widths, kAnyCount, must::any);
  s.array("model's values", params.values, kAnyCount, must::finite);
  s.must_hold("model's keys", "as many as there are values for", [&] { return params.sound(); });
}

template <class Stream, class C>
void choice_fields(Stream &s, const char *name, C &c) {
  s.array(name, c.type, kAnyCount, must::any);
  param_fields(s, c.params);
  s.value(name, c.integrator, must::at_most(kSameIntegrator));
  s.value(name, c.max_jump, must::Be{[](double j) { return j > 0; }, "an energy above zero"});
}

template <class Stream, class B>
void switch_fields(Stream &s, B &b) {
  s.list("models to come", b.switches, [&](auto &x) {
    s.value("model to come", x.t, must::finite);
    choice_fields(s, "model to come", x.to);
  });
  s.list("rules of models", b.rule, [&](auto &r) {
    for (auto *c : {&r.touching, &r.near, &r.far}) choice_fields(s, "rule of models", *c);
    s.value("rule's point", r.point, must::finite);
    for (auto *x : {&r.distance, &r.hysteresis, &r.wait, &r.called})
      s.value("rule's value", *x, must::not_negative);
    s.value("rule's refusal", r.refused, must::finite);
    s.value("rule's level", r.level, must::at_most(uint32_t(SwitchLevel::undecided)));
  });
  s.must_hold("rules of models", "one rule at most, with a model for far",
              [&] { return b.rule.empty() || (b.rule.size() == 1 && !b.rule[0].far.type.empty()); });
}

}  // namespace dfm
