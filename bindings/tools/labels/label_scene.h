// From a volume of labels to surfaces, bodies, voxel obstacles and a scene, as files in one folder.
#pragma once
#include <string>
#include <vector>

#include "deform/deform.h"
#include "label_surface.h"
#include "label_table.h"

namespace labels {

struct Options {
  std::string volume, table, out;  // table: empty: defaults
  double unit = 0;                 // m; 0: as the file says
  double spacing = -1;     // m: voxels are joined up to about this length; 0: never; below 0: by the size
  uint32_t passes = 10;    // of smoothing
  uint32_t cells = 10000;  // of all bodies together, about
};

// What was made of one label.
struct LabelReport {
  int64_t value = 0;
  std::string name, thing;
  size_t voxels = 0, changed = 0;  // in the file; changed so that it does not touch itself
  double voxel_volume = 0, volume = 0, cell_volume = 0;  // m3: of its voxels, its surface, its cells
  uint32_t triangles = 0, cells = 0;
  bool at_border = false, obstacle = false;
};
struct ThingReport {
  std::string name;
  bool obstacle = false;
  uint32_t points = 0, triangles = 0, cells = 0;
  double quality_min = 0, quality_mean = 0;  // mean ratio of its cells, 1 for a regular tetrahedron
  double farthest = 0;  // m, of its cells' boundary from the surface of its labels, where it has the former
};
struct Border {
  std::string a, b;
  uint32_t points = 0, triangles = 0;
  bool held = false;                  // b is an obstacle; else attached by the spring and damper
  double stiffness = 0, damping = 0;  // N/m, N s/m
};
struct Report {
  std::array<uint32_t, 3> size{}, factor{};  // voxels of the file, and how many were joined
  std::vector<LabelReport> labels;
  std::vector<ThingReport> things;
  std::vector<Border> borders;
  size_t open_edges = 0, crossing = 0, restored = 0;
  std::string scene_hash;     // of scene.json: who changes it then does not lose it
  double largest_change = 0;  // of a label's volume, share of that of its voxels
  std::vector<std::string> warnings;
};

// Writes scene.json, labels.json, NAME.obj for each body and obstacle, NAME.vtk for each body, and
// surfaces/NAME.obj for each label. Throws cli::Failure.
Report make_scene(dfm_context *context, const Options &options);

}  // namespace labels
