#include "rtp.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <random>
#include <thread>
#include <utility>

#include "messages.h"
#include "secret.h"
#include "system.h"

namespace cli {
namespace {

constexpr uint32_t kPayload = 1188;  // bytes: a datagram of 1,200 passes every network
constexpr uint8_t kRtpVersion = 2 << 6, kPayloadType = 96;
constexpr double kFrameRate = 30, kSlowest = 5;  // frames a second
constexpr std::chrono::seconds kReports(5), kEnding(1);
constexpr std::chrono::milliseconds kRound(600);  // and half of one: who joins late is whole within a second
constexpr std::chrono::milliseconds kTick(5);     // within which what comes is heard
constexpr int kPatience = 5;                      // ms
constexpr double kTooMuch = 0.1, kLittle = 0.02;  // share lost: frames become rarer, and more frequent again
constexpr size_t kMaxRequests = 256;              // that wait; what comes beyond comes again
constexpr size_t kMaxSteerers = 4096;             // that a run knows
constexpr int kMaxHeard = 256;                    // datagrams at a time
constexpr double kTicks = 90000;                  // of the timestamp, in a second
constexpr double kFrom1900 = 2208988800.0;        // s, to 1970
constexpr auto kListens = std::chrono::seconds(5);  // who steers is gone after that

// Of --stream, whose token is no part of it.
RtpUrl sink(const std::string &url) {
  RtpUrl out = rtp_url(url, "--stream");
  if (out.host.empty()) throw Failure(kBadInput, "--stream " + url + ": expected rtp://ADDRESS:PORT");
  if (!out.token.empty())
    throw Failure(kBadInput, "--stream " + url + ": no token belongs here; `deform serve` has --token");
  return out;
}

}  // namespace

RtpUrl rtp_url(const std::string &url, const std::string &what) {
  const auto refuse = [&](const std::string &why) {
    throw Failure(kBadInput, what + " " + url + ": " + why);
  };
  const std::string scheme = "rtp://", query = "?token=";
  RtpUrl out;
  std::string rest = url;
  if (const size_t at = url.find(query); at != std::string::npos) {
    out.token = url.substr(at + query.size());
    rest = url.substr(0, at);
    if (rest.ends_with('/')) rest.pop_back();
    if (out.token.size() > kToken) refuse("the token has more than 64 letters");
  }
  const size_t colon = rest.rfind(':');
  if (!rest.starts_with(scheme) || colon < scheme.size()) refuse("expected rtp://ADDRESS:PORT");
  out.host = rest.substr(scheme.size(), colon - scheme.size());
  if (out.host.size() > 1 && out.host.front() == '[' && out.host.back() == ']')
    out.host = out.host.substr(1, out.host.size() - 2);
  out.port = rest.substr(colon + 1);
  unsigned number = 0;
  const char *const last = out.port.data() + out.port.size();
  const auto [end, bad] = std::from_chars(out.port.data(), last, number);
  if (bad != std::errc() || end != last || number == 0 || number > 65535)
    refuse("expected a port from 1 to 65535 behind the last colon");
  return out;
}

int rtp_socket(const RtpUrl &url, const std::string &what, bool connected) {
  std::string why;
  const int out = os::datagram_socket(url.host, url.port, connected, why);
  if (out < 0) throw Failure(kBadInput, what + " rtp://" + url.host + ":" + url.port + ": " + why);
  return out;
}

std::vector<unsigned char> control_packet(uint32_t source, size_t head, const std::string &text) {
  std::vector<unsigned char> out((head + text.size() + 3) / 4 * 4, ' ');
  std::fill_n(out.begin(), head, static_cast<unsigned char>(0));
  std::copy(text.begin(), text.end(), out.begin() + static_cast<std::ptrdiff_t>(head));
  out[0] = kRtpVersion;
  out[1] = kApp;
  put16(&out[2], static_cast<uint32_t>(out.size() / 4 - 1));
  put32(&out[4], source);
  std::memcpy(&out[8], kControl, 4);
  return out;
}

void check_sink(const std::string &url) { os::close_socket(rtp_socket(sink(url), "--stream", true)); }

RtpSender::RtpSender(dfm_world world, const std::string &url, std::string token)
    : world_(world),
      token_(std::move(token)),
      socket_(rtp_socket(sink(url), "--stream", true)),
      begin_(dfm_world_time(world)),
      interval_(1 / kFrameRate) {
  std::random_device system;
  sequence_ = static_cast<uint16_t>(system());
  source_ = system();
  first_stamp_ = system();
  thread_ = std::thread([this] { work(); });
}

RtpSender::~RtpSender() {
  stop(true);
  os::close_socket(socket_);
}

void RtpSender::stop(bool at_once) {
  if (!thread_.joinable()) return;
  until_ = Clock::now() + (at_once ? Clock::duration(0) : kEnding);
  {
    const std::lock_guard lock(mutex_);
    inbox_.until = at_once ? Inbox::stops : Inbox::ends;
  }
  filled_.notify_one();
  thread_.join();
}

uint32_t RtpSender::stamp() const {
  const double passed = std::chrono::duration<double>(Clock::now() - began_).count();
  return first_stamp_ + static_cast<uint32_t>(static_cast<uint64_t>(passed * kTicks));
}

// What the network does not take within a few milliseconds is lost, like what it loses later.
void RtpSender::send(const unsigned char *payload, size_t n, bool marker) {
  if (Clock::now() > until_.load()) return;
  datagram_.resize(kRtpHeader + n);
  unsigned char *const to = datagram_.data();
  to[0] = kRtpVersion;
  to[1] = static_cast<unsigned char>(kPayloadType | (marker ? 0x80 : 0));
  put16(to + 2, sequence_++);
  put32(to + 4, stamp_);
  put32(to + 8, source_);
  std::memcpy(to + kRtpHeader, payload, n);
  if (!os::send(socket_, to, datagram_.size(), kPatience)) return;
  octets_ += n;
  const std::lock_guard lock(mutex_);
  ++report_.packets;
  report_.bytes += datagram_.size();
}

void RtpSender::send_all(const Packets &packets, bool frame) {
  stamp_ = stamp();
  each_packet(packets, [&](size_t at, size_t size) {
    send(&packets[at], size, frame && at + size == packets.size());
  });
}

// What these seconds have of a round, which takes half of its time.
void RtpSender::send_round(double seconds) {
  stamp_ = stamp();
  const double share = std::min(1.0, 2 * seconds / std::chrono::duration<double>(kRound).count());
  const size_t upto = sent_ + static_cast<size_t>(share * static_cast<double>(round_.size()));
  while (sent_ < round_.size() && sent_ <= upto) {
    const size_t size = word_at(round_, sent_ + 16);
    send(&round_[sent_], size, false);
    sent_ += size;
  }
}

void RtpSender::send_report(bool ends) {
  unsigned char out[64] = {};
  const double now =
                   std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(),
               from = now + kFrom1900;
  out[0] = kRtpVersion;
  out[1] = kSenderReport;
  put16(out + 2, 6);
  put32(out + 4, source_);
  put32(out + 8, static_cast<uint32_t>(static_cast<uint64_t>(from)));
  put32(out + 12,
        static_cast<uint32_t>((from - static_cast<double>(static_cast<uint64_t>(from))) * 4294967295.0));
  put32(out + 16, stamp());
  put32(out + 20, static_cast<uint32_t>(report().packets));
  put32(out + 24, static_cast<uint32_t>(octets_));
  unsigned char *const name = out + 28;  // one item: a canonical name of six letters
  name[0] = kRtpVersion | 1;
  name[1] = kDescription;
  put16(name + 2, 4);
  put32(name + 4, source_);
  name[8] = 1;
  name[9] = 6;
  std::memcpy(name + 10, "deform", 6);
  unsigned char *const goodbye = name + 20;
  goodbye[0] = kRtpVersion | 1;
  goodbye[1] = kGoodbye;
  put16(goodbye + 2, 1);
  put32(goodbye + 4, source_);
  os::send(socket_, out, ends ? 56 : 48, 0);
}

// Reports and requests of the receiver. The socket accepts only the address to which it sends.
void RtpSender::hear() {
  unsigned char in[2048];
  std::ptrdiff_t n = 0;
  for (int i = 0; i < kMaxHeard && (n = os::receive(socket_, in, sizeof in)) > 0; ++i)
    each_report(in, static_cast<size_t>(n), [&](const unsigned char *report, size_t size) {
      if (report[1] == kApp) return hear_request(report, size);
      if (size < 32 || (report[0] & 31) == 0 || report[1] != kReceiverReport) return;
      const std::lock_guard lock(mutex_);
      report_.lost = report[12] / 256.0;
      if (report_.lost > kTooMuch) interval_ = std::min(1.4 * interval_, 1 / kSlowest);
      else if (report_.lost < kLittle) interval_ = std::max(0.9 * interval_, 1 / kFrameRate);
    });
}

// In order and once each: what is lost comes again, with all that follows it.
void RtpSender::hear_request(const unsigned char *in, size_t n) {
  if (token_.empty() || n < kRequestHead || std::memcmp(in + 8, kControl, 4) != 0) return;
  std::string padded = token_;
  padded.resize(kToken);
  const uint32_t source = get32(in + 4);
  if (!same_secret(padded, in + 12, kToken)) return;
  const std::lock_guard lock(mutex_);
  if (!taken_.contains(source) && taken_.size() >= kMaxSteerers) return;
  heard_ = Clock::now();
  steerer_ = source;
  uint32_t &taken = taken_[source];
  if (get32(in + 12 + kToken) != taken + 1 || requests_.size() >= kMaxRequests) return;
  ++taken;
  requests_.emplace_back(in + kRequestHead, in + n);
}

bool RtpSender::steered() const {
  const std::lock_guard lock(mutex_);
  return steerer_ && Clock::now() < heard_ + kListens;
}

std::vector<std::string> RtpSender::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(requests_, {});
}

