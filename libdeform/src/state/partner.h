// What the rules and masks of a world see of one side of a pair: of a body, or of an obstacle.
#pragma once
#include "friction/pair_rules.h"
#include "state/obstacle.h"
#include "state/world.h"

namespace dfm {

struct Partner {
  uint64_t id;
  uint32_t category, collides_with;
  PairSide side;  // of it as a whole; the texts live in the world
  bool sensor;
  const Obstacle *shape;  // null: a body

  bool has_shape() const { return !shape || shape->def.shape != DFM_SHAPE_NONE; }
  // Whether masks and rules let them touch; rule: the one for this pair, or null.
  bool meets(const Partner &other, const FilterRule *rule) const {
    return rule ? rule->collide : (category & other.collides_with) && (other.category & collides_with);
  }
  bool meets(const Partner &other, const std::vector<FilterRule> &rules) const {
    return meets(other, best_rule(rules, side, other.side));
  }
};

inline Partner partner_of(const Body &b) {
  return {b.id, b.category, b.collides_with, {b.name, {}, b.material, b.whole_name}, b.sensor, nullptr};
}
inline Partner partner_of(const Obstacle &o) {
  return {o.id, o.def.category, o.def.collides_with, {o.name, {}, o.material}, o.sensor, &o};
}
// Bodies by slot, then obstacles.
inline Partner partner_of(const World &w, uint32_t thing) {
  const size_t nb = w.bodies.size();
  return thing < nb ? partner_of(*w.bodies[thing]) : partner_of(*w.obstacles[thing - nb]);
}

}  // namespace dfm
