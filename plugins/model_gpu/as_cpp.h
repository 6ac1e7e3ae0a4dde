// The names of the .glsl files on the processor; `call` is the Call in whose scope they are included. Comes
// after all other headers.
#include "stepper.h"

#define precise
#define UNROLLED
#define IN(name, n) const double (&name)[n]
#define OUT(name, n) double (&name)[n]
#define PLACE(i) call.of<const dvec4>(kPlace)[i]
#define SPEED(i) call.of<const dvec4>(kSpeed)[i]
#define LOAD(i) call.of<const dvec4>(kLoad)[i]
#define NEXT_PLACE(i, value) call.of<dvec4>(kNextPlace)[i] = value
#define NEXT_SPEED(i, value) call.of<dvec4>(kNextSpeed)[i] = value
#define SEEN(i) call.of<const dvec4>(kSeen)[i]
#define NEXT_SEEN(i, value) call.of<dvec4>(kNextSeen)[i] = value
#define OF_DAMPERS(i) (call.now.per_lag > 0 ? SEEN(i) : SPEED(i))
#define STEP call.now.step
#define KEPT call.now.kept
#define PER_LAG call.now.per_lag
#define DAMPING call.now.damping
#define WAS call.now.was
#define KEEP call.now.keep
#define NEXT call.now.next
#define PART call.now.part
#define CORNER(i) call.of<const uvec4>(kCorners)[i]
#define SHAPE(i) call.of<const dvec4>(kShapes)[i]
#define VOLUME(i) call.of<const dvec4>(kShapes)[i]
#define FORCE(i, value) call.of<dvec4>(kForces)[i] = value
#define CORNER_ROW(i) call.of<const uvec2>(kCornerRows)[i]
#define CORNER_FORCE(i) call.of<const dvec4>(kForces)[i]
#define REST_ROW(i) call.of<const double>(kRestRows)[i]
#define RAISE(rate) call.raise(rate)
#define SPRING_ROW(i) call.of<const uvec2>(kSpringRows)[i]
#define SPRING(i) call.of<const uvec4>(kSprings)[i]
#define OPTIONS(i) call.of<const uvec2>(kOptions)[i]
#define STRETCH(i) call.of<const double>(kStretches)[i]
#define NEXT_STRETCH(i, value) call.of<double>(kStretches)[i] = value
#define HAS_CELLS call.has(kWithCells)
#define HAS_OPTIONS call.has(kWithOptions)
#define HAS_BRANCHES call.has(kWithBranches)
#define TURNED call.has(kTurned)
