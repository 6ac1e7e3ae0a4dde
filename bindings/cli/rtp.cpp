#include "rtp.h"

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
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
constexpr int kRound = 1000, kPatience = 5;       // ms
constexpr int kReports = 5;                       // s
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

// Connected to the first address of the host to which this machine has a way.
int open_socket(const std::string &url) {
  const auto refuse = [&](const std::string &why) -> int {
    throw Failure(kBadInput, "--stream " + url + ": " + why);
  };
  const std::string scheme = "rtp://";
  const size_t colon = url.rfind(':');
  if (url.compare(0, scheme.size(), scheme) != 0 || colon < scheme.size())
    return refuse("expected rtp://ADDRESS:PORT");
  std::string host = url.substr(scheme.size(), colon - scheme.size());
  if (host.size() > 1 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  const std::string port = url.substr(colon + 1);
  unsigned number = 0;
  const auto [end, bad] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (bad != std::errc() || end != port.data() + port.size() || number == 0 || number > 65535)
    return refuse("expected a port from 1 to 65535 behind the last colon");
  addrinfo wanted = {}, *found = nullptr;
  wanted.ai_socktype = SOCK_DGRAM;
  wanted.ai_flags = AI_NUMERICSERV;
  const int error = getaddrinfo(host.c_str(), port.c_str(), &wanted, &found);
  if (error) return refuse(gai_strerror(error));
  std::string why = "no address";
  int out = -1;
  for (const addrinfo *at = found; at && out < 0; at = at->ai_next) {
    out = socket(at->ai_family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (out >= 0 && connect(out, at->ai_addr, at->ai_addrlen) == 0) break;
    why = std::strerror(errno);
    if (out >= 0) close(out);
    out = -1;
  }
  freeaddrinfo(found);
  return out >= 0 ? out : refuse(why);
}

}  // namespace

RtpSender::RtpSender(const SceneFile &scene, const std::string &url)
    : scene_(scene),
      socket_(open_socket(url)),
      begin_(dfm_world_time(scene.world())),
      interval_(1 / kFrameRate) {
  std::random_device system;
  sequence_ = static_cast<uint16_t>(system());
  source_ = system();
  first_stamp_ = system();
  began_ = last_frame_ = next_frame_ = next_report_ = next_round_ = Clock::now();
}

RtpSender::~RtpSender() { close(socket_); }

uint32_t RtpSender::stamp() const {
  const double passed = std::chrono::duration<double>(Clock::now() - began_).count();
  return first_stamp_ + static_cast<uint32_t>(static_cast<uint64_t>(passed * kTicks));
}

// What the network does not take within a few milliseconds is lost, like what it loses later.
void RtpSender::send(const unsigned char *payload, size_t n, bool marker, uint32_t stamp) {
  datagram_.resize(kRtpHeader + n);
  unsigned char *const to = datagram_.data();
  to[0] = kRtpVersion;
  to[1] = static_cast<unsigned char>(kPayloadType | (marker ? 0x80 : 0));
  put16(to + 2, sequence_++);
  put32(to + 4, stamp);
  put32(to + 8, source_);
  std::memcpy(to + kRtpHeader, payload, n);
  ssize_t sent = ::send(socket_, to, datagram_.size(), 0);
  if (sent < 0 && (errno == EAGAIN || errno == ENOBUFS)) {
    pollfd room = {socket_, POLLOUT, 0};
    poll(&room, 1, kPatience);
    sent = ::send(socket_, to, datagram_.size(), 0);
  }
  if (sent < 0) return;
  ++report_.packets;
  report_.bytes += datagram_.size();
  octets_ += n;
}

void RtpSender::send_all(const Packets &packets, bool frame) {
  const uint32_t now = stamp();
  each_packet(packets, [&](size_t at, size_t size) {
    send(&packets[at], size, frame && at + size == packets.size(), now);
  });
}

void RtpSender::send_frame() {
  dfm_stream_def def = dfm_stream_def_default();
  def.flags = DFM_STREAM_CONTACTS;
  def.frame = number_++;
  def.packet = kPayload;
  write_packets(scene_.world(), def, frame_);
  const Shapes shapes = shapes_in(frame_);
  if (shapes != shapes_) send_changed(shapes);
  send_all(frame_, true);
  ++report_.frames;
}

// Bodies whose triangles are others than before, at once; the round has the rest.
void RtpSender::send_changed(const Shapes &shapes) {
  for (const auto &shape : shapes) {
    if (std::find(shapes_.begin(), shapes_.end(), shape) != shapes_.end()) continue;
    for (const BodyView &body : scene_.bodies()) {
      if (static_cast<uint32_t>(body.handle) != shape.first) continue;
      dfm_stream_def def = dfm_stream_def_default();
      def.kind = DFM_STREAM_SCENE;
      def.packet = kPayload;
      def.frame = number_;
      def.body = body.handle;
      write_packets(scene_.world(), def, changed_);
      send_all(changed_, false);
    }
  }
  shapes_ = shapes;
}

// What these seconds have of a round, which takes half of its time.
void RtpSender::send_round(double seconds) {
  const Clock::time_point now = Clock::now();
  if (sent_ == round_.size()) {
    if (now < next_round_) return;
    next_round_ = std::max(now, next_round_ + std::chrono::milliseconds(kRound));
    dfm_stream_def def = dfm_stream_def_default();
    def.kind = DFM_STREAM_SCENE;
    def.packet = kPayload;
    def.frame = number_;
    write_packets(scene_.world(), def, round_);
    sent_ = 0;
  }
  const double share = std::min(1.0, 2e3 * seconds / kRound);
  const size_t upto = sent_ + static_cast<size_t>(share * static_cast<double>(round_.size()));
  while (sent_ < round_.size() && sent_ <= upto) {
    const size_t size = word_at(round_, sent_ + 16);
    send(&round_[sent_], size, false, stamp());
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
  put32(out + 20, static_cast<uint32_t>(report_.packets));
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
  ::send(socket_, out, ends ? 56 : 48, 0);
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
  send_round(std::chrono::duration<double>(now - last_frame_).count());
  last_frame_ = now;
  if (now >= next_report_) {
    send_report(false);
    next_report_ = now + std::chrono::seconds(kReports);
  }
  report_.seconds += std::chrono::duration<double>(Clock::now() - now).count();
}

void RtpSender::end() {
  for (int i = 0; i < 2; ++i) {
    send_round(kRound);  // what is left of the present one, and another one
    next_round_ = Clock::now();
    send_round(kRound);
    send_frame();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  send_report(true);
}

}  // namespace cli
