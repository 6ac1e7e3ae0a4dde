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
