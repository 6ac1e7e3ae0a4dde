// M23: forces given part by part, the extension dfm.part_forces/1.
#include <algorithm>
#include <cmath>
#include <mutex>

#include "check/groups.h"
#include "check/model.h"
#include "check/runner.h"
#include "deform/plugin_draft.h"

namespace cli::check {
namespace {

constexpr double kShaken = 0.02;  // of an edge
constexpr double kClose = 1e-12;  // of the largest force

// What the model gives, on any of its workers.
struct Given {
  std::mutex mutex;
  Numbers f;                          // [npoint,stride]
  std::vector<uint32_t> part, point;  // how often each has come
  uint32_t stride = 0;
  int64_t part_beyond = -1, point_beyond = -1;  // the last number of one that there is not
  bool fourth = false;                          // a fourth component was not zero
};

void take(void *user, uint32_t part, uint32_t n, const uint32_t *point, const double *f) {
  Given &given = *static_cast<Given *>(user);
  const std::lock_guard lock(given.mutex);
  if (part >= given.part.size()) {
    given.part_beyond = part;
    return;
  }
  ++given.part[part];
  for (uint32_t i = 0; i < n; ++i) {
    if (point[i] >= given.point.size()) {
      given.point_beyond = point[i];
      continue;
    }
    ++given.point[point[i]];
    for (size_t a = 0; a < 3; ++a) given.f[size_t(given.stride) * point[i] + a] = f[4 * size_t{i} + a];
    given.fourth |= f[4 * size_t{i} + 3] != 0;
  }
}

void compare(const Body &body, const dfm_part_forces &table) {
  uint32_t parts = 0;
  body.must("parts", [&] {
    parts = table.parts(body.self);
    return DFM_OK;
  });
  if (!parts) return;
  if (parts > body.points())
    broken("it says that it has %u parts of %u points; each point is in one of them", parts, body.points());
  Given given;
  given.stride = body.stride;
  given.f.assign(body.x.size(), 0.0);
  given.part.assign(parts, 0);
  given.point.assign(body.points(), 0);
  std::vector<double> now(body.state.size()), wanted_state(body.state.size());
  dfm_kin k = body.kin();
  if (!now.empty()) k.state_out = now.data();
  body.must("forces of " DFM_EXT_PART_FORCES, [&] { return table.forces(body.self, &k, 0, take, &given); });
  if (given.part_beyond >= 0)
    broken("it gives the forces of part %lld, and says that it has %u; number parts from 0",
           static_cast<long long>(given.part_beyond), parts);
  if (given.point_beyond >= 0)
    broken("it gives the force on point %lld of %u; give those of the mesh only",
           static_cast<long long>(given.point_beyond), body.points());
  for (uint32_t p = 0; p < parts; ++p)
    if (given.part[p] != 1)
      broken("it gives part %u %u times in one call; give each part once", p, given.part[p]);
  for (uint32_t p = 0; p < body.points(); ++p)
    if (given.point[p] != 1) broken("point %u is in %u parts; put each point into one", p, given.point[p]);
  if (given.fourth) broken("the fourth component of a force is not zero; write a zero there");
  Numbers wanted(body.x.size(), 0.0);
  if (!wanted_state.empty()) k.state_out = wanted_state.data();
  body.must("add_forces", [&] { return body.ops.add_forces(body.self, &k, wanted.data()); });
  const double off = most_apart(given.f, wanted);
  if (!(off <= kClose * largest(wanted)))
    broken("forces given part by part are up to %.3g N off those of add_forces; give the same forces", off);
  if (now != wanted_state)
    broken("forces of " DFM_EXT_PART_FORCES
           " writes another state_out than add_forces; write the same state");
}

}  // namespace

std::string parts_are_the_whole(const Subject &subject) {
  Random random(subject.seed);
  bool offered = false;
  const std::string summary = for_variants(subject, [&](const Variant &variant) {
    Body body(subject, small_block(variant.cell), variant);
    const auto *table = static_cast<const dfm_part_forces *>(body.extension(DFM_EXT_PART_FORCES));
    if (!table || !table->parts || !table->forces) return;  // V03
    offered = true;
    body.shake(kShaken * kCube, 0.1, random);
    compare(body, *table);
  });
  if (!offered) skip("it does not offer " DFM_EXT_PART_FORCES);
  return summary;
}

}  // namespace cli::check
