// DIR/recording: the states of a run with --record, and what makes the same run again.
#pragma once
#include <string>
#include <vector>

#include "output.h"

namespace cli {

// Writes recording/run.json at the start, and a state with a row of recording/states.csv each time.
class Recorder {
 public:
  Recorder(const SceneFile &scene, const RunOptions &options);
  void add();

 private:
  const SceneFile &scene_;
  std::string folder_;
  Csv index_;
  uint32_t count_ = 0;
};

struct RecordedState {
  double t = 0;  // s
  std::string path, hash;
};

struct Recording {
  std::string scene;  // its file
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
  // Nothing where every state came and was the same; else what differed first.
  std::string sentence() const;
  size_t same() const { return same_; }

 private:
  const Recording &recording_;
  size_t next_ = 0, same_ = 0;
  std::string first_;
};

}  // namespace cli
