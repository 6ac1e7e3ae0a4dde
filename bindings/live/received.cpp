#include "live/received.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

static_assert(std::endian::native == std::endian::little);

namespace live {
namespace {

constexpr size_t kHeader = 32, kChunk = 8;    // bytes
constexpr size_t kMax = size_t{1} << 22;      // points and triangles of all surfaces together
constexpr size_t kEach = 64;                  // of them, that a surface counts for beside its own
constexpr size_t kMaxRows = size_t{1} << 16;  // of contacts, and of what is there
constexpr size_t kLongestName = 100;          // bytes
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Numbers of frames begin again at 2^32.
bool older(uint32_t frame, uint32_t other) {
  const uint32_t behind = other - frame;
  return behind > 0 && behind < 1u << 31;
}

size_t weight(const Received::Mesh &m) {
  return kEach + m.points + m.faces + (m.before ? weight(*m.before) : 0);
}

}  // namespace

class Received::Chunk {
 public:
  Chunk(const unsigned char *bytes, size_t n) : bytes_(bytes), n_(n) {}
  size_t size() const { return n_; }
  const unsigned char *bytes() const { return bytes_; }
  bool has(size_t at, size_t bytes) const { return at <= n_ && bytes <= n_ - at; }
  template <class T = uint32_t>
  T get(size_t at) const {
    T x;
    std::memcpy(&x, bytes_ + at, sizeof x);
    return x;
  }
  // Whether n finite floats stand there.
  bool finite(size_t at, size_t n) const {
    if (!has(at, 4 * n)) return false;
    for (size_t i = 0; i < n; ++i)
      if (!std::isfinite(get<float>(at + 4 * i))) return false;
    return true;
  }
  // Its length stands at `at`.
  std::string name(size_t at) const {
    const size_t n = std::min({size_t{get(at)}, kLongestName, n_ - at - 4});
    return {reinterpret_cast<const char *>(bytes_ + at + 4), n};
  }

