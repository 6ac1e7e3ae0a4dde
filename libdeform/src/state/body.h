// A soft body: its points, surface, model, dynamics, and its prescribed loads and motions.
#pragma once
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "body/zones.h"
#include "deform/deform.h"
#include "dynamics/dynamics.h"
#include "dynamics/mass_scaling.h"
#include "state/cut_record.h"
#include "state/energy_book.h"
#include "state/model_choice.h"
#include "state/motion.h"
#include "state/sleep.h"

namespace dfm {

class SearchTree;
struct FormerSurface;
struct SelfRest;
struct World;

// An entry of a material, or a field (material empty), that the body's model has no parameter for.
struct Unused { std::string key, material; };

// A lasting load: force[i] on points[i], times the keyed scale, times 1 + sine.
struct Load {
  uint32_t number;
  std::vector<uint32_t> points;
  std::vector<double> force;
  std::vector<dfm_scale_key> keys;
  dfm_sine sine{};
};
// A spring of rest length zero from the weighted mean of points to a place, or a path of places.
struct Spring {
  uint32_t number;
  std::vector<uint32_t> points;
  std::vector<double> weights;
  std::vector<dfm_vector_key> keys;
  Vec3 to;
  double stiffness, damping;
};
// Held points carried by keyed poses (relative to the first key) and a sine.
struct HeldMotion {
  std::vector<uint32_t> points;
  std::vector<double> start;
  std::vector<dfm_pose_key> keys;
  dfm_sine sine{};
};

inline constexpr int32_t kNoCoupling = -1;

// By which integrator a body moves. step: s, the longest explicit sub-step of the body as its model was made;
// infinite: none, or not computed.
// chosen: what the library has chosen where it was left to it. in_impact: implicit time, but explicit until
// an impact is over (step/impact.h).
enum class Chosen : uint32_t { no, explicitly, implicit, in_impact };
struct Integrator {
  uint32_t used = DFM_INTEGRATOR_SYMPLECTIC_EULER;
  bool open = false;  // prepare() is to choose it
  Chosen chosen = Chosen::no;
  double step = std::numeric_limits<double>::infinity();
  uint32_t point = 0;  // that bounds it
  // What the spectrum at rest has of the bound by row sums, with these parameters; 1: not measured, or the
  // body has been cut: faces that jam gain energy at longer sub-steps.
  double share = 1;
};

// What the list of effects has left out of a model: the values as they were given, all rows end to end
// (empty: nothing is left out), and, [nparam], the rows whose differences between cells are left out.
struct SwitchedOff {
  std::vector<double> requested;
  std::vector<uint8_t> by_cell;
};

// [nparam] 1: there is a field of that row.
std::vector<uint8_t> differs_by_cell(const dfm_type &type, const std::vector<CellField> &fields);

struct CachedModel {
  ModelInstance instance;
  ModelOrigin origin;
  SwitchedOff switched_off;
  const std::vector<double> &requested() const {
    return switched_off.requested.empty() ? instance.params : switched_off.requested;
  }
};

// The pressure of what touches a body, a running mean (step/step_bound.cpp).
struct Squeezed {
  double pressure = 0, at = 0;  // Pa; s, of the last look
  double since = 0;             // s, of the last look at which it was small
  double weight = 0;            // Pa, its own, if it has been reported
  bool reported = false;
};

// How a body moves: model instance and dynamics, with the inputs of both.
struct BodyModel {
  ModelInstance model;
  std::unique_ptr<Dynamics> dynamics;  // of points and model of the body that has it
  std::vector<CellField> fields;
  std::vector<Unused> unused;
  ModelOrigin origin;
  SwitchedOff switched_off;
  Integrator integrator;
};

// Cells of a body, and what follows from them and from the points at rest alone.
struct Structure {
  Array<uint32_t> tets, edges;
  // DFM_CELL_*; nodes of cells that are not first-order tetrahedra, of which `tets` has several each in turn
  uint32_t cell_type = 8;
  Array<uint32_t> cells;
  Array<uint32_t> inner;  // [n,2] cells on both sides of inner faces; empty: not needed so far
  Surface surface;
  SurfaceZones zones;
  double smooth = 0;  // degrees, of make_bulges(); 0: faces are flat
  CutRecord cut;
  // a new number after each cut: what is derived from points, cells or surface is out of date
  uint64_t shape = 0;
  Array<double> share;   // [ntet] how much of each cell is material; empty: all
  Array<double> inside;  // [ncell,27] the same of hexahedra, as dfm_mesh_info has it; empty: all
  Composition composition;
};

// What lasts by points. Snapshots have it.
struct OnPoints {
  std::vector<Load> loads;
  std::vector<Spring> springs;
  std::vector<HeldMotion> motions;
  std::vector<BladeTrack> blades;  // of the last cuts
  Array<double> anchor;            // [n,4] m, positions when it came to rest; empty if sleep is off
};

// Points and cells of a body, and what depends on them. A cut exchanges it for another (cut/body_shape.h).
struct BodyShape : Structure, OnPoints, BodyModel {
  Phyxels p;
  Vec3 corner(size_t cell, size_t k) const { return p.x_at(tets[4 * cell + k]); }
  uint32_t ncell() const { return static_cast<uint32_t>(tets.size() / 4); }
  Array<double> surfel_impulse;  // [nsurfel,3] N s of the last sub-step
  double mass = 0, rest_volume = 0;
  // instances for future changes; they keep what they computed from the mesh
  std::vector<CachedModel> cached_models;
  std::unique_ptr<SearchTree> search;   // rays and closest points
  std::unique_ptr<SelfRest> self_rest;  // made with a cut; null: made when it is needed
};

// What lasts of a body beside its points and its model. Snapshots have it.
struct BodyState {
  uint32_t category = 1, collides_with = ~0u;
  SeparateRule separate;
  std::vector<PlannedCut> planned_cuts;  // by time
  std::vector<Switch> switches;          // future changes, by time
  std::vector<SwitchRule> rule;          // one or none
  uint64_t first_model = 0;              // hash of the model's inputs when the world took its first step
  uint32_t next_load = 1;                // number of the next load or spring
  Vec3 contact_impulse;                  // N s since creation
  EnergyBook energy;
  ChangeBook changes;
  SleepState sleep_state;
};

struct Body : BodyShape, BodyState {
  static constexpr char kKind[] = "body";
  World *world = nullptr;
  uint64_t id = 0, handle = 0;
  uint32_t slot = 0;
  std::string name, material;
  bool sensor = false;  // reports what overlaps it, and pushes nothing
  bool tears = false;   // a material of its cells tears at a limited strain
  void *user = nullptr;

