// What the parts of `deform run` share: options, and what a run has measured so far.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <array>
#include <string>
#include <vector>

#include "crossing.h"
#include "rtp.h"
#include "scene_file.h"

namespace cli {

class Command;

struct RunOptions {
  std::string scene, out;
  double time = 0;        // 0: the scene's duration
  double frame_rate = 0;  // 0: what the scene says
  std::vector<std::string> set;
  bool profile = false, check = false, plot = false;
  uint64_t jitter = 0;
  struct Save {
    double at;  // s since the start of the scene
    std::string path;
  };
  std::vector<Save> saves;
  std::string from;      // a state to go on from; empty: the scene's start
  bool record = false;   // every recorded state, as a state file
  std::string problems;  // folder for contact problems; empty: none are written
  uint32_t every = 0;    // of them that is written, beside the unsolved ones; 0: none
  CaptureProblems *capture = nullptr;
  std::string stream;      // "rtp://ADDRESS:PORT"; empty: nowhere
  std::string save_scene;  // where the world of the end is written as a scene; empty: nowhere
  // in place of dfm_world_step(), where another program steps; empty: none does
  std::function<dfm_status(dfm_world, double, uint32_t *)> step;
};
void add_run_options(Command sub, RunOptions &options);  // those that any such program has

class Comparison;
// The run of `deform run`, and that of `deform replay`, which compares the state with the recorded one
// after each step. Throws Failure where the run stops itself or a signal ends it.
void run_scene(RunOptions options, const Globals &globals, Comparison *comparison = nullptr);

// Wall time of every step, thinned evenly once there are very many; the longest is kept exactly.
class StepTimes {
 public:
  void add(double seconds);
  double quantile(double q) const;  // s
  double longest() const { return longest_; }

 private:
  std::vector<float> kept_;
  uint64_t seen_ = 0, every_ = 1;
  double longest_ = 0;
};

struct RunResult {
  uint64_t steps = 0;
  // pairs that were through each other at the start; those that were put apart
  uint32_t overlaps = 0, untangled = 0;
  // s; start: of the scene, begun: where this run began; wall and cpu are of the steps, without outputs and
  // checks
  double start = 0, begun = 0, simulated = 0, wall = 0, cpu = 0;
  StepTimes times;
  RtpSender::Report stream;  // of --stream
  uint64_t pictures = 0;
  double drawing = 0;    // s, wall time of the pictures
  std::string drawn_by;  // the renderer, as OpenGL names it
  std::vector<dfm_swap> swaps;
  std::map<std::string, std::string> unwatched;  // bodies that the energy watch did not look at, and why
  std::string impulses = "{}";                   // JSON, Impulses::json()
  std::string sensors;                           // JSON, Sensors::json(); empty: there are none
  bool interrupted = false, stopped = false;
  std::string stop_reason, stop_body;
  // of equilibria: those found, steps from rest, share of the forces that the last one leaves
  uint64_t load_steps = 0, iterations = 0;
  double residual = 0;
  double contacts_mean = 0;  // of sub-steps; static: of equilibria
  bool hold_begun = false;
  double creep = 0;  // m/s, NAN if no pair qualifies
  uint32_t hold_count = 0;
};

// Adds those that it does not look at as the world is now.
void add_unwatched(const SceneFile &scene, RunResult &run);

// What recorded states showed. "Recorded" is every state written to bodies.csv, and with --check every step.
struct Checks {
  uint64_t states = 0;
  // pairs of one state: all, and by whether two surfaces cross or one crosses itself
  size_t intersections_max = 0;
  size_t between_max = 0, self_max = 0;
  size_t self_first = 0;  // of the start state
  uint32_t inverted_max = 0;
  size_t between_last = 0, self_last = 0;  // of the last state
  // of pairs between surfaces: those of two parts of one body, and all others
  size_t parts_max = 0, parts_last = 0, others_max = 0, others_last = 0;
  // in the state with the most pairs: two surfaces that cross, two that are parts, one that crosses itself
  std::string crossing[2], parted[2], crossed;
  uint32_t inverted_last = 0;
  // of the body and the state with the most inverted cells
  std::string inverted_body, inverted_model;
  uint32_t inverted_there = 0, cells_there = 0;
  double volume_there = 1;  // over that at rest
  bool finite = true, too_far = false;
};

// Judges one state: crossings, inverted cells, finiteness.
class Checker {
 public:
  explicit Checker(const SceneFile &scene);
  Checker(const Checker &) = delete;  // solids_ points into cores_
  void check(bool start_state);
  const Checks &result() const { return checks_; }

 private:
  std::vector<std::array<uint32_t, 2>> joined() const;
  void keep(const crossing::Found &found);

  const SceneFile &scene_;
  // obstacles of triangles, and the cores of voxels
  std::vector<ObstacleView> solids_;
  std::vector<std::vector<double>> cores_, positions_, placed_;  // of voxels; of bodies; of solids
  std::vector<crossing::Surface> surfaces_;
  std::vector<double> state_;  // x and v of one body
  crossing::Counter counter_;
  Checks checks_;
};

std::string summary_json(const SceneFile &scene, const RunOptions &options, const RunResult &run,
                         const Checks &checks);
void print_table(const SceneFile &scene, const RunResult &run, const Checks &checks);
void print_profile(const SceneFile &scene, const RunResult &run);

dfm_world_stats world_stats(const SceneFile &scene);
dfm_body_measure body_measure(const BodyView &body);
dfm_body_measure rigid_measure(const RigidView &rigid);

}  // namespace cli
