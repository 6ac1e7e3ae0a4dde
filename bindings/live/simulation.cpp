#include "live/simulation.h"

#include <chrono>

#include "messages.h"
#include "state_file.h"
#include "step_size.h"

namespace live {

Simulation::Simulation(const cli::SceneFile &scene, double start)
    : scene_(scene), world_(scene.world()), hand_(scene), start_(start), first_(cli::snapshot_of(world_)) {}

double Simulation::time() const { return dfm_world_time(world_) - start_; }

bool Simulation::at_end() const {
  return !beyond_ && cli::next_step(scene_, start_, dfm_world_time(world_)) <= 0;
}

bool Simulation::step() {
  const double now = dfm_world_time(world_);
  const double left = cli::next_step(scene_, start_, now);
  if (left <= 0 && !beyond_) return false;
  const double step = left > 0 ? left : cli::full_step(scene_);
  const auto begin = std::chrono::steady_clock::now();
  trouble_.clear();
  if (recorder_ && step != recorded_step_) {
    cli::JsonObject line;
    recorder_->act(line.add("do", "\"step\"", "length", step).text());
    recorded_step_ = step;
  }
  hand_.before_step(step);
  if (dfm_world_step(world_, step, nullptr) != DFM_OK) {
    trouble_ = dfm_last_error();
    return false;
  }
  const double ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  step_ms_ += (step_ms_ > 0 ? 0.05 : 1) * (ms - step_ms_);
  if (recorder_ && time() >= next_record_ * (1 - 1e-9)) {
    recorder_->add();
    recorded_at_ = time();
    while (next_record_ <= recorded_at_ * (1 + 1e-9)) next_record_ += interval();
  }
  return true;
}

double Simulation::interval() const {
  const double every = scene_.settings().every;
  return every > 0 ? every : 0.02;
}

void Simulation::act(const cli::JsonObject &line) {
  cli::JsonValue parsed;
  const std::string text = line.text();
  if (!cli::parse_json(text, parsed)) throw cli::Failure(cli::kBadInput, "not to be written down: " + text);
  hand_.act(parsed);
  if (recorder_) recorder_->act(text);
}

void Simulation::release() {
  if (!hand_.pulls()) return;
  cli::JsonObject line;
  act(line.add("do", "\"release\""));
}

void Simulation::load(const std::string &path) {
  stop_recording();
  cli::read_state(scene_, path);
  was_set();
}

void Simulation::save(const std::string &path) {
  release();  // or the spring would pull forever in what goes on from the file
  cli::write_state(scene_, path);
}

void Simulation::start_recording(const cli::RunOptions &options) {
  release();
  recorder_.emplace(scene_, options, true);
  recorder_->add();
  recorded_at_ = time();
  next_record_ = recorded_at_ + interval();
  recorded_step_ = 0;
  for (const cli::JsonValue &line : hand_.tool_lines()) recorder_->act(cli::json_text(line));
}

uint32_t Simulation::stop_recording() {
  if (!recorder_) return 0;
  release();
  if (time() > recorded_at_) recorder_->add();
  const uint32_t n = recorder_->count();
  recorder_.reset();
  return n;
}

void Simulation::restart() {
  stop_recording();
  cli::need(dfm_world_restore(world_, first_.data(), first_.size()));
  was_set();
}

void Simulation::was_set() {
  hand_.forget();
  beyond_ = false;
  trouble_.clear();
}

}  // namespace live