  std::recursive_mutex querying;  // one query of the model at a time, from any thread
  uint64_t x_version = 1;         // increases whenever p.x may have changed
  bool emptied = false;           // a cut has removed all cells; the body is in World::emptied
  uint64_t piece_of = 0;          // id of the body, made by the host, of which this one is a piece; 0: none
  std::string whole_name;    // name of that body; its rules of friction and contact apply to this piece too
  bool rolled_back = false;  // a piece that a restore has removed; it is in World::rolled_back
  CutsAhead ahead;
  int32_t coupling = kNoCoupling;  // DFM_COUPLING_* of a surface of its own
  double support = 0;              // of that coupling, as in the def
  MassScaling scaling;             // of p.mass, for the model that it was made with
  // as last computed; valid while asleep
  struct {
    bool known = false, near = false;  // near: it has contacts or attachments
    StepBound found;
    uint32_t inverted = 0;
    double strain_rate = 0;  // 1/s, of the edge that stretches fastest
  } bound;
  Squeezed squeezed;
  // until prepare() has seen it: the surface before the last cut, and where its features are now
  std::unique_ptr<FormerSurface> former_surface;

  Body();
  ~Body();
  bool loads_vary() const;
  void relax_dampers();         // as if the velocities had been the same for long
  double young() const;         // Pa, the largest of all cells; 0: the model has no such parameter
  double impulse_time() const;  // s that surfel_impulse belongs to; 0: nothing may touch any more
};

}  // namespace dfm
