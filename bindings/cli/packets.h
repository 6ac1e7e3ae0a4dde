// What dfm_world_stream writes, as the command sends it on.
#pragma once
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "deform/deform.h"

namespace cli {

using Packets = std::vector<unsigned char>;  // one behind the other

using Shapes = std::vector<std::pair<uint32_t, uint32_t>>;  // of things: number and shape

void write_packets(dfm_world world, const dfm_stream_def &def, Packets &out);

// What viewers get of a world. look() fills it, in the memory of the last time: a frame in one packet,
// surfaces as floats, with contacts; and where something is new, the scene, and of it what has changed (the
// first time nothing: all of it is new).
class Teller {
 public:
  Packets frame, scene, changed;
  void look(dfm_world world);
  uint32_t number() const { return number_; }  // of `frame`

 private:
  uint32_t number_ = 0;
  bool looked_ = false;
  Shapes shapes_, now_;  // of the scene that was told last
};

// What it has, for a network: packets of at most that many bytes (0: one), surfaces in 16 bits.
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

// f(begin, size) for each chunk of them.
template <class F>
void each_chunk(const Packets &packets, F f) {
  each_packet(packets, [&](size_t begin, size_t bytes) {
    for (size_t at = begin + 32; at < begin + bytes;) {
      const size_t size = 8 + size_t{word_at(packets, at + 4)};
      f(at, size);
      at += size;
    }
  });
}
// What write(to, &bytes) gives, behind `head` bytes, in the memory that `out` has where that is enough.
template <class F>
dfm_status fill(Packets &out, size_t head, F write) {
  out.resize(std::max<size_t>(out.capacity(), head + 64));
  size_t bytes = out.size() - head;
  dfm_status status = write(out.data() + head, &bytes);
  if (status != DFM_OK && bytes > out.size() - head) {
    out.resize(head + bytes + bytes / 4);  // what it needs; some more for the next ones
    bytes = out.size() - head;
    status = write(out.data() + head, &bytes);
  }
  out.resize(status == DFM_OK ? head + bytes : head);
  return status;
}

}  // namespace cli
