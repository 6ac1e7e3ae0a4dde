#include "server.h"

#include <libwebsockets.h>

#include <algorithm>
#include <cstring>
#include <new>

#include "cli/messages.h"
#include "cli/packets.h"
#include "cli/secret.h"
#include "page.h"

namespace serve {
namespace {

constexpr size_t kLongestText = 1024;  // bytes of a viewer's message
constexpr size_t kMaxRequests = 256;   // that wait for the simulation; what comes beyond is dropped
constexpr size_t kMaxViewers = 32, kMaxChanges = 64;

struct Http { size_t sent; };  // of the page

// Empty where it is absent, and "?" where it is longer than any that is allowed.
std::string header(lws *wsi, lws_token_indexes which) {
  char text[256];
  if (lws_hdr_total_length(wsi, which) >= static_cast<int>(sizeof text)) return "?";
  return lws_hdr_copy(wsi, text, sizeof text, which) > 0 ? text : "";
}

}  // namespace

// The state of one connection; libwebsockets keeps it in memory that it has zeroed.
struct Server::Viewer {
  uint32_t number;
  uint64_t scene, frame, state;  // what it has
  bool greeted;
  size_t length;
  char text[kLongestText];
};

struct Server::Call {
  static Server &of(lws *wsi) { return *static_cast<Server *>(lws_context_user(lws_get_context(wsi))); }

  static int page(lws *wsi, lws_callback_reasons reason, void *user, void *in, size_t) {
    switch (reason) {
      case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION: return -1;  // a WebSocket names the other protocol
      case LWS_CALLBACK_HTTP: {
        const std::string path = static_cast<const char *>(in);
        const Server &server = of(wsi);
        const unsigned status = path != "/"            ? HTTP_STATUS_NOT_FOUND
                                : !server.allowed(wsi) ? HTTP_STATUS_FORBIDDEN
                                                       : HTTP_STATUS_OK;
        if (status != HTTP_STATUS_OK) {
          if (lws_return_http_status(wsi, status, "deform serve: open the URL that it has printed"))
            return -1;
          return lws_http_transaction_completed(wsi) ? -1 : 0;
        }
        unsigned char head[LWS_PRE + 1024], *const start = head + LWS_PRE,
                                                   *p = start, *const end = head + sizeof head;
        const auto add = [&](const char *name, const char *value) {
          return lws_add_http_header_by_name(wsi, reinterpret_cast<const unsigned char *>(name),
                                             reinterpret_cast<const unsigned char *>(value),
                                             static_cast<int>(std::strlen(value)), &p, end);
        };
        if (lws_add_http_common_headers(wsi, HTTP_STATUS_OK, "text/html; charset=utf-8", sizeof kPage - 1, &p,
                                        end) ||
            add("cache-control:", "no-store") || add("referrer-policy:", "no-referrer") ||
            add("content-security-policy:", "frame-ancestors http://127.0.0.1:* http://localhost:*") ||
            lws_finalize_write_http_header(wsi, start, &p, end))
          return -1;
        static_cast<Http *>(user)->sent = 0;
        lws_callback_on_writable(wsi);
        return 0;
      }
      case LWS_CALLBACK_HTTP_WRITEABLE: {
        Http &http = *static_cast<Http *>(user);
        unsigned char part[LWS_PRE + 4096];
        const size_t n = std::min<size_t>(4096, sizeof kPage - 1 - http.sent);
        std::memcpy(part + LWS_PRE, kPage + http.sent, n);
        http.sent += n;
        const bool last = http.sent == sizeof kPage - 1;
        if (lws_write(wsi, part + LWS_PRE, n, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) < 0) return -1;
        if (last) return lws_http_transaction_completed(wsi) ? -1 : 0;
        lws_callback_on_writable(wsi);
        return 0;
      }
      default: return 0;
    }
  }

  static int stream(lws *wsi, lws_callback_reasons reason, void *user, void *in, size_t n) {
    const auto viewer = static_cast<Viewer *>(user);
    switch (reason) {
      case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION: return of(wsi).allowed(wsi) ? 0 : -1;
      case LWS_CALLBACK_ESTABLISHED: of(wsi).joins(*viewer, wsi); return 0;
      case LWS_CALLBACK_CLOSED: of(wsi).remove_viewer(viewer->number); return 0;
      case LWS_CALLBACK_RECEIVE: {
        if (lws_frame_is_binary(wsi)) return -1;  // of text the library checks that it is UTF-8
        const bool ends = lws_is_final_fragment(wsi) && lws_remaining_packet_payload(wsi) == 0;
        return of(wsi).hears(*viewer, static_cast<const char *>(in), n, ends) ? 0 : -1;
      }
      case LWS_CALLBACK_SERVER_WRITEABLE: return of(wsi).writes(*viewer, wsi) ? 0 : -1;
      case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
        of(wsi).pack_frame();
        lws_callback_on_writable_all_protocol(lws_get_context(wsi), lws_get_protocol(wsi));
        return 0;
      default: return 0;
    }
  }

