// What the planner chose for a scene with an accuracy or a budget.
#pragma once
#include <string>

#include "scene_file.h"

namespace cli {

std::string planned_json(const SceneFile &scene);  // "" if the scene names neither
void print_planned(const std::string &json);       // nothing where it is ""
void print_choice(const std::string &json);        // the line of that which names what is simulated
// One sentence for a run; "" where there is nothing to say.
std::string planned_sentence(const std::string &json);

}  // namespace cli
