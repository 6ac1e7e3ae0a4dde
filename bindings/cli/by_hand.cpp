#include "by_hand.h"

#include <cstdlib>

#include "messages.h"

namespace cli {
namespace {

std::vector<double> numbers(const JsonValue &line, const char *key) {
  std::vector<double> out;
  if (const JsonValue *const list = line.find(key))
    for (const JsonValue &item : list->items) out.push_back(std::strtod(item.text.c_str(), nullptr));
  return out;
}

std::vector<double> vector(const JsonValue &line, const char *key) {
  std::vector<double> out = numbers(line, key);
  if (out.size() != 3) throw Failure(kBadInput, std::string("expected three numbers under \"") + key + "\"");
  return out;
}

double scalar(const JsonValue &line, const char *key) { return std::strtod(line.get(key).c_str(), nullptr); }

}  // namespace

const BodyView &ByHand::body(const JsonValue &line) const {
  for (const BodyView &b : scene_.bodies())
    if (b.name == line.get("body")) return b;
  throw Failure(kBadInput, "there is no body '" + line.get("body") + "'");
}

void ByHand::pull(const JsonValue &line) {
  const std::vector<double> points = numbers(line, "points"), weights = numbers(line, "weights");
  const std::vector<double> to = vector(line, "to");
  if (weights.size() != points.size()) throw Failure(kBadInput, "a pull has a weight for each point");
  const std::vector<uint32_t> places(points.begin(), points.end());
  dfm_spring_def def = {};
  def.size = sizeof def;
  def.npoint = uint32_t(places.size());
  def.points = places.data();
  def.weights = weights.data();
  for (int i = 0; i < 3; ++i) def.to[i] = to[size_t(i)];
  def.stiffness = scalar(line, "stiffness");
  def.damping = scalar(line, "damping");
  const dfm_body of = body(line).handle;
  need(dfm_body_add_spring(of, &def, &spring_));
  body_ = of;
}

void ByHand::act(const JsonValue &line) {
  const std::string what = line.get("do");
  const double value = scalar(line, "value");
  const std::string key = line.get("key");
  const dfm_param_value row = {key.c_str(), &value, 1};
  const dfm_params params = {sizeof(dfm_params), 1, &row};
  if (what == "pull") {
    pull(line);
  } else if (what == "move" && body_) {
    need(dfm_body_set_spring_target(body_, spring_, vector(line, "to").data()));
  } else if (what == "release" && body_) {
    need(dfm_body_remove_spring(body_, spring_));
    body_ = 0;
  } else if (what == "gravity") {
    need(dfm_world_set_gravity(scene_.world(), vector(line, "to").data()));
  } else if (what == "friction") {
    const JsonValue *const sides = line.find("between");
    if (!sides || sides->items.size() != 2) throw Failure(kBadInput, "friction is between two sides");
    need(dfm_world_set_friction(scene_.world(), sides->items[0].text.c_str(), sides->items[1].text.c_str(),
                                &params));
  } else if (what == "param") {
    need(dfm_body_set_params(body(line).handle, &params));
  } else if (what == "step") {
    step_ = scalar(line, "length");
  } else {
    throw Failure(kBadInput, "\"" + what + "\" is nothing that a hand does here");
  }
}

void ByHand::force(double out[3]) const { need(dfm_body_get_spring_force(body_, spring_, out)); }

}  // namespace cli
