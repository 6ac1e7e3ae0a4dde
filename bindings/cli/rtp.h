// A run as packets of RTP (RFC 3550) to one address: what dfm_world_stream writes, each packet the payload
// of one datagram. The scene is sent again about once a second, so that who comes late, or has lost a part,
// is whole after the next round; where something is new, it is sent and a round begins at once. The thread
// that steps takes a copy of the state; another one packs and sends it. The format: doc/reference/stream.md.
#pragma once
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "packets.h"

namespace cli {

// Numbers in headers are big-endian.
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
inline constexpr size_t kToken = 64, kRequestHead = 12 + kToken + 4, kReplyHead = 20;  // bytes
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
int rtp_socket(const RtpUrl &url, const std::string &what, bool connected);  // to it, else bound to it

// As RtpSender does, which sends what it can: throws Failure.
void check_sink(const std::string &url);

class RtpSender {
 public:
  // url: "rtp://ADDRESS:PORT". token: of who may steer, from that address alone; empty: nobody. Throws
  // Failure.
  RtpSender(dfm_world world, const std::string &url, std::string token = "");
  ~RtpSender();
  RtpSender(const RtpSender &) = delete;
  // After a step: waits where the run is ahead of the clock, and sends where a picture is due.
  void after_step();
  void show();                               // what is sent next, where a picture is due
  bool steered() const;                      // who has the token listens
  std::vector<std::string> take();           // what it has asked for since the last call, in order
  void send_state(const std::string &text);  // to it
  void
  end();  // the last state, twice, and that nothing follows; waits until it is sent, for a second at most

  struct Report {
    uint64_t frames = 0, packets = 0, bytes = 0;
    double seconds = 0;                   // that the run itself has spent
    double lost = 0;                      // share, as the receiver has said last
    double lasted = 0;                    // s, from the start to the last frame
    std::map<uint32_t, uint64_t> bodies;  // bytes of their displacements, by number
  };
  Report report() const;

 private:
  using Clock = std::chrono::steady_clock;
  // What the thread of the network gets; what it has not taken in time, the next one replaces.
  struct Inbox {
    Packets frame, news, scene;  // empty: none
    std::string text;
    enum { goes, ends, stops } until = goes;
  };
  void hand_over();
  void stop(bool at_once);
  void work();
  void send_all(const Packets &packets, bool frame);
  void count_frame();
  void send_round(double seconds);
  void send(const unsigned char *payload, size_t n, bool marker);
  void send_report(bool ends);
  void send_reply(const std::string &text);
  void send_end();
  uint32_t stamp() const;
  void hear();
  void hear_request(const unsigned char *in, size_t n);

  const dfm_world world_;
  const std::string token_;
  const int socket_;
  const double begin_;  // s, of the world
  const Clock::time_point began_ = Clock::now();

  // The thread that steps uses these.
  Clock::time_point next_frame_ = began_;
  Teller teller_;

  mutable std::mutex mutex_;  // of these
  std::condition_variable filled_;
  Inbox inbox_;
  double interval_;                     // s, between frames: longer where packets get lost
  uint32_t steerer_ = 0;                // source of who steers
  std::map<uint32_t, uint32_t> taken_;  // of each source, the number of the last request
  Clock::time_point heard_;             // from who steers
  std::vector<std::string> requests_;
  Report report_;

  // The thread of the network uses these.
  uint16_t sequence_;
  uint32_t source_, first_stamp_;
  uint32_t stamp_ = 0;  // of what is sent now
  uint64_t octets_ = 0;
  Packets frame_, news_, round_, next_scene_;
  std::vector<unsigned char> datagram_;
  size_t sent_ = 0;                                                  // bytes of the round
  std::atomic<Clock::time_point> until_ = Clock::time_point::max();  // it sends no packets after that
  std::thread thread_;
};

}  // namespace cli
