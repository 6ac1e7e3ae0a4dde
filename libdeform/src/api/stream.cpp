// deform/stream.h: the state of a world as packets, in the format of doc/reference/stream.md.
#include "deform/stream.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <vector>

#include "api/objects.h"
#include "core/hash.h"
#include "world/queries.h"

using namespace dfm;

static_assert(std::endian::native == std::endian::little);

void dfm_stream_def_default_sized(uint32_t size, dfm_stream_def *out) {
  dfm_stream_def d{};
  d.kind = DFM_STREAM_FRAME;
  give_default(size, out, d);
}

namespace {

constexpr uint32_t kHeader = 32, kChunk = 8, kSurfaceHead = 48, kRangeHead = 16;  // bytes
constexpr uint32_t kLongestName = 100, kThing = 48 + kLongestName;                // bytes of a head, at most
constexpr uint32_t kLeastPacket = 256;
constexpr float kSteps = 65535;  // of a range in 16 bits

// The low half of a handle is the place in its table, and the rest says which thing of that place it is.
uint32_t number_of(uint64_t handle) { return static_cast<uint32_t>(handle); }

// Changes with the triangles of a body and with the shape that displacements count from, so that these are
// never put on another one.
uint32_t shape_of(const Body &b) {
  Hash hash;
  hash.add(b.handle);
  hash.add(b.origin.frame);
  for (const uint32_t corner : std::span(b.surface.tri.data(), 3 * size_t{b.surface.ntri}))
    hash.value = (hash.value ^ corner) * 1099511628211ull;  // by numbers: a quarter of the time by bytes
  return static_cast<uint32_t>(hash.value ^ hash.value >> 32);
}

// Packets of chunks. Where a chunk does not fit into the packet any more, another one begins.
class Packets {
 public:
  // Chunks end at multiples of 4.
  Packets(const World &w, const dfm_stream_def &d) : def_(d), most_(d.packet / 4 * 4), time_(w.time) {
    begin();
  }
  // Bytes that a chunk may still have in this packet, payload alone; the packet that is next has room().
  size_t left() const { return !most_ ? SIZE_MAX : most_ - std::min<size_t>(most_, size() + kChunk); }
  size_t room() const { return !most_ ? SIZE_MAX : most_ - kHeader - kChunk; }
  void next() {
    end();
    begin();
  }
  void chunk(const char *tag) {
    chunk_ = bytes_.size();
    bytes_.insert(bytes_.end(), tag, tag + 4);
    add(uint32_t{0});
  }
  void end_chunk() {
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    put(chunk_ + 4, static_cast<uint32_t>(bytes_.size() - chunk_ - kChunk));
  }
  template <class T>
  void add(T value) {
    const auto *const p = reinterpret_cast<const unsigned char *>(&value);
    bytes_.insert(bytes_.end(), p, p + sizeof value);
  }
  void add(Vec3 v) {
    for (const double x : {v.x, v.y, v.z}) add(static_cast<float>(x));
  }
  void add(const std::string &text) {
    add(static_cast<uint32_t>(text.size()));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
  }
  void add(std::span<const uint32_t> numbers) {
    const auto *const p = reinterpret_cast<const unsigned char *>(numbers.data());
    bytes_.insert(bytes_.end(), p, p + numbers.size_bytes());
  }
  // A list of `count` rows of `row` bytes, over as many chunks as it takes; write(i) adds one.
  template <class Write>
  void rows(const char *tag, size_t count, size_t row, Write write) {
    for (size_t i = 0; i < count;) {
      if (left() < row) next();
      chunk(tag);
      for (; i < count && (bytes_.size() - chunk_ == kChunk || fits(row)); ++i) write(i);
      end_chunk();
    }
  }
  const std::vector<unsigned char> &whole() {
    end();
    for (size_t i = 0; i < starts_.size(); ++i) put(starts_[i] + 8, static_cast<uint32_t>(starts_.size()));
    return bytes_;
  }

 private:
  size_t size() const { return bytes_.size() - starts_.back(); }
  bool fits(size_t more) const { return !most_ || size() + more <= most_; }
  void begin() {
    const auto fragment = static_cast<uint32_t>(starts_.size());
    starts_.push_back(bytes_.size());
    bytes_.insert(bytes_.end(), {'D', 'F', 'M', 'S'});
    add(uint8_t{1});
    add(static_cast<uint8_t>(def_.kind));
    add(static_cast<uint16_t>(def_.kind == DFM_STREAM_SCENE && !def_.body));  // nothing else is in the scene
    add(uint32_t{0});                                                         // packets of the frame
    add(fragment);
    add(uint32_t{0});  // bytes
    add(def_.frame);
    add(time_);
  }
  void end() {
    if (size() > UINT32_MAX) fail(DFM_E_ARG, "stream: a packet has 4 GiB; set dfm_stream_def.packet");
    put(starts_.back() + 16, static_cast<uint32_t>(size()));
  }
  void put(size_t at, uint32_t value) { std::memcpy(&bytes_[at], &value, sizeof value); }

