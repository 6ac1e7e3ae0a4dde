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
        for (size_t i = at + 8; i < at + 8 + bytes; i += 8)
          out.emplace_back(word_at(frame, i), word_at(frame, i + 4));
      at += 8 + bytes;
    }
  });
  return out;
}

void write_packets(dfm_world world, const dfm_stream_def &def, Packets &out) {
  out.resize(std::max<size_t>(out.capacity(), 64));
  size_t bytes = out.size();
  if (dfm_world_stream(world, &def, out.data(), &bytes) != DFM_OK) {
    out.resize(bytes + bytes / 4);  // what it needs; some more for the next ones
    bytes = out.size();
    need(dfm_world_stream(world, &def, out.data(), &bytes));
  }
  out.resize(bytes);
}

}  // namespace cli
