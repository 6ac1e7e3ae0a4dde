// Names of the features of a surface that a cut has remade (geometry/surface.h), and its zones.
#pragma once
#include <string>

#include "mesh/cut_mesh.h"
#include "state/body.h"

namespace dfm {

struct FeatureNames;

inline constexpr char kCutGroup[] = "cut";  // of the triangles that cuts have laid open

// A feature whose points are those of one before has its name, if no lower one has taken it; a patch has that
// of the first of its triangles which was there before. Others get new names. `record` gets the next ones.
void name_features(const Body &before, const CutMesh &mesh, Surface &surface, CutRecord &record);

// Which triangles lay on others before a cut opened their face: fills laid, laid_surfel, slit.
void find_laid(const Memory &memory, const WholeBody &whole, const CutRecord &record, Surface &surface);

// As a snapshot has them. Throws Error where they do not fit the surface.
void take_names(const std::string &body, FeatureNames &names, Surface &surface, CutRecord &record);

// A triangle of the whole body's surface keeps its zone; one that a cut has laid open is of the group "cut"
// and of the material of its cell.
void make_cut_zones(const Memory &memory, const WholeBody &whole, const CutRecord &record,
                    const Makeup &makeup, const Array<uint32_t> &tets, const Surface &surface,
                    SurfaceZones &out);

}  // namespace dfm
