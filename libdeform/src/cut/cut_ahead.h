// Cuts by tools, made by a thread beside the steps. For a body with a delay, the faces that a tool passes
// through are noted. The thread makes the shape that is left; `delay` later it replaces the present one.
#pragma once
#include <cstdint>
#include <span>

namespace dfm {

struct Body;
struct World;

// delay: s; 0: none. Throws Error; then nothing has changed.
void set_cut_delay(Body &b, double delay);
// Notes faces between present cells that the part `by` has passed through in this step.
void open_later(Body &b, std::span<const uint64_t> faces, uint64_t by);
// Opens the faces that are due; called after the tools have cut. Throws Error; the faces of the body that
// failed, and of the bodies after it, are tried again after the next step.
void open_scheduled(World &w, double dt);
// Called after that: gives the thread the cuts that it has not started.
void prepare_cuts(World &w);
// A piece takes over the waiting faces of its body; faces between cells of other pieces have no effect.
void inherit_cuts(const Body &from, Body &piece);

}  // namespace dfm
