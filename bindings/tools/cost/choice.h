// One way to simulate the scene: what is changed in it, as the words of `deform run --set`.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "subject.h"

namespace cli::cost {

// What may be chosen. A word that is empty leaves the scene as it is; others are JSON text.
struct Knobs {
  std::string model, integrator, step, tolerance, law, self, guard, volume, precision;
  double cells = 1;  // times the scene's
  bool operator==(const Knobs &) const = default;
};

using Settings = std::vector<std::pair<std::string, std::string>>;  // pointer, JSON text

// Surfaces of bodies that are filled again, if the scene gives cells in a file: by body, "" elsewhere.
using Surfaces = std::vector<std::string>;

std::string seconds(double h);  // a step as JSON text
Settings settings_of(const Subject &subject, const Surfaces &surfaces, const Knobs &knobs);
// "corotational_fem, implicit_euler 0.01 s, cells x0.5"; "the scene as it is" where nothing is chosen.
std::string label_of(const Knobs &knobs);
// What the scene says, in words for a table; of several, all.
std::string models_of(const Subject &subject);
std::string laws_of(const Subject &subject);
std::string precision_of(const Subject &subject);  // single if any body has this setting

}  // namespace cli::cost
