// Closed surfaces of labels that share their borders: one vertex at a corner of voxels where labels meet, one
// quadrilateral (two triangles) on each voxel face between two labels. Neighbors own the same vertices.
//
//        +---+---+---+            voxels of labels 1 and 2 and their border: vertices at corners, moved by
//        | 1 | 1 | 2 |            smoothing by at most half a voxel
//        +---o---o---+
//        | 1 | 2 | 2 |
//        +---+---+---+
#pragma once
#include "label_volume.h"

namespace labels {

// What lies beyond the border of the volume.
constexpr uint16_t kOutside = 0xffff;

// Voxels that were changed so that no label, and no group of labels, touches itself along an edge or at a
// corner alone: there its surface would not be one of a solid.
struct Repaired {
  size_t voxels = 0;
  std::vector<size_t> of_label;  // [value.size()] voxels that a label has lost
};
// group: [value.size()] which labels form one solid, by any number; 0 is the background's.
// Throws cli::Failure where it finds no way.
Repaired compose(const std::string &path, Volume &volume, const std::vector<uint32_t> &group);

// One voxel for a block of `factor` voxels per axis: the label that most of them have, of those with equal
// votes the first in `value`.
Volume coarsened(const Volume &volume, const std::array<uint32_t, 3> &factor);

// The part with labels, and one layer around it where the volume has one: what reaches the end of it reaches
// the border of the volume.
Volume cropped(const Volume &volume);

struct Surfaces {
  std::vector<double> points;       // [npoint,3] m
  std::vector<uint32_t> triangles;  // [ntriangle,3]
  // [ntriangle] labels (index into value, or kOutside) behind a triangle and in front of it: its corners turn
  // counter-clockwise seen from the front
  std::vector<std::array<uint16_t, 2>> sides;
  std::vector<double> volume;  // [value.size()] m3 enclosed
  size_t restored = 0;         // vertices that went back toward their corner, so that nothing crosses
  size_t crossing = 0;         // pairs of triangles that cross or fold onto each other: 0
};
// target: [value.size()] m3, volumes that smoothing is to keep. passes: of smoothing; 0: corners of voxels.
Surfaces surfaces_of(const Volume &cropped, const std::vector<double> &target, uint32_t passes);

// The surface around some labels, outward. from: [npoint] place of each of its points in `surfaces`.
struct Shell {
  std::vector<double> points;
  std::vector<uint32_t> triangles, from;
  std::vector<uint16_t> beyond;  // [ntriangle] label in front
  size_t open_edges = 0;         // edges that have not exactly two triangles of opposite direction: 0
  double volume = 0;             // m3
};
Shell shell_of(const Surfaces &surfaces, const std::vector<bool> &inside);

}  // namespace labels
