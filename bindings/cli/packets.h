// What dfm_world_stream writes, as the command sends it on.
#pragma once
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "deform/deform.h"

namespace cli {

using Packets = std::vector<unsigned char>;  // one behind the other

// Number and shape of each thing in packets of a frame: another shape means other triangles.
using Shapes = std::vector<std::pair<uint32_t, uint32_t>>;
Shapes shapes_in(const Packets &frame);

void write_packets(dfm_world world, const dfm_stream_def &def, Packets &out);
// The present state as one packet; of a frame its surfaces as floats, and contacts.
void write_packet(dfm_world world, uint32_t kind, uint32_t frame, Packets &out);
// Those of a scene for all that `now` has and `before` has not.
Packets news_packets(dfm_world world, uint32_t frame, const Shapes &before, const Shapes &now);
// What the two above write, for a network: packets of at most that many bytes (0: one), surfaces in 16 bits.
void pack(const Packets &packets, uint32_t most, Packets &out);

inline uint32_t word_at(const Packets &packets, size_t at) {
  uint32_t x;
  std::memcpy(&x, &packets[at], sizeof x);
  return x;
}
// f(begin, size) for each packet.
template <class F>
void each_packet(const Packets &packets, F f) {
  for (size_t at = 0; at < packets.size();) {
    const size_t size = word_at(packets, at + 16);
    f(at, size);
    at += size;
  }
}

}  // namespace cli
