// Serves a page and a stream of messages to browsers on this machine, on a thread of its own, which packs
// frames too. The simulation shows what is new and takes what viewers have sent; it never waits for the
// network.
#pragma once
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "deform/stream.h"
#include "live/viewers.h"

struct lws_context;
struct lws;

namespace serve {

using live::Bytes;
using live::Request;

class Server final : public live::Viewers {
 public:
  // dfm_stream_pack; the Python package has no other way to it.
  using Pack = decltype(&dfm_stream_pack);
  // Listens on 127.0.0.1; port 0: a free one. Throws cli::Failure.
  Server(uint16_t port, std::string token, Pack pack);
  ~Server() override;
  Server(const Server &) = delete;
  uint16_t port() const { return port_; }
  void show_scene(Bytes whole, Bytes changed) override;
  void show_frame(Bytes &frame) override;
  void show_state(std::string json) override;
  std::vector<Request> take() override;
  uint32_t viewers() const override;
  uint32_t in_control() const override;
  // A viewer by another transport, which has its place among those of control. 0: there are too many.
  uint32_t join();
  void remove_viewer(uint32_t viewer);
  void hear(uint32_t viewer, const std::string &text);
  bool works() const;  // false: the network has failed

 private:
  struct Viewer;
  struct Call;                             // what libwebsockets calls
  using Message = std::shared_ptr<Bytes>;  // begins with LWS_PRE bytes for the transport
  struct Change {
    uint64_t number;
    Message message;
  };

  static Message message_of(const void *data, size_t bytes);
  void wake();
  void pack_frame();
  void serve();
  bool allowed(lws *wsi) const;
  void joins(Viewer &viewer, lws *wsi);
  bool hears(Viewer &viewer, const char *text, size_t n, bool ends);  // false: the viewer is to go
  bool writes(Viewer &viewer, lws *wsi);
  Message next_for(Viewer &viewer, bool &text);

  std::string token_;
  const Pack pack_;
  uint16_t port_ = 0;
  lws_context *context_ = nullptr;
  std::thread thread_;
  // The thread of the network uses these: the frame that is packed, and as it goes out.
  Bytes packed_;
  Message frame_;
  uint64_t frame_number_ = 0;

  mutable std::mutex mutex_;  // of all below
  bool stops_ = false;
  Bytes fresh_;  // the newest frame, which is not packed yet
  Message scene_, state_;
  std::deque<Change> changes_;
  uint64_t scene_number_ = 0, state_number_ = 0;
  std::deque<Request> requests_;
  std::vector<uint32_t> present_;  // viewers in the order in which they came
  uint32_t control_ = 0, last_viewer_ = 0;
};

}  // namespace serve