  // -1 drops the viewer: an exception may not pass through libwebsockets.
  template <lws_callback_function f>
  static int shielded(lws *wsi, lws_callback_reasons reason, void *user, void *in, size_t n) {
    try {
      return f(wsi, reason, user, in, n);
    } catch (const std::bad_alloc &) {
      return -1;
    }
  }
};

Server::Server(uint16_t port, std::string token, Pack pack)
    : token_(std::move(token)), pack_(pack), frame_(message_of(nullptr, 0)) {
  static const lws_protocols protocols[] = {
      {"http", &Call::shielded<&Call::page>, sizeof(Http), 0, 0, nullptr, 0},
      {"dfm.stream.1", &Call::shielded<&Call::stream>, sizeof(Viewer), kLongestText, 0, nullptr, 0},
      {nullptr, nullptr, 0, 0, 0, nullptr, 0}};
  // a viewer that answers no ping is gone
  static const lws_retry_bo_t patience = {nullptr, 0, 0, 20, 40, 0};
  lws_set_log_level(0, nullptr);
  lws_context_creation_info info = {};
  info.port = port;
  info.iface = "127.0.0.1";
  info.protocols = protocols;
  info.retry_and_idle_policy = &patience;
  info.user = this;
  info.gid = static_cast<gid_t>(-1);
  info.uid = static_cast<uid_t>(-1);
  info.options = LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND | LWS_SERVER_OPTION_DISABLE_IPV6 |
                 LWS_SERVER_OPTION_VALIDATE_UTF8;
  context_ = lws_create_context(&info);
  lws_vhost *const host = context_ ? lws_get_vhost_by_name(context_, "default") : nullptr;
  const int found = host ? lws_get_vhost_listen_port(host) : -1;
  if (found <= 0) {
    if (context_) lws_context_destroy(context_);
    throw cli::Failure(cli::kBadInput, "serve: port " + std::to_string(port) +
                                           " of 127.0.0.1 is taken or not allowed; give another --port");
  }
  port_ = static_cast<uint16_t>(found);
  thread_ = std::thread([this] { serve(); });
}

Server::~Server() {
  {
    const std::lock_guard lock(mutex_);
    stops_ = true;
  }
  wake();
  thread_.join();
  lws_context_destroy(context_);
}

void Server::serve() {
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (stops_) return;
    }
    if (lws_service(context_, 0) < 0) {
      const std::lock_guard lock(mutex_);
      stops_ = true;
    }
  }
}

// The one call of libwebsockets that another thread may make.
void Server::wake() { lws_cancel_service(context_); }

Server::Message Server::message_of(const void *data, size_t bytes) {
  auto out = std::make_shared<Bytes>(LWS_PRE + bytes);
  if (bytes) std::memcpy(out->data() + LWS_PRE, data, bytes);
  return out;
}

void Server::show_scene(Bytes whole, Bytes changed) {
  Message all = message_of(whole.data(), whole.size());
  Message part = changed.empty() ? nullptr : message_of(changed.data(), changed.size());
  {
    const std::lock_guard lock(mutex_);
    scene_ = std::move(all);
    ++scene_number_;
    if (part) changes_.push_back({scene_number_, std::move(part)});
    else changes_.clear();
    if (changes_.size() > kMaxChanges) changes_.pop_front();
  }
  wake();
}

void Server::show_frame(Bytes &frame) {
  {
    const std::lock_guard lock(mutex_);
    fresh_.swap(frame);
  }
  wake();
}

// On the thread of the network, which alone reads what it packs; the newest frame alone.
void Server::pack_frame() {
  {
    const std::lock_guard lock(mutex_);
    packed_.swap(fresh_);
    fresh_.clear();
  }
  if (packed_.empty()) return;
  const auto pack = [&](void *to, size_t *n) {
    return pack_(packed_.data(), packed_.size(), nullptr, to, n);
  };
  if (cli::fill(*frame_, LWS_PRE, pack) == DFM_OK) ++frame_number_;
  packed_.clear();
}

