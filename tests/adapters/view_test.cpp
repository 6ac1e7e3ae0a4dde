// `deform view` by its scripts, under Xvfb: what it draws is looked at pixel by pixel, what it simulates by
// state hashes. A machine without Xvfb passes these tests over.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "render/render.h"
#include "support.h"

namespace {

// A soft block above a floor.
const char *kScene = R"({
  "format": "deform-scene", "version": 1,
  "time": {"duration": 0.2, "step": 0.002},
  "materials": {"gel": {"density": 1000, "young": 20000, "poisson": 0.3,
    "damping": {"mass": 2, "stiffness": 0.005}}},
  "bodies": [{"name": "block", "mesh": {"make": "beam", "size": [0.1, 0.1, 0.1], "cells": 60},
              "material": "gel", "pose": {"position": [0, 0, 0.01]}}],
  "obstacles": [{"name": "floor", "shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}],
  "contact": {"friction": [{"between": ["block", "floor"], "law": "coulomb", "params": {"mu": 0.6}}]},
  "probes": [{"name": "corner", "body": "block", "point": [0.1, 0.1, 0.1]}],
  "output": {"every": 0.02, "camera": {"eye": [0.05, -0.6, 0.3], "look_at": [0.05, 0.05, 0.05]}}
})";

// A display of its own for each test, gone with it.
class Display {
 public:
  Display() {
    int ends[2];
    if (pipe(ends) != 0) return;
    child_ = fork();
    if (child_ == 0) {
      char fd[16];
      std::snprintf(fd, sizeof fd, "%d", ends[1]);
      execlp("Xvfb", "Xvfb", "-displayfd", fd, "-screen", "0", "640x480x24", "-nolisten", "tcp",
             static_cast<char *>(nullptr));
      _exit(127);
    }
    close(ends[1]);
    std::string text;
    for (char c = 0; read(ends[0], &c, 1) == 1 && c != '\n';) text += c;
    close(ends[0]);
    if (text.empty()) return;
    number_ = std::atoi(text.c_str());
    setenv("DISPLAY", (":" + std::to_string(number_)).c_str(), 1);
  }
  ~Display() {
    if (child_ > 0) {
      kill(child_, SIGTERM);
      waitpid(child_, nullptr, 0);
    }
  }
  bool there() const { return number_ >= 0; }

 private:
  pid_t child_ = -1;
  int number_ = -1;
};

class Viewer : public testing::Test {
 protected:
  void SetUp() override {
    if (!display_.there()) GTEST_SKIP() << "no Xvfb on this machine: install Debian's xvfb";
    std::filesystem::remove_all(folder_);  // the viewer keeps the files of earlier runs
    std::filesystem::create_directories(folder_);
    test::write_file(scene_, kScene);
  }
  test::CommandResult view(const std::string &script, std::vector<std::string> more = {}) {
    test::write_file(folder_ + "/script.txt", "0 key t\n" + script);  // panels would cover so small a window
    more.insert(more.begin(), {"view", scene_, "--script", folder_ + "/script.txt", "--out", folder_,
                               "--size", "320x240", "--json"});
    return test::deform(more);
  }
  render::Image picture(const std::string &name) const {
    render::Image image;
    std::string why;
    EXPECT_TRUE(render::read_png(folder_ + "/" + name, image, &why)) << why;
    return image;
  }
  // Text of a value in the line that tells of a shot.
  static std::string reported(const test::CommandResult &result, const std::string &shot,
                              const std::string &key) {
    const size_t line = result.out.find("/" + shot + "\"");
    const size_t at = result.out.find("\"" + key + "\": ", line);
    if (line == std::string::npos || at == std::string::npos) return "";
    const size_t begin = at + key.size() + 4;
    const bool list = result.out[begin] == '[';
    return result.out.substr(begin, result.out.find_first_of(list ? "]" : ",}\n", begin) - begin);
  }
  static double number(const test::CommandResult &result, const std::string &shot, const std::string &key) {
    const std::string text = reported(result, shot, key);
    return text.empty() ? NAN : std::strtod(text.c_str() + (text[0] == '['), nullptr);
  }

