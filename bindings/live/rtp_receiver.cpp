#include "live/rtp_receiver.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "cli/messages.h"

namespace live {
namespace {

constexpr auto kReports = std::chrono::seconds(1), kSilence = std::chrono::seconds(2);
constexpr auto kAgain = std::chrono::milliseconds(50);  // requests are sent again
constexpr size_t kMostAsked = 64;                       // requests that wait
constexpr int kBuffer = 1 << 21;                        // bytes, of the system for the socket
constexpr uint8_t kVersion = 2 << 6;

bool same(const sockaddr_storage &a, socklen_t na, const sockaddr_storage &b, socklen_t nb) {
  return na == nb && std::memcmp(&a, &b, na) == 0;
}

}  // namespace

RtpReceiver::RtpReceiver(const std::string &url)
    : url_(cli::rtp_url(url, "view")), socket_(cli::rtp_socket(url_, "view", bind)) {
  setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &kBuffer, sizeof kBuffer);
  std::random_device system;
  own_ = system();
  heard_ = reported_ = asked_ = Clock::now();
}

RtpReceiver::~RtpReceiver() { close(socket_); }

void RtpReceiver::hear() {
  unsigned char in[2048];
  for (;;) {
    sockaddr_storage from = {};
    socklen_t size = sizeof from;
    const ssize_t n = recvfrom(socket_, in, sizeof in, 0, reinterpret_cast<sockaddr *>(&from), &size);
    if (n < 0) break;
    // one sender at a time: another one counts when this one has ended, or is silent
    const bool its = begun_ && same(from, size, sender_, sender_size_);
    if (begun_ && !its && !ended_ && Clock::now() < heard_ + kSilence) continue;
    if (n < int{cli::kRtpHeader} || in[0] >> 6 != 2) continue;
    const bool rtp = in[1] < cli::kSenderReport || in[1] > cli::kApp;
    if (!its && !rtp) continue;
    sender_ = from;
    sender_size_ = size;
    heard_ = Clock::now();
    if (rtp) datagram(in, size_t(n));
    else
      cli::each_report(in, size_t(n), [&](const unsigned char *p, size_t bytes) {
        if (p[1] == cli::kGoodbye) ended_ = true;
        if (p[1] == cli::kApp) answer(p, bytes);
      });
  }
  if (!begun_ || ended_) return;
  const Clock::time_point now = Clock::now();
  if (now >= reported_ + kReports) report();
  if (!requests_.empty() && now >= asked_ + kAgain) send_requests();
}

void RtpReceiver::datagram(const unsigned char *in, size_t n) {
  const uint32_t sequence = cli::get16(in + 2), source = cli::get32(in + 8);
  if (!begun_ || source != source_) {  // another run
    begun_ = true;
    source_ = source;
    first_ = highest_ = sequence;
    received_ = expected_before_ = received_before_ = 0;
    scene_ = {};
    state_ = {};
    sliders_.clear();
    requests_.clear();
    reported_ = Clock::now() - kReports;
  }
  ended_ = false;
  const uint32_t ahead = (sequence - uint32_t(highest_)) & 0xffff;
  if (ahead < 0x8000) highest_ += ahead;  // counts on past 16 bits
  ++received_;
  frames_ += in[1] >> 7;
  scene_.read(in + cli::kRtpHeader, n - cli::kRtpHeader);
}

void RtpReceiver::answer(const unsigned char *in, size_t n) {
  if (n < cli::kAnswerHead || std::memcmp(in + 8, cli::kControl, 4) != 0) return;
  if (cli::get32(in + 12) != own_) return;
  const uint32_t taken = cli::get32(in + 16);
  while (!requests_.empty() && int32_t(taken - requests_.front().number) >= 0) requests_.pop_front();
  cli::JsonValue state;
  if (cli::parse_json({in + cli::kAnswerHead, in + n}, state) && state.kind == cli::JsonValue::object) {
    told(state);
    state_ = std::move(state);
  }
}

// One slider in each answer.
void RtpReceiver::told(const cli::JsonValue &state) {
  for (const cli::JsonValue &s : state.list("sliders")) {
    const std::string name = s.get("name");
    auto at =
        std::find_if(sliders_.begin(), sliders_.end(), [&](const Slider &have) { return have.name == name; });
    if (at == sliders_.end()) {
      if (sliders_.size() >= kMostAsked) return;
      at = sliders_.insert(at, Slider{name, s.get("label"), 0, 1, 0, s.get("logarithmic") == "true"});
    }
    at->low = s.scalar("low");
    at->high = s.scalar("high");
    if (requests_.empty()) at->value = s.scalar("value");  // else it may be from before what was asked for
  }
}

// What may have been taken keeps its text: only what no datagram has carried yet is replaced.
void RtpReceiver::ask(const cli::JsonObject &request, bool replaced) {
  if (replaced && !requests_.empty() && requests_.back().replaced && requests_.back().number > sent_) {
    requests_.back().text = request.text();
    return;
  }
  if (!may_ask() || requests_.size() >= kMostAsked) return;
  requests_.push_back({++number_, request.text(), replaced});
  if (!replaced || requests_.size() == 1) send_requests();
}

std::vector<unsigned char> RtpReceiver::request(uint32_t number, const std::string &text) const {
  std::vector<unsigned char> out = cli::control_packet(own_, cli::kRequestHead, text);
  std::memcpy(&out[12], url_.token.data(), url_.token.size());
  cli::put32(&out[12 + cli::kToken], number);
  return out;
}

void RtpReceiver::send_requests() {
  asked_ = Clock::now();
  if (!begun_) return;
  sent_ = number_;
  for (const Request &r : requests_) {
    const std::vector<unsigned char> out = request(r.number, r.text);
    sendto(socket_, out.data(), out.size(), 0, reinterpret_cast<const sockaddr *>(&sender_), sender_size_);
  }
}

void RtpReceiver::report() {
  reported_ = Clock::now();
  const uint64_t all = highest_ + 1 - first_;
  const uint64_t expected = all - expected_before_, came = received_ - received_before_;
  const double share = expected > came ? double(expected - came) / double(expected) : 0;
  expected_before_ = all;
  received_before_ = received_;
  std::vector<unsigned char> out(32);
  out[0] = kVersion | 1;
  out[1] = cli::kReceiverReport;
  cli::put16(&out[2], 7);
  cli::put32(&out[4], own_);
  cli::put32(&out[8], source_);
  cli::put32(&out[12], uint32_t(255 * share) << 24 | uint32_t(std::min<uint64_t>(lost(), 0xffffff)));
  cli::put32(&out[16], uint32_t(highest_));
  if (may_ask()) {  // says that it listens
    const std::vector<unsigned char> here = request(0, "");
    out.insert(out.end(), here.begin(), here.end());
  }
  sendto(socket_, out.data(), out.size(), 0, reinterpret_cast<const sockaddr *>(&sender_), sender_size_);
}

}  // namespace live
