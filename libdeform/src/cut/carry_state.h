// What a body carries over into its shape after a cut, other than its points: loads, the state of its model,
// names of the features of its surface (geometry/surface.h), zones.
#pragma once
#include <string>

#include "mesh/cut_mesh.h"
#include "state/body.h"

namespace dfm {

struct FeatureNames;

inline constexpr char kCutGroup[] = "cut";  // group of the triangles that cuts have exposed

// `before`: the previous shape of the body, or of the body that it came from; the mesh maps present to
// previous numbers. Lasting loads, springs and motions of points. A load on a split point is divided among
// its copies in proportion to their masses; a load on a removed point is removed. parts: another body takes
// the other cells: springs are shared.
void carry_loads(const BodyShape &before, const CutMesh &mesh, bool parts, Body &b);
// [nedge] previous numbers, kNone for new ones; edges are in lexicographic order.
std::vector<uint32_t> edges_before(const Array<uint32_t> &before, const CutMesh &mesh,
                                   const Array<uint32_t> &now);
// The state of the model: slots by point, cell, edge and instance; new edges start in the initial state.
void carry_state(const BodyShape &before, const CutMesh &mesh, const std::vector<uint32_t> &edge, Body &b);
// [nsurfel] previous numbers; kNone for new ones, and for copies but the first.
std::vector<uint32_t> surfels_before(const Body &before, const CutMesh &mesh, const Surface &now);
// Impulses of surfels; new ones have none.
void carry_surfels(const Array<double> &from, const std::vector<uint32_t> &surfel, Array<double> &to);

// A feature with the points of a previous one keeps its name, unless a lower one has taken it; a patch keeps
// that of its first triangle that existed before. Others get new names. `record` gets the next free names.
void name_features(const Body &before, const CutMesh &mesh, Surface &surface, CutRecord &record);

// Finds triangles that coincided before a cut opened their face: fills coincident, coincident_surfel, slit.
void find_coincident(const Memory &memory, const WholeBody &whole, const CutRecord &record, Surface &surface);

// Sets names from a snapshot. Throws Error if they do not fit the surface.
void take_names(const std::string &body, FeatureNames &names, Surface &surface, CutRecord &record);

// A triangle of the surface of the whole body keeps its zone; one that a cut has exposed belongs to the group
// "cut" and has the material of its cell.
void make_cut_zones(const Memory &memory, const WholeBody &whole, const CutRecord &record,
                    const Composition &composition, const Array<uint32_t> &tets, const Surface &surface,
                    SurfaceZones &out);

}  // namespace dfm
