// How long the next step of a run is, the same for `deform run` and for the viewer: the same bits.
#pragma once
#include "scene_file.h"

namespace cli {

// s, of the scene's step or, where that is "auto", of the stable one, at most as long as a record; the last
// step ends with the scene.
// 0: the scene is at its end. start: when it began, now: simulated time, s.
double next_step(const SceneFile &scene, double start, double now);
// The same where no end is near.
double full_step(const SceneFile &scene);
// Throws Failure where the first step needs more sub-steps than the library takes, which it would say after
// the run's folder has been emptied. Bodies whose integrator is chosen by the library move implicitly then.
void check_first_step(const SceneFile &scene);
// s, no step is longer, whatever integrator moves the bodies.
double longest_step(const SceneFile &scene);

}  // namespace cli
