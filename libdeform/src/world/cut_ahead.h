// Cuts by tools that are made beside the steps: of a body with a delay, the faces that a tool comes through
// are noted, a thread makes the body that is left, and `delay` later it takes the place of the present one.
#pragma once
#include <cstdint>
#include <span>

namespace dfm {

struct Body;
struct World;

// delay: s; 0: none. Throws Error, and then nothing has changed.
void set_cut_delay(Body &b, double delay);
// Faces between present cells that the part `by` has come through in this step.
void open_later(Body &b, std::span<const uint64_t> faces, uint64_t by);
// After tools have been looked at: opens the faces whose time has come. Throws Error; the
// faces of the body that fails, and of those after it, are tried again after the next step.
void open_due(World &w, double dt);
// Then: has the cuts begun that are not.
void prepare_cuts(World &w);
// A piece waits for the faces of the body that it comes off: those that it has not are not missed.
void inherit_cuts(const Body &from, Body &piece);

}  // namespace dfm
