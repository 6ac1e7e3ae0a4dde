// What `--stream` sends (bindings/cli/rtp.h) while another thread steps the world.
#include "rtp.h"

#include <arpa/inet.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <map>
#include <thread>

#include "coupled.h"
#include "live/received.h"
#include "stack.h"

namespace {

std::atomic<bool> congested = false;  // the network takes nothing

}  // namespace

extern "C" ssize_t send(int socket, const void *bytes, size_t n, int flags) {
  if (!congested) return syscall(SYS_sendto, socket, bytes, n, flags, nullptr, 0);
  usleep(200000);
  errno = EAGAIN;
  return -1;
}

namespace {

// Who has looked on from the start, and who comes later.
struct Viewers {
  int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
  std::string url;
  live::Received early, late;
  std::map<double, std::vector<double>> seen;  // of each frame that is whole, where the body is
  size_t gaps = 0;

  Viewers() {
    sockaddr_in at = {};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(socket, reinterpret_cast<const sockaddr *>(&at), sizeof at), 0);
    socklen_t size = sizeof at;
    getsockname(socket, reinterpret_cast<sockaddr *>(&at), &size);
    const int buffer = 1 << 22;
    setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &buffer, sizeof buffer);
    const timeval patience = {20, 0};  // where the sender's goodbye is lost
    setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    url = "rtp://127.0.0.1:" + std::to_string(ntohs(at.sin_port));
  }
  ~Viewers() { close(socket); }

  // Until the sender says that nothing follows.
  void receive(uint32_t body) {
    std::vector<unsigned char> in(1 << 16);
    int sequence = -1;
    for (bool ends = false; !ends;) {
      const ssize_t n = recv(socket, in.data(), in.size(), 0);
      if (n <= 0) return;
      if (in[1] >= cli::kSenderReport && in[1] <= cli::kApp) {
        cli::each_report(in.data(), size_t(n),
                         [&](const unsigned char *p, size_t) { ends |= p[1] == cli::kGoodbye; });
        continue;
      }
      const int number = int(cli::get16(&in[2]));
      gaps += sequence >= 0 && number != ((sequence + 1) & 0xffff);
      sequence = number;
      EXPECT_TRUE(early.read(&in[12], size_t(n) - 12));
      if (early.frame() > 20) late.read(&in[12], size_t(n) - 12);
      const auto found = early.meshes().find(body);
      if (in[1] >> 7 && found != early.meshes().end() && found->second.drawn())
        seen[early.time()] = found->second.x;
    }
  }
};

TEST(Rtp, SentOnAnotherThread_FramesAreWhatTheStepsHaveLeft) {
  test::Context c;
  const test::Stack s = test::make_stack(c, 0.02);
  Viewers viewers;
  std::thread network([&] { viewers.receive(uint32_t(s.upper)); });
  std::map<double, std::vector<double>> steps;
  dfm_obstacle added = 0;
  {
    cli::RtpSender sender(s.world, viewers.url);
    for (uint64_t frames = 0; frames < 45; frames = sender.report().frames) {
      test::run(s.world, 1e-3, 1e-3);
      steps[dfm_world_time(s.world)] = test::surface_positions(s.upper);
      sender.after_step();
      if ((frames != 10 || added) && frames != 30) continue;
      if (added) test::ok(dfm_obstacle_destroy(added));
      dfm_obstacle_def d = dfm_obstacle_def_default();
      d.shape = frames == 30 ? DFM_SHAPE_BOX : DFM_SHAPE_SPHERE;
      d.radius = 0.1;
      d.half_size[0] = d.half_size[1] = d.half_size[2] = 0.1;
      d.pose.position[0] = 3;
      test::ok(dfm_obstacle_create(s.world, &d, &added));
    }
    sender.end();
  }
  network.join();
  EXPECT_EQ(viewers.gaps, 0u);
  EXPECT_GT(viewers.seen.size(), 30u);
  for (const auto &[time, x] : viewers.seen) {
    const std::vector<double> &at = steps.at(time);
    ASSERT_EQ(x.size(), at.size());
    for (size_t i = 0; i < x.size(); ++i) ASSERT_NEAR(x[i], at[i], 3e-7 + 0.05 / 131070) << time << " s";
  }
  // the last obstacle has come, and the one before is gone, for both
  for (const live::Received *r : {&viewers.early, &viewers.late}) {
    ASSERT_TRUE(r->meshes().contains(uint32_t(s.upper)));
    EXPECT_TRUE(r->meshes().at(uint32_t(s.upper)).drawn());
    ASSERT_TRUE(r->meshes().contains(uint32_t(added)));
    EXPECT_EQ(r->meshes().at(uint32_t(added)).kind, uint32_t{DFM_SHAPE_BOX});
    for (const auto &[number, thing] : r->meshes())
      EXPECT_TRUE(!thing.rigid || number == uint32_t(added) || number == uint32_t(s.floor));
  }
}

TEST(Rtp, NetworkThatTakesNothing_DoesNotHoldTheEnd) {
  test::Context c;
  const test::Stack s = test::make_stack(c, 0.02);
  Viewers viewers;
  cli::RtpSender sender(s.world, viewers.url);
  test::run(s.world, 1e-3, 1e-3);
  sender.after_step();
  congested = true;
  const auto before = std::chrono::steady_clock::now();
  sender.end();
  congested = false;
  EXPECT_LT(std::chrono::steady_clock::now() - before, std::chrono::seconds(3));
}

// unsanitized: against the clock
TEST(Rtp, RateFollowsWhatTheReceiverHasLost) {
  test::Context c;
  const test::Stack s = test::make_stack(c, 0.05);
  Viewers viewers;
  cli::RtpSender sender(s.world, viewers.url);
  sockaddr_storage from = {};
  socklen_t size = sizeof from;
  unsigned char in[2048];
  ASSERT_GT(recvfrom(viewers.socket, in, sizeof in, 0, reinterpret_cast<sockaddr *>(&from), &size), 0);
  const auto frames = [&](double seconds) {
    const uint64_t before = sender.report().frames;
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (std::chrono::steady_clock::now() < end) {
      sender.show();
      usleep(1000);
    }
    return sender.report().frames - before;
  };
  const auto lost = [&](unsigned char share) {  // of 256
    for (int i = 0; i < 40; ++i) {
      unsigned char out[32] = {};
      out[0] = 0x81;
      out[1] = cli::kReceiverReport;
      out[3] = 7;
      out[12] = share;
      EXPECT_EQ(sendto(viewers.socket, out, sizeof out, 0, reinterpret_cast<const sockaddr *>(&from), size),
                ssize_t{sizeof out});
    }
    frames(0.3);
  };
  EXPECT_GT(frames(1), 10u);
  lost(128);
  EXPECT_NEAR(sender.report().lost, 0.5, 1e-12);
  EXPECT_LE(frames(1), 7u);
  lost(12);  // between the two bounds: as it was
  EXPECT_LE(frames(1), 7u);
  lost(0);
  EXPECT_GT(frames(1), 10u);
}

}  // namespace
