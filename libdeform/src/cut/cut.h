// Cuts of a body between two steps: cells are removed, faces between cells open (doc/concepts/cutting.md).
#pragma once
#include <array>
#include <new>

#include "core/error.h"
#include "deform/cut.h"
#include "geometry/cut_shape.h"
#include "state/body.h"

namespace dfm {

struct BodyShape;
struct MadeShape;

struct CutReport : dfm_cut_info {
  uint32_t opened = 0;  // faces
  CutReport() : dfm_cut_info{} {}
};

// The functions that follow throw Error; then nothing has changed.
// Removes the first `most` of the cells that the shape meets.
CutReport remove_by_shape(Body &b, const CutShape &shape, uint32_t most);
CutReport remove_cells(Body &b, const Array<uint8_t> &removed);
// Opens the faces between two cells whose middles lie on opposite sides of the blade or plane: the first
// `most` on its way. Removes no cell.
CutReport split_by_blade(Body &b, const CutShape &blade, uint32_t most);

// Opens faces between present cells: pairs (mesh/cut_mesh.h), in any order.
CutReport open_faces(Body &b, const Array<uint64_t> &faces);

// The same in two calls (cut/cut_ahead.h), with faces between cells of the whole body. The first reads only
// what steps do not change; the body must have the same shape in the second. open_time: s, of the
// second.
std::unique_ptr<MadeShape> make_opened(const Body &b, const Array<uint64_t> &faces, double open_time);
std::unique_ptr<BodyShape> put_opened(Body &b, MadeShape &made);

// Present cells on both sides of a face of the whole body; kNone: it was removed.
std::array<uint32_t, 2> present_cells(const Body &b, uint64_t face);
uint64_t face_of_whole(const Body &b, uint64_t face);  // between present cells

// Reserves memory for n events beside those of contacts and attachments that a cut ends.
void reserve_cut_events(World &w, size_t n);

// Runs f; false: there was not enough memory for it.
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

// Moves a body without cells, or a piece that a restore takes back, out of the list that steps see, or back
// into it. Allocates nothing after reserve_places().
void reserve_places(World &w, size_t more);  // for all present bodies and `more` new ones
void set_place(World &w, Body &b, bool emptied, bool rolled_back) noexcept;

}  // namespace dfm
