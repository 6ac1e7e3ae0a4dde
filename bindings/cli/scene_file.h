// A scene as the command sees it: opened, with the names and sizes of what is in it. On the public API only.
#pragma once
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "cli.h"

namespace cli {

struct BodyView {
  dfm_body handle = 0;
  std::string name, model;
  uint32_t number = 0;  // in the order in which bodies have come; it stays the same throughout a run
  uint32_t npoint = 0, ntet = 0, nsurfel = 0;
  uint32_t shape = 0;  // changes with its points, cells or triangles
  double rest_volume = 0;
  bool cut = false;                 // it has been cut, or is a piece that came off
  dfm_body whole = 0;               // a piece: the body that the scene has made; else the body itself
  std::vector<uint32_t> triangles;  // [n,3] surfel numbers
};

struct ObstacleView {
  dfm_obstacle handle = 0;
  std::string name;
  dfm_obstacle_def def = {};
};

// A rigid body; it is drawn as the obstacle that it is too.
struct RigidView {
  dfm_rigid handle = 0;
  std::string name;
};
// By a quaternion x, y, z, w; all zero reads as identity.
void rotate(const double q[4], const double v[3], double out[3]);
inline double norm(const double v[3]) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }
// Points of an obstacle of triangles where it is now, [n,3].
void place_points(const ObstacleView &obstacle, std::vector<double> &out);

class SceneFile {
 public:
  SceneFile(const Globals &globals, const std::string &path, const std::vector<std::string> &set,
            uint64_t jitter_seed);

  dfm_context *context() const { return context_.get(); }
  dfm_scene scene() const { return scene_; }
  dfm_world world() const { return world_; }
  const std::string &path() const { return path_; }
  const dfm_scene_settings &settings() const { return settings_; }
  const std::vector<BodyView> &bodies() const { return bodies_; }
  // Lists the bodies of the world again if others are there: pieces of a cut come, bodies of which a cut has
  // taken all cells go, and a restored state brings the bodies that it has. Cheap enough for every step.
  void renew_list() const;
  // Reads points, cells and surface of a body again if a tear has changed them.
  void renew(size_t body) const;
  const std::vector<ObstacleView> &obstacles() const { return obstacles_; }
  const std::vector<RigidView> &rigids() const { return rigids_; }
  const std::string &name_of(uint64_t handle) const;    // of a body or an obstacle
  std::string value(const std::string &pointer) const;  // JSON text; "" where nothing is
  // The JSON pointer of a body of the file by its name: the world has them in another order where the file
  // gives them ids. For others, as pieces, a pointer at which nothing is.
  std::string pointer_of(const std::string &body) const;
  std::string explain() const;

 private:
  void find_wholes() const;
  std::unique_ptr<dfm_context, decltype(&dfm_context_destroy)> context_;  // owns scene and world
  std::string path_;
  dfm_scene scene_ = 0;
  dfm_world world_ = 0;
  dfm_scene_settings settings_ = {};
  mutable std::vector<BodyView> bodies_;
  std::vector<ObstacleView> obstacles_;
  std::vector<RigidView> rigids_;
  std::map<std::string, size_t> places_;  // of bodies in the file, by their names as JSON text
  mutable std::map<uint64_t, std::string> names_;
  mutable std::map<uint64_t, uint32_t> numbers_;
};

std::string explain_text(dfm_world world);  // of dfm_world_explain

}  // namespace cli
