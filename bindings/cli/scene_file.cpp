#include "scene_file.h"

#include <algorithm>
#include <utility>

#include "costs_file.h"
#include "messages.h"
#include "progress.h"

namespace cli {

void rotate(const double q[4], const double v[3], double out[3]) {
  double n2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  if (n2 == 0) {
    for (int i = 0; i < 3; ++i) out[i] = v[i];
    return;
  }
  const double s = 2 / n2;
  const double u[3] = {q[1] * v[2] - q[2] * v[1] + q[3] * v[0], q[2] * v[0] - q[0] * v[2] + q[3] * v[1],
                       q[0] * v[1] - q[1] * v[0] + q[3] * v[2]};
  out[0] = v[0] + s * (q[1] * u[2] - q[2] * u[1]);
  out[1] = v[1] + s * (q[2] * u[0] - q[0] * u[2]);
  out[2] = v[2] + s * (q[0] * u[1] - q[1] * u[0]);
}

void place_points(const ObstacleView &obstacle, std::vector<double> &out) {
  dfm_pose pose = {};
  need(dfm_obstacle_get_pose(obstacle.handle, &pose));
  out.resize(3 * size_t(obstacle.def.npoint));
  for (size_t i = 0; i < out.size(); i += 3) {
    rotate(pose.rotation, obstacle.def.points + i, &out[i]);
    for (int k = 0; k < 3; ++k) out[i + size_t(k)] += pose.position[k];
  }
}

namespace {

void read_shape(const dfm_body_info &info, BodyView &body) {
  body.cut = body.npoint > 0;  // it had another shape before
  ++body.shape;
  body.npoint = info.npoint;
  body.ntet = info.ntet;
  body.nsurfel = info.nsurfel;
  body.rest_volume = info.rest_volume;
  body.triangles.resize(3 * size_t(info.ntriangle));
  uint32_t n = 0;
  need(dfm_surface_triangles(body.handle, info.ntriangle, body.triangles.data(), &n));
  std::vector<uint32_t> points(info.npoint), cells(info.ntet);
  need(dfm_body_origins(body.handle, info.npoint, points.data(), info.ntet, cells.data()));
  const auto moved = [](const std::vector<uint32_t> &of) {
    for (uint32_t i = 0; i < of.size(); ++i)
      if (of[i] != i) return true;
    return false;
  };
  body.cut = body.cut || moved(points) || moved(cells);
}

}  // namespace

SceneFile::SceneFile(const Globals &globals, const std::string &path, const std::vector<std::string> &set,
                     uint64_t jitter_seed)
    : context_(make_context(globals), dfm_context_destroy), path_(path) {
  std::vector<const char *> assignments;
  for (const std::string &s : set) assignments.push_back(s.c_str());
  dfm_scene_options options = {};
  options.size = sizeof options;
  options.nset = uint32_t(assignments.size());
  options.set = assignments.data();
  options.jitter_seed = jitter_seed;
  offer_costs();
  {
    // surfaces are filled, grids are made
    const Patience patience(!globals.quiet && !globals.json, "reading " + path);
    need(dfm_scene_open(context_.get(), path.c_str(), &options, &scene_));
  }
  need(dfm_scene_world(scene_, &world_));
  settings_ = got<dfm_scene_settings>(dfm_scene_get_settings, scene_);
  std::string name;
  for (size_t b = 0; !(name = value("/bodies/" + std::to_string(b) + "/name")).empty(); ++b)
    places_.emplace(name, b);

  renew_list();
  for (const dfm_obstacle handle : listed<dfm_obstacle>(dfm_world_obstacles, world_)) {
    ObstacleView obstacle;
    obstacle.handle = handle;
    obstacle.def = got<dfm_obstacle_def>(dfm_obstacle_get_def, handle);
    obstacle.name = names_[handle] = obstacle.def.name ? obstacle.def.name : "";
    obstacles_.push_back(obstacle);
  }
  for (const dfm_rigid handle : listed<dfm_rigid>(dfm_world_rigids, world_))
    rigids_.push_back({handle, names_[handle]});
}

void SceneFile::renew_list() const {
  const std::vector<dfm_body> handles = listed<dfm_body>(dfm_world_bodies, world_);
  if (std::ranges::equal(handles, bodies_, {}, {}, &BodyView::handle)) return;
  const bool pieces = !names_.empty();  // a scene has all other bodies from the start
  std::vector<BodyView> before = std::exchange(bodies_, {});
  for (const dfm_body handle : handles) {
    if (const auto old = std::ranges::find(before, handle, &BodyView::handle); old != before.end()) {
      bodies_.push_back(std::move(*old));
      continue;
    }
    const dfm_body_info info = got<dfm_body_info>(dfm_body_get_info, handle);
    BodyView body;
    body.handle = handle;
    body.name = info.name;
    body.model = info.model;
    read_shape(info, body);
    body.cut = body.cut || pieces;
    body.whole = handle;
    body.number = numbers_.try_emplace(handle, uint32_t(numbers_.size())).first->second;
    names_[body.handle] = body.name;
    bodies_.push_back(std::move(body));
  }
  if (pieces) find_wholes();
}

void SceneFile::find_wholes() const {
  for (const BodyView &body : bodies_) {
    if (!body.cut || body.whole != body.handle) continue;
    const std::vector<dfm_body> pieces = listed<dfm_body>(dfm_body_pieces, body.handle);
    for (BodyView &piece : bodies_)
      if (std::ranges::find(pieces, piece.handle) != pieces.end()) piece.whole = body.handle;
  }
}

void SceneFile::renew(size_t at) const {
  BodyView &body = bodies_[at];
  const dfm_body_info info = got<dfm_body_info>(dfm_body_get_info, body.handle);
  if (info.npoint != body.npoint || info.ntet != body.ntet) read_shape(info, body);
}

const std::string &SceneFile::name_of(uint64_t handle) const {
  static const std::string unknown = "?";
  const auto found = names_.find(handle);
  return found == names_.end() ? unknown : found->second;
}

std::string SceneFile::value(const std::string &pointer) const {
  size_t bytes = 0;
  if (dfm_scene_value(scene_, pointer.c_str(), nullptr, &bytes) < 0) return "";
  std::string text(bytes, '\0');
  need(dfm_scene_value(scene_, pointer.c_str(), text.data(), &bytes));
  text.resize(bytes - 1);
  return text;
}

std::string SceneFile::pointer_of(const std::string &body) const {
  const auto at = places_.find('"' + body + '"');
  return "/bodies/" + std::to_string(at == places_.end() ? places_.size() : at->second);
}

std::string SceneFile::explain() const { return explain_text(world_); }

std::string explain_text(dfm_world world) {
  size_t bytes = 0;
  need(dfm_world_explain(world, nullptr, &bytes));
  std::string text(bytes, '\0');
  need(dfm_world_explain(world, text.data(), &bytes));
  text.resize(text.find('\0') == std::string::npos ? text.size() : text.find('\0'));
  return text;
}

}  // namespace cli
