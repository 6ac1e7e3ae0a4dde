#include "scene/scene.h"

#include <algorithm>
#include <limits>

#include "core/error.h"
#include "core/handle.h"
#include "mesh/cells.h"
#include "plugin/context.h"
#include "scene/build.h"
#include "scene/device.h"
#include "scene/node.h"
#include "scene/planner/planner.h"
#include "scene/read.h"
#include "snapshot/snapshot_cuts.h"
#include "state/world.h"

namespace dfm::scene {

namespace {

// The destructor of a JSON container allocates (it lists its children, not to recurse), which without memory
// ends the process. Emptied from below it has nothing to list. The parser bounds the depth.
void dismantle(json &value) noexcept {
  if (!value.is_structured()) return;
  for (json &child : value) dismantle(child);
  value.clear();
}

}  // namespace

struct Scene::Tree {
  json root;
  ~Tree() { dismantle(root); }
};

Scene::Scene(dfm_context *context, const std::string &path, const dfm_scene_options *options)
    : context_(context), tree_(std::make_unique<Tree>()) {
  tree_->root = parse_file(path);
  for (uint32_t i = 0; options && i < options->nset; ++i) {
    if (!options->set || !options->set[i])
      fail(DFM_E_ARG, "scene options: set[%u] is NULL, expected \"/json/pointer=value\"", i);
    apply_set(tree_->root, options->set[i], path);
  }
  definition_ = read_scene(tree_->root, path, context->registry);
  MeshFiles files(context, definition_);
  // The scene then says what was chosen, and is read as if its file had said so.
  json chosen, devices;
  if (definition_.wanted.any()) {
    chosen = plan_scene(context, definition_, files, tree_->root);
    definition_ = read_scene(tree_->root, path, context->registry);
  }
  if (std::ranges::any_of(definition_.bodies, [](const Body &b) { return b.device.has_value(); })) {
    devices = choose_devices(context, definition_, files, tree_->root);
    definition_ = read_scene(tree_->root, path, context->registry);
  }
  if (!chosen.is_null())
    tree_->root[definition_.wanted.target > 0 ? "accuracy" : "budget"]["chosen"] = std::move(chosen);
  if (!devices.is_null()) tree_->root["devices"] = std::move(devices);
  Built built = build(context, definition_, files, options ? options->jitter_seed : 0);
  world_ = built.world;
  probes_ = std::move(built.probes);
}

Scene::~Scene() {
  if (world_) dfm_world_destroy(world_);
}

dfm_world Scene::release_world() { return std::exchange(world_, 0); }

namespace {

// The points of a probe as they are numbered now: a cut gives cells and points new numbers. Null: the body
// does not have its cell.
const uint32_t *points_of(const dfm::Body &b, const ProbePoint &probe) {
  if (b.emptied || b.rolled_back) return nullptr;
  uint32_t tet = probe.tet;
  if (b.cut.whole) {
    const auto at = std::ranges::find(b.cut.cell, tet);
    if (at == b.cut.cell.end()) return nullptr;
    tet = uint32_t(at - b.cut.cell.begin());
  }
  if (probe.weights.size() == 4) return &b.tets[4 * size_t{tet}];
  const CellKind &kind = cell_kind(b.cell_type);
  return &b.cells[kind.nodes * size_t{tet / kind.tets}];
}

}  // namespace

dfm::Body *Scene::probe_body(size_t i, const uint32_t *&points) const {
  const ProbePoint &p = probes_[i];
  dfm::Body &own = resolve<dfm::Body>(Kind::body, p.body);
  points = points_of(own, p);
  if (points) return &own;
  for (dfm::Body *const other : all_bodies(*own.world)) {
    if (other->piece_of != own.id) continue;
    points = points_of(*other, p);
    if (points) return other;
  }
  return nullptr;
}

void Scene::probe_state(size_t i, double position[3], double velocity[3]) const {
  const uint32_t *points;
  const dfm::Body *const b = probe_body(i, points);
  const double none = b ? 0 : std::numeric_limits<double>::quiet_NaN();
  Vec3 x{none, none, none}, v = x;
  if (b) b->dynamics->see_points();
  for (size_t c = 0; b && c < probes_[i].weights.size(); ++c) {
    x += probes_[i].weights[c] * b->p.x_at(points[c]);
    v += probes_[i].weights[c] * b->p.v_at(points[c]);
  }
  store3(position, x);
  store3(velocity, v);
}

std::string Scene::value(const std::string &pointer) const {
  const json *found = nullptr;
  try {
    const json::json_pointer where(pointer);
    if (tree_->root.contains(where)) found = &tree_->root.at(where);
  } catch (const json::exception &) {
    fail(DFM_E_ARG, "\"%s\" is not a JSON pointer (RFC 6901), e.g. \"/output/every\"", pointer.c_str());
  }
  if (!found) fail(DFM_E_ARG, "%s has nothing at %s", definition_.file.c_str(), pointer.c_str());
  return found->dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace dfm::scene
