// Points of a body that an attachment holds at an obstacle, and that lie in another obstacle, or in this one
// if it may touch them, or are pressed on it. The attachment is rigid and neither obstacle yields, so no
// motion satisfies attachment and contact: their impulses grow against each other until the energy watch
// stops the run or the guard finds no way.
#pragma once
#include <cstdint>
#include <string>

#include "step/overlap/overlap_sides.h"

namespace dfm {

struct Attachment;
struct World;

struct HeldIn {
  const Attachment *by = nullptr;  // that holds most of them; nullptr: there is none
  uint32_t points = 0;
};
// deeper: m, than which the places of these surfels of body p.a are in obstacle p.b; negative: that far from
// it, too.
HeldIn held_in(const World &w, OverlapSides &sides, const OverlapPair &p, double deeper);
// "its attachment to ... ", what it does, and what to do; b: slot of the obstacle that they are in.
std::string describe_held_in(const World &w, const HeldIn &held, uint32_t b);
// For a message about body `a` on obstacle `b`, by slot, in a step that fails: the same, or "".
std::string describe_held_at(World &w, uint32_t a, uint32_t b);

}  // namespace dfm
