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
#include "step/sides.h"
#include "world/queries.h"

using namespace dfm;

static_assert(std::endian::native == std::endian::little);

namespace {

constexpr uint32_t kHeader = 32, kChunk = 8, kSurfaceHead = 20, kPackedHead = 48, kRangeHead = 16;  // bytes
constexpr uint32_t kLongestName = 100;                                                              // bytes
constexpr uint32_t kMinPacket = 256, kSensor = 1u << 16;
constexpr float kSteps = 65535;  // of a range in 16 bits

using Bytes = std::span<const unsigned char>;

uint32_t word(Bytes bytes, size_t at) {
  uint32_t x;
  std::memcpy(&x, &bytes[at], sizeof x);
  return x;
}

// The low half of a handle is the place in its table, and the rest says which thing of that place it is.
uint32_t number_of(uint64_t handle) { return static_cast<uint32_t>(handle); }

// Changes with the triangles of a body and with the shape that displacements count from, so that these are
// never put on another one.
uint32_t shape_of(const Body &b) {
  Hash hash;
  hash.add(b.handle);
  hash.add(b.origin.frame);
  uint64_t lanes[4] = {hash.value, hash.value, hash.value, hash.value};  // by turns: none waits for another
  const size_t n = 3 * size_t{b.surface.ntri};
  for (size_t i = 0; i < n; ++i) lanes[i % 4] = (lanes[i % 4] ^ b.surface.tri[i]) * 1099511628211ull;
  for (const uint64_t lane : lanes) hash.add(lane);
  return static_cast<uint32_t>(hash.value ^ hash.value >> 32);
}
// Nothing of an obstacle's shape ever changes.
uint32_t shape_of(const Obstacle &o) { return static_cast<uint32_t>(o.handle >> 32); }

// Packets of chunks, that all begin as the first one.
class Packets {
 public:
  Packets(const dfm_stream_def &d, double time) {
    std::memcpy(head_, "DFMS\x01", 5);
    head_[5] = static_cast<unsigned char>(d.kind);
    head_[6] = d.kind == DFM_STREAM_SCENE && !d.body;  // nothing else is in the scene
    std::memcpy(head_ + 20, &d.frame, sizeof d.frame);
    std::memcpy(head_ + 24, &time, sizeof time);
    begin();
  }
  // Those of a packet, in packets of `most` bytes.
  Packets(Bytes packet, uint32_t most) : most_(most / 4 * 4) {
    std::copy_n(packet.begin(), kHeader, head_);
    begin();
  }
  // Bytes that a chunk may still have in this packet, payload alone; the packet that is next has room().
  size_t left() const { return !most_ ? SIZE_MAX : most_ - std::min<size_t>(most_, size() + kChunk); }
  size_t room() const { return !most_ ? SIZE_MAX : most_ - kHeader - kChunk; }
  void next() {
    end();
    begin();
  }
  void chunk(const void *tag) {
    chunk_ = bytes_.size();
    std::memcpy(more(kChunk), tag, 4);
  }
  // Chunks end at multiples of 4.
  void end_chunk() {
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    put(chunk_ + 4, static_cast<uint32_t>(bytes_.size() - chunk_ - kChunk));
  }
  template <class T>
  void add(T value) {
    std::memcpy(more(sizeof value), &value, sizeof value);
  }
  void add(const std::string &text) {
    add(static_cast<uint32_t>(text.size()));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
  }
  void add(Bytes bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  // at(i), a Vec3, for each i below n.
  template <class At>
  void vectors(size_t n, At at) {
    unsigned char *to = more(12 * n);
    for (size_t i = 0; i < n; ++i, to += 12) {
      const Vec3 v = at(i);
      const float x[3] = {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
      std::memcpy(to, x, sizeof x);
    }
  }
  void add(Vec3 v) {
    vectors(1, [&](size_t) { return v; });
  }
  const std::vector<unsigned char> &whole() {
    end();
    for (const size_t start : starts_) put(start + 8, static_cast<uint32_t>(starts_.size()));
    return bytes_;
  }

 private:
  size_t size() const { return bytes_.size() - starts_.back(); }
  unsigned char *more(size_t n) {
    bytes_.resize(bytes_.size() + n);
    return bytes_.data() + bytes_.size() - n;
  }
  void begin() {
    starts_.push_back(bytes_.size());
    bytes_.insert(bytes_.end(), head_, head_ + kHeader);
    put(starts_.back() + 12, static_cast<uint32_t>(starts_.size() - 1));
  }
  void end() {
    if (size() > UINT32_MAX) fail(DFM_E_ARG, "stream: a packet has 4 GiB");
    put(starts_.back() + 16, static_cast<uint32_t>(size()));
  }
  void put(size_t at, uint32_t value) { std::memcpy(&bytes_[at], &value, sizeof value); }

  unsigned char head_[kHeader] = {};
  size_t most_ = 0;  // bytes of a packet; 0: any
  std::vector<unsigned char> bytes_;
  std::vector<size_t> starts_;
  size_t chunk_ = 0;
};

// ---- the state as one packet

void add_range(const char *tag, uint32_t id, uint32_t shape, uint32_t n, Packets &out) {
  out.chunk(tag);
  for (const uint32_t x : {id, shape, 0u, n}) out.add(x);
}

void add_triangles(uint32_t id, uint32_t shape, std::span<const uint32_t> tri, Packets &out) {
  if (tri.empty()) return;
  add_range("TRIS", id, shape, static_cast<uint32_t>(tri.size() / 3), out);
  out.add(Bytes(reinterpret_cast<const unsigned char *>(tri.data()), tri.size_bytes()));
  out.end_chunk();
}

// Names in a scene are as long as its author likes; a packet has the beginning.
std::string name_in(const std::string &name) { return name.substr(0, kLongestName); }

void add_body(const Body &b, Packets &out) {
  const Surface &s = b.surface;
  const uint32_t id = number_of(b.handle), shape = shape_of(b);
  out.chunk("BODY");
  for (const uint32_t x : {id, shape, s.nsurfel, s.ntri}) out.add(x);
  out.add(name_in(b.name));
  out.end_chunk();
  if (s.nsurfel) {
    add_range("BASE", id, shape, s.nsurfel, out);
    out.vectors(s.nsurfel, [&](size_t i) { return surfel_at_rest(b, static_cast<uint32_t>(i)); });
    out.end_chunk();
  }
  add_triangles(id, shape, {s.tri.data(), 3 * size_t{s.ntri}}, out);
}

void add_obstacle(const Obstacle &o, Packets &out) {
  const uint32_t id = number_of(o.handle), shape = shape_of(o);
  const auto n = static_cast<uint32_t>(o.points.size() / 3);
  out.chunk("OBST");
  for (const uint32_t x : {id, shape, n, static_cast<uint32_t>(o.triangles.size() / 3)}) out.add(x);
  out.add(o.def.shape | (o.sensor ? kSensor : 0));
  out.add(static_cast<float>(o.def.radius));
  out.add(static_cast<float>(o.def.half_length));
  out.add(load3(o.def.half_size));
  out.add(name_in(o.name));
  out.end_chunk();
  if (n) {
    add_range("BASE", id, shape, n, out);
    out.vectors(n, [&](size_t i) { return load3(&o.points[3 * i]); });
    out.end_chunk();
  }
  add_triangles(id, shape, {o.triangles.data(), o.triangles.size()}, out);
}

void add_surface(const Body &b, uint32_t shape, Packets &out) {
  const uint32_t n = b.surface.nsurfel;
  if (n == 0) return;
  add_range("SURF", number_of(b.handle), shape, n, out);
  out.add(uint32_t{1});
  out.vectors(n, [&](size_t i) { return surfel_displacement(b, static_cast<uint32_t>(i)); });
  out.end_chunk();
}

void add_contacts(const World &w, Packets &out) {
  out.chunk("CONT");
  for (const ContactStore *const s : {&w.store, &w.tool_store})
    for (uint32_t i = 0; i < s->n; ++i) {
      if (!s->bears(i)) continue;
      out.add(load3(&s->point[3 * size_t{i}]));
      out.add(((b_first(w, *s, i) ? -1 : 1) / s->h) * s->world_impulse(i));
      out.add(uint32_t{s->sticks[i]});
    }
  out.end_chunk();
}

void add_frame(const World &w, const dfm_stream_def &d, Packets &out) {
  std::vector<uint32_t> shapes;
  for (const auto &b : w.bodies) shapes.push_back(shape_of(*b));
  out.chunk("LIST");
  out.add(static_cast<uint32_t>(w.bodies.size() + w.obstacles.size()));
  for (size_t i = 0; i < w.bodies.size(); ++i) {
    out.add(number_of(w.bodies[i]->handle));
    out.add(shapes[i]);
  }
  for (const auto &o : w.obstacles) {
    out.add(number_of(o->handle));
    out.add(shape_of(*o));
  }
  out.end_chunk();
  out.chunk("POSE");
  for (const auto &o : w.obstacles) {
    out.add(number_of(o->handle));
    out.add(o->pose.position);
    double q[4];
    store_quat(q, o->pose.rotation);
    for (const double x : q) out.add(static_cast<float>(x));
  }
  out.end_chunk();
  for (size_t i = 0; i < w.bodies.size(); ++i) add_surface(*w.bodies[i], shapes[i], out);
  if (d.flags & DFM_STREAM_CONTACTS) add_contacts(w, out);
}

void add_scene(const World &w, const dfm_stream_def &d, Packets &out) {
  for (const auto &b : w.bodies)
    if (!d.body || b->handle == d.body) add_body(*b, out);
  for (const auto &o : w.obstacles)
    if (!d.body || o->handle == d.body) add_obstacle(*o, out);
}

// ---- the same in packets for a network

// Adds rows of three floats, quantized in each direction in the range that they have.
void add_quantized(Bytes rows, Packets &out) {
  const size_t n = rows.size() / 4;
  const auto at = [&](size_t i) {
    float x;
    std::memcpy(&x, &rows[4 * i], sizeof x);
    return x;
  };
  float low[3], step[3];
  double per[3];
  for (size_t k = 0; k < 3; ++k) {
    float high = low[k] = at(k);
    for (size_t i = k; i < n; i += 3) {
      low[k] = std::min(low[k], at(i));
      high = std::max(high, at(i));
    }
    step[k] = (high - low[k]) / kSteps;
    per[k] = step[k] > 0 ? 1 / double{step[k]} : 0;
  }
  for (const float x : low) out.add(x);
  for (const float x : step) out.add(x);
  out.add(uint32_t{0});
  for (size_t i = 0; i < n; ++i) {
    const double way = (double{at(i)} - double{low[i % 3]}) * per[i % 3];
    // what is not finite, of a packet that is not ours, has no place in the range
    out.add(static_cast<uint16_t>(way >= 0 ? std::min(way + 0.5, double{kSteps}) : 0));
  }
}

// What stands in a chunk, over as many chunks as it takes.
void add_parts(Bytes chunk, const dfm_stream_def &d, Packets &out) {
  static const struct {
    char tag[5];
    uint32_t head, row;  // bytes
  } kLists[] = {{"LIST", 4, 8},           {"POSE", 0, 32},          {"CONT", 0, 28},
                {"BASE", kRangeHead, 12}, {"TRIS", kRangeHead, 12}, {"SURF", kSurfaceHead, 12}};
  const auto list = std::find_if(std::begin(kLists), std::end(kLists),
                                 [&](const auto &l) { return std::memcmp(l.tag, &chunk[0], 4) == 0; });
  const Bytes content = chunk.subspan(kChunk);
  if (list == std::end(kLists) || content.size() == list->head) {  // names and sizes, lists of nothing
    if (out.left() < content.size()) out.next();
    if (out.left() < content.size()) fail(DFM_E_ARG, "stream: a chunk of the packet fits into no packet");
    out.add(chunk);
    return;
  }
  const bool surface = list->head == kSurfaceHead, packs = surface && !(d.flags & DFM_STREAM_FLOAT32);
  if (content.size() < list->head || (content.size() - list->head) % list->row != 0 ||
      (surface && word(content, 16) != 1))
    fail(DFM_E_ARG, "stream: expected one packet as dfm_world_stream writes it with FLOAT32");
  const size_t head = packs ? kPackedHead : list->head, row = packs ? 6 : list->row;
  const Bytes rows = content.subspan(list->head);
  const size_t n = rows.size() / list->row;
  for (size_t i = 0; i < n;) {
    // a new packet where this one has room for a few alone
    if (out.left() < std::min<size_t>(head + row * (n - i), out.room() / 2)) out.next();
    const size_t m = std::min(n - i, (std::min<size_t>(out.left(), 1u << 30) - head) / row);
    out.chunk(&chunk[0]);
    out.add(content.first(std::min(list->head, 8u)));
    if (list->head >= kRangeHead) {
      out.add(word(content, 8) + static_cast<uint32_t>(i));
      out.add(static_cast<uint32_t>(m));
    }
    if (surface) out.add(uint32_t{!packs});
    const Bytes part = rows.subspan(list->row * i, list->row * m);
    if (packs) add_quantized(part, out);
    else out.add(part);
    out.end_chunk();
    i += m;
  }
}

std::vector<unsigned char> pack(Bytes packet, const dfm_stream_def &d) {
  if (packet.size() < kHeader || std::memcmp(packet.data(), "DFMS\x01", 5) != 0 ||
      word(packet, 16) != packet.size())
    fail(DFM_E_ARG, "stream: expected one packet as dfm_world_stream writes it with FLOAT32");
  Packets out(packet, d.packet);
  for (size_t at = kHeader; at < packet.size();) {
    const size_t rest = packet.size() - at;
    if (rest < kChunk || word(packet, at + 4) > rest - kChunk)
      fail(DFM_E_ARG, "stream: a chunk of the packet is longer than the packet");
    const size_t size = kChunk + word(packet, at + 4);
    add_parts(packet.subspan(at, size), d, out);
    at += size;
  }
  return out.whole();
}

dfm_stream_def checked(const dfm_stream_def *def) {
  const dfm_stream_def d = take_def(def, dfm_stream_def_default());
  if (d.kind > DFM_STREAM_FRAME)
    fail(DFM_E_ARG, "stream: kind is %u; expected DFM_STREAM_SCENE or DFM_STREAM_FRAME", d.kind);
  if (d.flags & ~uint32_t{DFM_STREAM_FLOAT32 | DFM_STREAM_CONTACTS})
    fail(DFM_E_ARG, "stream: flags are %u; expected DFM_STREAM_FLOAT32 and DFM_STREAM_CONTACTS alone",
         d.flags);
  if (d.packet != 0 && d.packet < kMinPacket)
    fail(DFM_E_ARG, "stream: packets of %u bytes; expected at least %u, or 0 for one packet", d.packet,
         kMinPacket);
  return d;
}

}  // namespace

dfm_status dfm_world_stream(dfm_world world, const dfm_stream_def *def, void *buffer, size_t *bytes) {
  return as_status([&] {
    const World &w = whole(not_in_step(world_of(world)));
    const dfm_stream_def d = checked(def);
    const auto meant = [&](const auto &thing) { return thing->handle == d.body; };
    if (d.body && std::none_of(w.bodies.begin(), w.bodies.end(), meant) &&
        std::none_of(w.obstacles.begin(), w.obstacles.end(), meant))
      fail(DFM_E_ARG, "stream: 'body' is no body or obstacle of this world");
    Packets packets(d, w.time);
    if (d.kind == DFM_STREAM_SCENE) add_scene(w, d, packets);
    else add_frame(w, d, packets);
    const std::vector<unsigned char> &all = packets.whole();
    const bool ready = !d.packet && (d.kind == DFM_STREAM_SCENE || d.flags & DFM_STREAM_FLOAT32);
    if (ready) return copy_bytes(all.data(), all.size(), buffer, bytes);
    const std::vector<unsigned char> packed = pack(all, d);
    copy_bytes(packed.data(), packed.size(), buffer, bytes);
  });
}

dfm_status dfm_stream_pack(const void *packet, size_t size, const dfm_stream_def *def, void *buffer,
                           size_t *bytes) {
  return as_status([&] {
    need(packet, "packet");
    const dfm_stream_def d = checked(def);
    const std::vector<unsigned char> out = pack({static_cast<const unsigned char *>(packet), size}, d);
    copy_bytes(out.data(), out.size(), buffer, bytes);
  });
}
