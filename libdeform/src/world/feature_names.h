// Names of the features of a surface that a cut has remade (geometry/surface.h), and its zones.
#pragma once
#include <string>

#include "mesh/cut_mesh.h"
#include "state/body.h"

namespace dfm {

struct FeatureNames;

inline constexpr char kCutGroup[] = "cut";  // group of the triangles that cuts have exposed

// A feature with the points of a previous one keeps its name, unless a lower one has taken it; a patch keeps
// that of its first triangle that existed before. Others get new names. `record` gets the next free names.
void name_features(const Body &before, const CutMesh &mesh, Surface &surface, CutRecord &record);

// Finds the triangles that coincided before a cut opened their face: fills laid, laid_surfel, slit.
void find_laid(const Memory &memory, const WholeBody &whole, const CutRecord &record, Surface &surface);

// Sets names from a snapshot. Throws Error if they do not fit the surface.
void take_names(const std::string &body, FeatureNames &names, Surface &surface, CutRecord &record);

// A triangle of the surface of the whole body keeps its zone; one that a cut has exposed belongs to the group
// "cut" and has the material of its cell.
void make_cut_zones(const Memory &memory, const WholeBody &whole, const CutRecord &record,
                    const Makeup &makeup, const Array<uint32_t> &tets, const Surface &surface,
                    SurfaceZones &out);

}  // namespace dfm
