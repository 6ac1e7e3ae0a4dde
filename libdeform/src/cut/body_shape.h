// A cut, and a restore across a cut, make a new shape and exchange it with that of the body, so that a cut is
// complete or has no effect.
#pragma once
#include "body/feature_map.h"
#include "body/self_rest.h"
#include "mesh/cut_mesh.h"
#include "state/body.h"
#include "state/search_tree.h"
#include "world/body_model.h"

namespace dfm {

void exchange(Body &b, BodyShape &other) noexcept;

// Names of the features of the surface and the next free names; empty lists: make_shape() finds them.
struct FeatureNames {
  Array<uint32_t> of[kFeatureKinds];  // patches: by triangle
  Array<NamedBy> named;               // as in Surface
  uint32_t next[kFeatureKinds] = {};
};

// The original body, for its record.
std::shared_ptr<const WholeBody> whole_of(const Body &b);

// A shape that a body may take, complete but for what steps change.
struct MadeShape {
  CutMesh mesh;  // numbers of `b` before
  std::unique_ptr<BodyShape> shape;
  std::vector<uint32_t> edge, surfel;  // previous numbers, or kNone
  FeatureMap features;
  std::shared_ptr<const SelfList> list;  // of the surface before, for lists that nobody else has; or null
};
// The shape of the mesh that a cut leaves. Reads what steps do not change, and nothing of the state: any
// thread may do it, if no other one changes `b` meanwhile other than by steps. open: as below. open_time:
// with all that the step would make that begins at this time, s; null: without. Throws Error.
std::unique_ptr<MadeShape> make_shape(const Body &b, CutMesh &&mesh, Array<uint64_t> &&open,
                                      const double *open_time);
// All that make_shape() reads of a body: of the present one, and of what is left of it.
std::unique_ptr<Body> structure_of(const Body &b);
std::unique_ptr<Body> structure_left(const Body &before, MadeShape &made);
// Puts it into the body, with the state of the body, as cut_body() does. ahead: as it was made; the longest
// explicit sub-step is that at rest then, and not that of now. from: the body that this is a piece of; null:
// itself.
std::unique_ptr<BodyShape> take_shape(Body &b, MadeShape &made, bool parts, bool ahead,
                                      const Body *from = nullptr);

// Gives `b` the mesh that a cut leaves, and returns the previous shape; exchange() with it undoes the cut.
// open: faces of the whole body. State, loads, springs, motions and held points follow the points; the state
// of the model follows its slots. Throws Error; then `b` is unchanged. parts: another body takes the other
// cells.
std::unique_ptr<BodyShape> cut_body(Body &b, CutMesh &&mesh, Array<uint64_t> &&open, bool parts);
// Gives `piece` a part of the present mesh of `from`, with its state; a previous shape of the piece is
// dropped. Throws Error; then the piece is unchanged.
void shape_piece(const Body &from, CutMesh &&mesh, Array<uint64_t> &&open, Body &piece);

// Gives `b` the shape of a snapshot: a mesh cut from the whole body of `b`. Its state is that at rest, and it
// has no model yet. names: of the surface; null: the whole body, which has no own names. like: `b` itself, or
// the body of which it is a piece.
std::unique_ptr<BodyShape> restore_shape(Body &b, const Body &like, std::shared_ptr<const WholeBody> whole,
                                         CutMesh &&mesh, Array<uint64_t> &&open, FeatureNames *names);

}  // namespace dfm
