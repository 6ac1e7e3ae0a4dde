#include "packets.h"

#include <algorithm>

#include "messages.h"

namespace cli {

Shapes shapes_in(const Packets &frame) {
  Shapes out;
  each_packet(frame, [&](size_t begin, size_t size) {
    for (size_t at = begin + 32; at < begin + size;) {
      const uint32_t bytes = word_at(frame, at + 4);
      if (std::memcmp(&frame[at], "LIST", 4) == 0)
        for (size_t i = at + 12; i < at + 8 + bytes; i += 8)
          out.emplace_back(word_at(frame, i), word_at(frame, i + 4));
      at += 8 + bytes;
    }
  });
  return out;
}

namespace {

// Into the memory that `out` has got before, where that is enough.
template <class F>
void fill(Packets &out, F write) {
  out.resize(std::max<size_t>(out.capacity(), 64));
  size_t bytes = out.size();
  if (write(out.data(), &bytes) != DFM_OK) {
    out.resize(bytes + bytes / 4);  // what it needs; some more for the next ones
    bytes = out.size();
    need(write(out.data(), &bytes));
  }
  out.resize(bytes);
}

}  // namespace

void write_packets(dfm_world world, const dfm_stream_def &def, Packets &out) {
  fill(out, [&](void *to, size_t *bytes) { return dfm_world_stream(world, &def, to, bytes); });
}

void write_packet(dfm_world world, uint32_t kind, uint32_t frame, Packets &out) {
  dfm_stream_def def = dfm_stream_def_default();
  def.kind = kind;
  def.frame = frame;
  if (kind == DFM_STREAM_FRAME) def.flags = DFM_STREAM_CONTACTS | DFM_STREAM_FLOAT32;
  write_packets(world, def, out);
}

Packets news_packets(dfm_world world, uint32_t frame, const Shapes &before, const Shapes &now) {
  std::vector<uint64_t> things = listed<uint64_t>(dfm_world_bodies, world);
  const std::vector<uint64_t> others = listed<uint64_t>(dfm_world_obstacles, world);
  things.insert(things.end(), others.begin(), others.end());
  Packets out, one;
  for (const auto &shape : now) {
    if (std::find(before.begin(), before.end(), shape) != before.end()) continue;
    const auto thing = std::find_if(things.begin(), things.end(), [&](uint64_t handle) {
      return static_cast<uint32_t>(handle) == shape.first;
    });
    if (thing == things.end()) continue;
    dfm_stream_def def = dfm_stream_def_default();
    def.kind = DFM_STREAM_SCENE;
    def.frame = frame;
    def.body = *thing;
    write_packets(world, def, one);
    out.insert(out.end(), one.begin(), one.end());
  }
  return out;
}

void pack(const Packets &packets, uint32_t most, Packets &out) {
  dfm_stream_def def = dfm_stream_def_default();
  def.packet = most;
  out.clear();
  Packets one;
  each_packet(packets, [&](size_t at, size_t size) {
    fill(one, [&](void *to, size_t *bytes) { return dfm_stream_pack(&packets[at], size, &def, to, bytes); });
    out.insert(out.end(), one.begin(), one.end());
  });
}

}  // namespace cli
