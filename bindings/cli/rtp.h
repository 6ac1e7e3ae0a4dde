// A run as packets of RTP (RFC 3550) to one address: what dfm_world_stream writes, each packet the payload
// of one datagram. The scene is sent again about once a second, so that who comes late, or has lost a part,
// is whole after the next round; where a cut changes triangles, a round begins at once. The format:
// doc/reference/stream.md.
#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "packets.h"
#include "scene_file.h"

namespace cli {

class RtpSender {
 public:
  // url: "rtp://ADDRESS:PORT". Throws Failure.
  RtpSender(const SceneFile &scene, const std::string &url);
  ~RtpSender();
  RtpSender(const RtpSender &) = delete;
  // After a step: sends where a picture is due, and waits where the run is ahead of the clock.
  void after_step();
  void end();  // the last state, twice, and that nothing follows

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

  const SceneFile &scene_;
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
  Report report_;
};

}  // namespace cli
