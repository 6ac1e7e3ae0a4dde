// Cells leave a body between two steps, and faces between cells open (doc/concepts/cutting.md).
#pragma once
#include <new>

#include "core/error.h"
#include "geometry/cut_shape.h"
#include "state/body.h"

namespace dfm {

struct MadeShape;

struct CutReport {
  uint32_t removed = 0;             // cells
  uint32_t opened = 0;              // faces
  uint32_t left = 0;                // cells that the shape meets and that its limit has left
  uint32_t copies = 0;              // of points
  uint32_t parts = 0;               // that the body consists of now
  uint32_t pieces = 0;              // bodies that have come off it
  double area = 0;                  // m2 of triangles that have come to the surface, at rest
  double mass = 0;                  // kg, taken away
  Vec3 momentum;                    // N s, taken away
  double kinetic = 0, elastic = 0;  // J, taken away; elastic NaN where the model gives none
  double fracture = 0;              // J, that opening the faces takes
  Vec3 force;                       // N, on the blade: by which its way takes that work
};

// Throws Error, in one sentence, where the body cannot be cut while it has this model.
void check_may_cut(const Body &b, const ModelInstance &model);

// Throw Error, and then nothing has changed.
// The first `most` of the cells that the shape meets go.
CutReport remove_by_shape(Body &b, const CutShape &shape, uint32_t most);
CutReport remove_cells(Body &b, const Array<uint8_t> &removed);
// Faces between cells whose middles lie on both sides of the blade or plane open, the first `most` on its
// way. No cell goes.
CutReport split_by_blade(Body &b, const CutShape &blade, uint32_t most);

// Opens faces between present cells: pairs (mesh/cut_mesh.h), in any order.
CutReport open_faces(Body &b, const Array<uint64_t> &faces);

// The same in two parts (world/cut_ahead.h), with faces between cells of the whole body. The first reads what
// steps do not change; the second takes it if the body has the same shape still. due: s, when that is.
std::unique_ptr<MadeShape> make_opened(const Body &b, const Array<uint64_t> &faces, double due);
void put_opened(Body &b, MadeShape &made);

uint32_t present_cell(const Body &b, uint32_t whole);           // kNone: it has gone
uint64_t face_of_whole(const Body &b, uint32_t i, uint32_t j);  // between present cells

// Reserves this many events after those of what a cut ends, so that the result of a cut can be reported.
void reserve_cut_events(World &w, size_t n);

// Whether f had the memory that it needs.
template <class F>
bool found_memory(F &&f) {
  try {
    f();
    return true;
  } catch (const std::bad_alloc &) {
    return false;
  } catch (const Error &e) {
    if (e.status != DFM_E_NOMEM) throw;
    return false;
  }
}

// Kinetic energy, J.
double kinetic_of(const Body &b);

// Puts a body without cells, or a piece that a restore takes back, where steps do not see it, and back;
// allocates nothing once there is room.
void reserve_places(World &w, size_t more);  // for all bodies that there are, and `more`
void set_place(World &w, Body &b, bool emptied, bool undone) noexcept;

}  // namespace dfm
