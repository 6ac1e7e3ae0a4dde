#include "dynamics/rigid/host.h"

#include <map>
#include <mutex>

#include "core/error.h"
#include "core/names.h"
#include "dynamics/rigid/tool_host.h"
#include "deform/obstacle.h"

namespace dfm {
namespace {

constexpr double kPi = 3.14159265358979323846;

struct Hosts {
  std::mutex mutex;
  std::map<std::string, dfm_rigid_host> tables;
};

Hosts &hosts() {
  static Hosts all;
  return all;
}

}  // namespace

void register_host(const std::string &name, const dfm_rigid_host &table) {
  if (name.empty()) fail(DFM_E_ARG, "a rigid host needs a name");
  if (!table.create || !table.destroy || !table.predict || !table.respond || !table.commit)
    fail(DFM_E_ARG, "rigid host '%s': create, destroy, predict, respond and commit must all be there",
         name.c_str());
  Hosts &all = hosts();
  std::lock_guard lock(all.mutex);
  if (name == "builtin" || name == kToolHost || all.tables.count(name))
    fail(DFM_E_STATE, "a rigid host '%s' is registered already; choose another name", name.c_str());
  all.tables.emplace(name, table);
}

dfm_rigid_host find_host(const std::string &name) {
  if (name == "builtin") return builtin_host();
  if (name == kToolHost) return tool_host();
  Hosts &all = hosts();
  std::lock_guard lock(all.mutex);
  const auto found = all.tables.find(name);
  if (found != all.tables.end()) return found->second;
  std::vector<std::string> names{"builtin"};
  for (const auto &[known, table] : all.tables) names.push_back(known);
  fail(DFM_E_ARG, "no rigid host '%s' is registered%s; there %s: %s", name.c_str(),
       did_you_mean(name, names, '\'').c_str(), names.size() == 1 ? "is" : "are", join(names).c_str());
}

double solid_volume(const dfm_rigid_def &d) {
  const double r = d.radius, *const a = d.half_size;
  switch (d.shape) {
    case DFM_SHAPE_BOX: return 8 * a[0] * a[1] * a[2];
    case DFM_SHAPE_NONE: return 0;
    case DFM_SHAPE_CAPSULE: return kPi * r * r * (2 * d.half_length) + 4.0 / 3 * kPi * r * r * r;
    default: return 4.0 / 3 * kPi * r * r * r;
  }
}

void solid_inertia(const dfm_rigid_def &d, double out[3]) {
  const double m = d.mass, r = d.radius, *const a = d.half_size;
  if (d.shape == DFM_SHAPE_BOX) {
    for (int k = 0; k < 3; ++k)
      out[k] = m / 3 * (a[(k + 1) % 3] * a[(k + 1) % 3] + a[(k + 2) % 3] * a[(k + 2) % 3]);
  } else if (d.shape == DFM_SHAPE_CAPSULE) {
    // A cylinder of length 2 c and two half balls, whose centers of mass are 3/8 r beyond their planes.
    const double c = d.half_length;
    const double ball = 4.0 / 3 * kPi * r * r * r;
    const double tube = 2 * kPi * r * r * c;
    const double density = m / (ball + tube);
    const double mb = density * ball, mt = density * tube;
    out[2] = mt * 0.5 * r * r + mb * 0.4 * r * r;
    out[0] = out[1] = mt * (0.25 * r * r + c * c / 3) + mb * (0.4 * r * r + c * c + 0.75 * r * c);
  } else {
    out[0] = out[1] = out[2] = 0.4 * m * r * r;
  }
}

}  // namespace dfm
