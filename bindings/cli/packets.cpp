#include "packets.h"

#include <set>
#include <unordered_map>

#include "messages.h"

namespace cli {

namespace {

// Number and shape of each thing in packets of a frame: another shape means other triangles.
void list_shapes(const Packets &frame, Shapes &out) {
  out.clear();
  each_chunk(frame, [&](size_t at, size_t size) {
    if (std::memcmp(&frame[at], "LIST", 4) == 0)
      for (size_t i = at + 12; i < at + size; i += 8)
        out.emplace_back(word_at(frame, i), word_at(frame, i + 4));
  });
}

// Those of a scene for all that `now` has and `before` has not.
Packets news_packets(dfm_world world, uint32_t frame, const Shapes &before, const Shapes &now) {
  std::unordered_map<uint32_t, uint64_t> things;  // handles by number
  for (const uint64_t body : listed<uint64_t>(dfm_world_bodies, world)) things[uint32_t(body)] = body;
  for (const uint64_t other : listed<uint64_t>(dfm_world_obstacles, world)) things[uint32_t(other)] = other;
  const std::set known(before.begin(), before.end());
  Packets out, one;
  for (const auto &shape : now) {
    const auto thing = things.find(shape.first);
    if (thing == things.end() || known.contains(shape)) continue;
    dfm_stream_def def = dfm_stream_def_default();
    def.kind = DFM_STREAM_SCENE;
    def.frame = frame;
    def.body = thing->second;
    write_packets(world, def, one);
    out.insert(out.end(), one.begin(), one.end());
  }
  return out;
}

void write_packet(dfm_world world, uint32_t kind, uint32_t frame, Packets &out) {
  dfm_stream_def def = dfm_stream_def_default();
  def.kind = kind;
  def.frame = frame;
  if (kind == DFM_STREAM_FRAME) def.flags = DFM_STREAM_CONTACTS | DFM_STREAM_FLOAT32;
  write_packets(world, def, out);
}

}  // namespace

void write_packets(dfm_world world, const dfm_stream_def &def, Packets &out) {
  need(fill(out, 0, [&](void *to, size_t *bytes) { return dfm_world_stream(world, &def, to, bytes); }));
}

void Teller::look(dfm_world world) {
  number_ += looked_;
  write_packet(world, DFM_STREAM_FRAME, number_, frame);
  list_shapes(frame, now_);
  scene.clear();
  changed.clear();
  if (!looked_ || now_ != shapes_) {
    if (looked_) changed = news_packets(world, number_, shapes_, now_);
    write_packet(world, DFM_STREAM_SCENE, number_, scene);
    shapes_.swap(now_);
  }
  looked_ = true;
}

void pack(const Packets &packets, uint32_t most, Packets &out) {
  dfm_stream_def def = dfm_stream_def_default();
  def.packet = most;
  out.clear();
  Packets one;
  each_packet(packets, [&](size_t at, size_t size) {
    need(fill(one, 0,
              [&](void *to, size_t *bytes) { return dfm_stream_pack(&packets[at], size, &def, to, bytes); }));
    out.insert(out.end(), one.begin(), one.end());
  });
}

}  // namespace cli
