// What may vary in a scene, axis by axis, and why an axis is left out.
#pragma once
#include <string>
#include <vector>

#include "choice.h"

namespace cli::cost {

// One choice and the axes that it is on. One that differs from the scene in one thing is on an
// axis; "front": in several, to look for cheaper ways.
struct Candidate {
  Knobs knobs;
  std::vector<std::string> axes;
};

struct Axis {
  std::string name, left_out;      // left_out: the reason, "" where it varies
  std::vector<std::string> kinds;  // of errors: "time", "space", "model", "contact"
};

struct Axes {
  std::vector<Axis> axes;
  std::vector<Candidate> candidates;  // the scene as it is comes first
  std::string reference_model;        // "": the models that the scene names
  std::string reference_why;
  bool meshes = false;    // number or kind of the cells may vary
  bool lattices = false;  // and may be hexahedra, which have the least error for their cost
  bool steps = false;     // integrator and step may vary
};

// Axis names in the order of the table.
const std::vector<std::string> &axis_names();

// wanted: names of axes, all where empty.
Axes find_axes(const Subject &subject, const std::string &mesh_left_out,
               const std::vector<std::string> &wanted);

}  // namespace cli::cost
