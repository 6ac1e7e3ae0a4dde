// DIR/recording: the states of a run with --record, and what makes the same run again.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "by_hand.h"
#include "output.h"

namespace cli {

// Writes recording/run.json at the start, and a state with a row of recording/states.csv each time.
class Recorder {
 public:
  // by_hand: acts follow (by_hand.h), without which the run does not come about again.
  Recorder(const SceneFile &scene, const RunOptions &options, bool by_hand = false);
  void add();
  void act(const std::string &line);  // done at the time that the world has now
  uint32_t count() const { return count_; }

 private:
  const SceneFile &scene_;
  std::string folder_;
  Csv index_;
  File acts_;
  uint32_t count_ = 0;
};

struct RecordedState {
  double t = 0;  // s
  std::string path, hash;
};

struct RecordedAct {
  double t = 0;  // s
  JsonValue line;
};

struct Recording {
  std::string scene;  // its file
  std::vector<RecordedAct> acts;
  std::vector<std::string> set;
  uint64_t jitter = 0;
  std::vector<RecordedState> states;
};
// Throws Failure where `run` is no folder of a run with --record, or what it holds is damaged.
Recording read_recording(const std::string &run);

// Whether a run passes through the states of a recording, bit by bit.
class Comparison {
 public:
  explicit Comparison(const Recording &recording) : recording_(recording) {}
  void look(const SceneFile &scene);
  // Does what was done by hand at this time, and returns how long the next step is: `own`, unless recorded.
  // 0: everything that was recorded has come, or something differs.
  double prepare(const SceneFile &scene, double own);
  // Nothing where every state came and was the same; else what differed first.
  std::string sentence() const;
  size_t same() const { return same_; }

 private:
  const Recording &recording_;
  std::optional<ByHand> hand_;
  size_t next_ = 0, same_ = 0, act_ = 0;
  std::string first_;
};

}  // namespace cli