 private:
  const unsigned char *bytes_;
  size_t n_;
};

bool Received::read(const unsigned char *bytes, size_t n) {
  while (n > 0) {
    if (n < kHeader || std::memcmp(bytes, "DFMS\x01", 5) != 0) return false;
    const size_t size = Chunk(bytes, n).get(16);
    if (size < kHeader || size > n) return false;
    packet(bytes, size);
    bytes += size;
    n -= size;
  }
  return true;
}

void Received::packet(const unsigned char *bytes, size_t n) {
  const Chunk head(bytes, n);
  const bool frame = bytes[5] == 1, everything = bytes[5] == 0 && bytes[6] == 1 && head.get(8) == 1;
  packet_frame_ = head.get(20);
  if (frame) {
    const double time = head.get<double>(24);
    if ((begun_ && older(packet_frame_, frame_)) || !std::isfinite(time)) return;  // what is there is newer
    if (packet_frame_ != frame_) {
      contacts_.clear();
      parts_.clear();
    }
    begun_ = true;
    frame_ = packet_frame_;
    time_ = time;
  }
  if (everything)
    for (auto &[number, m] : meshes_) m.in_packet = false;
  part_ = head.get(12);
  const size_t before = contacts_.size();
  chunks(bytes + kHeader, n - kHeader);
  if (contacts_.size() > before) parts_.insert(part_);
  if (everything)
    forget([&](uint32_t, const Mesh &m) { return !m.in_packet && !older(packet_frame_, m.frame); });
}

template <class F>
void Received::forget(F gone) {
  std::erase_if(meshes_, [&](const auto &entry) {
    const bool out = gone(entry.first, entry.second);
    if (out) held_ -= weight(entry.second);
    return out;
  });
}

void Received::chunks(const unsigned char *bytes, size_t n) {
  const Chunk all(bytes, n);
  for (size_t at = 0; all.has(at, kChunk);) {
    const size_t size = all.get(at + 4);
    if (size % 4 != 0 || !all.has(at + kChunk, size)) break;
    chunk(bytes + at, Chunk(bytes + at + kChunk, size));
    at += kChunk + size;
  }
}

void Received::chunk(const unsigned char *tag, const Chunk &c) {
  static const struct {
    char tag[5];
    void (Received::*read)(const Chunk &);
  } kKinds[] = {{"BODY", &Received::body},      {"OBST", &Received::thing},   {"BASE", &Received::base},
                {"TRIS", &Received::triangles}, {"LIST", &Received::list},    {"POSE", &Received::poses},
                {"SURF", &Received::surface},   {"CONT", &Received::contacts}};
  for (const auto &kind : kKinds)
    if (std::memcmp(tag, kind.tag, 4) == 0) return (this->*kind.read)(c);
}

// False: the chunk is kept until as much has come as the lists of the mesh need at least.
bool Received::fills(Mesh &m, const char *tag, const Chunk &c) {
  if (m.filled) return true;
  const auto size = uint32_t(c.size());
  m.waiting.insert(m.waiting.end(), tag, tag + 4);
  m.waiting.insert(m.waiting.end(), reinterpret_cast<const unsigned char *>(&size),
                   reinterpret_cast<const unsigned char *>(&size) + sizeof size);
  m.waiting.insert(m.waiting.end(), c.bytes(), c.bytes() + size);
  if (m.waiting.size() < 12 * (m.points + m.faces)) return false;
  const std::vector<unsigned char> all = std::move(m.waiting);
  m.filled = true;
  m.base.assign(3 * m.points, std::numeric_limits<float>::quiet_NaN());
  m.moved.assign(3 * m.points, m.rigid ? 0 : kNone);
  m.x.assign(3 * m.points, kNone);
  m.triangles.assign(3 * m.faces, UINT32_MAX);
  chunks(all.data(), all.size());
  return false;
}

void Received::body(const Chunk &c) {
  if (c.has(0, 20)) set_triangles(c, Mesh(), 16);
}

void Received::thing(const Chunk &c) {
  if (!c.has(0, 44) || !c.finite(20, 5)) return;
  Mesh t;
  t.rigid = true;
  t.kind = c.get(16) & 0xffff;
  t.sensor = c.get(16) >> 16 & 1;
  t.radius = c.get<float>(20);
  t.half_length = c.get<float>(24);
  for (size_t k = 0; k < 3; ++k) t.half_size[k] = c.get<float>(28 + 4 * k);
  set_triangles(c, std::move(t), 40);
}

// One thing has a number, and the newest that was told has it. name: where it stands.
void Received::set_triangles(const Chunk &c, Mesh fresh, size_t name) {
  const auto found = meshes_.find(c.get(0));
  if (found != meshes_.end()) {
    Mesh &m = found->second;
    m.in_packet = true;
    if ((m.shape == c.get(4) && m.rigid == fresh.rigid) || older(packet_frame_, m.frame)) return;
  }
  fresh.points = c.get(8);
  fresh.faces = c.get(12);
  const size_t others = held_ - (found == meshes_.end() ? 0 : weight(found->second));
  if (others + weight(fresh) > kMax) return;
  fresh.name = c.name(name);
  fresh.shape = c.get(4);
  fresh.frame = packet_frame_;
  fresh.in_packet = true;
  fresh.filled = fresh.points + fresh.faces == 0;
  fresh.missing = 3 * fresh.faces + (fresh.rigid ? 3 * fresh.points + 1 : 6 * fresh.points);
  if (found != meshes_.end()) {
    Mesh &old = found->second;
    std::unique_ptr<Mesh> before;
    if (!fresh.rigid && !old.rigid && fresh.missing > 0)
      before = old.missing == 0 ? std::make_unique<Mesh>(std::move(old)) : std::move(old.before);
    if (before && others + weight(fresh) + weight(*before) <= kMax) fresh.before = std::move(before);
  }
  held_ = others + weight(fresh);
  meshes_.insert_or_assign(c.get(0), std::move(fresh));
}

Received::Mesh *Received::mesh(const Chunk &c) {
  if (!c.has(0, 16)) return nullptr;
  const auto found = meshes_.find(c.get(0));
  return found == meshes_.end() || found->second.shape != c.get(4) ? nullptr : &found->second;
}

void Received::base(const Chunk &c) {
  Mesh *const m = mesh(c);
  if (!m) return;
  const size_t first = 3 * size_t{c.get(8)}, n = 3 * size_t{c.get(12)}, all = 3 * m->points;
  if (n == 0 || first > all || n > all - first || !c.finite(16, n) || !fills(*m, "BASE", c)) return;
  for (size_t i = 0; i < n; ++i) {
    float &to = m->base[first + i];
    m->missing -= std::isnan(to);
    to = c.get<float>(16 + 4 * i);
    m->x[first + i] = double{to} + m->moved[first + i];
  }
  if (m->missing == 0) complete(*m);
}

void Received::triangles(const Chunk &c) {
  Mesh *const m = mesh(c);
  if (!m) return;
  const size_t first = 3 * size_t{c.get(8)}, n = 3 * size_t{c.get(12)}, all = 3 * m->faces;
  if (n == 0 || first > all || n > all - first || !c.has(16, 4 * n)) return;
  for (size_t i = 0; i < n; ++i)
    if (c.get(16 + 4 * i) >= m->points) return;
  if (!fills(*m, "TRIS", c)) return;
  for (size_t i = 0; i < n; ++i) {
    uint32_t &to = m->triangles[first + i];
    m->missing -= to == UINT32_MAX;
    to = c.get(16 + 4 * i);
  }
  if (m->missing == 0) complete(*m);
}

// Complete: what was drawn before is not needed any more.
void Received::complete(Mesh &m) {
  if (!m.before) return;
  held_ -= weight(*m.before);
  m.before.reset();
}

// What a list that is whole leaves out is gone, unless it was told later.
void Received::list(const Chunk &c) {
  if (!c.has(0, 4) || c.get(0) > kMaxRows) return;
  const size_t all = c.get(0);
  if (listed_ != frame_) listing_.clear();
  listed_ = frame_;
  for (size_t at = 4; c.has(at, 8) && listing_.size() < all; at += 8) listing_[c.get(at)] = c.get(at + 4);
  if (listing_.size() < all) return;
  present_.swap(listing_);
  listing_.clear();
  forget([&](uint32_t number, const Mesh &m) { return !present(number) && older(m.frame, frame_); });
}

void Received::poses(const Chunk &c) {
  for (size_t at = 0; c.has(at, 32); at += 32) {
    const auto found = meshes_.find(c.get(at));
    if (found == meshes_.end() || !found->second.rigid || !c.finite(at + 4, 7)) continue;
    Mesh &t = found->second;
    for (size_t k = 0; k < 3; ++k) t.position[k] = double{c.get<float>(at + 4 + 4 * k)};
    for (size_t k = 0; k < 4; ++k) t.rotation[k] = double{c.get<float>(at + 16 + 4 * k)};
    t.missing -= !t.placed;
    t.placed = true;
  }
}

void Received::surface(const Chunk &c) {
  Mesh *const found = c.has(0, 20) ? mesh(c) : nullptr;
  if (!found || found->rigid) return;
  Mesh &m = *found;
  const size_t first = 3 * size_t{c.get(8)}, n = 3 * size_t{c.get(12)};
  const size_t all = 3 * m.points;
  const bool floats = c.get(16) & 1;
  if (n == 0 || first > all || n > all - first) return;
  if (floats ? !c.finite(20, n) : !c.finite(20, 6) || !c.has(48, 2 * n)) return;
  if (!fills(m, "SURF", c)) return;
  for (size_t i = 0; i < n; ++i) {
    double &to = m.moved[first + i];
    m.missing -= std::isnan(to);
    if (floats) {
      to = double{c.get<float>(20 + 4 * i)};
    } else {
      const size_t k = 4 * (i % 3);
      to = double{c.get<float>(20 + k)} + double{c.get<float>(32 + k)} * c.get<uint16_t>(48 + 2 * i);
    }
    m.x[first + i] = double{m.base[first + i]} + to;
  }
  if (m.missing == 0) complete(m);
}

// A packet that comes again brings none.
void Received::contacts(const Chunk &c) {
  if (parts_.contains(part_)) return;
  for (size_t at = 0; c.has(at, 28) && contacts_.size() < kMaxRows; at += 28) {
    if (!c.finite(at, 6)) continue;
    Contact row;
    for (size_t k = 0; k < 3; ++k) {
      row.point[k] = c.get<float>(at + 4 * k);
      row.force[k] = c.get<float>(at + 12 + 4 * k);
    }
    row.sticks = c.get(at + 24);
    contacts_.push_back(row);
  }
}

}  // namespace live
