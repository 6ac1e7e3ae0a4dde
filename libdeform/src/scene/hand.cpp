// A recorded hand: the pose of a tool, and the opening of its jaws, in a table over time.
#include "scene/hand.h"

#include "core/error.h"
#include "scene/table.h"

namespace dfm::scene {
namespace {

constexpr char kPose[] = "t,x,y,z,qx,qy,qz,qw", kOpening[] = "t,x,y,z,qx,qy,qz,qw,opening_deg";
constexpr uint64_t kMostRows = 4000000;                          // more than an hour at 1 kHz
constexpr double kRadian = 0.017453292519943295, kWidest = 170;  // degrees

}  // namespace

void read_hand(const std::string &path, Tool &tool) {
  Table table(path, kPose, kMostRows, 9);
  const std::string header = table.first();
  const bool opens = header == kOpening;
  if (!opens && header != kPose)
    fail(DFM_E_FORMAT, "%s:1: expected the header %s or %s", path.c_str(), kPose, kOpening);
  table.begin(header);
  const bool jaws = tool.def.shape == DFM_TOOL_GRASPER || tool.def.shape == DFM_TOOL_SCISSORS;
  double v[9];
  while (table.next(v)) {
    if (!tool.keys.empty() && !(v[0] > tool.keys.back().t))
      fail(DFM_E_FORMAT, "%s:%zu: times must increase, but %g s follows %g s", path.c_str(), table.line(),
           v[0], tool.keys.back().t);
    if (!(v[4] * v[4] + v[5] * v[5] + v[6] * v[6] + v[7] * v[7] > 0))
      fail(DFM_E_FORMAT, "%s:%zu: the quaternion qx,qy,qz,qw is zero", path.c_str(), table.line());
    tool.keys.push_back({v[0], {{v[1], v[2], v[3]}, {v[4], v[5], v[6], v[7]}}});
    if (!opens || !jaws) continue;
    if (!(v[8] >= 0 && v[8] <= kWidest))
      fail(DFM_E_FORMAT, "%s:%zu: an opening of %g degrees; it is between 0 and %g", path.c_str(),
           table.line(), v[8], kWidest);
    tool.opening_keys.push_back({v[0], kRadian * v[8]});
  }
  if (tool.keys.empty()) fail(DFM_E_FORMAT, "%s: no rows below the header", path.c_str());
}

}  // namespace dfm::scene
