// All of a body that depends on which points and cells it has. A cut, and a snapshot from before or after
// one, makes it beside what the body has and exchanges the two, so that a body is cut as a whole or not at
// all.
#pragma once
#include "mesh/cut_mesh.h"
#include "state/body.h"
#include "world/body_model.h"

namespace dfm {

struct BodyShape {
  Phyxels p;
  Array<uint32_t> tets, edges;
  Surface surface;
  SurfaceZones zones;
  CutRecord cut;
  uint64_t shape = 0;
  Array<double> share, surfel_impulse, anchor;
  Makeup makeup;
  double mass = 0, rest_volume = 0;
  std::vector<Load> loads;
  std::vector<Spring> springs;
  std::vector<HeldMotion> motions;
  std::vector<SpareModel> spares;
  std::unique_ptr<SearchTree> search;
  BodyModel model;
};

void exchange(Body &b, BodyShape &other) noexcept;

// Names of the surface's features and the numbers that give the next ones; empty lists: make_shape() finds
// them.
struct FeatureNames {
  Array<uint32_t> of[kFeatureKinds];  // patches: by triangle
  uint32_t next[kFeatureKinds] = {};
};

// The body as it was made, for its record.
std::shared_ptr<const WholeBody> whole_of(const Body &b);

// Puts into `b` what a cut of its present mesh leaves, and what it had into the shape that is returned;
// exchange() with that undoes it. open: faces of the whole body. State, loads, springs, motions and held
// points follow the points, the model's state its slots. Throws Error, and then `b` is as it was.
std::unique_ptr<BodyShape> cut_body(Body &b, CutMesh &&mesh, Array<uint64_t> &&open);

// Puts into `b` the shape of a snapshot: a mesh cut from the whole body, which `b` has been or comes from.
// Its state is that of rest. names: of the surface; null: the whole body, which has no names of its own.
std::unique_ptr<BodyShape> restore_shape(Body &b, std::shared_ptr<const WholeBody> whole, CutMesh &&mesh,
                                         Array<uint64_t> &&open, FeatureNames *names);

}  // namespace dfm
