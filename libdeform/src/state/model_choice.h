// What a body's model follows from, and which one it is to have later (doc/concepts/changing_models.md).
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

// A model parameter that differs from cell to cell, and who said so ("field", "materials", "share").
struct CellField {
  std::string key, from;
  uint32_t width;
  Array<double> values;
};

// What the body is made of, whichever model it has: stays with its mesh.
struct Makeup {
  std::vector<Material> materials;  // of its cells, by first cell
  std::vector<uint32_t> of;         // [ntet] index into materials; empty: the first for all
  std::vector<CellField> given;     // fields of its def
};

// Parameters of a model that somebody has given. Three arrays: a snapshot that claims many takes
// little memory.
struct ModelParams {
  std::string keys;              // a newline ends each
  std::vector<uint32_t> widths;  // [key]
  std::vector<double> values;    // of all keys, end to end
  bool operator==(const ModelParams &) const = default;
  bool sound() const {
    size_t sum = 0;
    for (const uint32_t width : widths) sum += width;
    return sum == values.size() && size_t(std::count(keys.begin(), keys.end(), '\n')) == widths.size() &&
           (keys.empty() || keys.back() == '\n');
  }
};

// What the present instance was made with, beside the makeup.
struct ModelOrigin {
  ModelParams params;
  Pose frame;                 // that puts the rest positions where the instance takes them to be
  uint32_t integrator = 0;    // DFM_INTEGRATOR_*; AUTO: the world's
  std::vector<uint8_t> held;  // [npoint] components, as the instance was told
};

// In place of a DFM_INTEGRATOR_*: that which the body has when its model changes.
inline constexpr uint32_t kSameIntegrator = DFM_INTEGRATOR_TR_BDF2 + 1;

// A model that a body is to have, in the words of dfm_body_set_model.
struct ModelChoice {
  std::string type;  // id
  ModelParams params;
  uint32_t integrator = kSameIntegrator;
  double max_jump = HUGE_VAL;  // J
  double stable = -1;  // s, explicit sub-step when it was made beforehand; infinite: any; negative: not known
};
// From the step on that begins at t or after it.
struct Switch {
  double t = 0;  // s
  ModelChoice to;
};

// Which model a body has by what it does and where it is.
enum class SwitchLevel : uint32_t { far, near, touching, undecided };
struct SwitchRule {
  ModelChoice touching, near, far;  // type empty: this one is not asked for; far is
  Vec3 point;                       // m, the place of interest
  double distance = 0;              // m from it within which the body is near
  double hysteresis = 0;            // share of the distance by which it has to be farther to be so no more
  double wait = 0;                  // s that a finer model stays when nothing calls for it
  // as it stands
  uint32_t level = uint32_t(SwitchLevel::undecided);
  double called = 0;    // s, when the level was last called for
  double refused = -1;  // s, when a change was last refused; negative: the last one was not
};

// A change of a model, made or refused.
struct Swap {
  uint64_t body = 0;  // handle
  double t = 0;       // s
  const dfm_type *from = nullptr, *to = nullptr;
  double before = 0, after = 0;  // J, elastic; NaN where the model gives none
  double max_jump = 0;           // J
  bool refused = false;
  bool unpaid = false;  // refused, because changes have put in too much
};

}  // namespace dfm