  static std::vector<double> vector(const test::CommandResult &result, const std::string &shot,
                                    const std::string &key) {
    const std::string text = reported(result, shot, key);
    std::vector<double> out(3, NAN);
    if (text.empty()) return out;
    std::sscanf(text.c_str(), "[%lf, %lf, %lf", &out[0], &out[1], &out[2]);
    return out;
  }

  // m, of the block's center of mass
  static double height(const test::CommandResult &result, const std::string &shot) {
    const std::string text = reported(result, shot, "block");
    return std::strtod(text.c_str() + std::min(text.rfind(',') + 1, text.size()), nullptr);
  }

  const std::string folder_ = test::scratch("view"), scene_ = folder_ + "/scene.json";
  Display display_;
};

size_t different(const render::Image &a, const render::Image &b) {
  size_t n = 0;
  for (size_t i = 0; i + 2 < a.rgb.size() && a.rgb.size() == b.rgb.size(); i += 3)
    n += !std::equal(&a.rgb[i], &a.rgb[i] + 3, &b.rgb[i]);
  return a.rgb.size() == b.rgb.size() ? n : a.rgb.size();
}

// Pixels of the block, which is the only thing red.
size_t red(const render::Image &image) {
  size_t n = 0;
  for (size_t i = 0; i + 2 < image.rgb.size(); i += 3) n += image.rgb[i] > image.rgb[i + 1] + 60;
  return n;
}

}  // namespace

TEST_F(Viewer, Pictures_ShowTheSceneAndChangeWhileItRunsOnly) {
  const test::CommandResult done = view(
      "0 shot start.png\n0.1 shot paused.png\n0.15 key space\n0.25 key space\n0.25 shot running.png\n"
      "0.25 drag right 200 120 260 120 0.1\n0.45 shot turned.png\n");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const render::Image start = picture("start.png");
  EXPECT_EQ(start.width, 320u);
  EXPECT_EQ(start.height, 240u);
  EXPECT_GT(red(start), 1000u);
  EXPECT_EQ(different(start, picture("paused.png")), 0u);
  EXPECT_GT(different(start, picture("running.png")), 100u);
  EXPECT_EQ(reported(done, "turned.png", "state_hash"), reported(done, "running.png", "state_hash"));
  EXPECT_GT(different(picture("running.png"), picture("turned.png")), 1000u);
}

