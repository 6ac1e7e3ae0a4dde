// A snapshot of an ODE scene is that of the dfm_world, followed by what that lacks: bodies without geoms that
// joints lead to, and the memory of friction between rigid bodies. The dfm_world has everything else that a
// later step depends on: states, the last effect of joints, which bodies sleep, and idle times.
//
//   magic, version, bytes of all, checksum, bytes of the world's, geoms in the space, bodies with them,
//   bodies without, numbers of friction, seed the world's | of bodies with geoms: enabled? | of those
//   without: 16 numbers each | friction
//
// A restore reads and checks all of it before it changes anything; the world's own restore comes first and is
// the only part that can still refuse.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "adapter.h"

namespace dfm_ode_detail {
namespace {

constexpr uint64_t kMagic = 0x0065646f5f6d6664ull, kVersion = 2;  // "dfm_ode" 0
constexpr size_t kPerBody = 16;
// seed: of dWorldQuickStep's order of constraints
struct Head { uint64_t magic, version, length, checksum, world, geoms, members, bodies, friction, seed; };

// FNV-1a, 64 bit, of everything but the checksum itself.
uint64_t checksum_of(const unsigned char *data, size_t bytes) {
  uint64_t value = 14695981039346656037ull;
  for (size_t i = 0; i < bytes; ++i)
    if (i < offsetof(Head, checksum) || i >= offsetof(Head, checksum) + sizeof(uint64_t))
      value = (value ^ data[i]) * 1099511628211ull;
  return value;
}

bool flag(double x) { return x == 0 || x == 1; }

// Valid as written by save(): finite, a unit quaternion, enabled 0 or 1, an idle time of 0 or more.
bool good_body(const double *p) {
  double nan_flag = 0;
  for (size_t i = 0; i < kPerBody; ++i) nan_flag += 0.0 * p[i];
  const double q = p[3] * p[3] + p[4] * p[4] + p[5] * p[5] + p[6] * p[6];
  return nan_flag == 0 && std::fabs(q - 1) < 1e-3 && flag(p[13]) && p[14] >= 0 && p[15] >= 0;
}

void save(dBodyID b, const OdeEngine::Idle &idle, std::vector<double> &out) {
  const dReal *const x = dBodyGetPosition(b);
  const dReal *const q = dBodyGetQuaternion(b);
  const dReal *const v = dBodyGetLinearVel(b);
  const dReal *const w = dBodyGetAngularVel(b);
  out.insert(out.end(), x, x + 3);
  out.insert(out.end(), q, q + 4);
  out.insert(out.end(), v, v + 3);
  out.insert(out.end(), w, w + 3);
  out.insert(out.end(), {double(dBodyIsEnabled(b)), idle[0], idle[1]});
}

void load(dBodyID b, const double *p) {
  dBodySetPosition(b, p[0], p[1], p[2]);
  const dQuaternion q = {p[3], p[4], p[5], p[6]};
  dBodySetQuaternion(b, q);
  dBodySetLinearVel(b, p[7], p[8], p[9]);
  dBodySetAngularVel(b, p[10], p[11], p[12]);
  (p[13] != 0 ? dBodyEnable : dBodyDisable)(b);
}

}  // namespace

dfm_status Adapter::snapshot(void *buffer, size_t *bytes) {
  TRY(sync());
  std::vector<double> numbers;
  const std::vector<dBodyID> hidden = hidden_bodies();
  // wakes connected bodies before the world reports which ones sleep
  for (auto &b : bodies_) numbers.push_back(dBodyIsEnabled(b->id));
  for (const dBodyID b : hidden) save(b, engine_.idle(b), numbers);
  const size_t of_bodies = numbers.size();
  near_.save(
      [&](dGeomID g) {
        const auto at = std::find(seen_.begin(), seen_.end(), g);
        return at == seen_.end() ? -1.0 : double(at - seen_.begin());
      },
      numbers);
  size_t world = 0;
  TRY(dfm_world_snapshot(world_, nullptr, &world));
  Head head{kMagic,
            kVersion,
            0,
            0,
            world,
            seen_.size(),
            bodies_.size(),
            hidden.size(),
            numbers.size() - of_bodies,
            dRandGetSeed()};
  const size_t whole = head.length = sizeof head + world + numbers.size() * sizeof(double), room = *bytes;
  *bytes = whole;
  if (!buffer) return DFM_OK;
  if (room < whole)
    return failed(DFM_E_ARG,
                  "a snapshot of this scene takes %zu bytes, the buffer has %zu; ask with buffer NULL first",
                  whole, room);
  auto *to = static_cast<unsigned char *>(buffer);
  std::memcpy(to, &head, sizeof head);
  to += sizeof head;
  TRY(dfm_world_snapshot(world_, to, &world));
  std::memcpy(to + world, numbers.data(), numbers.size() * sizeof(double));
  head.checksum = checksum_of(static_cast<unsigned char *>(buffer), whole);
  std::memcpy(buffer, &head, sizeof head);
  return DFM_OK;
}

dfm_status Adapter::restore(const void *buffer, size_t bytes) {
  TRY(sync());
  const auto *from = static_cast<const unsigned char *>(buffer);
  Head head{};
  if (bytes >= sizeof head) std::memcpy(&head, from, sizeof head);
  const std::vector<dBodyID> hidden = hidden_bodies();
  const size_t rest = bytes < sizeof head ? 0 : bytes - sizeof head;
  const size_t fixed = sizeof(double) * (bodies_.size() + kPerBody * hidden.size());
  if (head.magic == kMagic && head.version != kVersion)
    return failed(DFM_E_FORMAT,
                  "the snapshot was written by another version of the adapter (format %llu, this one reads "
                  "%llu); nothing was restored",
                  static_cast<unsigned long long>(head.version), static_cast<unsigned long long>(kVersion));
  if (head.magic == kMagic && (head.length != bytes || head.checksum != checksum_of(from, bytes)))
    return failed(DFM_E_FORMAT,
                  "the snapshot is cut short or damaged (length or checksum); nothing was restored");
  if (head.magic != kMagic)
    return failed(DFM_E_FORMAT,
                  "these %zu bytes are not a snapshot of dfm_ode_snapshot; nothing was restored", bytes);
  if (head.geoms != seen_.size() || head.members != bodies_.size() || head.bodies != hidden.size())
    return failed(
        DFM_E_FORMAT,
        "the snapshot belongs to another scene of ODE: it has %llu geoms, %llu bodies with geoms and "
        "%llu without, and there are %zu, %zu and %zu; nothing was restored",
        static_cast<unsigned long long>(head.geoms), static_cast<unsigned long long>(head.members),
        static_cast<unsigned long long>(head.bodies), seen_.size(), bodies_.size(), hidden.size());
  if (head.world > rest || rest - head.world < fixed ||
      (rest - head.world - fixed) / sizeof(double) != head.friction ||
      (rest - head.world - fixed) % sizeof(double) != 0)
    return failed(DFM_E_FORMAT, "the snapshot is damaged: its parts do not add up; nothing was restored");
  const size_t first = bodies_.size(), behind = first + kPerBody * hidden.size();
  std::vector<double> numbers(behind + head.friction);
  std::memcpy(numbers.data(), from + sizeof head + head.world, numbers.size() * sizeof(double));
  bool good = std::all_of(numbers.begin(), numbers.begin() + std::ptrdiff_t(first), flag);
  for (size_t i = 0; i < hidden.size(); ++i) good = good && good_body(&numbers[first + kPerBody * i]);
  good = good && std::all_of(numbers.begin() + std::ptrdiff_t(behind), numbers.end(),
                             [](double x) { return std::isfinite(x); });
  if (!good)
    return failed(DFM_E_FORMAT,
                  "the snapshot is damaged: a number of its bodies or of their friction is out of range; "
                  "nothing was restored");
  RigidFriction::Memory friction;
  const auto geom = [&](double number) {
    const bool there = number == std::floor(number) && number >= 0 && number < double(seen_.size());
    return there ? seen_[size_t(number)] : nullptr;
  };
  if (!near_.read(geom, numbers.data() + behind, head.friction, friction))
    return failed(DFM_E_FORMAT,
                  "the snapshot was made with another law between rigid bodies; call dfm_ode_set_friction "
                  "with that one first");
  if (const dfm_status status = dfm_world_restore(world_, from + sizeof head, head.world); status != DFM_OK)
    return status;
  for (size_t i = 0; i < first; ++i) (numbers[i] != 0 ? dBodyEnable : dBodyDisable)(bodies_[i]->id);
  for (size_t i = 0; i < hidden.size(); ++i) {
    const double *const of_body = &numbers[first + kPerBody * i];
    load(hidden[i], of_body);
    engine_.set_idle(hidden[i], {of_body[14], of_body[15]});
  }
  near_.take(std::move(friction));
  dRandSetSeed(static_cast<unsigned long>(head.seed));
  keeps_friction_ = true;
  clock_.time = -1;  // the time of no world: the next step sees that the world was restored
  return sync();
}

}  // namespace dfm_ode_detail