void RtpSender::send_state(const std::string &text) {
  const std::lock_guard lock(mutex_);
  inbox_.text = text;
}

RtpSender::Report RtpSender::report() const {
  const std::lock_guard lock(mutex_);
  return report_;
}

void RtpSender::send_reply(const std::string &text) {
  std::vector<unsigned char> out = control_packet(source_, kReplyHead, text);
  {
    const std::lock_guard lock(mutex_);
    put32(&out[12], steerer_);
    put32(&out[16], taken_[steerer_]);
  }
  os::send(socket_, out.data(), out.size(), 0);
}

void RtpSender::after_step() {
  const std::chrono::duration<double> simulated(dfm_world_time(world_) - begin_);
  std::this_thread::sleep_until(began_ + std::chrono::duration_cast<Clock::duration>(simulated));
  show();
}

void RtpSender::show() {
  const Clock::time_point now = Clock::now();
  if (now < next_frame_) return;
  hand_over();
  const std::lock_guard lock(mutex_);
  next_frame_ = std::max(next_frame_, now - std::chrono::milliseconds(1)) +
                std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(interval_));
  report_.seconds += std::chrono::duration<double>(Clock::now() - now).count();
}

// A copy of the state, and of the scene where it is new. Updates not yet sent are replaced.
void RtpSender::hand_over() {
  teller_.look(world_);
  {
    const std::lock_guard lock(mutex_);
    std::swap(inbox_.frame, teller_.frame);
    if (!teller_.scene.empty()) {
      inbox_.news = std::move(teller_.changed);
      inbox_.scene = std::move(teller_.scene);
    }
  }
  filled_.notify_one();
}

