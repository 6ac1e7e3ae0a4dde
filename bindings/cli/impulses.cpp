#include "impulses.h"

#include <algorithm>
#include <iterator>

#include "json_text.h"
#include "messages.h"
#include "step_size.h"

namespace cli {
namespace {

constexpr double kWindow = 5e-3;      // s
constexpr double kFinest = 1.0 / 64;  // of the window: shorter pieces are put together

}  // namespace

double LargestInWindow::within(double from, double to) const {
  double sum = 0;
  for (const Piece &p : pieces_)
    if (p.to > from && p.from < to)
      sum += p.impulse * (std::min(p.to, to) - std::max(p.from, from)) / (p.to - p.from);
  return sum;
}

// The sum in a window is linear in its place between places where it begins or ends with a piece.
void LargestInWindow::add(double from, double to, double impulse) {
  if (!(impulse > 0) || !(to > from)) return;
  if (!pieces_.empty() && to - pieces_.back().from <= kFinest * window_) {
    pieces_.back().to = to;
    pieces_.back().impulse += impulse;
  } else pieces_.push_back({from, to, impulse});
  most_ = std::max(most_, within(to - window_, to));
  for (; pieces_.front().from + window_ <= to; pieces_.pop_front())
    most_ = std::max(most_, within(pieces_.front().from, pieces_.front().from + window_));
}

double LargestInWindow::value() const {
  double most = most_;
  for (const Piece &p : pieces_) most = std::max(most, within(p.from, p.from + window_));
  return most;
}

double peak_window(const SceneFile &scene) { return std::max(kWindow, longest_step(scene)); }

void Impulses::add_step(double step) {
  const double begin = dfm_world_time(scene_.world()) - step;
  for (const dfm_pair_impulse &p : listed<dfm_pair_impulse>(dfm_world_pair_impulses, scene_.world())) {
    Sum &sum = sums_.try_emplace({p.a, p.b}, Sum{0, LargestInWindow(window_)}).first->second;
    sum.normal += p.normal_impulse;
    constexpr size_t parts = std::size(dfm_pair_impulse{}.part);
    for (size_t k = 0; k < parts; ++k)
      sum.largest.add(begin + step * double(k) / parts, begin + step * double(k + 1) / parts, p.part[k]);
  }
}

std::string Impulses::json() const {
  JsonObject out;
  for (const auto &[pair, sum] : sums_) {
    out.add(scene_.name_of(pair.first) + "/" + scene_.name_of(pair.second),
            json_object("normal_Ns", sum.normal, "peak_N", sum.largest.value() / window_, "peak_window_s",
                        window_));
  }
  return out.text();
}

}  // namespace cli
