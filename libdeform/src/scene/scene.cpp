#include "scene/scene.h"

#include <algorithm>
#include <limits>

#include "core/error.h"
#include "plugin/context.h"
#include "scene/build.h"
#include "scene/device.h"
#include "scene/node.h"
#include "scene/planner/planner.h"
#include "scene/read.h"

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

void need(const ProbePoint &p, dfm_status status) {
  if (status < 0) fail(status, "probe \"%s\": %s", p.name.c_str(), dfm_last_error());
}

// The four points of a probe's cell as they are numbered now: a cut gives cells and points new numbers.
// False: the body does not have the cell.
bool find_cell(const ProbePoint &p, dfm_body body, uint32_t points[4]) {
  dfm_body_info info = {};
  info.size = sizeof info;
  need(p, dfm_body_get_info(body, &info));
  if (body == p.body && info.ntet == p.ntet && info.npoint == p.npoint) {
    std::copy_n(p.points, 4, points);
    return true;
  }
  if (info.ntet == 0) return false;
  std::vector<uint32_t> origins(info.ntet), cells(4 * size_t(info.ntet));
  need(p, dfm_body_origins(body, 0, nullptr, info.ntet, origins.data()));
  need(p, dfm_body_get_rest(body, 0, nullptr, info.ntet, cells.data()));
  const auto at = std::find(origins.begin(), origins.end(), p.cell);
  if (at == origins.end()) return false;
  std::copy_n(cells.begin() + 4 * (at - origins.begin()), 4, points);
  return true;
}

}  // namespace

dfm_body Scene::probe_body(size_t i, uint32_t points[4]) const {
  const ProbePoint &p = probes_[i];
  if (find_cell(p, p.body, points)) return p.body;
  uint32_t n = 0;
  need(p, dfm_body_pieces(p.body, 0, nullptr, &n));
  std::vector<dfm_body> pieces(n);
  if (n > 0) need(p, dfm_body_pieces(p.body, n, pieces.data(), &n));
  for (const dfm_body piece : pieces)
    if (find_cell(p, piece, points)) return piece;
  return 0;
}

void Scene::probe_state(size_t i, double position[3], double velocity[3]) {
  const ProbePoint &p = probes_[i];
  uint32_t n = 0, points[4];
  const dfm_body body = probe_body(i, points);
  if (!body) {
    std::fill_n(position, 3, std::numeric_limits<double>::quiet_NaN());
    std::fill_n(velocity, 3, std::numeric_limits<double>::quiet_NaN());
    return;
  }
  need(p, dfm_body_get_state(body, 0, nullptr, nullptr, &n));
  std::vector<double> x(3 * size_t(n)), v(3 * size_t(n));
  need(p, dfm_body_get_state(body, n, x.data(), v.data(), &n));
  for (int k = 0; k < 3; ++k) {
    position[k] = velocity[k] = 0;
    for (int c = 0; c < 4; ++c) {
      position[k] += p.weights[c] * x[3 * size_t(points[c]) + size_t(k)];
      velocity[k] += p.weights[c] * v[3 * size_t(points[c]) + size_t(k)];
    }
  }
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
