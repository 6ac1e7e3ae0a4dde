#include "rtp.h"

#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <thread>

#include "messages.h"

namespace cli {
namespace {

constexpr uint32_t kRtpHeader = 12, kPayload = 1188;  // bytes: a datagram of 1,200 passes every network
constexpr uint8_t kRtpVersion = 2 << 6, kPayloadType = 96, kSenderReport = 200, kReceiverReport = 201,
                  kDescription = 202, kGoodbye = 203;
constexpr double kFrameRate = 30, kSlowest = 5;   // frames a second
constexpr double kRound = 1, kReports = 5;        // s
constexpr double kTooMuch = 0.1, kLittle = 0.02;  // share lost: frames become rarer, and more frequent again
constexpr double kTicks = 90000;                  // of the timestamp, in a second
constexpr double kFrom1900 = 2208988800.0;        // s, to 1970

void put16(unsigned char *to, uint32_t x) {
  to[0] = static_cast<unsigned char>(x >> 8);
  to[1] = static_cast<unsigned char>(x);
}
void put32(unsigned char *to, uint32_t x) {
  put16(to, x >> 16);
  put16(to + 2, x & 0xffff);
}

uint32_t word_at(const std::vector<unsigned char> &bytes, size_t at) {
  uint32_t x;
  std::memcpy(&x, &bytes[at], sizeof x);
  return x;
}

// f(begin, size) for each packet.
template <class F>
void each_packet(const std::vector<unsigned char> &packets, F f) {
  for (size_t at = 0; at < packets.size();) {
    const size_t size = word_at(packets, at + 16);
    f(at, size);
    at += size;
  }
}

int open_socket(const std::string &url) {
  const auto refuse = [&](const std::string &why) -> int {
    throw Failure(kBadInput, "--stream " + url + ": " + why);
  };
  const std::string scheme = "rtp://";
  const size_t colon = url.rfind(':');
  if (url.compare(0, scheme.size(), scheme) != 0 || colon == std::string::npos || colon < scheme.size())
    return refuse("expected rtp://ADDRESS:PORT");
  std::string host = url.substr(scheme.size(), colon - scheme.size());
  if (host.size() > 1 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  addrinfo wanted = {}, *found = nullptr;
  wanted.ai_socktype = SOCK_DGRAM;
  wanted.ai_flags = AI_NUMERICSERV;
  const int error = getaddrinfo(host.c_str(), url.c_str() + colon + 1, &wanted, &found);
  if (error) return refuse(gai_strerror(error));
  const int out = socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const bool joined = out >= 0 && connect(out, found->ai_addr, found->ai_addrlen) == 0;
  freeaddrinfo(found);
  if (joined) return out;
  const std::string why = std::strerror(errno);
  if (out >= 0) close(out);
  return refuse(why);
}

}  // namespace

std::vector<std::pair<uint32_t, uint32_t>> shapes_in(const std::vector<unsigned char> &packets) {
  std::vector<std::pair<uint32_t, uint32_t>> out;
  each_packet(packets, [&](size_t begin, size_t size) {
    for (size_t at = begin + 32; at < begin + size;) {
      const uint32_t bytes = word_at(packets, at + 4);
      if (std::memcmp(&packets[at], "LIST", 4) == 0)
        for (size_t i = at + 8; i < at + 8 + bytes; i += 8)
          out.emplace_back(word_at(packets, i), word_at(packets, i + 4));
      at += 8 + bytes;
    }
  });
  return out;
}

void write_packets(dfm_world world, const dfm_stream_def &def, std::vector<unsigned char> &out) {
  out.resize(std::max<size_t>(out.capacity(), 64));
  size_t bytes = out.size();
  if (dfm_world_stream(world, &def, out.data(), &bytes) != DFM_OK) {
    out.resize(bytes + bytes / 4);  // what it needs; some more for the next ones
    bytes = out.size();
    need(dfm_world_stream(world, &def, out.data(), &bytes));
  }
  out.resize(bytes);
}

RtpSender::RtpSender(const SceneFile &scene, const std::string &url)
    : scene_(scene),
      socket_(open_socket(url)),
      begin_(dfm_world_time(scene.world())),
      interval_(1 / kFrameRate) {
  std::random_device system;
  sequence_ = static_cast<uint16_t>(system());
  source_ = system();
  first_stamp_ = system();
  began_ = next_frame_ = next_report_ = next_round_ = Clock::now();
}

RtpSender::~RtpSender() { close(socket_); }

void RtpSender::send(const unsigned char *payload, size_t n, bool marker) {
  datagram_.resize(kRtpHeader + n);
  unsigned char *const to = datagram_.data();
  const double passed = std::chrono::duration<double>(Clock::now() - began_).count();
  to[0] = kRtpVersion;
  to[1] = static_cast<unsigned char>(kPayloadType | (marker ? 0x80 : 0));
  put16(to + 2, sequence_++);
  put32(to + 4, first_stamp_ + static_cast<uint32_t>(static_cast<uint64_t>(passed * kTicks)));
  put32(to + 8, source_);
  std::memcpy(to + kRtpHeader, payload, n);
  // what the network does not take now is lost, like what it loses later
  if (::send(socket_, to, datagram_.size(), 0) >= 0) {
    ++report_.packets;
    report_.bytes += datagram_.size();
  }
  octets_ += n;
}

void RtpSender::send_frame() {
  dfm_stream_def def = dfm_stream_def_default();
  def.flags = DFM_STREAM_CONTACTS;
  def.frame = number_++;
  def.packet = kPayload;
  write_packets(scene_.world(), def, frame_);
  auto shapes = shapes_in(frame_);
  if (shapes != shapes_) {
    shapes_ = std::move(shapes);
    next_round_ = Clock::now();
    sent_ = round_.size();
  }
  each_packet(frame_, [&](size_t at, size_t size) { send(&frame_[at], size, at + size == frame_.size()); });
  ++report_.frames;
}

// Of the round that is on its way, or of the next one where that is due.
void RtpSender::send_scene(size_t packets) {
  if (sent_ == round_.size()) {
    if (Clock::now() < next_round_) return;
    next_round_ += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(kRound));
    dfm_stream_def def = dfm_stream_def_default();
    def.kind = DFM_STREAM_SCENE;
    def.packet = kPayload;
    write_packets(scene_.world(), def, round_);
    sent_ = 0;
  }
  for (; packets > 0 && sent_ < round_.size(); --packets) {
    const size_t size = word_at(round_, sent_ + 16);
    send(&round_[sent_], size, false);
    sent_ += size;
  }
}

void RtpSender::send_report(bool bye) {
  unsigned char out[64] = {};
  const double now =
                   std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(),
               passed = std::chrono::duration<double>(Clock::now() - began_).count(), from = now + kFrom1900;
  out[0] = kRtpVersion;
  out[1] = kSenderReport;
  put16(out + 2, 6);
  put32(out + 4, source_);
  put32(out + 8, static_cast<uint32_t>(static_cast<uint64_t>(from)));
  put32(out + 12,
        static_cast<uint32_t>((from - static_cast<double>(static_cast<uint64_t>(from))) * 4294967295.0));
  put32(out + 16, first_stamp_ + static_cast<uint32_t>(static_cast<uint64_t>(passed * kTicks)));
  put32(out + 20, static_cast<uint32_t>(report_.packets));
  put32(out + 24, static_cast<uint32_t>(octets_));
  unsigned char *const next = out + 28;
  next[0] = kRtpVersion | 1;
  if (bye) {
    next[1] = kGoodbye;
    put16(next + 2, 1);
    put32(next + 4, source_);
    ::send(socket_, out, 36, 0);
    return;
  }
  next[1] = kDescription;  // one item: a canonical name of six letters
  put16(next + 2, 4);
  put32(next + 4, source_);
  next[8] = 1;
  next[9] = 6;
  std::memcpy(next + 10, "deform", 6);
  ::send(socket_, out, 28 + 20, 0);
}

// Reports of the receiver.
void RtpSender::hear() {
  unsigned char in[512];
  for (ssize_t n; (n = recv(socket_, in, sizeof in, 0)) > 0;) {
    if (n < 32 || in[0] >> 6 != 2 || (in[0] & 31) == 0 || in[1] != kReceiverReport) continue;
    report_.lost = in[12] / 256.0;
    if (report_.lost > kTooMuch) interval_ = std::min(1.4 * interval_, 1 / kSlowest);
    else if (report_.lost < kLittle) interval_ = std::max(0.9 * interval_, 1 / kFrameRate);
  }
}

void RtpSender::after_step() {
  const std::chrono::duration<double> simulated(dfm_world_time(scene_.world()) - begin_);
  std::this_thread::sleep_until(began_ + std::chrono::duration_cast<Clock::duration>(simulated));
  const Clock::time_point now = Clock::now();
  if (now < next_frame_) return;
  next_frame_ = std::max(next_frame_, now - std::chrono::milliseconds(1)) +
                std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(interval_));
  hear();
  send_frame();
  // a round takes half of its time
  send_scene(1 + static_cast<size_t>(2 * interval_ / kRound * double(round_.size()) / kPayload));
  if (now >= next_report_) {
    send_report(false);
    next_report_ = now + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(kReports));
  }
  report_.seconds += std::chrono::duration<double>(Clock::now() - now).count();
}

void RtpSender::end() {
  for (int i = 0; i < 2; ++i) {
    next_round_ = Clock::now();
    send_scene(SIZE_MAX);  // what is left of the present round
    send_scene(SIZE_MAX);
    send_frame();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  send_report(true);
}

}  // namespace cli
