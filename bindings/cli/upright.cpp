#include "upright.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "json_text.h"

namespace cli {
namespace {

using Vector = std::array<double, 3>;

Vector vector_of(const JsonValue &list) {
  Vector out{};
  for (size_t k = 0; k < 3 && k < list.items.size(); ++k)
    out[k] = std::strtod(list.items[k].text.c_str(), nullptr);
  return out;
}

double norm(const Vector &v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

}  // namespace

Upright::Upright(const SceneFile &scene) {
  JsonValue gravity;
  if (!parse_json(scene.value("/gravity"), gravity)) return;
  if (const JsonValue *const keys = gravity.find("keyframes")) {
    for (const JsonValue &key : keys->items)
      if (const JsonValue *const value = key.find("value"))
        keys_.push_back({key.scalar("t"), vector_of(*value)});
  } else {
    keys_.push_back({0, vector_of(gravity)});
  }
  std::erase_if(keys_, [](const Key &k) { return !(norm(k.gravity) > 0); });
  for (const Key &k : keys_) {
    const Vector &a = keys_.front().gravity, &b = k.gravity;
    const double along = (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) / (norm(a) * norm(b));
    tilts_ = tilts_ || along < 1 - 1e-9;
  }
}

void Upright::at(double t, double up[3]) const {
  Vector g{0, 0, -1};
  const auto after = std::ranges::find_if(keys_, [t](const Key &k) { return k.t >= t; });
  if (after != keys_.end()) g = after->gravity;
  else if (!keys_.empty()) g = keys_.back().gravity;
  if (after != keys_.end() && after != keys_.begin()) {
    const Key &before = after[-1];
    const double share = (t - before.t) / (after->t - before.t);
    for (size_t k = 0; k < 3; ++k) g[k] = before.gravity[k] + share * (after->gravity[k] - before.gravity[k]);
  }
  const double length = norm(g);
  for (size_t k = 0; k < 3; ++k) up[k] = length > 0 ? -g[k] / length : k == 2;
}

}  // namespace cli
