// A run as packets of RTP (RFC 3550) to one address: what dfm_world_stream writes, each packet the payload
// of one datagram. The scene is sent again about once a second, so that who comes late, or has lost a part,
// is whole after the next round; where a cut changes triangles, a round begins at once. The format:
// doc/reference/stream.md.
#pragma once
#include <sys/socket.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "packets.h"
#include "scene_file.h"

namespace cli {

// Of numbers in headers, which are big-endian.
inline void put16(unsigned char *to, uint32_t x) {
  to[0] = static_cast<unsigned char>(x >> 8);
  to[1] = static_cast<unsigned char>(x);
}
inline void put32(unsigned char *to, uint32_t x) {
  put16(to, x >> 16);
  put16(to + 2, x & 0xffff);
}
inline uint32_t get16(const unsigned char *from) { return uint32_t{from[0]} << 8 | from[1]; }
inline uint32_t get32(const unsigned char *from) { return get16(from) << 16 | get16(from + 2); }

inline constexpr uint32_t kRtpHeader = 12;  // bytes
// Types of packets of RTCP.
enum : uint8_t { kSenderReport = 200, kReceiverReport = 201, kDescription = 202, kGoodbye = 203, kApp = 204 };
// Packets of that type and the name "DFMC": a request is the token, its number and its text; an answer the
// number of the last request that was taken, and the state.
inline constexpr size_t kToken = 64, kRequestHead = 12 + kToken + 4, kAnswerHead = 20;  // bytes
inline constexpr char kControl[] = "DFMC";
// With `text` behind the head, whose fields behind the name are left zero.
std::vector<unsigned char> control_packet(uint32_t source, size_t head, const std::string &text);

// f(bytes, n) for each packet of RTCP in a datagram, as long as they are whole.
template <class F>
void each_report(const unsigned char *bytes, size_t n, F f) {
  while (n >= 8 && bytes[0] >> 6 == 2) {
    const size_t size = 4 + 4 * size_t{get16(bytes + 2)};
    if (size < 8 || size > n) return;
    f(bytes, size);
    bytes += size;
    n -= size;
  }
}

// "rtp://ADDRESS:PORT[?token=TEXT]"; throws Failure, whose sentence begins with `what`.
struct RtpUrl { std::string host, port, token; };
RtpUrl rtp_url(const std::string &url, const std::string &what);
// A socket at the first of the host's addresses at which open(socket, address, length) gives 0.
int rtp_socket(const RtpUrl &url, const std::string &what,
               const std::function<int(int, const sockaddr *, socklen_t)> &open);

class RtpSender {
 public:
  // url: "rtp://ADDRESS:PORT". token: of who may steer, from that address alone; empty: nobody. Throws
  // Failure.
  RtpSender(const SceneFile &scene, const std::string &url, std::string token = "");
  ~RtpSender();
  RtpSender(const RtpSender &) = delete;
  // After a step: waits where the run is ahead of the clock, and sends where a picture is due.
  void after_step();
  void show();                         // sends where a picture is due
  bool steered() const;                // who has the token listens
  std::vector<std::string> take();     // what it has asked for since the last call, in order
  void tell(const std::string &text);  // to it
  void end();                          // the last state, twice, and that nothing follows

  struct Report {
    uint64_t frames = 0, packets = 0, bytes = 0;
    double seconds = 0;  // of the run's own time, for encoding and sending
    double lost = 0;     // share, as the receiver has said last
  };
  const Report &report() const { return report_; }

 private:
  using Clock = std::chrono::steady_clock;
  void send_frame();
  void send_changed(const Shapes &shapes);
  void send_round(double seconds);
  void send(const unsigned char *payload, size_t n, bool marker, uint32_t stamp);
  void send_all(const Packets &packets, bool frame);
  void send_report(bool ends);
  uint32_t stamp() const;
  void hear();
  void hear_request(const unsigned char *in, size_t n);

  const SceneFile &scene_;
  const std::string token_;
  int socket_ = -1;
  uint16_t sequence_;
  uint32_t source_, first_stamp_;
  uint64_t octets_ = 0;
  double begin_;  // s, of the world
  Clock::time_point began_, last_frame_, next_frame_, next_report_, next_round_;
  double interval_;  // s, between frames: longer where packets get lost
  Packets frame_, changed_, round_;
  std::vector<unsigned char> datagram_;
  size_t sent_ = 0;  // bytes of the round
  Shapes shapes_;
  uint32_t number_ = 0;
  uint32_t steerer_ = 0;                // source of who steers
  std::map<uint32_t, uint32_t> taken_;  // of each source, the number of the last request
  Clock::time_point heard_;             // from who steers
  std::vector<std::string> requests_;
  Report report_;
};

}  // namespace cli