TEST_F(Viewer, UntouchedRun_EndsWithTheBitsOfDeformRun) {
  const test::CommandResult viewed = view("0 key space\n0.5 shot end.png\n");
  ASSERT_EQ(viewed.exit_code, 0) << viewed.err;
  const test::CommandResult run = test::deform({"run", scene_, "--out", folder_ + "/run", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const size_t at = run.out.find("\"state_hash\": ");
  ASSERT_NE(at, std::string::npos);
  EXPECT_EQ(reported(viewed, "end.png", "state_hash"), run.out.substr(at + 14, 18));
  EXPECT_NEAR(number(viewed, "end.png", "t"), 0.2, 1e-9);
}

TEST_F(Viewer, StepAndRestart_ContinueAndBackToTheFirstBits) {
  const test::CommandResult done = view(
      "0 shot a.png\n0.05 key s\n0.1 shot b.png\n0.15 key s\n0.2 shot c.png\n0.25 key r\n0.3 shot d.png\n");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_NEAR(number(done, "b.png", "t"), 0.002, 1e-12);
  EXPECT_NEAR(number(done, "c.png", "t"), 0.004, 1e-12);
  EXPECT_EQ(reported(done, "d.png", "state_hash"), reported(done, "a.png", "state_hash"));
  EXPECT_NE(reported(done, "c.png", "state_hash"), reported(done, "b.png", "state_hash"));
}

// The block rests on the floor; the mouse takes it at its middle, pulls it to the right, and holds it there.
TEST_F(Viewer, PulledBody_FollowsTheMouseAndStaysOnTheFloor) {
  const std::string pull =
      "0 key space\n0.3 shot rest.png\n0.3 drag 160 120 220 150 0.4 0.5\n1.1 shot held.png\n";
  const std::vector<std::string> longer{"--set", "/time/duration=5"};
  const test::CommandResult done = view(pull, longer);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const double before = number(done, "rest.png", "block"), after = number(done, "held.png", "block");
  EXPECT_GT(after, before + 0.03) << done.out;
  EXPECT_GT(height(done, "held.png"),
            height(done, "rest.png") - 0.02);  // pulled down too, and the floor bears
  EXPECT_GT(red(picture("held.png")), 1000u);
  EXPECT_EQ(reported(view(pull, longer), "held.png", "state_hash"), reported(done, "held.png", "state_hash"));
  // a thousand times as stiff: still stable, and nearer to the mouse
  const test::CommandResult stiff = view("0 slider pull 1000\n" + pull, longer);
  ASSERT_EQ(stiff.exit_code, 0) << stiff.err;
  EXPECT_GT(number(stiff, "held.png", "block"), before + 0.03);
  EXPECT_LT(number(stiff, "held.png", "block"), before + 0.2);
}

// A model that takes no spring, by impulses: it follows in the same way, stable at a stiffness far too large.
TEST_F(Viewer, PulledBodyOfAModelThatTakesNoSpring_FollowsTheMouse) {
  const std::string pull =
      "0 key space\n0.3 shot rest.png\n0.3 drag 160 120 220 150 0.4 0.5\n1.1 shot held.png\n";
  const std::vector<std::string> modal{"--set", "/time/duration=5", "--set",
                                       R"(/bodies/0/model={"type": "modal"})"};
  const test::CommandResult done = view(pull, modal);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const double before = number(done, "rest.png", "block");
  EXPECT_GT(number(done, "held.png", "block"), before + 0.03) << done.out;
  EXPECT_EQ(reported(view(pull, modal), "held.png", "state_hash"), reported(done, "held.png", "state_hash"));
  const test::CommandResult stiff = view("0 slider pull 1000\n" + pull, modal);
  ASSERT_EQ(stiff.exit_code, 0) << stiff.err;
  EXPECT_GT(number(stiff, "held.png", "block"), before + 0.03);
  EXPECT_LT(number(stiff, "held.png", "block"), before + 0.2);
}

// A rigid body that hangs before the block: the mouse takes it to the right, and the recording has it again.
TEST_F(Viewer, PulledRigidBody_FollowsTheMouseAndIsReplayed) {
  const std::vector<std::string> brick{
      "--set", "/gravity=[0, 0, 0]", "--set",
      R"(/rigid={"bodies": [{"name": "brick", "shape": "box", "half_size": [0.03, 0.03, 0.03], "mass": 0.2,
         "pose": {"position": [0.05, -0.1, 0.107]}}]})"};
  const test::CommandResult done = view(
      "0 key space\n0 key v\n0 shot rest.png\n0.02 drag 165 115 220 120 0.1 0.1\n0.19 shot end.png\n"
      "0.195 key v\n",
      brick);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_NEAR(number(done, "rest.png", "brick"), 0.05, 1e-9);
  EXPECT_GT(number(done, "end.png", "brick"), 0.06) << done.out;
  EXPECT_GT(different(picture("rest.png"), picture("end.png")), 300u);
  const test::CommandResult again = test::deform({"replay", folder_, "--out", folder_ + "/again"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NE(again.out.find("the same bits in all "), std::string::npos) << again.out;
}

// A pair of jaws with keys of its own before the block: the user takes it aside by mouse and keys, turns it,
// opens it, lets it go back, and a replay has the same bits.
TEST_F(Viewer, ToolInHand_GoesWhereItIsLedAndBackToItsKeys) {
  const std::vector<std::string> jaws{
      "--set", "/time/duration=5", "--set",
      R"(/tools=[{"name": "jaws", "shape": "grasper", "half_size": [0.004, 0.01, 0.02], "opening_deg": 20,
         "pose": {"position": [0.05, -0.08, 0.12]}, "motion": {"keyframes": [
           {"t": 0, "position": [0.05, -0.08, 0.12]}, {"t": 4, "position": [0.05, -0.08, 0.14]}]}}])"};
  // the camera looks along +y: the picture's right is +x
  const test::CommandResult done = view(
      "0 key space\n0 key v\n0.1 shot keys.png\n0.1 drag 155 115 215 115 0.2\n0.6 shot aside.png\n"
      "0.6 key up\n0.6 key up\n0.6 key pageup\n0.6 key shift+left\n0.6 key k\n0.9 shot moved.png\n"
      "0.9 key l\n1.6 shot back.png\n1.6 key v\n",
      jaws);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_NEAR(number(done, "keys.png", "at"), 0.05, 1e-12);
  EXPECT_GT(number(done, "aside.png", "at"), 0.07);
  EXPECT_GT(vector(done, "moved.png", "at")[2], vector(done, "aside.png", "at")[2] + 1e-3);
  EXPECT_GT(vector(done, "moved.png", "at")[1], vector(done, "aside.png", "at")[1] + 1e-3);
  const std::vector<double> back = vector(done, "back.png", "at");
  EXPECT_NEAR(back[0], 0.05, 1e-12);
  EXPECT_NEAR(back[2], 0.12 + 0.02 * number(done, "back.png", "t") / 4, 1e-12);
  EXPECT_GT(different(picture("keys.png"), picture("aside.png")), 200u);
  const test::CommandResult again = test::deform({"replay", folder_, "--out", folder_ + "/again"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NE(again.out.find("the same bits in all "), std::string::npos) << again.out;
}

// Any scene gets a ball by one key: led into the block it pushes it down, and feels it. A recording that
// begins with it in hand is replayed.
TEST_F(Viewer, AddedProbe_PressesAndReportsItsForce) {
  std::string script =
      "0.1 key space\n0.3 key space\n0.3 key b\n0.3 shot asked.png\n0.32 key b\n0.32 shot added.png\n"
      "0.35 key space\n";
  for (int i = 0; i < 24; ++i) script += "0.4 key down\n";
  script += "0.4 key v\n1.2 shot pressed.png\n1.2 key v\n";
  const std::vector<std::string> longer{"--set", "/time/duration=5"};
  const test::CommandResult done = view(script, longer);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_GT(number(done, "asked.png", "t"), 0.1) << "what was simulated is not given up by one key";
  EXPECT_EQ(number(done, "added.png", "t"), 0);
  EXPECT_NEAR(vector(done, "added.png", "at")[2], 0.126, 1e-6);
  const test::CommandResult alone = view("0 key space\n0.8 shot rest.png\n", longer);
  EXPECT_LT(height(done, "pressed.png"), height(alone, "rest.png") - 1e-3);
  EXPECT_GT(vector(done, "pressed.png", "force")[2], 1) << done.out;
  EXPECT_GT(different(picture("added.png"), picture("pressed.png")), 500u);
  const test::CommandResult again = test::deform({"replay", folder_, "--out", folder_ + "/again"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NE(again.out.find("the same bits in all "), std::string::npos) << again.out;
}

// A stand-in for libspnav (spnav_stand_in.cpp) pushes a ball to the right and away while it is in hand.
TEST_F(Viewer, SpaceMouse_LeadsTheToolInHand) {
  const std::string ball = R"(/tools=[{"name": "ball", "shape": "sphere", "radius": 0.01,
    "pose": {"position": [0.05, -0.05, 0.15]}}])";
  const std::vector<std::string> more{"--set", "/time/duration=5", "--set", ball};
  setenv("DEFORM_VIEW_SPNAV", DEFORM_TEST_SPNAV, 1);
  const test::CommandResult done = view(
      "0 key space\n0 key v\n0.1 key tab\n0.1 shot a.png\n1.6 shot b.png\n2 shot c.png\n2 key v\n", more);
  setenv("DEFORM_VIEW_SPNAV", "/nothing/libspnav.so", 1);
  const test::CommandResult none = view("0 key h\n0 key tab\n0.2 shot d.png\n", more);
  unsetenv("DEFORM_VIEW_SPNAV");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const std::vector<double> from = vector(done, "a.png", "at"), to = vector(done, "b.png", "at");
  // the camera looks along +y and a little down; fifty frames at half of the size in a second
  EXPECT_GT(to[0] - from[0], 0.05) << done.out;
  EXPECT_NEAR((to[1] - from[1]) / (to[0] - from[0]), 0.45, 0.1) << "half as far away as to the right";
  EXPECT_NEAR(vector(done, "c.png", "at")[0], to[0], 1e-3) << "nobody pushes any more";
  EXPECT_EQ(none.exit_code, 0) << "without the library it is not there, and nothing else changes";
  const test::CommandResult again = test::deform({"replay", folder_, "--out", folder_ + "/again"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
}

// The daemon of 6-DOF mice, for one client, with protocol 1 of libspnav: the client sends its request for the
// protocol, which is given back; an event is eight numbers: 0, the motion (x, y, z, rx, ry, rz) and a period,
// or 1 (2) and the number of a button that is pressed (released).
class Spacenavd {
 public:
  explicit Spacenavd(const std::string &path) : path_(path) {
    unlink(path.c_str());
    sockaddr_un at{};
    at.sun_family = AF_UNIX;
    std::snprintf(at.sun_path, sizeof at.sun_path, "%s", path.c_str());
    listens_ = socket(AF_UNIX, SOCK_STREAM, 0);
    there_ = bind(listens_, reinterpret_cast<sockaddr *>(&at), sizeof at) == 0 && listen(listens_, 1) == 0;
  }
  ~Spacenavd() {
    shutdown(listens_, SHUT_RDWR);
    if (thread_.joinable()) thread_.join();
    close(listens_);
    unlink(path_.c_str());
  }
  bool there() const { return there_; }
  // Sends `first` to the client, and once the file is there `then`.
  void serve(std::vector<std::array<int32_t, 8>> first, std::string file,
             std::vector<std::array<int32_t, 8>> then) {
    thread_ = std::thread([this, first = std::move(first), file = std::move(file), then = std::move(then)] {
      const int client = accept(listens_, nullptr, nullptr);
      if (client < 0) return;
      uint32_t requested = 0;
      if (recv(client, &requested, sizeof requested, MSG_WAITALL) == sizeof requested) asked_ = requested;
      const auto tell = [&](const void *what, size_t size) {
        return send(client, what, size, MSG_NOSIGNAL) == ssize_t(size);
      };
      bool lives = tell(&requested, sizeof requested);
      for (const auto &event : first) lives = lives && tell(event.data(), sizeof event);
      pollfd ends{client, POLLIN, 0};
      char byte;
      // until the client goes
      for (bool reported = false; lives && !(poll(&ends, 1, 5) > 0 && recv(client, &byte, 1, 0) == 0);) {
        if (reported || access(file.c_str(), R_OK) != 0) continue;
        reported = true;
        for (const auto &event : then) lives = lives && tell(event.data(), sizeof event);
      }
      close(client);
    });
  }
  uint32_t requested() const { return asked_; }

 private:
  std::string path_;
  int listens_ = -1;
  bool there_ = false;
  std::atomic<uint32_t> asked_ = 0;
  std::thread thread_;
};

// The real libspnav, and a daemon of the test behind it: the mouse is pushed to the right and away, then let
// go while its button opens the jaws.
TEST_F(Viewer, SpaceMouseByLibspnav_LeadsTheToolInHand) {
  void *const library = dlopen("libspnav.so.0", RTLD_NOW | RTLD_LOCAL);
  if (!library && access("/etc/debian_version", R_OK) != 0) GTEST_SKIP() << "no libspnav on this system";
  ASSERT_NE(library, nullptr) << "cmake/deps.txt lists libspnav0, and it is not here: cmake/setup.sh doors";
  dlclose(library);
  const std::string socket =
      "/tmp/deform_spnav_" + std::to_string(getpid());  // a path of 107 letters at most
  Spacenavd daemon(socket);
  ASSERT_TRUE(daemon.there());
  daemon.serve({{0, 150, 0, 75, 0, 0, 0, 16}}, folder_ + "/b.png",
               {{0, 0, 0, 0, 0, 0, 0, 16}, {1, 1, 0, 0, 0, 0, 0, 0}});
  setenv("SPNAV_SOCKET", socket.c_str(), 1);
  setenv("DEFORM_VIEW_SPNAV", "libspnav.so.0", 1);  // a script has no mouse otherwise
  const test::CommandResult done = view(
      "0 key space\n0 key v\n0.1 key tab\n0.1 shot a.png\n1.6 shot b.png\n2 shot c.png\n2.6 shot d.png\n"
      "2.6 key v\n",
      {"--set", "/time/duration=4", "--set",
       R"(/tools=[{"name": "jaws", "shape": "grasper", "half_size": [0.004, 0.01, 0.02], "opening_deg": 20,
               "pose": {"position": [0.05, -0.05, 0.2]}}])"});
  unsetenv("SPNAV_SOCKET");
  unsetenv("DEFORM_VIEW_SPNAV");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(daemon.requested() >> 16, 0x7faau) << "a request of libspnav";
  const std::vector<double> from = vector(done, "a.png", "at"), to = vector(done, "b.png", "at");
  EXPECT_GT(to[0] - from[0], 0.05) << done.out;
  EXPECT_NEAR((to[1] - from[1]) / (to[0] - from[0]), 0.45, 0.1) << "half as far away as to the right";
  EXPECT_NEAR(vector(done, "d.png", "at")[0], vector(done, "c.png", "at")[0], 1e-6) << "let go";
  EXPECT_GT(different(picture("c.png"), picture("d.png")), 10u) << "the jaws open";
  const test::CommandResult again = test::deform({"replay", folder_, "--out", folder_ + "/again"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
}

TEST_F(Viewer, Sliders_ChangeTheScene) {
  // on a floor that leans: with friction it stays, without it slides off
  const std::vector<std::string> leans{"--set", "/obstacles/0/normal=[-0.3, 0, 1]"};
  const std::string run = "0 key space\n0.25 shot end.png\n";
  const test::CommandResult stays = view(run, leans),
                            slides = view("0 slider mu:block:floor 0.05\n" + run, leans);
  ASSERT_EQ(slides.exit_code, 0) << slides.err;
  EXPECT_GT(std::abs(number(slides, "end.png", "block") - number(stays, "end.png", "block")), 0.02);
  // softer, it sinks in further; without gravity it does not fall
  const test::CommandResult soft = view("0 slider young:block 2000\n" + run);
  EXPECT_LT(height(soft, "end.png"), height(view(run), "end.png") - 0.002);
  const test::CommandResult floats = view("0 slider gravity 0\n" + run);
  EXPECT_NEAR(height(floats, "end.png"), 0.06, 1e-6);
}

TEST_F(Viewer, SavedState_IsLoadedWithItsBitsAndByDeformRun) {
  const test::CommandResult done = view(
      "0 key space\n0.1 key space\n0.1 key f5\n0.1 shot saved.png\n0.15 key space\n0.2 shot later.png\n"
      "0.25 key f9\n0.25 key space\n0.25 shot loaded.png\n0.3 key space\n0.6 shot end.png\n");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(reported(done, "loaded.png", "state_hash"), reported(done, "saved.png", "state_hash"));
  EXPECT_NE(reported(done, "later.png", "state_hash"), reported(done, "saved.png", "state_hash"));
  const test::CommandResult run =
      test::deform({"run", scene_, "--from", folder_ + "/000.state", "--out", folder_ + "/run", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find(reported(done, "end.png", "state_hash")), std::string::npos);
  const std::string kept = test::read_file(folder_ + "/000.state");
  const test::CommandResult next = view("0 key f5\n0 key s\n0 key f5\n0 key f9\n0.1 shot a.png\n");
  ASSERT_EQ(next.exit_code, 0) << next.err;
  EXPECT_TRUE(test::read_file(folder_ + "/000.state") == kept);
  EXPECT_EQ(number(next, "a.png", "t"), 0.002);
  EXPECT_TRUE(std::filesystem::exists(folder_ + "/002.state"));
}

// The panel says what counts again; with panels, so that they are compared.
TEST_F(Viewer, LoadedState_TakesTheSlidersBack) {
  const std::string begin = "0 key t\n0 slider gravity 5\n0.02 key f5\n",
                    end = "0.06 key f9\n0.1 shot a.png\n";
  const test::CommandResult kept = view(begin + end);
  ASSERT_EQ(kept.exit_code, 0) << kept.err;
  const render::Image before = picture("a.png");
  std::filesystem::remove(folder_ + "/000.state");
  const test::CommandResult moved = view(begin + "0.04 slider gravity 15\n" + end);
  ASSERT_EQ(moved.exit_code, 0) << moved.err;
  EXPECT_EQ(different(before, picture("a.png")), 0u);
}

// The clock of the window counts from the start of the scene.
TEST_F(Viewer, ReplayOfASceneThatBeginsLater_PlaysAtOnce) {
  const std::vector<std::string> later = {"--set", "/time/start=5"};
  const test::CommandResult done = view("0 key space\n0 key v\n0.15 key v\n0.15 shot end.png\n", later);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  test::write_file(folder_ + "/look.txt",
                   "0 key space\n0.05 shot a.png\n0.08 slider time 0.1\n0.08 shot b.png\n"
                   "0.15 shot c.png\n");
  const test::CommandResult looked = test::deform(
      {"view", "--replay", folder_, "--script", folder_ + "/look.txt", "--out", folder_, "--json"});
  ASSERT_EQ(looked.exit_code, 0) << looked.err;
  EXPECT_NEAR(number(looked, "a.png", "t"), 0.05, 0.011);
  EXPECT_NEAR(number(looked, "b.png", "t"), 0.1, 1e-9);
  EXPECT_GT(number(looked, "c.png", "t"), 0.12);
}

// With a pull, a slider and a pause in it, and beyond the end of the scene.
TEST_F(Viewer, RecordedSession_IsReplayedToTheSameBitsAndShown) {
  const test::CommandResult done = view(
      "0 key space\n0.05 key v\n0.1 drag 160 120 220 90 0.2 0.1\n0.2 slider mu:block:floor 0.1\n"
      "0.3 key space\n0.35 key space\n0.5 key v\n0.5 shot end.png\n");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const test::CommandResult again = test::deform({"replay", folder_, "--out", folder_ + "/again"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NE(again.out.find("the same bits in all "), std::string::npos) << again.out;
  test::write_file(folder_ + "/look.txt",
                   "0 key t\n0 shot first.png\n0.1 slider time 9\n0.1 shot last.png\n"
                   "0.15 drag right 200 120 260 120 0.1\n0.4 shot turned.png\n");
  const test::CommandResult looked =
      test::deform({"view", "--replay", folder_, "--script", folder_ + "/look.txt", "--out", folder_,
                    "--size", "320x240", "--json"});
  ASSERT_EQ(looked.exit_code, 0) << looked.err;
  EXPECT_EQ(reported(looked, "last.png", "state_hash"), reported(done, "end.png", "state_hash"));
  EXPECT_GT(different(picture("first.png"), picture("last.png")), 300u);
  EXPECT_GT(different(picture("last.png"), picture("turned.png")), 1000u);
}

TEST_F(Viewer, Stroke_CutsTheBlockAndIsReplayed) {
  const std::string stroke = "0.04 drag 160 10 160 230 0.06\n0.18 shot end.png\n0.19 key v\n";
  const test::CommandResult whole = view("0 key space\n0 key v\n" + stroke);
  const test::CommandResult cut = view("0 key space\n0 key v\n0 key x\n" + stroke);
  ASSERT_EQ(cut.exit_code, 0) << cut.err;
  EXPECT_NE(reported(cut, "end.png", "state_hash"), reported(whole, "end.png", "state_hash"));
  EXPECT_EQ(test::read_file(folder_ + "/recording/acts.jsonl").find("\"cut\""), std::string::npos);
  const std::string second = folder_ + "/2";
  EXPECT_NE(test::read_file(second + "/recording/acts.jsonl").find("\"cut\""), std::string::npos);
  const test::CommandResult again = test::deform({"replay", second, "--out", folder_ + "/again"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NE(again.out.find("the same bits in all "), std::string::npos) << again.out;
}

// A stroke makes a body of its own of a part; it is gone where the scene goes back to before.
TEST_F(Viewer, SceneThatGoesBackToBeforeACut_HasNoPieces) {
  const std::vector<std::string> parts{"--set", "/bodies/0/separate={}"};
  const std::string cut = "0 key space\n0 key x\n0.04 drag 160 10 160 230 0.06\n0.12 shot cut.png\n";
  for (const char *back : {"0.15 key r\n", "0.15 key f9\n"}) {
    const test::CommandResult done =
        view("0 shot whole.png\n0 key f5\n" + cut + back + "0.2 shot back.png\n", parts);
    ASSERT_EQ(done.exit_code, 0) << back << done.err;
    EXPECT_FALSE(reported(done, "cut.png", "block.1").empty()) << done.out;
    EXPECT_EQ(height(done, "back.png") > 0, true);
    EXPECT_EQ(done.out.find("block.1", done.out.find("back.png")), std::string::npos) << done.out;
  }
}

TEST_F(Viewer, ImpossibleInput_IsReportedInOneSentence) {
  const struct {
    const char *script, *sentence;
  } cases[] = {
      {"0 jump\n", "script.txt:2: expected key, drag, slider or shot, found \"jump\""},
      {"\n0 key\n", "script.txt:3: expected the name of a key, found the end of the line"},
      {"0 key z\n", "there is no key \"z\""},
      {"0 slider nothing 1\n", "there is no slider \"nothing\""},
  };
  for (const auto &c : cases) {
    const test::CommandResult done = view(c.script);
    EXPECT_EQ(done.exit_code, 2);
    EXPECT_NE(done.err.find(c.sentence), std::string::npos) << done.err;
    EXPECT_EQ(std::count(done.err.begin(), done.err.end(), '\n'), 1) << done.err;
  }
  setenv("DEFORM_VIEW_GLFW", "/nothing/libglfw.so", 1);
  const test::CommandResult bare = view("0 shot a.png\n");
  unsetenv("DEFORM_VIEW_GLFW");
  EXPECT_EQ(bare.exit_code, 2);
  EXPECT_EQ(bare.err, "deform: view: libglfw.so.3 cannot be loaded: install Debian's libglfw3\n");
  unsetenv("DISPLAY");
  const test::CommandResult done = view("0 shot a.png\n");
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_NE(done.err.find("view: no display: "), std::string::npos) << done.err;
  EXPECT_EQ(std::count(done.err.begin(), done.err.end(), '\n'), 1) << done.err;
}

TEST(ViewerPrograms, OfTheCommandAndTheWindow_LinkNoWindowSystem) {
  for (const char *ending : {"", "-view"}) {
    const std::string program = std::string(DEFORM_COMMAND) + ending;
    const test::CommandResult needed = test::run({"/usr/bin/ldd", program});
    EXPECT_NE(needed.out.find("libdeform.so"), std::string::npos) << needed.out << needed.err;
    for (const char *library : {"libX11", "libGL", "libglfw", "libwayland"})
      EXPECT_EQ(needed.out.find(library), std::string::npos) << program << " needs " << library;
  }
}
