// org.deform.msm_gpu and org.deform.corotational_fem_gpu: the springs and cells of org.deform.msm, the
// cells of org.deform.corotational_fem, moved in explicit sub-steps on a compute device (Zerbato 2010,
// (2.25), (2.26), 2.1.2 and 7.1); the bodies step themselves.
#include <cstring>

#include "../model_common/spring_mask.h"
#include "../model_common/stepper.h"
#include "cells.h"
#include "deform/plugin_draft.h"
#include "gpu_body.h"
#include "springs.h"
#include "vulkan_stepper.h"

namespace gpu {

namespace {
// One device for each choice, open until the last host has gone, since opening takes longer than the set-up
// of a body. No static variable here has a destructor: it would leave memory when the file is unloaded.
struct Devices { std::shared_ptr<Vulkan> open[3]; };
std::mutex one;
uint32_t hosts = 0;
Devices *devices = nullptr;
}  // namespace

std::unique_ptr<Stepper> open_stepper(const dfm_host *host, const char *who, Choice choice, uint32_t npoint) {
  try {
    std::shared_ptr<Vulkan> vulkan;
    {
      const std::lock_guard<std::mutex> alone(one);
      if (!devices) devices = new Devices;
      std::shared_ptr<Vulkan> &open = devices->open[choice];
      if (!open) {
        open = std::make_shared<Vulkan>(Wanted(choice));
        host->log(host->ctx, 1, 0, (std::string(who) + ": its bodies are on " + open->name + ".").c_str());
      }
      vulkan = open;
    }
    return std::make_unique<VulkanStepper>(std::move(vulkan), npoint);
  } catch (const std::string &why) {
    model::refuse(host, who, "%s", why.c_str());
  }
}

namespace {

const dfm_effect_row kOfCells[] = {{"damping", Cells::kDampingStiffness, 0, 0},
                                   {"damping", Cells::kDampingMass, 0, 0}};
template <class Of>
const dfm_effect_rows kEffectRows = model::rows_of(kOfCells);
template <>
const dfm_effect_rows kEffectRows<Springs> = model::rows_of(msm::kOff);
// state follows by slot
const dfm_topology kTopology = {sizeof(dfm_topology), 0, nullptr};
const dfm_seen_velocity kSeenVelocity = {sizeof(dfm_seen_velocity), 0};

// The tables of the model on bodies Of.
template <class Of>
struct Tables {
  using One = Body<Of>;
  using Ops = model::StepperOps<One>;

  static dfm_status create(const dfm_host *h, const dfm_mesh *m, void **self) {
    return model::create<One>(h, m, Of::kId, self);
  }
  static dfm_status set_params(void *self, const double *params) {
    One &of = *static_cast<One *>(self);
    return Of::valid(of.host, params) ? model::change(of, params) : DFM_E_ARG;
  }
  static dfm_status state_init(const void *self, double *state) {
    static_cast<const One *>(self)->begin(state);
    return DFM_OK;
  }
  static constexpr dfm_slots kSlots = {sizeof(dfm_slots), 2, One::kSlots, 0, 0},
                             kWithBranches = {sizeof(dfm_slots), 4, One::kSlots, 0, 0};
  static const void *extension(const void *self, const char *id) {
    if (!strcmp(id, DFM_EXT_SLOTS))
      return static_cast<const One *>(self)->has_branch() ? &kWithBranches : &kSlots;
    if (!strcmp(id, "dfm.stepper/1")) return &Ops::kStepper;
    if (!strcmp(id, DFM_EXT_EFFECTS)) return &Ops::kActiveEffects;
    if (!strcmp(id, DFM_EXT_EFFECT_ROWS)) return &kEffectRows<Of>;
    if (!strcmp(id, DFM_EXT_IDLE)) return &Ops::kIdle;
    if (!strcmp(id, DFM_EXT_FACTS)) return &Ops::kFacts;
    if (!strcmp(id, DFM_EXT_TOPOLOGY)) return &kTopology;
    if (!strcmp(id, DFM_EXT_SEEN_VELOCITY)) return &kSeenVelocity;
    if constexpr (std::is_same_v<Of, Springs>)
      if (!strcmp(id, DFM_EXT_SPRING_MASK)) return &msm::SpringMask<One>::kTable;
    return nullptr;
  }
  static constexpr dfm_model model(uint32_t caps) {
    dfm_model t = model::bare_table<One>(caps | DFM_CAP_ENERGY | DFM_CAP_DAMPING | DFM_CAP_ROTATION_INVARIANT,
                                         create, set_params, state_init, extension);
    t.bound = Ops::bound;
    t.energy = Ops::energy;
    return t;
  }
  static constexpr dfm_type type(const char *name, const char *source, const char *const *effects,
                                 const dfm_model *of) {
    return dfm::plugin::type(DFM_KIND_MODEL, Of::kId, name, "0.1.0", "MIT", source, Of::kRows.of, effects,
                             of);
  }
};

const dfm_model kSpringModel = Tables<Springs>::model(DFM_CAP_PLAUSIBLE);
const dfm_model kCellModel = Tables<Cells>::model(0);
const char *const kCellEffects[] = {"volume", "large_rotation", "damping", nullptr};
const dfm_type kSpringType = Tables<Springs>::type(
    "mass-spring on a compute device",
    "Zerbato 2010, (2.25), (2.26) and 7.1; Van Gelder 1998, Approximate simulation of elastic membranes by "
    "triangulated spring meshes",
    msm::kEffects, &kSpringModel);
const dfm_type kCellType = Tables<Cells>::type(
    "corotational finite elements on a compute device",
    "Zerbato 2010, (2.1)-(2.13) corrected, and 7.1; Mueller and Gross 2004, Interactive virtual materials",
    kCellEffects, &kCellModel);

void shut_down() {
  const std::lock_guard<std::mutex> alone(one);
  if (--hosts > 0) return;
  delete devices;
  devices = nullptr;
}

}  // namespace
}  // namespace gpu

extern "C" DFM_EXPORT const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi,
                                                         uint32_t host_abi_min) {
  using namespace gpu;
  static const dfm_type *const types[] = {&kSpringType, &kCellType};
  static const dfm_plugin plugin = {sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 2, types, shut_down};
  const dfm_plugin *const made = dfm::plugin::publish(host, host_abi, host_abi_min, &plugin);
  const std::lock_guard<std::mutex> alone(one);
  hosts += made != nullptr;
  return made;
}
