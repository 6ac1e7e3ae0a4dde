#include "recording.h"

#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "json_text.h"
#include "messages.h"
#include "state_file.h"
#include "system.h"

namespace fs = std::filesystem;

namespace cli {
namespace {

constexpr const char *kFormat = "deform-recording", *kVersion = "1", *kByHand = "2",
                     *kHead = "t,file,state_hash";
constexpr uint64_t kMaxIndex = uint64_t{1} << 28;  // bytes

std::string run_file(const SceneFile &scene, const RunOptions &options, bool by_hand) {
  return indented(json_object("format", quoted(kFormat), "version", by_hand ? kByHand : kVersion, "scene",
                              quoted(name_of(fs::absolute(path_of(scene.path())))), "set",
                              json_words(options.set), "jitter", options.jitter));
}

std::string made(const std::string &folder) {
  make_folder(folder);
  return folder;
}

}  // namespace

Recorder::Recorder(const SceneFile &scene, const RunOptions &options, bool by_hand)
    : scene_(scene),
      folder_(made(options.out + "/recording")),
      index_(folder_ + "/states.csv", kHead),
      acts_(nullptr, std::fclose) {
  if (by_hand) acts_ = new_file(folder_ + "/acts.jsonl");
  write_whole(folder_ + "/run.json", run_file(scene, options, by_hand));
}

void Recorder::act(const std::string &line) {
  const std::string row = "{\"t\": " + number(dfm_world_time(scene_.world())) + ", " + line.substr(1) + "\n";
  if (std::fwrite(row.data(), 1, row.size(), acts_.get()) != row.size() || std::fflush(acts_.get()) != 0)
    cannot_write(folder_ + "/acts.jsonl");
}

void Recorder::add() {
  const std::string name = formatted("%06u.state", count_++);
  write_state(scene_, folder_ + "/" + name);
  index_.cell(dfm_world_time(scene_.world())).cell(name).cell(hash_text(dfm_world_hash(scene_.world())));
  index_.end_row();
  index_.flush();
}

Recording read_recording(const std::string &run) {
  const std::string folder = run + "/recording", file = folder + "/run.json", index = folder + "/states.csv";
  if (!fs::exists(path_of(file)))
    throw Failure(kBadInput, run +
                                 ": no recording in this folder; make one with `deform run SCENE --record "
                                 "--out " +
                                 run + "`");
  JsonValue text;
  if (!parse_json(read_file(file, kMaxIndex, "a recording's run.json"), text) ||
      text.get("format") != kFormat || (text.get("version") != kVersion && text.get("version") != kByHand))
    throw Failure(kBadInput, file + ": not a recording that this version reads; record the run again");
  Recording out;
  out.scene = text.get("scene");
  out.jitter = std::strtoull(text.get("jitter").c_str(), nullptr, 10);
  for (const JsonValue &s : text.list("set")) out.set.push_back(s.text);
  std::istringstream rows(read_file(index, kMaxIndex, "a recording's states.csv"));
  std::string row;
  for (std::getline(rows, row); std::getline(rows, row);) {
    const size_t first = row.find(','), second = row.find(',', first + 1);
    if (first == std::string::npos || second == std::string::npos) break;  // a row that was being written
    out.states.push_back({std::strtod(row.c_str(), nullptr),
                          folder + "/" + row.substr(first + 1, second - first - 1), row.substr(second + 1)});
  }
  if (text.get("version") == kByHand) {
    const std::string acts = folder + "/acts.jsonl";
    std::istringstream lines(read_file(acts, kMaxIndex, "a recording's acts.jsonl"));
    while (std::getline(lines, row)) {
      RecordedAct act;
      if (!parse_json(row, act.line)) throw Failure(kBadInput, acts + ": damaged; record the run again");
      act.t = act.line.scalar("t");
      out.acts.push_back(std::move(act));
    }
  }
  if (out.states.empty()) throw Failure(kBadInput, index + ": no state in it; record the run again");
  return out;
}

void Comparison::look(const SceneFile &scene) {
  const double t = dfm_world_time(scene.world());
  while (next_ < recording_.states.size() && recording_.states[next_].t < t)
    ++next_;  // never came: sentence()
  if (next_ == recording_.states.size() || recording_.states[next_].t != t) return;
  const std::string hash = hash_text(dfm_world_hash(scene.world())), then = recording_.states[next_++].hash;
  if (hash == then) ++same_;
  else if (first_.empty())
    first_ = "at t = " + number(t) + " s the state has the hash " + hash + ", and had " + then;
}

double Comparison::prepare(const SceneFile &scene, double own) {
  if (!first_.empty()) return 0;
  if (recording_.acts.empty()) return own;
  if (next_ == recording_.states.size()) return 0;
  if (!hand_) hand_.emplace(scene);
  const double t = dfm_world_time(scene.world());
  for (; act_ < recording_.acts.size() && recording_.acts[act_].t <= t; ++act_)
    hand_->act(recording_.acts[act_].line);
  const double h = hand_->step() > 0 ? hand_->step() : own;
  hand_->before_step(h);
  return h;
}

std::string Comparison::sentence() const {
  if (!first_.empty()) return first_;
  if (same_ == recording_.states.size()) return "";
  return std::to_string(recording_.states.size() - same_) + " of " +
         std::to_string(recording_.states.size()) +
         " recorded states were not reached: the steps differ, or the run ended earlier";
}

}  // namespace cli
