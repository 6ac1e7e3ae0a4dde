#include "impulses.h"

#include <algorithm>

#include "json_text.h"
#include "messages.h"

namespace cli {

void Impulses::add_step() {
  uint32_t n = 0;
  need(dfm_world_pair_impulses(scene_.world(), 0, nullptr, &n));
  if (n == 0) return;
  step_.resize(n);
  need(dfm_world_pair_impulses(scene_.world(), n, step_.data(), &n));
  for (const dfm_pair_impulse &p : step_) {
    Sum &sum = sums_[{p.a, p.b}];
    sum.normal += p.normal_impulse;
    sum.peak = std::max(sum.peak, p.peak_normal);
  }
}

std::string Impulses::json() const {
  JsonObject out;
  for (const auto &[pair, sum] : sums_) {
    JsonObject row;
    row.add("normal_Ns", number(sum.normal)).add("peak_N", number(sum.peak));
    out.add(scene_.name_of(pair.first) + "/" + scene_.name_of(pair.second), row.text());
  }
  return out.text();
}

}  // namespace cli