  const dfm_stream_def &def_;
  size_t most_;  // bytes of a packet; 0: any
  double time_;
  std::vector<unsigned char> bytes_;
  std::vector<size_t> starts_;
  size_t chunk_ = 0;
};

// Three values for each of n points or triangles, over as many chunks as it takes; write(i) adds three.
template <class Write>
void ranges(const char *tag, uint32_t id, uint32_t shape, uint32_t n, Packets &out, Write write) {
  constexpr size_t each = 12;
  for (uint32_t first = 0; first < n;) {
    if (out.left() < kRangeHead + each) out.next();
    const size_t fit = (std::min<size_t>(out.left(), 1u << 30) - kRangeHead) / each;
    const auto last = static_cast<uint32_t>(std::min<size_t>(n, first + fit));
    out.chunk(tag);
    for (const uint32_t x : {id, shape, first, last - first}) out.add(x);
    for (uint32_t i = first; i < last; ++i) write(i);
    out.end_chunk();
    first = last;
  }
}

void triangles(uint32_t id, uint32_t shape, std::span<const uint32_t> tri, Packets &out) {
  ranges("TRIS", id, shape, static_cast<uint32_t>(tri.size() / 3), out,
         [&](uint32_t i) { out.add(tri.subspan(3 * size_t{i}, 3)); });
}

// Names in a scene are as long as its author likes; a packet has the beginning.
std::string name_in(const std::string &name) { return name.substr(0, kLongestName); }

void add_body(const Body &b, Packets &out) {
  const Surface &s = b.surface;
  const uint32_t id = number_of(b.handle), shape = shape_of(b);
  if (out.left() < kThing) out.next();
  out.chunk("BODY");
  for (const uint32_t x : {id, shape, s.nsurfel, s.ntri}) out.add(x);
  out.add(name_in(b.name));
  out.end_chunk();
  ranges("BASE", id, shape, s.nsurfel, out, [&](uint32_t i) { out.add(surfel_at_rest(b, i)); });
  triangles(id, shape, {s.tri.data(), 3 * size_t{s.ntri}}, out);
}

void add_obstacle(const Obstacle &o, Packets &out) {
  const uint32_t id = number_of(o.handle), n = static_cast<uint32_t>(o.points.size() / 3);
  if (out.left() < kThing) out.next();
  out.chunk("OBST");
  for (const uint32_t x : {id, o.def.shape, n, static_cast<uint32_t>(o.triangles.size() / 3)}) out.add(x);
  out.add(uint32_t{o.sensor});
  out.add(static_cast<float>(o.def.radius));
  out.add(static_cast<float>(o.def.half_length));
  out.add(load3(o.def.half_size));
  out.add(name_in(o.name));
  out.end_chunk();
  ranges("BASE", id, o.def.shape, n, out, [&](uint32_t i) { out.add(load3(&o.points[3 * size_t{i}])); });
  triangles(id, o.def.shape, {o.triangles.data(), o.triangles.size()}, out);
}

// Displacements of surfels `first` to `last`, in the range that they have.
void add_surfels(const Body &b, uint32_t shape, std::span<const Vec3> all, uint32_t first, uint32_t last,
                 bool floats, Packets &out) {
  out.chunk("SURF");
  for (const uint32_t x : {number_of(b.handle), shape, first, last - first, uint32_t{floats}}) out.add(x);
  const std::span<const Vec3> part = all.subspan(first, last - first);
  if (floats) {
    for (const Vec3 &u : part) out.add(u);
    return out.end_chunk();
  }
  float low[3], high[3], step[3];
  for (size_t k = 0; k < 3; ++k) {
    const auto at = [k](const Vec3 &u) { return static_cast<float>(k == 0 ? u.x : k == 1 ? u.y : u.z); };
    low[k] = high[k] = at(part[0]);
    for (const Vec3 &u : part) {
      low[k] = std::min(low[k], at(u));
      high[k] = std::max(high[k], at(u));
    }
    step[k] = (high[k] - low[k]) / kSteps;
  }
  for (const float x : low) out.add(x);
  for (const float x : step) out.add(x);
  out.add(uint32_t{0});
  for (const Vec3 &u : part) {
    const double x[3] = {u.x, u.y, u.z};
    for (size_t k = 0; k < 3; ++k) {
      const double way = step[k] > 0 ? (x[k] - double{low[k]}) / double{step[k]} : 0;
      out.add(static_cast<uint16_t>(std::lround(std::clamp(way, 0.0, double{kSteps}))));
    }
  }
  out.end_chunk();
}

void add_surface(const Body &b, uint32_t shape, const dfm_stream_def &d, std::vector<Vec3> &moved,
                 Packets &out) {
  const uint32_t n = b.surface.nsurfel;
  const bool floats = (d.flags & DFM_STREAM_FLOAT32) != 0;
  const size_t each = floats ? 12 : 6;
  moved.resize(n);
  for (uint32_t i = 0; i < n; ++i) moved[i] = surfel_displacement(b, i);
  for (uint32_t i = 0; i < n;) {
    // a new packet where this one has room for a few alone
    if (out.left() < std::min<size_t>(kSurfaceHead + each * (n - i), out.room() / 2)) out.next();
    const size_t most = (std::min<size_t>(out.left(), 1u << 30) - kSurfaceHead) / each;
    const auto last = static_cast<uint32_t>(std::min<size_t>(n, i + most));
    add_surfels(b, shape, moved, i, last, floats, out);
    i = last;
  }
}

void add_contacts(const World &w, Packets &out) {
  struct Row {
    Vec3 point, force;
    uint32_t sticks;
  };
  std::vector<Row> rows;
  for (uint32_t i = 0; i < w.report.n; ++i) {
    const double *const f = &w.report.frame[9 * size_t{i}], *const l = &w.report.impulse[3 * size_t{i}];
    if (!(l[0] > 0)) continue;
    const Vec3 impulse = l[0] * load3(f) + l[1] * load3(f + 3) + l[2] * load3(f + 6);
    rows.push_back(
        {load3(w.report.contacts[i].point), (1 / w.report.h) * impulse, uint32_t{w.report.mode[i] == 1}});
  }
  for (const RigidContact &c : w.rigid_report.contacts)
    rows.push_back({c.point, (1 / w.rigid_report.h) * c.force(), c.sticks});
  out.rows("CONT", rows.size(), 28, [&](size_t i) {
    out.add(rows[i].point);
    out.add(rows[i].force);
    out.add(rows[i].sticks);
  });
}

void add_frame(const World &w, const dfm_stream_def &d, Packets &out) {
  std::vector<const Body *> bodies;
  for (const auto &b : w.bodies) bodies.push_back(b.get());
  std::vector<uint32_t> shapes;
  for (const Body *b : bodies) shapes.push_back(shape_of(*b));
  out.rows("LIST", bodies.size(), 8, [&](size_t i) {
    out.add(number_of(bodies[i]->handle));
    out.add(shapes[i]);
  });
  out.rows("POSE", w.obstacles.size(), 32, [&](size_t i) {
    const Obstacle &o = *w.obstacles[i];
    out.add(number_of(o.handle));
    out.add(o.pose.position);
    double q[4];
    store_quat(q, o.pose.rotation);
    for (const double x : q) out.add(static_cast<float>(x));
  });
  std::vector<Vec3> moved;
  for (size_t i = 0; i < bodies.size(); ++i) add_surface(*bodies[i], shapes[i], d, moved, out);
  if (d.flags & DFM_STREAM_CONTACTS) add_contacts(w, out);
}

void add_scene(const World &w, const dfm_stream_def &d, Packets &out) {
  for (const auto &b : w.bodies)
    if (!d.body || b->handle == d.body) add_body(*b, out);
  if (d.body) return;
  for (const auto &o : w.obstacles) add_obstacle(*o, out);
}

void check(const World &w, const dfm_stream_def &d) {
  if (d.kind > DFM_STREAM_FRAME)
    fail(DFM_E_ARG, "stream: kind is %u; expected DFM_STREAM_SCENE or DFM_STREAM_FRAME", d.kind);
  if (d.flags & ~uint32_t{DFM_STREAM_FLOAT32 | DFM_STREAM_CONTACTS})
    fail(DFM_E_ARG, "stream: flags are %u; expected DFM_STREAM_FLOAT32 and DFM_STREAM_CONTACTS alone",
         d.flags);
  if (d.packet != 0 && d.packet < kLeastPacket)
    fail(DFM_E_ARG, "stream: packets of %u bytes; expected at least %u, or 0 for one packet", d.packet,
         kLeastPacket);
  if (d.body &&
      std::none_of(w.bodies.begin(), w.bodies.end(), [&](const auto &b) { return b->handle == d.body; }))
    fail(DFM_E_ARG, "stream: 'body' is no body of this world that has cells");
}

}  // namespace

dfm_status dfm_world_stream(dfm_world world, const dfm_stream_def *def, void *buffer, size_t *bytes) {
  return as_status([&] {
    const World &w = whole(settled(world_of(world)));
    const dfm_stream_def d = take_def(def, dfm_stream_def_default());
    check(w, d);
    Packets packets(w, d);
    if (d.kind == DFM_STREAM_SCENE) add_scene(w, d, packets);
    else add_frame(w, d, packets);
    const std::vector<unsigned char> &all = packets.whole();
    give_bytes(all.data(), all.size(), buffer, bytes);
  });
}
