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
  std::vector<BladeTrack> blades;
  std::unique_ptr<SearchTree> search;
  BodyModel model;
};

void exchange(Body &b, BodyShape &other) noexcept;

// What a shape takes over from the one before, wherever that stands now.
struct Former {
  const Phyxels &p;
  const Array<uint32_t> &tets, &edges;
  const std::vector<Load> &loads;
  const std::vector<Spring> &springs;
  const std::vector<HeldMotion> &motions;
  const ModelInstance &model;
  Integrator integrator;
  bool parts = false;  // another body takes the rest: springs are shared
};
Former former(const BodyShape &s);
Former former(const Body &b);

// Names of the surface's features and the numbers that give the next ones; empty lists: make_shape() finds
// them.
struct FeatureNames {
  Array<uint32_t> of[kFeatureKinds];  // patches: by triangle
  Array<NamedBy> named;               // as in Surface
  uint32_t next[kFeatureKinds] = {};
};

// The body as it was made, for its record.
std::shared_ptr<const WholeBody> whole_of(const Body &b);

// Puts into `b` what a cut of its present mesh leaves, and what it had into the shape that is returned;
// exchange() with that undoes it. open: faces of the whole body. State, loads, springs, motions and held
// points follow the points, the model's state its slots. Throws Error, and then `b` is as it was.
// parts: another body takes the rest of the cells.
std::unique_ptr<BodyShape> cut_body(Body &b, CutMesh &&mesh, Array<uint64_t> &&open, bool parts);
// Puts into `piece`, which has no shape or one that it loses, a part of the present mesh of `from`, with its
// state. Throws Error, and then the piece has the shape that it had.
void shape_piece(const Body &from, CutMesh &&mesh, Array<uint64_t> &&open, Body &piece);

// Puts into `b` the shape of a snapshot: a mesh cut from the whole body, which `b` has been or comes from.
// Its state is that of rest. names: of the surface; null: the whole body, which has no names of its own.
// like: has the model that the body gets, and how it was made: `b` itself, or the body that it is a piece of.
std::unique_ptr<BodyShape> restore_shape(Body &b, const Body &like, std::shared_ptr<const WholeBody> whole,
                                         CutMesh &&mesh, Array<uint64_t> &&open, FeatureNames *names);

}  // namespace dfm
