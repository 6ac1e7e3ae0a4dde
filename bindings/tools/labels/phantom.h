// Volumes of labels that are made from ellipsoids, cylinders and boxes, with the volumes that these have:
// data for examples and tests that need no file from outside.
#pragma once
#include "label_volume.h"

namespace labels {

struct Phantom {
  Volume volume;
  std::vector<double> exact;  // [value.size()] m3, in closed form; 0 for the background
};
// kind: "abdomen" (fat, liver, lesion, two kidneys, spine; ends at the border of the volume) or "nodule" (a
// block of gel with a ball in it). voxel: m. Throws cli::Failure for another kind, or more than 1e8 voxels.
Phantom make_phantom(const std::string &kind, double voxel);

// NRRD with gzip, lengths in millimeters, names of the labels as 3D Slicer writes them.
std::string nrrd_text(const Volume &volume);

}  // namespace labels
