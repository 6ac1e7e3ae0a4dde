// One way to simulate the scene: what is changed in it, as the words of `deform run --set`.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "subject.h"

namespace cli::cost {

// Cells of the bodies: the scene's own, second-order tetrahedra, or hexahedra of a lattice under the surface.
enum class Cells { own, second_order, hexahedra };
// As a share of the number of tetrahedra: hexahedra as large as the cubes that 12 of a body-centered lattice
// make.
inline constexpr double kHexahedron = 1.0 / 12;

// What may be chosen. A word that is empty leaves the scene as it is; others are JSON text.
struct Knobs {
  std::string model, integrator, step, tolerance, law, self, guard, volume, precision;
  Cells kind = Cells::own;
  double cells = 1;  // times the scene's number
  bool own_mesh() const { return kind == Cells::own && cells == 1; }
  bool operator==(const Knobs &) const = default;
};

using Settings = std::vector<std::pair<std::string, std::string>>;  // pointer, JSON text

bool has_hexahedra(const Subject &subject, size_t body);  // as the scene is
std::string seconds(double h);                            // a step as JSON text
Settings settings_of(const Subject &subject, const Knobs &knobs);
// "corotational_fem, implicit_euler 0.01 s, cells x0.5"; "the scene as it is" where nothing is chosen.
std::string label_of(const Knobs &knobs);
// What the scene says, in words for a table; of several, all.
std::string models_of(const Subject &subject);
std::string laws_of(const Subject &subject);
std::string precision_of(const Subject &subject);  // single if any body has this setting

}  // namespace cli::cost
