// What a terminal is shown of a call that takes long, and what a file is not.
#include "progress.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

namespace {

// stderr as a terminal for as long as this lives; read gives what came out on the other side.
class Terminal {
 public:
  Terminal() : kept_(dup(STDERR_FILENO)), near_(posix_openpt(O_RDWR | O_NOCTTY)) {
    if (near_ < 0 || grantpt(near_) != 0 || unlockpt(near_) != 0) return;
    far_ = open(ptsname(near_), O_RDWR | O_NOCTTY);
    if (far_ >= 0) dup2(far_, STDERR_FILENO);
  }
  ~Terminal() {
    dup2(kept_, STDERR_FILENO);
    for (const int fd : {kept_, near_, far_})
      if (fd >= 0) close(fd);
  }
  bool works() const { return far_ >= 0; }
  std::string read() const {
    // What one side has written reaches the other by and by, on a busy machine not at once.
    std::string all;
    char text[4096];
    for (pollfd ready{near_, POLLIN, 0}; poll(&ready, 1, 300) > 0;) {
      const ssize_t n = ::read(near_, text, sizeof text);
      if (n <= 0) break;
      all.append(text, size_t(n));
    }
    return all;
  }

 private:
  int kept_, near_, far_ = -1;
};

std::string shown(bool wanted, std::chrono::milliseconds wait, std::chrono::milliseconds takes) {
  const Terminal terminal;
  if (!terminal.works()) return "no terminal";
  {
    const cli::Patience patience(wanted, "filling a.obj", wait);
    std::this_thread::sleep_for(takes);
  }
  return terminal.read();
}

using std::chrono::milliseconds;

}  // namespace

// The line says where the time goes: steps per second alone would not.
// unsanitized: too slow there; shorter tests run the same code
TEST(Progress, Pictures_AreReportedWithTheirTime) {
  const Terminal terminal;
  if (!terminal.works()) GTEST_SKIP() << "this system gives no pseudo terminal";
  {
    cli::Progress progress(true);
    progress.show(0.1, 1, 50, 1, 1.2);
    EXPECT_EQ(terminal.read(), "") << "what is short is not shown";
    std::this_thread::sleep_for(milliseconds(2000));
    progress.show(0.5, 1, 50, 3, 4.2);
  }
  const std::string text = terminal.read();
  EXPECT_NE(text.find("50 steps/s  3 pictures took 4 s of "), std::string::npos) << text;
}

TEST(Patience, LongCall_IsReportedAndItsLineCleared) {
  const std::string text = shown(true, milliseconds(20), milliseconds(300));
  if (text == "no terminal") GTEST_SKIP() << "this system gives no pseudo terminal";
  EXPECT_EQ(text.find("\rfilling a.obj, 0 s "), 0u) << text;
  EXPECT_EQ(text.rfind("\r\033[K"), text.size() - 4) << "the line is wiped at the end";
}

TEST(Patience, ShortCall_PrintsNothing) {
  EXPECT_EQ(shown(true, milliseconds(10000), milliseconds(30)).find("filling"), std::string::npos);
}

TEST(Patience, QuietCall_PrintsNothing) {
  EXPECT_EQ(shown(false, milliseconds(10), milliseconds(100)).find("filling"), std::string::npos);
}
