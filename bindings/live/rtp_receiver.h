// The other end of `--stream rtp://`: takes packets at an address of this machine, reports to their sender
// what gets lost, and asks it for what doc/reference/stream.md lists.
#pragma once
#include <sys/socket.h>

#include <chrono>
#include <deque>
#include <string>
#include <vector>

#include "cli/json_text.h"
#include "cli/rtp.h"
#include "live/received.h"

namespace live {

class RtpReceiver {
 public:
  // url: "rtp://ADDRESS:PORT[?token=TEXT]", what the sender sends to. Throws cli::Failure.
  explicit RtpReceiver(const std::string &url);
  ~RtpReceiver();
  RtpReceiver(const RtpReceiver &) = delete;
  // Takes what has come, and sends what is due; call it often.
  void hear();
  const Received &scene() const { return scene_; }
  uint64_t runs() const { return runs_; }      // of which something has come, this one included
  uint64_t frames() const { return frames_; }  // that have come to their end
  uint64_t packets() const { return received_; }
  uint64_t lost() const { return highest_ + 1 > first_ + received_ ? highest_ + 1 - first_ - received_ : 0; }
  bool ended() const { return ended_; }  // the sender has said so
  bool may_request() const { return !url_.token.empty(); }
  // replaces: the kind of unsent request that this one replaces, "pull" or a slider's name; empty: none.
  void send(const cli::JsonObject &request, const std::string &replaces = "");
  // What the sender tells who has the token; null before.
  const cli::JsonValue &state() const { return state_; }
  struct Slider {
    std::string name, label;
    double low = 0, high = 1, value = 0;
    bool logarithmic = false;
  };
  std::vector<Slider> &sliders() { return sliders_; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Request { std::string text, replaces; };
  bool datagram(const unsigned char *in, size_t n);
  void handle_reply(const unsigned char *in, size_t n);
  void handle_state(const cli::JsonValue &state);
  void report();
  void send_requests();
  std::vector<unsigned char> request(uint32_t number, const std::string &text) const;

  const cli::RtpUrl url_;
  int socket_;
  uint32_t own_ = 0, source_ = 0;  // numbers of this end and of the sender
  bool begun_ = false, ended_ = false;
  sockaddr_storage sender_ = {};
  socklen_t sender_size_ = 0;
  uint64_t first_ = 0, highest_ = 0, received_ = 0, expected_before_ = 0, received_before_ = 0, frames_ = 0;
  uint64_t runs_ = 0;
  Clock::time_point heard_, reported_, last_request_;
  Received scene_;
  uint32_t taken_ = 0;            // number of the last one that the sender has taken
  std::deque<Request> requests_;  // those with the next numbers
  size_t sent_ = 0;               // so many of them, from the first on, were sent and keep their text
  cli::JsonValue state_;
  double state_frame_ = 0;  // frame of the state
  std::vector<Slider> sliders_;
};

}  // namespace live
