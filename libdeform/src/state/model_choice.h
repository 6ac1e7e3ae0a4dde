// The inputs of a body's model, and its future changes (doc/concepts/changing_models.md).
#pragma once
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/memory.h"
#include "deform/plugin.h"
#include "deform/world.h"
#include "state/material.h"
#include "state/motion.h"

namespace dfm {

// A model parameter that differs between cells, and its source ("field", "materials", "share").
struct CellField {
  std::string key, from;
  uint32_t width;
  Array<double> values;
};

// The material of the body, independent of its model: stays with its mesh.
struct Composition {
  std::vector<Material> materials;  // of its cells, by first cell
  std::vector<uint32_t> of;         // [ntet] index into materials; empty: the first for all
  std::vector<CellField> given;     // fields of its def
};

// Parameters of a model that the host has given. Three arrays, so that a damaged snapshot that claims many of
// them takes little memory.
struct ModelParams {
  std::string keys;              // a newline ends each
  std::vector<uint32_t> widths;  // [key]
  std::vector<double> values;    // of all keys, end to end
  bool operator==(const ModelParams &) const = default;
  bool is_valid() const {
    size_t sum = 0;
    for (const uint32_t width : widths) sum += width;
    return sum == values.size() && size_t(std::count(keys.begin(), keys.end(), '\n')) == widths.size() &&
           (keys.empty() || keys.back() == '\n');
  }
};

// The inputs of the present instance other than the composition.
struct ModelOrigin {
  ModelParams params;
  Pose frame;                 // takes the rest positions to where the instance expects them
  uint32_t integrator = 0;    // DFM_INTEGRATOR_*; AUTO: the world's
  std::vector<uint8_t> held;  // [npoint] held components, as given to the instance
};

// Used instead of a DFM_INTEGRATOR_*: keep the integrator that the body has when its model changes.
inline constexpr uint32_t kSameIntegrator = DFM_INTEGRATOR_TR_BDF2 + 1;

// A requested model, with the fields of dfm_body_set_model.
struct ModelChoice {
  std::string type;  // id
  ModelParams params;
  uint32_t integrator = kSameIntegrator;
  double max_jump = HUGE_VAL;  // J
  // s, explicit sub-step if the model was made in advance; infinite: any; negative: unknown
  double stable = -1;
};
// Takes effect in the first step that begins at t or later.
struct Switch {
  double t = 0;  // s
  ModelChoice to;
};

// Rule that selects a model by contact and distance.
enum class SwitchLevel : uint32_t { far, near, touching, undecided };
struct SwitchRule {
  ModelChoice touching, near, far;  // an empty type means unused; far is always used
  Vec3 point;                       // m, the place of interest
  double distance = 0;              // m from it within which the body is near
  double hysteresis = 0;  // share of the distance that must be exceeded before the body is far again
  double wait = 0;        // s for which a finer model is kept after it is no longer needed
  // present state
  uint32_t level = uint32_t(SwitchLevel::undecided);
  double called = 0;    // s, when the level was last needed
  double refused = -1;  // s, when a change was last refused; negative: the last one was made
};

// A change of a model, made or refused.
struct Swap {
  uint64_t body = 0;  // handle
  double t = 0;       // s
  const dfm_type *from = nullptr, *to = nullptr;
  double before = 0, after = 0;  // J, elastic; NaN if the model has no energy
  double max_jump = 0;           // J
  bool refused = false;
  bool unpaid = false;  // refused because changes have added too much energy
};

}  // namespace dfm
