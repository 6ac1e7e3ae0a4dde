// The server of `deform serve` for the Python package: plain C functions that ctypes calls. One thread at a
// time for each server.
#include "serve/server.h"

#include <cstdio>
#include <cstring>
#include <deque>

#include "cli/messages.h"
#include "serve/token.h"

#define SERVE_API extern "C" __attribute__((visibility("default")))

namespace {

struct Served {
  std::unique_ptr<serve::Server> server;
  std::deque<serve::Request> requests;
  serve::Bytes frame;
};

serve::Bytes bytes_of(const unsigned char *bytes, size_t n) { return {bytes, bytes + n}; }

// No exception goes on into C.
template <class F>
void attempt(F f) {
  try {
    f();
  } catch (const std::exception &) {}
}

}  // namespace

/** Listens on 127.0.0.1.
 * @param pack  dfm_stream_pack
 * @param port  in: 0 for a free one; out: the port
 * @param token [65] in: "" for a new one; out: what the URL has to say
 * @param why   out, [capacity] one sentence where that fails. @return NULL then. */
SERVE_API void *deform_serve_open(serve::Server::Pack pack, uint16_t *port, char *token, char *why,
                                  size_t capacity) {
  try {
    auto served = std::make_unique<Served>();
    if (!*token) std::strcpy(token, serve::new_token().c_str());
    served->server = std::make_unique<serve::Server>(*port, token, pack);
    *port = served->server->port();
    return served.release();
  } catch (const std::exception &e) {
    std::snprintf(why, capacity, "%s", e.what());
    return nullptr;
  }
}
SERVE_API void deform_serve_close(void *served) { delete static_cast<Served *>(served); }

/** What viewers get: a scene as a whole for those that come later, and what of it has changed (nchanged 0:
 * everything) for those that are there; a frame; the state as JSON. Where memory is short: nothing. */
SERVE_API void deform_serve_scene(void *served, const unsigned char *whole, size_t n,
                                  const unsigned char *changed, size_t nchanged) {
  attempt([&] {
    static_cast<Served *>(served)->server->show_scene(bytes_of(whole, n), bytes_of(changed, nchanged));
  });
}
SERVE_API void deform_serve_frame(void *served, const unsigned char *frame, size_t n) {
  Served &s = *static_cast<Served *>(served);
  attempt([&] {
    s.frame.assign(frame, frame + n);
    s.server->show_frame(s.frame);
  });
}
SERVE_API void deform_serve_state(void *served, const char *json) {
  attempt([&] { static_cast<Served *>(served)->server->show_state(json); });
}

/** The next request of who is in control.
 * @param viewer out, its number
 * @param text   out, [1025]
 * @return 1; 0 there is none; -1 the network has failed */
SERVE_API int deform_serve_next(void *served, uint32_t *viewer, char *text) {
  Served &s = *static_cast<Served *>(served);
  if (!s.server->works()) return -1;
  if (s.requests.empty())
    attempt([&] {
      for (serve::Request &request : s.server->take()) s.requests.push_back(std::move(request));
    });
  if (s.requests.empty()) return 0;
  *viewer = s.requests.front().viewer;
  std::snprintf(text, 1025, "%s", s.requests.front().text.c_str());
  s.requests.pop_front();
  return 1;
}
SERVE_API uint32_t deform_serve_viewers(void *served) {
  return static_cast<Served *>(served)->server->viewers();
}
SERVE_API uint32_t deform_serve_control(void *served) {
  return static_cast<Served *>(served)->server->in_control();
}
