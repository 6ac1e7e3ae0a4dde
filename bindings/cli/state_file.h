// The state of a world as a file: what `deform run --save` and `--record` write, `--from` and `deform replay`
// read.
#pragma once
#include <string>

#include "scene_file.h"

namespace cli {

// Sixteen hexadecimal digits, as in summary.json.
std::string hash_text(uint64_t hash);
uint64_t hash_of(const std::string &bytes);  // FNV-1a, 64 bit: against a mistaken file, not against forgery
// A hash of the scene with its --set values, but for "output" and "time/duration": a run may go on for
// longer.
uint64_t scene_hash(const SceneFile &scene);

// Throw Failure: the file cannot be written; equilibria have no state to go on from.
void refuse_static(const SceneFile &scene, const std::string &option);
std::string snapshot_of(dfm_world world);  // the bytes of dfm_world_snapshot
void write_state(const SceneFile &scene, const std::string &path);

// The world as it is now as a scene at path, with the scene's probes and outputs, and its state beside it for
// --from. Where a scene cannot say something the rest is written and the user warned.
void write_as_scene(const SceneFile &scene, const std::string &path);
// Before the first step. Throw Failure where there can be no scene, and no state, of that name.
void check_scene_path(const SceneFile &scene, const std::string &path);
void check_state_path(const std::string &path);

// Puts the scene's world into the state of the file. Throws Failure where the file is damaged, of another
// format or scene, or was written with another version of the library or of a plugin that it needs; the world
// is then as before.
void read_state(const SceneFile &scene, const std::string &path);

}  // namespace cli
