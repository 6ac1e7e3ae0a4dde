// The choice as a scene: what changes (a JSON merge patch, RFC 7396), and the whole scene with it.
#pragma once
#include <string>

#include "study.h"

namespace cli::cost {

// It contains whole lists, because a merge patch cannot change a part of one. Null: nothing is chosen.
JsonValue scene_patch(const Subject &subject, const Study &study);
// Writes the scene with the pick's changes to `path`. Files keep their places: names are made relative to
// the new scene's folder, and surfaces that the study has written are copied beside it.
void write_applied(const Subject &subject, const Study &study, const std::string &path);

}  // namespace cli::cost
