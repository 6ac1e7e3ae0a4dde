// A scene in a page without a server: the session of `deform serve` in a worker of the browser, with one
// viewer. worker.js calls the functions below and takes the messages.
#include <emscripten.h>

#include <exception>
#include <memory>
#include <utility>

#include "cli/cli.h"
#include "cli/json_text.h"
#include "cli/messages.h"
#include "deform/plugin.h"
#include "live/session.h"

EM_JS(void, give_bytes, (const unsigned char *bytes, size_t n),
      { Module.give(HEAPU8.slice(bytes, bytes + n).buffer); });
EM_JS(void, give_text, (const char *utf8), { Module.give(UTF8ToString(utf8)); });

namespace web {
namespace {

class Page final : public live::Viewers {
 public:
  void show_scene(live::Bytes whole, live::Bytes changed) override {
    const live::Bytes &news = changed.empty() ? whole : changed;
    give_bytes(news.data(), news.size());
    whole_ = std::move(whole);
  }
  void show_frame(live::Bytes frame) override { give_bytes(frame.data(), frame.size()); }
  void show_state(std::string json) override { give_text(json.c_str()); }
  std::vector<live::Request> take() override { return std::exchange(requests_, {}); }
  uint32_t viewers() const override { return 1; }
  uint32_t in_control() const override { return 1; }

  // What a scene may choose from goes along, as JSON; a scene that was refused shows nothing.
  void join(const std::string &models, const std::string &laws) const {
    cli::JsonObject out;
    give_text(out.add("you", "1").add("models", models).add("laws", laws).text().c_str());
    if (!whole_.empty()) give_bytes(whole_.data(), whole_.size());
  }
  void ask(const char *text) { requests_.push_back({1, text}); }

 private:
  live::Bytes whole_;
  std::vector<live::Request> requests_;
};

Page page;
std::unique_ptr<live::Session> session;

cli::Globals globals() {
  cli::Globals out;
  out.quiet = true;  // progress would be shown by a thread
  return out;
}

std::string ids_of(dfm_context *context, uint32_t kind) {
  struct List {
    uint32_t kind;
    std::vector<std::string> ids;
  } list{kind, {}};
  const auto look = [](void *user, const dfm_type *type, const char *) {
    List &all = *static_cast<List *>(user);
    const std::string id = type->id;
    if (type->kind == all.kind) all.ids.push_back(cli::quoted(id.substr(id.rfind('.') + 1)));
  };
  cli::need(dfm_plugin_visit(context, look, &list));
  return cli::json_array(list.ids);
}

}  // namespace
}  // namespace web

extern "C" {

// Begins to run a scene of the module's own files. False: the page has been told why not.
EMSCRIPTEN_KEEPALIVE bool deform_open(const char *path) {
  try {
    web::session =
        std::make_unique<live::Session>(web::globals(), path, std::vector<std::string>{}, web::page, true);
    return true;
  } catch (const std::exception &e) {
    give_text(cli::JsonObject().add("refused", cli::quoted(e.what())).text().c_str());
    return false;
  }
}
// A viewer that has nothing yet gets the whole scene.
EMSCRIPTEN_KEEPALIVE void deform_join() {
  const std::unique_ptr<dfm_context, decltype(&dfm_context_destroy)> context(
      cli::make_context(web::globals()), dfm_context_destroy);
  web::page.join(web::ids_of(context.get(), DFM_KIND_MODEL), web::ids_of(context.get(), DFM_KIND_FRICTION));
}
// What the viewer asks for, with the next picture.
EMSCRIPTEN_KEEPALIVE void deform_ask(const char *text) { web::page.ask(text); }
// s: how long the picture lasts.
EMSCRIPTEN_KEEPALIVE void deform_picture(double seconds) {
  if (web::session) web::session->picture(seconds);
}
}
