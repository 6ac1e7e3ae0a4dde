#include "live/rtp_receiver.h"

#include <unistd.h>

#include <algorithm>
#include <cfloat>
#include <cstring>
#include <random>

#include "cli/messages.h"

namespace live {
namespace {

constexpr auto kReports = std::chrono::seconds(1), kSilence = std::chrono::seconds(2);
constexpr auto kAgain = std::chrono::milliseconds(50);  // requests are sent again
constexpr size_t kMaxRequests = 256, kAtOnce = 32;      // requests that wait; of them, that are sent
constexpr size_t kMaxSliders = 64, kLongest = 256;      // sliders; bytes of their texts
constexpr int kMaxHeard = 1024;                         // datagrams at a time
constexpr int kBuffer = 1 << 21;                        // bytes, of the system for the socket
constexpr uint8_t kVersion = 2 << 6;

bool shows(const RtpReceiver::Slider &s) {
  const auto good = [](const std::string &text) {
    return !text.empty() && text.size() <= kLongest && text.find('\0') == std::string::npos;
  };
  const double most = FLT_MAX / 4;  // what a panel takes
  return good(s.name) && good(s.label) && s.low >= -most && s.high <= most && float(s.low) < float(s.high) &&
         (!s.logarithmic || float(s.low) > 0) && s.value >= s.low && s.value <= s.high;
}

bool same(const sockaddr_storage &a, socklen_t na, const sockaddr_storage &b, socklen_t nb) {
  return na == nb && std::memcmp(&a, &b, na) == 0;
}

}  // namespace

RtpReceiver::RtpReceiver(const std::string &url)
    : url_(cli::rtp_url(url, "view")), socket_(cli::rtp_socket(url_, "view", false)) {
  setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &kBuffer, sizeof kBuffer);
  heard_ = reported_ = last_request_ = Clock::now();
}

RtpReceiver::~RtpReceiver() { close(socket_); }

void RtpReceiver::hear() {
  unsigned char in[1 << 16];
  for (int i = 0; i < kMaxHeard; ++i) {
    sockaddr_storage from = {};
    socklen_t size = sizeof from;
    const ssize_t n = recvfrom(socket_, in, sizeof in, 0, reinterpret_cast<sockaddr *>(&from), &size);
    if (n < 0) break;
    // one sender at a time: another one counts when this one has ended, or is silent
    const bool its = begun_ && same(from, size, sender_, sender_size_);
    if (begun_ && !its && !ended_ && Clock::now() < heard_ + kSilence) continue;
    if (n < int{cli::kRtpHeader} || in[0] >> 6 != 2) continue;
    const bool rtp = in[1] < cli::kSenderReport || in[1] > cli::kApp;
    if (rtp ? !datagram(in, size_t(n)) : !its) continue;
    sender_ = from;
    sender_size_ = size;
    heard_ = Clock::now();
    if (!rtp)
      cli::each_report(in, size_t(n), [&](const unsigned char *p, size_t bytes) {
        if (p[1] == cli::kGoodbye) ended_ = true;
        if (p[1] == cli::kApp) handle_reply(p, bytes);
      });
  }
  if (!begun_ || ended_) return;
  const Clock::time_point now = Clock::now();
  if (now >= reported_ + kReports) report();
  if (!requests_.empty() && now >= last_request_ + kAgain) send_requests();
}

// False: it is none of a run. Whose first one is none is not the sender, and does not get the token.
bool RtpReceiver::datagram(const unsigned char *in, size_t n) {
  const uint32_t sequence = cli::get16(in + 2), source = cli::get32(in + 8);
  if (!begun_ || source != source_) {  // another run
    if (n == cli::kRtpHeader || !Received().read(in + cli::kRtpHeader, n - cli::kRtpHeader)) return false;
    begun_ = true;
    own_ = std::random_device()();  // numbers of requests begin again
    source_ = source;
    first_ = highest_ = sequence;
    received_ = expected_before_ = received_before_ = 0;
    scene_ = {};
    state_ = {};
    state_frame_ = 0;
    ++runs_;
    sliders_.clear();
    requests_.clear();
    taken_ = 0;
    sent_ = 0;
    reported_ = Clock::now() - kReports;
  }
  ended_ = false;
  const uint32_t ahead = (sequence - uint32_t(highest_)) & 0xffff;
  if (ahead < 0x8000) highest_ += ahead;  // counts on past 16 bits
  ++received_;
  frames_ += in[1] >> 7;
  scene_.read(in + cli::kRtpHeader, n - cli::kRtpHeader);
  return true;
}

