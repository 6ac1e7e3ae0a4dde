// Lasting contacts: the data that a contact keeps from step to step, found by its key: warm start, bristle
// state, events, hold measure, report of the last sub-step.
#pragma once
#include <span>

#include "contact/contact_set.h"
#include "core/memory.h"
#include "math/vec3.h"

namespace dfm {

struct ContactState;
class Tasks;

// Description of a column for code that handles all columns. `values`: valid values in a snapshot.
enum class ColumnValues : uint8_t { any, finite, not_negative, flag, feature, law };
// widths: number of columns of the state; not by contact, or not always present
inline constexpr uint32_t kPerState = ~0u, kOwnLength = ~0u - 1;
struct ContactColumn {
  const char *name;     // in a snapshot; null: not included, follows from the others
  uint32_t width;       // values per contact
  bool hashed = false;  // part of dfm_world_hash()
  bool carried = true;  // kept unchanged while its contact sleeps
  uint64_t entries(uint64_t n, uint64_t nstate) const {
    return n * (width == kPerState ? nstate : width == kOwnLength ? 1 : width);
  }
};
template <ColumnValues kValues>
struct ColumnOf : ContactColumn {
  static constexpr ColumnValues values = kValues;
};

struct ContactStore {
  // Columns over the contacts of the last sub-step, in their order. To add one, declare it here, name it in
  // each_column(), and fill it in keep_contacts().
  uint32_t n = 0, nstate = 0;
  double h = 0;  // s, the sub-step that the impulses belong to
  Array<uint64_t> key;
  Array<uint64_t> id_a, id_b;  // ids of the pair (obstacles have ids of the same sequence)
  // as in ContactPoint; type_b: what feature_b of a body is
  Array<uint32_t> feature_a, feature_b;
  Array<uint8_t> type_a, type_b;
  Array<uint32_t> by_key;         // indices in ascending key order
  Array<double> normal, tangent;  // [n,3]; the second tangent is their product
  Array<double> impulse;          // [n,3] N s on a, in this frame
  // The start of the next sub-step: N s along the normal, without what opened the contact; and [n,3] the
  // tangent, turned with the surfaces.
  Array<double> lasting, turned;
  Array<double> point;        // [n,3] m, midway between the closest points
  Array<double> gap, slip;    // m, distance less d_c; [n,2] m/s
  Array<double> bristle;      // [n,nstate] row-major
  Array<uint32_t> law;        // the law the bristles belong to
  Array<double> dwell, area;  // s in contact, m2
  // m2, area in the next sub-step (contact/renewal.h); empty where no law counts by area
  Array<double> next_area;
  Array<double> start_depth;      // m, of what a pair was found with, less what has opened since
  Array<double> stick_drift;      // [n,3] m, slip to be taken back (step/solve/friction_memory.h)
  Array<double> path;             // [n,2] m, net slip since hold_begin, in the frame
  Array<uint8_t> touching, held;  // held: touched and stuck in every sub-step since hold_begin
  Array<uint8_t> sticks, began;   // loaded, and at rest; touched for the first time in the last step
  Array<Crossing> crossings;      // edges that touch each other, ascending

  explicit ContactStore(const Memory &memory);
  uint32_t find(uint64_t key) const;  // index, or kNone
  void order();                       // by_key, from key
  bool bears(uint32_t i) const { return touching[i] && impulse[size_t{3} * i] > 0; }
  // N s on a: of friction, and in all
  Vec3 friction_impulse(uint32_t i) const {
    const Vec3 t = load3(&tangent[size_t{3} * i]), other = cross(load3(&normal[size_t{3} * i]), t);
    return impulse[size_t{3} * i + 1] * t + impulse[size_t{3} * i + 2] * other;
  }
  Vec3 world_impulse(uint32_t i) const {
    return impulse[size_t{3} * i] * load3(&normal[size_t{3} * i]) + friction_impulse(i);
  }
  void drop(uint64_t id);  // contacts of a thing that goes; for stores without next_area and crossings
};

// f(ColumnOf<..>, column of each store). Memory, reserved room, data of sleepers, the copy for the budget of
// a step, snapshot and hash use this list, in this order.
template <class F, class... Store>
void each_column(F &&f, Store &...c) {
  using V = ColumnValues;
  f(ColumnOf<V::any>{{"contact key", 1, true}}, c.key...);
  f(ColumnOf<V::any>{{"contact body", 1}}, c.id_a...);
  f(ColumnOf<V::any>{{"contact partner", 1}}, c.id_b...);
  f(ColumnOf<V::any>{{"contact feature", 1}}, c.feature_a...);
  f(ColumnOf<V::any>{{"contact partner's feature", 1}}, c.feature_b...);
  f(ColumnOf<V::feature>{{"kind of feature", 1}}, c.type_a...);
  f(ColumnOf<V::feature>{{"kind of partner's feature", 1}}, c.type_b...);
  f(ColumnOf<V::finite>{{"contact normal", 3}}, c.normal...);
  f(ColumnOf<V::finite>{{"contact tangent", 3}}, c.tangent...);
  f(ColumnOf<V::finite>{{"contact impulse", 3}}, c.impulse...);
  f(ColumnOf<V::finite>{{"lasting load", 1}}, c.lasting...);
  f(ColumnOf<V::finite>{{"turned tangent", 3}}, c.turned...);
  f(ColumnOf<V::finite>{{"contact point", 3}}, c.point...);
  f(ColumnOf<V::finite>{{"contact gap", 1}}, c.gap...);
  f(ColumnOf<V::finite>{{"slip", 2}}, c.slip...);
  f(ColumnOf<V::finite>{{"bristle", kPerState, true}}, c.bristle...);
  f(ColumnOf<V::law>{{"contact law", 1}}, c.law...);
  f(ColumnOf<V::not_negative>{{"dwell", 1}}, c.dwell...);
  f(ColumnOf<V::not_negative>{{"contact area", 1}}, c.area...);
  f(ColumnOf<V::not_negative>{{"area due", kOwnLength, true}}, c.next_area...);
  f(ColumnOf<V::not_negative>{{"start depth", 1}}, c.start_depth...);
  f(ColumnOf<V::finite>{{"slip owed", 3}}, c.stick_drift...);
  f(ColumnOf<V::finite>{{"hold path", 2}}, c.path...);
  f(ColumnOf<V::flag>{{"touching", 1}}, c.touching...);
  f(ColumnOf<V::flag>{{"in hold", 1}}, c.held...);
  f(ColumnOf<V::flag>{{"sticks", 1}}, c.sticks...);
  f(ColumnOf<V::flag>{{"began", 1, false, false}}, c.began...);
  f(ColumnOf<V::any>{{"crossings", kOwnLength, false, false}}, c.crossings...);
  f(ColumnOf<V::any>{{nullptr, 1, false, false}}, c.by_key...);
}

// Fresh contacts take over what their predecessors kept: the tangent turned with the normal (minimal
// rotation), impulse times h/h_old, bristles where the law is the same. `tangents` [n,3] out; impulse [n,3]
// and state.bristle are filled. match [n] out: index or kNone. tasks: null: on this thread alone.
void warm_start(const ContactStore &old, std::span<const ContactPoint> contacts, double h,
                Array<double> &impulse, ContactState &state, double *tangents, uint32_t *match,
                Tasks *tasks = nullptr);

// The tangent t of normal m rotated to normal n by the smallest rotation; a new tangent if the normals are
// more than 120 degrees apart.
Vec3 transport(Vec3 t, Vec3 m, Vec3 n, bool *reset);

}  // namespace dfm