void RtpSender::count_frame() {
  const std::lock_guard lock(mutex_);
  ++report_.frames;
  report_.lasted = std::chrono::duration<double>(Clock::now() - began_).count();
  each_chunk(frame_, [&](size_t at, size_t size) {
    if (std::memcmp(&frame_[at], "SURF", 4) == 0) report_.bodies[word_at(frame_, at + 8)] += size;
  });
}

void RtpSender::end() {
  hand_over();
  stop(false);
}

void RtpSender::work() {
  Inbox in;
  Clock::time_point last = began_, next_report = began_, next_round = began_;
  while (in.until == Inbox::goes) {
    {
      std::unique_lock lock(mutex_);
      filled_.wait_until(lock, Clock::now() + kTick,
                         [&] { return !inbox_.frame.empty() || inbox_.until != Inbox::goes; });
      std::swap(in, inbox_);
      inbox_.frame.clear();  // keeps its memory
    }
    if (in.until == Inbox::stops) return;
    const Clock::time_point now = Clock::now();
    try {
      hear();
      if (!in.scene.empty()) {
        pack(in.news, kPayload, news_);
        Packets packed;
        pack(in.scene, kPayload, packed);
        send_all(round_.empty() ? packed : news_, false);  // the first time all is new
        next_scene_.swap(packed);
      }
      if (!in.frame.empty()) {
        pack(in.frame, kPayload, frame_);
        send_all(frame_, true);
        count_frame();
      }
      if (!in.text.empty()) send_reply(in.text);
      // A scene that changes in every frame waits for the end of a round: who comes late gets all of one.
      const bool over = sent_ >= round_.size();
      if (over && (now >= next_round || !next_scene_.empty())) {
        if (!next_scene_.empty()) round_ = std::exchange(next_scene_, {});
        sent_ = 0;
        next_round = now + kRound;
      }
      send_round(std::chrono::duration<double>(now - last).count());
      if (now >= next_report) {
        send_report(false);
        next_report = now + kReports;
      }
    } catch (const std::exception &) {  // no memory: lost, like what the network loses
    }
    last = now;
    in.news.clear();
    in.scene.clear();
    in.text.clear();
  }
  send_end();
}

void RtpSender::send_end() {
  for (int i = 0; i < 2; ++i) {
    send_round(1);  // what is left of the present one, and another one
    if (!next_scene_.empty()) round_ = std::exchange(next_scene_, {});
    sent_ = 0;
    send_round(1);
    send_all(frame_, true);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  send_report(true);
}

}  // namespace cli