void Server::show_state(std::string json) {
  Message message = message_of(json.data(), json.size());
  {
    const std::lock_guard lock(mutex_);
    state_ = std::move(message);
    ++state_number_;
  }
  wake();
}

std::vector<Request> Server::take() {
  const std::lock_guard lock(mutex_);
  std::vector<Request> out(requests_.begin(), requests_.end());
  requests_.clear();
  return out;
}

uint32_t Server::viewers() const {
  const std::lock_guard lock(mutex_);
  return static_cast<uint32_t>(present_.size());
}

bool Server::works() const {
  const std::lock_guard lock(mutex_);
  return !stops_;
}

uint32_t Server::in_control() const {
  const std::lock_guard lock(mutex_);
  return control_;
}

// Who has the token, and is no page of another origin. A browser names the page's origin; the host is checked
// too, so that a foreign name that resolves to this machine is none.
bool Server::allowed(lws *wsi) const {
  const std::string host = header(wsi, WSI_TOKEN_HOST), origin = header(wsi, WSI_TOKEN_ORIGIN);
  const std::string port = ":" + std::to_string(port_);
  if (host != "127.0.0.1" + port && host != "localhost" + port) return false;
  if (!origin.empty() && origin != "http://" + host) return false;
  char text[128];
  const char *const given = lws_get_urlarg_by_name(wsi, "token=", text, sizeof text);
  return given && cli::same_secret(token_, given, std::strlen(given));
}

uint32_t Server::join() {
  const std::lock_guard lock(mutex_);
  if (present_.size() >= kMaxViewers) return 0;
  present_.push_back(++last_viewer_);
  if (!control_) control_ = last_viewer_;
  return last_viewer_;
}

void Server::joins(Viewer &viewer, lws *wsi) {
  viewer.number = join();  // where it stays 0, it gets nothing
  if (viewer.number) lws_callback_on_writable(wsi);
}

void Server::remove_viewer(uint32_t viewer) {
  const std::lock_guard lock(mutex_);
  std::erase(present_, viewer);
  if (control_ == viewer) control_ = present_.empty() ? 0 : present_.front();
}

void Server::hear(uint32_t viewer, const std::string &text) {
  std::string bare = text;
  std::erase_if(bare, [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; });
  const std::lock_guard lock(mutex_);
  if (viewer && bare == R"({"do":"take"})") control_ = viewer;
  else if (viewer && viewer == control_ && requests_.size() < kMaxRequests)
    requests_.push_back({viewer, text});
}

bool Server::hears(Viewer &viewer, const char *text, size_t n, bool ends) {
  if (n > kLongestText - viewer.length) return false;
  if (n) std::memcpy(viewer.text + viewer.length, text, n);
  viewer.length += n;
  if (!ends) return true;
  hear(viewer.number, {viewer.text, viewer.length});
  viewer.length = 0;
  return true;
}

// Scene before state before frame: a frame is of no use to who lacks its triangles.
Server::Message Server::next_for(Viewer &viewer, bool &text) {
  const std::lock_guard lock(mutex_);
  text = false;
  if (scene_ && viewer.scene != scene_number_) {
    const auto next = std::find_if(changes_.begin(), changes_.end(),
                                   [&](const Change &c) { return c.number == viewer.scene + 1; });
    if (viewer.scene != 0 && next != changes_.end()) {
      ++viewer.scene;
      return next->message;
    }
    viewer.scene = scene_number_;
    return scene_;
  }
  if (state_ && viewer.state != state_number_) {
    viewer.state = state_number_;
    text = true;
    return state_;
  }
  if (frame_->size() > LWS_PRE && viewer.frame != frame_number_) {
    viewer.frame = frame_number_;
    return frame_;
  }
  return nullptr;
}

bool Server::writes(Viewer &viewer, lws *wsi) {
  if (!viewer.number) return false;
  bool text = true;
  Message message;
  if (!viewer.greeted) {
    const std::string hello = "{\"you\":" + std::to_string(viewer.number) + "}";
    message = message_of(hello.data(), hello.size());
    viewer.greeted = true;
  } else {
    message = next_for(viewer, text);
  }
  if (!message) return true;
  if (lws_write(wsi, message->data() + LWS_PRE, message->size() - LWS_PRE,
                text ? LWS_WRITE_TEXT : LWS_WRITE_BINARY) < 0)
    return false;
  lws_callback_on_writable(wsi);
  return true;
}

}  // namespace serve