void RtpReceiver::handle_reply(const unsigned char *in, size_t n) {
  if (!may_request() || n < cli::kReplyHead || std::memcmp(in + 8, cli::kControl, 4) != 0) return;
  if (cli::get32(in + 12) != own_) return;
  if (const uint32_t more = cli::get32(in + 16) - taken_; more <= sent_) {
    requests_.erase(requests_.begin(), requests_.begin() + more);
    taken_ += more;
    sent_ -= more;
  }
  cli::JsonValue state;
  if (!cli::parse_json({in + cli::kReplyHead, in + n}, state) || state.kind != cli::JsonValue::object) return;
  const double frame = state.scalar("frame");
  if (!(frame >= state_frame_ && frame <= UINT32_MAX)) return;  // it has come late
  state_frame_ = frame;
  handle_state(state);
  state_ = std::move(state);
}

// One slider in each answer; anyone may have sent it.
void RtpReceiver::handle_state(const cli::JsonValue &state) {
  for (const cli::JsonValue &s : state.list("sliders")) {
    Slider fresh = {s.get("name"),    s.get("label"),    s.scalar("low"),
                    s.scalar("high"), s.scalar("value"), s.get("logarithmic") == "true"};
    if (!shows(fresh)) continue;
    const auto at = std::find_if(sliders_.begin(), sliders_.end(),
                                 [&](const Slider &have) { return have.name == fresh.name; });
    if (at == sliders_.end()) {
      if (sliders_.size() < kMaxSliders) sliders_.push_back(std::move(fresh));
      continue;
    }
    if (!requests_.empty())  // it may be from before what was asked for
      fresh.value = std::clamp(at->value, fresh.low, fresh.high);
    *at = std::move(fresh);
  }
}

// What may have been taken keeps its text, and what replaces nothing keeps its place among all others.
void RtpReceiver::send(const cli::JsonObject &request, const std::string &replaces) {
  if (!may_request()) return;
  for (size_t i = requests_.size(); i > sent_ && !replaces.empty() && !requests_[i - 1].replaces.empty(); --i)
    if (requests_[i - 1].replaces == replaces) {
      requests_[i - 1].text = request.text();
      return;
    }
  if (requests_.size() >= kMaxRequests) {
    const auto waits = std::find_if(requests_.begin() + std::ptrdiff_t(sent_), requests_.end(),
                                    [](const Request &r) { return !r.replaces.empty(); });
    if (waits == requests_.end()) return;
    requests_.erase(waits);
  }
  requests_.push_back({request.text(), replaces});
  if (replaces.empty() || requests_.size() == 1) send_requests();
}

std::vector<unsigned char> RtpReceiver::request(uint32_t number, const std::string &text) const {
  std::vector<unsigned char> out = cli::control_packet(own_, cli::kRequestHead, text);
  std::memcpy(&out[12], url_.token.data(), url_.token.size());
  cli::put32(&out[12 + cli::kToken], number);
  return out;
}

void RtpReceiver::send_requests() {
  last_request_ = Clock::now();
  if (!begun_) return;
  sent_ = std::max(sent_, std::min(requests_.size(), kAtOnce));
  for (size_t i = 0; i < sent_; ++i) {
    const std::vector<unsigned char> out = request(taken_ + 1 + uint32_t(i), requests_[i].text);
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
  if (may_request()) {  // says that it listens
    const std::vector<unsigned char> here = request(0, "");
    out.insert(out.end(), here.begin(), here.end());
  }
  sendto(socket_, out.data(), out.size(), 0, reinterpret_cast<const sockaddr *>(&sender_), sender_size_);
}

}  // namespace live
