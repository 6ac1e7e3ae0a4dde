// A scene in a page without a server: the session of `deform serve` in a worker of the browser, with one
// viewer; or the rig of `deform friction`. worker.js calls the functions below and takes the messages.
#include <emscripten.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <memory>
#include <string_view>
#include <utility>

#include "cli/cli.h"
#include "cli/json_text.h"
#include "cli/messages.h"
#include "deform/plugin.h"
#include "friction/rig.h"
#include "live/session.h"

EM_JS(void, copy_bytes, (const unsigned char *bytes, size_t n),
      { Module.give(HEAPU8.slice(bytes, bytes + n).buffer); });
EM_JS(void, give_text, (const char *utf8), { Module.give(UTF8ToString(utf8)); });

namespace web {
namespace {

class Page final : public live::Viewers {
 public:
  void show_scene(live::Bytes whole, live::Bytes changed) override {
    const live::Bytes &news = changed.empty() ? whole : changed;
    copy_bytes(news.data(), news.size());
    whole_ = std::move(whole);
  }
  void show_frame(live::Bytes &frame) override { copy_bytes(frame.data(), frame.size()); }
  void show_state(std::string json) override { give_text(json.c_str()); }
  std::vector<live::Request> take() override { return std::exchange(requests_, {}); }
  uint32_t viewers() const override { return 1; }
  uint32_t in_control() const override { return 1; }

  // What a scene may choose from goes along, as JSON; a scene that was refused shows nothing.
  void join(const std::string &models, const std::string &laws) const {
    cli::JsonObject out;
    give_text(out.add("you", "1", "models", models, "laws", laws).text().c_str());
    if (!whole_.empty()) copy_bytes(whole_.data(), whole_.size());
  }
  void add_request(const char *text) { requests_.push_back({1, text}); }

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

// A case that the page has written: its viewer moves the law's parameters and the numbers of the drive, and
// gets all rows again.
class Rig {
 public:
  explicit Rig(const char *path) : case_(cli::read_case(path)) {}
  void picture() {
    for (const live::Request &request : page.take()) act(request.text);
    if (std::exchange(run_pending_, false)) run();
  }

 private:
  void act(const std::string &text) {
    cli::JsonValue line;
    if (!cli::parse_json(text, line) || line.get("do") != "slider") return;
    try {
      live::set_slider(sliders_, line);
      run_pending_ = true;
    } catch (const cli::Failure &e) {
      refuse(e);
    }
  }

  static void refuse(const std::exception &e) {
    give_text(cli::json_object("refused", cli::quoted(e.what())).c_str());
  }

  // A decade to both sides, as far as the law goes; what is zero, up to one.
  void add_slider(const std::string &name, const std::string &label, double value,
                  std::function<void(double)> apply, double low = -INFINITY, double high = INFINITY) {
    const bool decade = value > 0;
    live::Slider s;
    s.name = name;
    s.label = label;
    s.value = value;
    s.low = std::max(low, decade ? value / 10 : std::min(10 * value, 0.0));
    s.high = std::min(high, decade ? 10 * value : 1.0);
    s.logarithmic = decade && s.low > 0;
    s.apply = std::move(apply);
    sliders_.push_back(std::move(s));
  }

  void add_sliders(const cli::RigLaw &law) {
    for (auto &entry : case_.input)
      if (entry.second != 0)
        add_slider(entry.first, entry.first + " of the motion", entry.second,
                   [&entry](double x) { entry.second = x; });
    for (const dfm_param &row : cli::params_of(law.type())) {
      if (row.width > 1 || row.flags & (DFM_PARAM_ENUM | DFM_PARAM_INTEGER | DFM_PARAM_LIST)) continue;
      const std::string unit = row.unit == std::string_view("1") ? "" : std::string(", ") + row.unit;
      const auto apply = [this, key = std::string(row.key)](double x) {
        std::erase_if(case_.params, [&](const cli::CaseParam &p) { return p.key == key; });
        case_.params.push_back({key, {x}, ""});
      };
      add_slider(row.key, row.key + unit, law.param(row.key, 0), apply, row.min, row.max);
    }
  }

  void run() {
    try {
      cli::RigLaw law(globals(), case_, "");
      if (sliders_.empty()) add_sliders(law);
      cli::Progress silent(false);
      const cli::RigResult result = cli::run_rig(case_, law, kStep, silent);
      std::vector<std::string> columns, rows, sliders;
      for (const live::Slider &s : sliders_) sliders.push_back(live::slider_text(s));
      for (const std::string &name : result.columns) columns.push_back(cli::quoted(name));
      for (const std::vector<double> &row : result.rows) rows.push_back(cli::json_numbers(row));
      cli::JsonObject out;
      out.add("law", cli::quoted(law.type().id), "message", cli::quoted(result.stopped), "normal",
              law.normal_force(), "steps", result.steps, "sliders", cli::json_array(sliders), "columns",
              cli::json_array(columns));
      give_text(out.add("rows", cli::json_array(rows)).text().c_str());
    } catch (const std::exception &e) {
      refuse(e);
    }
  }

  static constexpr double kStep = 1e-4;  // s
  cli::FrictionCase case_;
  std::vector<live::Slider> sliders_;  // with the ranges that the page has
  bool run_pending_ = true;
};

std::unique_ptr<Rig> rig;

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

// Begins to run a scene of the module's own files, or a case of the rig. False: the page has been told why
// not.
EMSCRIPTEN_KEEPALIVE bool deform_open(const char *path) {
  try {
    if (std::string_view(path).starts_with("/friction/")) {
      web::rig = std::make_unique<web::Rig>(path);
      return true;
    }
    web::session =
        std::make_unique<live::Session>(web::globals(), path, std::vector<std::string>{}, web::page, true);
    return true;
  } catch (const std::exception &e) {
    give_text(cli::json_object("refused", cli::quoted(e.what())).c_str());
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
EMSCRIPTEN_KEEPALIVE void deform_ask(const char *text) { web::page.add_request(text); }
// s: how long the picture lasts.
EMSCRIPTEN_KEEPALIVE void deform_picture(double seconds) {
  if (web::session) web::session->picture(seconds);
  if (web::rig) web::rig->picture();
}
}
